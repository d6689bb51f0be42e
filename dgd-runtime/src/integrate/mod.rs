//! The loop: propose a step, try it, accept it or not, record what was asked for, go on.
//!
//! Inputs are smooth within a segment ([`Inputs`](crate::Inputs)). At the end of one
//!
//! 1. the step ends exactly there, and the natural step size is carried over;
//! 2. all that was evaluated with the old inputs is discarded;
//! 3. where the algebraic equations see the jump, their unknowns and then their sensitivities are
//!    made consistent again.
//!
//! Where a condition on time switches, and where a transition between modes is due, a step ends too
//! (`events`).
//!
//! Errors are measured in the weighted root-mean-square norm with weights rtol |y| + atol · size,
//! of the unknowns and of each direction's sensitivities apart; the largest counts.
//!
//! Where ∂f_a/∂y_a becomes singular, sensitivities end and the states go on alone
//! ([`UndefinedSensitivity`](crate::UndefinedSensitivity)).

// Lengths are constants where storage has a fixed size, and only once inlined there.
#![allow(clippy::inline_always)]

mod along;
mod bdf;
pub mod begin;
mod breaks;
pub mod butcher;
pub mod catalogue;
mod chosen;
pub(crate) mod controller;
mod diagnose;
pub(crate) mod drive;
mod esdirk;
mod events;
mod explicit_rk;
mod history;
mod initial_step;
mod instant;
mod locate;
pub(crate) mod locked;
mod memory;
mod moving_jump;
mod newton;
mod order;
mod record;
mod reselect;
mod rosenbrock;
mod simultaneous;
mod singular_point;
mod stepper;
pub mod tableau;
pub mod tableaux;
mod taylor;
mod trial;
mod watch;

use crate::delay::LateTimes;
use crate::error::{BadRequest, Failure, IntegrateError};
use crate::initial::{Algebraic, Place, start_values};
use crate::linalg::Singular;
use crate::linalg::norm::Tolerances;
use crate::observe::observe;
use crate::problem::{Options, Problem, parameter_size, unknown_sizes};
use crate::projection::Projection;
use crate::signal::{InputError, Segment, Side};
use crate::solution::Solution;
use crate::system::{Direction, Point, Signature, Storage, System};
use breaks::Breaks;
use catalogue::{Method, MethodKind};
use controller::Controller;
use drive::Drive;
use events::Hybrid;
pub use history::{Hat, NODES, Past, Seed};
use locked::Steps;
pub use memory::{Memory, held_by_bounds};
use moving_jump::MovingJumps;
use singular_point::Weak;
use stepper::{At, Base, Directions, Failed, Stepper, Trial};
use taylor::Expansion;

/// Corrections of sensitivities at the start of a history, and the part of the tolerance that is none.
const MOST_CORRECTIONS: usize = 8;
const CORRECTED: f64 = 1e-6;

/// So far before the point at which it can go on no more a run may end, in its span.
const NEAR: f64 = 1e-9;

/// Integrates from the first of the asked `times` to the last and gives the unknowns at all of
/// them.
///
/// Times ascend; one that occurs twice means just before and just after a jump of the inputs
/// ([`side`](crate::side)).
///
/// # Errors
///
/// [`Failure`], with what was reached.
///
/// # Panics
///
/// When the problem has another number of parameters or inputs than the model, or replaces the start
/// value of an unknown that does not exist.
pub fn simulate<S: System>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    S::integrate(problem, times, options, Wanted::Unknowns)
}

/// [`simulate`], of which only the unknowns at the positions `chosen` are kept, in this order: a run of a
/// large model then needs no memory for each of its unknowns at each time.
///
/// # Errors
///
/// [`Failure`], with what was reached.
///
/// # Panics
///
/// As [`simulate`], and where an unknown does not exist.
pub fn simulate_chosen<S: System>(
    problem: &Problem<'_, S>,
    chosen: &[usize],
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    S::integrate(problem, times, options, Wanted::Chosen(chosen))
}

/// [`simulate_chosen`], with the outputs, which are evaluated while the run goes on and may read any unknown:
/// [`observe`](crate::observe) gives them. So a run of a large model needs memory for what it is asked for
/// alone. Where an output is read late, or steps are equal, all is kept on the way.
///
/// # Errors
///
/// [`Failure`], with what was reached.
///
/// # Panics
///
/// As [`simulate_chosen`].
pub fn simulate_observed<S: System>(
    problem: &Problem<'_, S>,
    chosen: &[usize],
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    let outputs = &problem.system.signature().outputs;
    let is_late = outputs.iter().any(|output| output.delay.is_some());
    if !is_late && !matches!(options.steps, Steps::PerSample(_)) {
        return S::integrate(problem, times, options, Wanted::Observed(chosen));
    }
    let observed = |mut solution: Solution| {
        solution.w = observe(problem, &solution).w;
        solution.keep(chosen);
        solution
    };
    match S::integrate(problem, times, options, Wanted::Unknowns) {
        Ok(solution) => Ok(observed(solution)),
        Err(Failure { error, partial }) => {
            Err(Failure { error, partial: Box::new(observed(*partial)) })
        }
    }
}

