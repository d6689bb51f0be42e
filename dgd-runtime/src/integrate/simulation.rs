//! The state of a simulation from step to step.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use crate::algebraic::AlgebraicSystem;
use crate::integrate::delay::discontinuities::Discontinuities;
use crate::integrate::delay::memory::RunMemory;
use crate::integrate::delay::moving_jump::MovingJumps;
use crate::integrate::drive::InputCursor;
use crate::integrate::events::{HybridState, JumpWorkspace};
use crate::integrate::methods::catalogue::Method;
use crate::integrate::methods::stepper::{SensitivityWorkspace, StepBase, Stepper};
use crate::integrate::record::projection::Projection;
use crate::integrate::watched::RunMonitor;
use crate::linalg::KeptSum;
use crate::linalg::norm::Tolerances;
use crate::problem::{Options, Problem};
use crate::signal::LimitSide;
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// The outcome at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StepOutcome {
    /// Nothing.
    None,
    /// Inputs or modes change: values just after differ from those just before.
    Change,
}

/// The variables for which a step is tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StepVariables {
    /// Unknowns, and sensitivities if they are wanted.
    All,
    /// Only unknowns.
    Unknowns,
}

/// The state of a simulation.
pub(super) struct Simulation<'a, S: SolvableSystem> {
    pub(super) problem: &'a Problem<'a, S>,
    pub(super) tolerances: Tolerances,
    pub(super) max_steps: usize,
    pub(super) watched: Option<&'static RunMonitor>,
    pub(super) initial_step: Option<f64>,
    pub(super) method: &'static Method,
    pub(super) stepper: Stepper<S>,
    /// `None` without sensitivities, and once they are undefined.
    pub(super) directions: Option<SensitivityWorkspace<S>>,
    pub(super) algebraic: AlgebraicSystem<S>,
    /// The current segment of the inputs, and its end.
    pub(super) segment: usize,
    pub(super) segment_end: f64,
    pub(super) drive: InputCursor<'a, S>,
    /// Modes, conditions on time, and the state of the instant at which they change.
    pub(super) discrete: HybridState,
    /// Present if there are transitions.
    pub(super) jumps: Option<Box<JumpWorkspace<S>>>,
    /// Present if the times of input jumps depend on parameters.
    pub(super) moving: Option<MovingJumps<S>>,
    /// Present if there are delayed unknowns.
    pub(super) discontinuities: Option<Discontinuities<S>>,
    pub(super) t: f64,
    pub(super) y: S::Vector,
    /// Sizes of the unknowns, for tolerances.
    pub(super) sizes: S::Vector,
    /// Whether the stepper is linearised at (t, y) with the current inputs.
    pub(super) linearized: bool,
    /// Whether algebraic unknowns were made consistent again after a rejection at t.
    pub(super) corrected: bool,
    /// Length of the simulation.
    pub(super) span: f64,
    pub(super) row: S::Vector,
    pub(super) sensitivity_row: Option<S::Sensitivity>,
    /// Projection of recorded rows; `None` if no mode has algebraic unknowns.
    pub(super) projection: Option<Box<Projection<S>>>,
    /// The unknowns to record; `None` for all.
    pub(super) chosen: Option<&'a [usize]>,
    /// Work space for outputs, if they are recorded.
    pub(super) observed: Option<Vec<f64>>,
    /// The memory from which the run continues.
    pub(super) resumed: Option<&'a RunMemory>,
    /// The natural step size, for a run that continues this one.
    pub(super) natural_step: Option<f64>,
}

impl<'a, S: SolvableSystem> Simulation<'a, S> {
    pub(super) fn new(
        problem: &'a Problem<'a, S>,
        options: &Options,
        from: f64,
        directions: Option<SensitivityWorkspace<S>>,
    ) -> Self {
        let system = problem.system;
        debug_assert!(S::FEATURES.cover(system.signature()), "features that the type leaves out");
        let n = system.signature().unknowns.len();
        let segment = problem.inputs.segment_at(from, LimitSide::Right);
        let n_s = if directions.is_some() { system.signature().directions.len() } else { 0 };
        let discrete = HybridState::new(system, problem.p, from, n_s);
        // With transitions the jumps are taken one by one in either case, so that modes follow one another in the same
        // way.
        let moves = S::FEATURES.past && (n_s > 0 || discrete.has_transitions());
        let moving = moves.then(|| MovingJumps::new(problem));
        let tolerances = Tolerances { rtol: options.rtol, atol: options.atol };
        let drive =
            InputCursor::new(problem, problem.inputs.segment(segment), from, n_s, tolerances);
        let has_algebraic =
            S::FEATURES.algebraic && !AlgebraicSystem::<S>::is_explicit(system.signature());
        let sensitivity_row = directions.as_ref().map(|directions| directions.s.clone());
        let mut stepper = Stepper::new(system, options.method.kind);
        stepper.lay_out(system, options.rtol, n_s);
        if S::FEATURES.conserved {
            stepper.sums = KeptSum::all(&system.signature().conserved, n, n_s);
        }
        Self {
            problem,
            tolerances,
            max_steps: options.max_steps,
            watched: options.watched,
            initial_step: options.initial_step,
            method: options.method,
            stepper,
            directions,
            algebraic: AlgebraicSystem::new(system),
            projection: has_algebraic.then(|| Box::new(Projection::new(system, n_s))),
            segment,
            segment_end: problem.inputs.segment(segment).t1,
            discontinuities: drive
                .history
                .is_some()
                .then(|| Discontinuities::new(n, sensitivity_row.clone())),
            drive,
            jumps: (S::FEATURES.events && discrete.has_transitions())
                .then(|| Box::new(JumpWorkspace::new(system, n_s))),
            discrete,
            moving: moving.flatten(),
            t: from,
            y: S::Vector::zeros(n),
            sizes: S::Vector::zeros(n),
            linearized: false,
            corrected: false,
            span: 0.0,
            row: S::Vector::zeros(n),
            sensitivity_row,
            chosen: None,
            observed: None,
            resumed: None,
            natural_step: None,
        }
    }

    /// The time at which the next step must end, because something changes.
    #[inline]
    pub(super) fn stop(&self) -> f64 {
        let mut stop = self.segment_end;
        if S::FEATURES.events {
            stop = stop.min(self.discrete.next_switch());
        }
        if S::FEATURES.past {
            stop = stop.min(self.next_discontinuity());
        }
        stop
    }
}

/// The start of a step from t.
#[inline(always)]
pub(super) fn base<'a, S: SolvableSystem>(
    problem: &Problem<'a, S>,
    algebraic: &'a AlgebraicSystem<S>,
    discrete: &'a HybridState,
    t: f64,
) -> StepBase<'a, S> {
    let Problem { system, p, .. } = *problem;
    StepBase { system, p, z: discrete.z(), mass: &algebraic.mass, t }
}

pub(super) fn multiply(values: &mut [f64], by: &[f64]) {
    for (value, by) in values.iter_mut().zip(by) {
        *value *= by;
    }
}
