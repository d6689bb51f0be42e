//! Jumps whose times depend on parameters: those of held inputs with delays.
//!
//! A jump of u at t₁ is one of u(t − τ) at t₁ + τ, and moves with τ. Differential unknowns do not jump there for any θ,
//! so that
//!
//! ```text
//!   S⁻ + ẏ⁻ ∂τ/∂θ = S⁺ + ẏ⁺ ∂τ/∂θ,     S⁺ = S⁻ + (f⁻ − f⁺) ∂τ/∂θ
//! ```
//!
//! with f on both sides at consistent values. Jumps of several inputs at one time are taken one after another, fixed
//! ones first. Transitions that a jump triggers belong to its instant ([`crate::integrate::events`]), whose time moves
//! by ∂τ/∂θ.

use crate::error::IntegrateError;
use crate::integrate::simulation::Simulation;
use crate::observe::delay::delay_sensitivities;
use crate::problem::Problem;
use crate::signal::Segment;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Relative differences of inputs up to this are not jumps: the rounding of a product and a sum.
pub(in crate::integrate) const NO_JUMP: f64 = 16.0 * f64::EPSILON;

/// Work space for moving jumps.
pub(in crate::integrate) struct MovingJumps<S: SolvableSystem> {
    /// ∂τ/∂θ, delays × n_s by columns.
    dtau: Vec<f64>,
    /// ∂τ/∂θ of one delay.
    dt: Vec<f64>,
    /// Inputs while some of them have jumped.
    u: S::Inputs,
    before: S::Vector,
    after: S::Vector,
}

impl<S: SolvableSystem> MovingJumps<S> {
    /// `None` if no delay of an input depends on a direction.
    pub(in crate::integrate) fn new(problem: &Problem<'_, S>) -> Option<Self> {
        let signature = problem.system.signature();
        if signature.delayed_inputs.is_empty() {
            return None;
        }
        let dtau = delay_sensitivities(problem);
        let moves = |column: &[f64]| {
            signature.delayed_inputs.iter().any(|input| column[input.delay] != 0.0)
        };
        if !dtau.chunks_exact(signature.delays.len()).any(moves) {
            return None;
        }
        let n = signature.unknowns.len();
        Some(Self {
            dt: vec![0.0; signature.directions.len()],
            dtau,
            u: S::Inputs::zeros(signature.n_u()),
            before: S::Vector::zeros(n),
            after: S::Vector::zeros(n),
        })
    }
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Enters a segment whose start may depend on parameters.
    pub(in crate::integrate) fn enter_with_moving_jumps(
        &mut self,
        segment: Segment<'_>,
        moving: &mut MovingJumps<S>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let signature = self.problem.system.signature();
        let declared = signature.inputs.len();
        let u = moving.u.as_mut();
        u.copy_from_slice(segment.u);
        let mut jumping: Vec<usize> = Vec::new();
        for (position, delayed) in signature.delayed_inputs.iter().enumerate() {
            let (left, right) = (
                self.drive.evaluate(self.t, self.y.as_ref())[declared + position],
                u[declared + position],
            );
            if (right - left).abs() > NO_JUMP * left.abs().max(right.abs()) {
                u[declared + position] = left;
                jumping.push(delayed.delay);
            }
        }
        if jumping.is_empty() {
            let level = self.level_of(segment);
            self.jump(segment, solution)?;
            self.mark(level, &[]);
            return Ok(());
        }
        jumping.sort_unstable();
        jumping.dedup();

        let level = self.level_of(segment);
        let t0 = self.t;
        self.jump(Segment { t0, u: moving.u.as_ref(), ..segment }, solution)?;
        self.mark(level, &[]);
        for delay in jumping {
            let n_tau = signature.delays.len();
            for (dt, column) in moving.dt.iter_mut().zip(moving.dtau.chunks_exact(n_tau)) {
                *dt = column[delay];
            }
            self.begin_moving_jump(&moving.dt, solution);
            self.rates(&mut moving.before);
            for (position, delayed) in signature.delayed_inputs.iter().enumerate() {
                if delayed.delay == delay {
                    moving.u.as_mut()[declared + position] = segment.u[declared + position];
                }
            }
            self.enter(Segment { t0, u: moving.u.as_ref(), ..segment }, solution)?;
            self.rates(&mut moving.after);
            self.move_sensitivities(&moving.before, &moving.after, &moving.dt, solution)?;
            self.settle(solution)?;
            self.mark(level, &moving.dt);
        }
        self.drive.enter(segment);
        Ok(())
    }

    /// Begins the instant of a jump whose time has these derivatives, if transitions can follow from
    /// it.
    pub(in crate::integrate) fn begin_moving_jump(&mut self, dt: &[f64], solution: &mut Solution) {
        if S::FEATURES.events && self.discrete.has_transitions() {
            for (tau, dt) in self.discrete.saltation.tau.iter_mut().zip(dt) {
                *tau = *dt;
            }
            self.begin_instant(solution);
        }
    }

    /// f with the current inputs, if sensitivities need it.
    pub(in crate::integrate) fn rates(&mut self, f: &mut S::Vector) {
        if self.directions.is_none() {
            return;
        }
        let Problem { system, p, .. } = *self.problem;
        let (u, z) = (self.drive.evaluate(self.t, self.y.as_ref()), self.discrete.z());
        let point = EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z };
        system.rhs(point, f.as_mut());
    }

    /// S⁺ = S⁻ + (f⁻ − f⁺) dt/dθ for differential unknowns; the others follow.
    pub(in crate::integrate) fn move_sensitivities(
        &mut self,
        before: &S::Vector,
        after: &S::Vector,
        dt: &[f64],
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let Some(d) = &mut self.directions else { return Ok(()) };
        let n = before.as_ref().len().max(1);
        for (column, dt) in d.s.as_mut().chunks_exact_mut(n).zip(dt) {
            let sides = before.as_ref().iter().zip(after.as_ref());
            let rows = column.iter_mut().zip(sides).zip(self.algebraic.mass.as_ref());
            for ((s, (before, after)), mass) in rows {
                *s += mass * (before - after) * dt;
            }
        }
        solution.statistics.evaluations += 2;
        self.make_consistent(solution)
    }
}