/// [`simulate`], with the sensitivities of all unknowns to the model's directions.
///
/// # Errors
///
/// [`Failure`], with what was reached.
///
/// # Panics
///
/// As [`simulate`].
pub fn simulate_with_sensitivities<S: System>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<Solution, Failure> {
    S::integrate(problem, times, options, Wanted::Sensitivities)
}

/// What a run gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wanted<'a> {
    /// The unknowns alone.
    Unknowns,
    /// The unknowns, and what is known of delayed ones ([`Solution::past`]) even where no output reads it.
    UnknownsAndPast,
    /// The unknowns at these positions alone, in this order.
    Chosen(&'a [usize]),
    /// The same with all outputs; no output is read late, and steps are adaptive.
    Observed(&'a [usize]),
    /// The unknowns and their sensitivities to the model's directions.
    Sensitivities,
    /// The unknowns of a run that can be gone on from ([`Solution::memory`]), and goes on from another one's
    /// end: the problem has start values of all unknowns then, and the run begins where the other one ended.
    /// Outputs are not read late.
    Resumed(Before<'a>),
    /// The same with sensitivities.
    ResumedSensitivities(Before<'a>),
}

/// What a run goes on from, beside its unknowns.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Before<'a> {
    /// What the run before remembers; `None` for the first one.
    pub memory: Option<&'a Memory>,
    /// What unknowns that are read late were.
    pub past: Option<&'a Past>,
}

impl<'a> Wanted<'a> {
    /// The unknowns to be kept, where that is not all.
    fn chosen(self) -> Option<&'a [usize]> {
        match self {
            Wanted::Chosen(chosen) | Wanted::Observed(chosen) => Some(chosen),
            _ => None,
        }
    }

    fn with_sensitivities(self) -> bool {
        matches!(self, Wanted::Sensitivities | Wanted::ResumedSensitivities(_))
    }

    /// What the run goes on from.
    fn resumed(self) -> Before<'a> {
        match self {
            Wanted::Resumed(before) | Wanted::ResumedSensitivities(before) => before,
            _ => Before::default(),
        }
    }

    /// Whether another run is to go on from this one.
    fn is_remembered(self) -> bool {
        matches!(self, Wanted::Resumed(_) | Wanted::ResumedSensitivities(_))
    }
}

/// What [`simulate`] and [`simulate_with_sensitivities`] do, with this very type of system.
///
/// # Errors
///
/// [`Failure`], with what was reached.
///
/// # Panics
///
/// As [`simulate`].
pub fn integrate<S: System>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    wanted: Wanted<'_>,
) -> Result<Solution, Failure> {
    run(problem, times, options, wanted)
}

/// Runs to all times that the outputs need, and gives the solution at the asked ones.
fn run<S: System>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
    wanted: Wanted<'_>,
) -> Result<Solution, Failure> {
    let signature = problem.system.signature();
    let chosen = wanted.chosen();
    let directions = wanted.with_sensitivities().then(|| Directions::new(problem.system));
    assert_eq!(problem.p.len(), signature.parameters.len(), "number of parameters");
    assert_eq!(problem.inputs.len(), signature.inputs.len(), "number of inputs");
    if let Some(chosen) = chosen {
        let n = signature.unknowns.len();
        assert!(chosen.iter().all(|i| *i < n), "chosen unknowns");
    }
    let n_s = if directions.is_some() { signature.directions.len() } else { 0 };
    let mut solution = Solution::empty(signature, n_s);
    let reads_past = matches!(wanted, Wanted::UnknownsAndPast)
        || wanted.is_remembered()
        || outputs_read_past(signature)
        || (n_s > 0 && signature.outputs.iter().any(|output| output.delay.is_some()));
    if chosen.is_none() && reads_past {
        solution.n_past = signature.past().len();
    }
    let verified = verify(problem, times, options).and_then(|()| {
        history::verify(problem, n_s > 0)?;
        if let MethodKind::Taylor(_) = options.method.kind {
            taylor::verify(problem, options.method.name)?;
        }
        let late = if wanted.is_remembered() { None } else { LateTimes::new(problem, times)? };
        Ok((late, problem.inputs_read().map_err(IntegrateError::Inputs)?))
    });
    let (late, inputs) = match verified {
        Ok(verified) => verified,
        Err(error) => return Err(Failure { error, partial: Box::new(solution) }),
    };
    let read = Problem { inputs: &inputs, ..*problem };
    let all = late.as_ref().map_or(times, |late| &late.all);
    let outcome = match options.steps {
        Steps::PerSample(per_sample) => {
            let outcome = locked::run(&read, all, options, per_sample, directions, &mut solution);
            if let Some(chosen) = chosen {
                solution.keep(chosen);
            }
            outcome
        }
        Steps::Automatic | Steps::Adaptive => {
            solution.n = chosen.map_or(solution.n, <[usize]>::len);
            run_to(&read, all, options, directions, wanted, &mut solution)
        }
    };
    if let Some(late) = late {
        solution = late.split(times, solution);
    }
    match outcome {
        Ok(()) => Ok(solution),
        Err(error) => Err(Failure { error, partial: Box::new(solution) }),
    }
}

/// Runs to `times`; the problem's inputs are those that the model reads.
fn run_to<'a, S: System>(
    problem: &'a Problem<'a, S>,
    times: &[f64],
    options: &Options,
    directions: Option<Directions<S>>,
    wanted: Wanted<'a>,
    solution: &mut Solution,
) -> Result<(), IntegrateError> {
    let (Some(&from), Some(&until)) = (times.first(), times.last()) else {
        return Ok(());
    };
    solution.times.reserve(times.len());
    solution.y.reserve(solution.n * times.len());
    solution.s.reserve(solution.n * solution.n_s * times.len());
    solution.z.reserve(solution.n_z * times.len());
    solution.past.reserve(solution.n_past * times.len());
    let mut simulation = Simulation::new(problem, options, from, directions);
    simulation.chosen = wanted.chosen();
    if let Wanted::Observed(_) = wanted {
        let n_w = problem.system.signature().outputs.len();
        solution.w.reserve(n_w * times.len());
        simulation.observed = Some(vec![0.0; n_w]);
    }
    let before = wanted.resumed();
    simulation.resumed = before.memory;
    if let Some(past) = before.past {
        simulation.drive.resume_history(past, from);
    }
    let outcome = simulation.integrate(times, until, solution);
    if wanted.is_remembered() {
        solution.memory = Some(simulation.memory());
    }
    let reached = simulation.t;
    for stretch in &mut solution.undefined {
        stretch.until = reached;
    }
    outcome
}

/// Whether outputs may read what is known of delayed unknowns: in a condition, too, of which no derivative
/// tells.
fn outputs_read_past(signature: &Signature) -> bool {
    !signature.past().is_empty() && !signature.outputs.is_empty()
}

fn verify<S: System>(
    problem: &Problem<'_, S>,
    times: &[f64],
    options: &Options,
) -> Result<(), IntegrateError> {
    verify_request(times, options).map_err(IntegrateError::BadRequest)?;
    verify_inputs(problem, times).map_err(IntegrateError::Inputs)
}

/// Whether options and times make sense.
pub fn verify_request(times: &[f64], options: &Options) -> Result<(), BadRequest> {
    options.verify().and_then(|()| verify_times(times))
}

/// Whether the inputs reach as far as the times, and are smooth where they must be.
pub fn verify_inputs<S: System>(problem: &Problem<'_, S>, times: &[f64]) -> Result<(), InputError> {
    match (times.first(), times.last()) {
        (Some(&from), Some(&until)) => {
            let covered = problem.inputs.cover(from, until);
            covered.and_then(|()| problem.verify_smooth(from, until))
        }
        _ => Ok(()),
    }
}

fn verify_times(times: &[f64]) -> Result<(), BadRequest> {
    // Counted without a way out in the middle, so that many are compared at once. What ascends from
    // one finite number to another is finite.
    let ascending = times.iter().zip(times.iter().skip(1)).filter(|(t, next)| t < next).count();
    if let (Some(first), Some(last)) = (times.first(), times.last())
        && first.is_finite()
        && last.is_finite()
        && ascending + 1 == times.len()
    {
        return Ok(());
    }
    if let Some(index) = times.iter().position(|t| !t.is_finite()) {
        return Err(BadRequest::TimeNotFinite { index });
    }
    if let Some(pair) = times.windows(2).find(|pair| pair[1] < pair[0]) {
        return Err(BadRequest::TimeBackwards { at: pair[1], previous: pair[0] });
    }
    if let Some(three) = times.windows(3).find(|three| three[0] == three[2]) {
        return Err(BadRequest::TimeRepeated { at: three[0] });
    }
    Ok(())
}

/// An error this large, in units of the tolerance, says little of the step that would have been right.
const FAR_OFF: f64 = 10.0;

/// What happens at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stop {
    /// Nothing.
    None,
    /// Inputs or modes change: values just after are not those just before.
    Change,
}

/// What a step is tried for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Variables {
    /// Unknowns, and sensitivities where they are wanted.
    All,
    /// Unknowns alone.
    Unknowns,
}

/// A simulation under way.
struct Simulation<'a, S: System> {
    problem: &'a Problem<'a, S>,
    tolerances: Tolerances,
    max_steps: usize,
    initial_step: Option<f64>,
    method: &'static Method,
    stepper: Stepper<S>,
    /// `None` without sensitivities, and once they are undefined.
    directions: Option<Directions<S>>,
    algebraic: Algebraic<S>,
    /// The current segment of the inputs, and where it ends.
    segment: usize,
    segment_end: f64,
    drive: Drive<'a, S>,
    /// Modes, conditions on time, and what is known of the instant at which they change.
    discrete: Hybrid,
    /// Where jumps of the inputs move with parameters.
    moving: Option<MovingJumps<S>>,
    /// Where unknowns are read late.
    breaks: Option<Breaks<S>>,
    t: f64,
    y: S::Vector,
    /// Sizes of the unknowns, for tolerances.
    sizes: S::Vector,
    /// Whether the stepper is linearised at (t, y) with the current inputs.
    linearized: bool,
    /// Whether algebraic unknowns were made consistent again after a rejection at t.
    corrected: bool,
    /// Length of the simulation.
    span: f64,
    row: S::Vector,
    sensitivity_row: Option<S::Sensitivity>,
    /// Of recorded rows; `None` where no mode has algebraic unknowns.
    projection: Option<Box<Projection<S>>>,
    /// The unknowns to be recorded; all without it.
    chosen: Option<&'a [usize]>,
    /// Work space for outputs, where they are recorded.
    observed: Option<Vec<f64>>,
    /// What the run goes on from.
    resumed: Option<&'a Memory>,
    /// The natural step size, for a run that goes on from this one.
    natural_step: Option<f64>,
}

impl<'a, S: System> Simulation<'a, S> {
    fn new(
        problem: &'a Problem<'a, S>,
        options: &Options,
        from: f64,
        directions: Option<Directions<S>>,
    ) -> Self {
        let system = problem.system;
        debug_assert!(S::FEATURES.cover(system.signature()), "features that the type leaves out");
        let n = system.signature().unknowns.len();
        let segment = problem.inputs.segment_at(from, Side::Right);
        let n_s = if directions.is_some() { system.signature().directions.len() } else { 0 };
        let discrete = Hybrid::new(system, problem.p, from, n_s);
        // With transitions the jumps are taken one by one in either case, so that one mode follows
        // the other in the same way.
        let moves = S::FEATURES.past && (n_s > 0 || discrete.has_transitions());
        let moving = moves.then(|| MovingJumps::new(problem));
        let tolerances = Tolerances { rtol: options.rtol, atol: options.atol };
        let drive = Drive::new(problem, problem.inputs.segment(segment), from, n_s, tolerances);
        let has_algebraic =
            S::FEATURES.algebraic && !Algebraic::<S>::is_explicit(system.signature());
        let sensitivity_row = directions.as_ref().map(|directions| directions.s.clone());
        let kind = options.method.kind;
        let mut stepper = Stepper::new(system, kind);
        if let MethodKind::Taylor(order) = kind {
            let order = taylor::order(order, options.rtol);
            stepper.expansion = Expansion::new(system, order, n_s);
        }
        Self {
            problem,
            tolerances,
            max_steps: options.max_steps,
            initial_step: options.initial_step,
            method: options.method,
            stepper,
            directions,
            algebraic: Algebraic::new(system),
            projection: has_algebraic.then(|| Box::new(Projection::new(system, n_s))),
            segment,
            segment_end: problem.inputs.segment(segment).t1,
            breaks: drive.history.is_some().then(|| Breaks::new(n, sensitivity_row.clone())),
            drive,
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

    fn integrate(
        &mut self,
        times: &[f64],
        until: f64,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.start(solution)?;
        self.record_now(times, solution);
        self.natural_step = self.resumed_step();
        if self.t == until {
            return Ok(());
        }

        self.span = until - self.t;
        let first = self.stop().min(until) - self.t;
        let h = match self.natural_step.or(self.initial_step) {
            Some(h) => h,
            None => self.initial_step(first, solution),
        };
        let kind = self.method.kind;
        let order = kind.estimate_order(self.tolerances.rtol);
        let mut controller = Controller::new(h, order, kind.law());
        loop {
            // A step may end with an event, which delays make a break of.
            let end = self.stop().min(until);
            if self.t < end {
                self.step(&mut controller, times, end, solution)?;
                continue;
            }
            if solution.times.len() == times.len() {
                // A method with several steps begins with its lowest order.
                self.natural_step = (!self.stepper.is_multistep()).then_some(controller.h);
                return Ok(());
            }
            if self.t == self.segment_end {
                self.enter_next_segment(solution)?;
            }
            self.switch_conditions(solution)?;
            self.pass_breaks(solution)?;
            self.record_now(times, solution);
        }
    }

    /// Consistent start values and sensitivities.
    fn start(&mut self, solution: &mut Solution) -> Result<(), IntegrateError> {
        let Problem { system, p, start, .. } = *self.problem;
        let n = self.y.as_ref().len();
        let u = self.drive.at(self.t, self.y.as_ref());
        let at = Point { t: self.t, y: &[], u, p, z: self.discrete.z() };
        start_values(self.problem, at, self.y.as_mut()).map_err(IntegrateError::Initial)?;
        unknown_sizes(system, self.y.as_ref(), self.sizes.as_mut());
        if let Some(d) = &mut self.directions {
            system.start_sensitivities(at, d.s.as_mut());
            let directions = &system.signature().directions;
            // A replaced start value depends on nothing but itself.
            for &(i, _) in start {
                let columns = d.s.as_mut().chunks_exact_mut(n);
                for (column, direction) in columns.zip(directions.iter()) {
                    column[i] = f64::from(u8::from(*direction == Direction::Start(i)));
                }
            }
            let columns = d.sizes.as_mut().chunks_exact_mut(n.max(1));
            for (column, direction) in columns.zip(directions.iter()) {
                let of_direction = match *direction {
                    Direction::Parameter(position) => parameter_size(system, position),
                    Direction::Start(i) => self.sizes.as_ref()[i],
                };
                for (size, unknown) in column.iter_mut().zip(self.sizes.as_ref()) {
                    *size = unknown / of_direction;
                }
            }
        }
        solution.statistics.segments = 1;
        match self.resumed {
            None => self.begin_modes(),
            Some(memory) => self.recall_modes(memory),
        }
        self.select_first_states();
        self.begin_switches();
        if let Some(memory) = self.resumed {
            self.recall_bounds(memory);
        }
        self.make_consistent(solution)?;
        self.reselect_states(solution)?;
        // What is beyond its bound at the start; other conditions that are true from the start act
        // once they have been false.
        self.begin_sample();
        self.settle(solution)?;
        self.begin_history();
        self.pass_breaks(solution)
    }

    /// Makes algebraic unknowns and their sensitivities consistent with the current inputs.
    fn make_consistent(&mut self, solution: &mut Solution) -> Result<(), IntegrateError> {
        self.make_values_consistent()?;
        if !self.algebraic.is_empty() && self.directions.is_some() {
            self.linearize_values();
            self.make_sensitivities_consistent(solution);
        }
        Ok(())
    }

    /// Makes algebraic unknowns consistent with the current inputs and modes.
    fn make_values_consistent(&mut self) -> Result<(), IntegrateError> {
        self.linearized = false;
        self.stepper.restart();
        if self.algebraic.is_empty() {
            return Ok(());
        }
        let Problem { system, p, .. } = *self.problem;
        let at =
            Place { t: self.t, u: self.drive.at(self.t, self.y.as_ref()), p, z: self.discrete.z() };
        self.algebraic
            .make_consistent(
                system,
                at,
                self.y.as_mut(),
                self.stepper.jacobian.as_mut(),
                self.sizes.as_ref(),
                self.tolerances,
            )
            .map_err(IntegrateError::Initial)
    }

    /// Linearises at (t, y), sensitivities left aside: no step can start from that.
    fn linearize_values(&mut self) {
        let Problem { system, p, .. } = *self.problem;
        let (mass, z) = (&self.algebraic.mass, self.discrete.z());
        let base = Base { system, p, z, mass, t: self.t };
        self.stepper.linearize(base, &mut self.drive, self.y.as_ref(), None);
        self.linearized = false;
    }

    /// Makes the sensitivities of algebraic unknowns follow those of the others, or ends them where
    /// they are not determined. The stepper is linearised at (t, y).
    fn make_sensitivities_consistent(&mut self, solution: &mut Solution) {
        let Problem { system, p, .. } = *self.problem;
        if self.directions.is_none() {
            return;
        }
        let singular = self.weak_equation(self.t, Weak::Singular);
        let Some(d) = &mut self.directions else { return };
        let pattern = &system.signature().jacobian;
        let jacobian = self.stepper.jacobian.as_ref();
        let singular = singular.or_else(|| {
            self.algebraic.factorise(pattern, jacobian).err().map(|Singular { row }| row)
        });
        solution.statistics.factorisations += 2;
        if let Some(row) = singular {
            self.end_sensitivities(self.t, row, solution);
        } else {
            let u = self.drive.at(self.t, self.y.as_ref());
            let at = Point { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
            let (s, g) = (d.s.as_mut(), d.g.as_mut());
            self.algebraic.make_sensitivities_consistent(system, at, s, g);
        }
    }

    /// Makes sensitivities of algebraic unknowns consistent with a history that has begun with them: until
    /// then what is read late was read as if it were not, with the derivative −ẋ to a delay, although nothing
    /// moved before the start. Linear but for delays that vary, so that one correction is most of it.
    fn make_sensitivities_consistent_with_history(&mut self) {
        let Problem { system, p, .. } = *self.problem;
        let history = self.drive.history.as_ref();
        if self.algebraic.is_empty() || history.is_none_or(|history| history.is_resumed()) {
            return;
        }
        for _ in 0..MOST_CORRECTIONS {
            let Some(d) = &mut self.directions else { return };
            let u = self.drive.at(self.t, self.y.as_ref());
            let at = Point { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
            let (s, g) = (d.s.as_mut(), d.g.as_mut());
            self.algebraic.correct_sensitivities(system, at, s, g);
            let Some(history) = &mut self.drive.history else { return };
            history.begin_sensitivities(self.y.as_ref(), s);
            let (sizes, atol) = (d.sizes.as_ref(), self.tolerances.atol);
            let is_small = |(g, size): (&f64, &f64)| g.abs() <= CORRECTED * atol * size;
            if g.iter().zip(sizes).all(is_small) {
                return;
            }
        }
    }

    /// Tries one step, and records what was asked for if it is accepted.
    #[inline]
    fn step(
        &mut self,
        controller: &mut Controller,
        times: &[f64],
        end: f64,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        let tried = solution.statistics.steps + solution.statistics.rejected;
        if tried >= self.max_steps {
            return Err(self.too_many_steps(tried));
        }
        if !self.stepper.solves_algebraic() && !self.algebraic.is_empty() {
            return Err(self.unsuited_method());
        }
        if self.stepper.wants_slopes() {
            self.begin_stepper(controller, solution);
        } else if !self.linearized && self.stepper.wants_jacobian() {
            self.linearize_for_step(solution);
        }

        let remaining = end - self.t;
        if !self.linearized && self.stepper.wants_series() {
            self.expand(controller.h.min(remaining), solution);
        }
        let h = controller.propose(remaining).min(self.reach());
        let outcome = self.try_step(h, Variables::All, solution);
        let error = match outcome {
            Ok(()) => self.error(),
            Err(_) => f64::NAN,
        };
        let error = if error > 1.0 { self.error_beyond_rounding(h, error) } else { error };
        let t_new = if h < remaining { self.t + h } else { end };
        // NaN compares false: what could not be evaluated is not accepted.
        if error <= 1.0 {
            if let Some(error) = self.reads_ahead(h) {
                return self.step_less_far(h, error, controller, solution);
            }
            if self.reaches_mark(t_new) {
                return Ok(());
            }
            if S::FEATURES.events
                && self.discrete.has_transitions()
                && let Some(part) = self.watch(h, t_new)
            {
                return self.step_to_threshold(controller, (h, part), t_new, times, solution);
            }
            let stop = if t_new == self.stop() { Stop::Change } else { Stop::None };
            self.accept(t_new, stop, times, solution);
            if let MethodKind::Bdf(most) = self.method.kind {
                self.choose_order(h, error, most, controller);
            } else {
                controller.accept(h, error);
            }
            return self.reselect_states(solution);
        }

        if error.is_finite() && self.step_to_corner((h, t_new), times, solution)? {
            return Ok(());
        }
        solution.statistics.rejected += 1;
        let had_memory = self.stepper.is_multistep() && !self.stepper.is_at_beginning();
        if self.stepper.is_multistep() {
            self.reject_multistep(h, error, controller);
        } else if error.is_finite() {
            controller.reject(h, error);
            if error > FAR_OFF * FAR_OFF {
                controller.limit(h, self.transient_step());
            }
        } else {
            controller.abandon(h);
        }
        // Below this a step does not move t reliably, and stages cannot be told apart.
        let least = 4.0 * f64::EPSILON * self.t.abs().max(f64::EPSILON * self.span);
        if controller.h > least {
            if had_memory || (self.stepper.is_multistep() && error.is_finite()) {
                return Ok(());
            }
            if let Some(h) = self.after_rejection(h, remaining, times, solution) {
                controller.h = h;
                // It leads off a singular point, and sensitivities have ended there.
                self.begin_sample();
                self.settle(solution)?;
            }
            return Ok(());
        }
        if error.is_finite()
            && let Some(row) = self.unresolved_equation(h)
        {
            self.end_sensitivities(self.t, row, solution);
            return Ok(());
        }
        Err(match outcome {
            Err(Failed::Singular { row }) => self.singular_iteration(h, row),
            Err(Failed::NotConverged { unknown }) => self.newton_diverged(h, unknown),
            Err(Failed::NotFinite { t, spoilt }) => self.spoilt(t, spoilt),
            Err(Failed::Unsettled) => self.step_size_too_small(h),
            Ok(()) if error.is_finite() => self.step_size_too_small(h),
            Ok(()) => self.not_finite(h),
        })
    }

    /// Goes on with shorter steps up to where a delay falls below zero, and ends there.
    fn step_less_far(
        &mut self,
        h: f64,
        error: IntegrateError,
        controller: &mut Controller,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if h <= NEAR * self.span {
            return Err(error);
        }
        solution.statistics.rejected += 1;
        if self.stepper.is_multistep() {
            self.reject_multistep(h, f64::NAN, controller);
        } else {
            controller.abandon(h);
        }
        Ok(())
    }

    /// Linearises at (t, y) as a step needs it.
    #[inline]
    fn linearize_for_step(&mut self, solution: &mut Solution) {
        let with_sensitivities = self.stepper.wants_second_derivatives();
        let base = base(self.problem, &self.algebraic, &self.discrete, self.t);
        let directions = self.directions.as_mut().filter(|_| with_sensitivities);
        let directions = directions.map(|d| (d, At::Start));
        self.stepper.linearize(base, &mut self.drive, self.y.as_ref(), directions);
        solution.statistics.linearizations += 1;
        self.linearized = true;
    }

    /// Tries a step of size h; one that reads itself is made consistent with itself.
    #[inline]
    fn try_step(
        &mut self,
        h: f64,
        variables: Variables,
        solution: &mut Solution,
    ) -> Result<(), Failed> {
        self.forget_trial();
        self.attempt(h, variables, solution)?;
        self.close_step(h, variables, solution)
    }

    /// Makes one attempt at a step of size h.
    #[inline]
    fn attempt(
        &mut self,
        h: f64,
        variables: Variables,
        solution: &mut Solution,
    ) -> Result<(), Failed> {
        let base = base(self.problem, &self.algebraic, &self.discrete, self.t);
        let sizes = self.sizes.as_ref();
        let trial = Trial { base, y: &self.y, h, sizes, tolerances: self.tolerances };
        let directions = self.directions.as_mut().filter(|_| variables == Variables::All);
        let statistics = &mut solution.statistics;
        let outcome = self.stepper.attempt(trial, &mut self.drive, directions, statistics);
        self.linearized &= !std::mem::take(&mut self.stepper.moved);
        outcome
    }

    /// Square of the local error of the step tried last, in units of the tolerance.
    #[inline]
    fn error(&self) -> f64 {
        let (y, y_new) = (self.y.as_ref(), self.stepper.y_new.as_ref());
        let e = self.stepper.local_error();
        let error = self.tolerances.mean_square(e, y, y_new, self.sizes.as_ref());
        larger(error, self.sensitivity_error())
    }

    /// Square of the local error of the sensitivities of the step tried last.
    #[inline]
    fn sensitivity_error(&self) -> f64 {
        let Some(d) = &self.directions else {
            return 0.0;
        };
        let e = self.stepper.sensitivity_error(d);
        let (s, s_new) = (d.s.as_ref(), d.s_new.as_ref());
        let n = self.y.as_ref().len().max(1);
        largest_block(self.tolerances, n, e, s, s_new, d.sizes.as_ref())
    }

    /// Records the asked times of an accepted step, and moves on to its end.
    #[inline]
    fn accept(&mut self, t_new: f64, stop: Stop, times: &[f64], solution: &mut Solution) {
        solution.statistics.steps += 1;
        self.linearized = false;
        self.corrected = false;
        if !self.algebraic.is_empty() && self.directions.is_some() {
            self.look_for_singular_point(t_new, solution);
        }
        self.remember_step(t_new);
        self.record_step(t_new, stop, times, solution);
        if let MethodKind::Explicit(tableau) = self.method.kind {
            self.stepper.note_stiffness(tableau, t_new - self.t);
        }
        self.stepper.advance(&self.algebraic.mass, self.directions.as_mut());
        std::mem::swap(&mut self.y, &mut self.stepper.y_new);
        if let Some(d) = &mut self.directions {
            std::mem::swap(&mut d.s, &mut d.s_new);
        }
        self.t = t_new;
    }

    /// Where the next step must end: something changes there.
    #[inline]
    fn stop(&self) -> f64 {
        let mut stop = self.segment_end;
        if S::FEATURES.events {
            stop = stop.min(self.discrete.next_switch());
        }
        if S::FEATURES.past {
            stop = stop.min(self.next_break());
        }
        stop
    }

    /// Makes the next segment of the inputs the current one.
    fn enter_next_segment(&mut self, solution: &mut Solution) -> Result<(), IntegrateError> {
        solution.statistics.segments += 1;
        self.segment += 1;
        let segment = self.problem.inputs.segment(self.segment);
        self.segment_end = segment.t1;
        if S::FEATURES.past
            && let Some(mut moving) = self.moving.take()
            && (self.directions.is_some() || self.discrete.has_transitions())
        {
            let entered = self.enter_with_moving_jumps(segment, &mut moving, solution);
            self.moving = Some(moving);
            return entered;
        }
        let level = self.level_of(segment);
        self.jump(segment, solution)?;
        self.mark(level, &[]);
        Ok(())
    }

    /// Goes on with the inputs of a segment that begins at a time of its own, and makes the
    /// transitions that their jump triggers.
    fn jump(
        &mut self,
        segment: Segment<'_>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.begin_sample();
        self.enter(segment, solution)?;
        self.settle(solution)
    }

    /// Goes on with the inputs of a segment.
    fn enter(
        &mut self,
        segment: Segment<'_>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.change_inputs(solution, |drive| drive.enter(segment))
    }

    /// Goes on with inputs that change as `enter` says.
    fn change_inputs(
        &mut self,
        solution: &mut Solution,
        enter: impl FnOnce(&mut Drive<S>),
    ) -> Result<(), IntegrateError> {
        let Problem { system, p, .. } = *self.problem;
        self.linearized = false;
        self.stepper.restart();
        if self.algebraic.is_empty() {
            enter(&mut self.drive);
            return Ok(());
        }

        // Most jumps are not seen by algebraic equations.
        let (t, y, z) = (self.t, self.y.as_ref(), self.discrete.z());
        let (before, after) = (&mut self.stepper.f, &mut self.stepper.y_new);
        let mut evaluate = |drive: &mut Drive<S>, f: &mut S::Vector, place: At| {
            let at = Point { t, y, u: drive.at(t, y), p, z };
            match (&mut self.directions, place) {
                (None, _) => system.rhs(at, f.as_mut()),
                (Some(Directions { s, g, .. }), At::Start) => {
                    system.sensitivity_rhs(at, s.as_ref(), f.as_mut(), g.as_mut());
                }
                (Some(Directions { s, s_new, .. }), At::End) => {
                    system.sensitivity_rhs(at, s.as_ref(), f.as_mut(), s_new.as_mut());
                }
            }
        };
        evaluate(&mut self.drive, before, At::Start);
        enter(&mut self.drive);
        evaluate(&mut self.drive, after, At::End);
        let seen = self
            .directions
            .as_ref()
            .is_some_and(|d| self.algebraic.differs(d.g.as_ref(), d.s_new.as_ref()));
        solution.statistics.evaluations += 2;
        if seen || self.algebraic.differs(before.as_ref(), after.as_ref()) {
            self.make_consistent(solution)?;
        }
        Ok(())
    }
}

/// Where a step from t starts.
#[inline(always)]
fn base<'a, S: System>(
    problem: &Problem<'a, S>,
    algebraic: &'a Algebraic<S>,
    discrete: &'a Hybrid,
    t: f64,
) -> Base<'a, S> {
    let Problem { system, p, .. } = *problem;
    Base { system, p, z: discrete.z(), mass: &algebraic.mass, t }
}

/// The largest mean square over blocks of n numbers; NaN if one is.
#[inline(always)]
fn largest_block(
    tolerances: Tolerances,
    n: usize,
    e: &[f64],
    y: &[f64],
    y_new: &[f64],
    sizes: &[f64],
) -> f64 {
    let mut largest = 0.0;
    for first in (0..e.len()).step_by(n) {
        let block = first..first + n;
        let [e, y, y_new] = [&e[block.clone()], &y[block.clone()], &y_new[block.clone()]];
        largest = larger(largest, tolerances.mean_square(e, y, y_new, &sizes[block]));
    }
    largest
}

/// The larger of two numbers; NaN if one is.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

fn multiply(values: &mut [f64], by: &[f64]) {
    for (value, by) in values.iter_mut().zip(by) {
        *value *= by;
    }
}
