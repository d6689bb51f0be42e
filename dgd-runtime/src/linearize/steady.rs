//! Steady states: 0 = f(t, y, u, p) with inputs and time standing still.
//!
//! Damped Newton from the model's start, for all unknowns together, in the modes that hold there. If that fails, or
//! ends where other modes would hold, a run with the inputs held continues until it comes to rest, through any mode
//! changes, and Newton starts again from its end. Delayed values equal current ones.

use nalgebra::DMatrix;

use super::conserved::ConservedCombination;
use super::error::SteadyStateError;
use super::held::SteadyEquations;
use super::point::OperatingPoint;
use super::singular;
use crate::algebraic::{AlgebraicPoint, AlgebraicSystem, add_terms};
use crate::discrete::state_selection::select_states;
use crate::discrete::{choose_sides, choose_start_modes, discrete_numbers};
use crate::error::IntegrateError;
use crate::integrate::fixed_step::Steps;
use crate::integrate::simulate;
use crate::integrate::start::consistent::consistent_start;
use crate::linalg::norm::Tolerances;
use crate::observe::delay::delays;
use crate::problem::{Options, Problem, unknown_sizes};
use crate::signal::{Inputs, LimitSide};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// The run towards rest lasts 10^k seconds, for k up to this.
const LONGEST: i32 = 9;
/// Maximum number of its steps.
const MOST_STEPS: usize = 20_000;
/// Maximum number of times the sides of switches are chosen again.
const MOST_SIDES: usize = 8;
/// Residuals below this fraction of the equation's terms, at unknowns of their sizes, count as zero.
const AT_REST: f64 = 1e-9;
/// Error allowed for a run at rest, in units of its tolerance.
const RUN: f64 = 10.0;
/// Tolerances of the last corrections.
const POLISHED: Tolerances = Tolerances { rtol: 1e-10, atol: 1e-10 };

/// A steady state, and the conserved combinations held there.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyState {
    /// The point.
    pub at: OperatingPoint,
    /// Conserved combinations; empty if the steady state is isolated.
    pub conserved: Vec<ConservedCombination>,
}

/// The steady state of `problem` with the inputs as they are at `t`, found from its start values there.
///
/// If there are several, it is one near the start values; it need not be stable.
///
/// # Errors
///
/// [`SteadyStateError`]: there is none, there is a continuous family of them, or none is found.
pub fn steady_state<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    t: f64,
    options: &Options,
) -> Result<OperatingPoint, SteadyStateError> {
    found(problem, t, options, false).map(|rest| rest.at)
}

/// The same, but from a family of steady states takes the one that a run from the start values approaches: conserved
/// combinations keep their values.
///
/// # Errors
///
/// [`SteadyStateError`]: there is none, or none is found.
pub fn rest<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    t: f64,
    options: &Options,
) -> Result<SteadyState, SteadyStateError> {
    found(problem, t, options, true)
}

fn found<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    t: f64,
    options: &Options,
    may_hold: bool,
) -> Result<SteadyState, SteadyStateError> {
    let verified = problem.verify().and_then(|()| problem.verify_factorisation());
    verified.map_err(|error| SteadyStateError::Start(IntegrateError::BadRequest(error)))?;
    let mut constant = vec![0.0; problem.inputs.len()];
    problem
        .inputs
        .cover(t, t)
        .map_err(|error| SteadyStateError::Start(IntegrateError::Inputs(error)))?;
    problem.inputs.value(t, LimitSide::Right, &mut constant);
    let inputs = Inputs::constant(&constant);
    let problem = Problem { inputs: &inputs, ..*problem };
    let start = consistent_start(&problem, t, options).map_err(SteadyStateError::Start)?;
    let mut search =
        SteadySearch::new(&problem, t, &start.y, options).map_err(SteadyStateError::Start)?;
    search.may_hold = may_hold;
    if let Some(found) = search.rest(&start.y, &start.z, InitialGuess::Start)? {
        return Ok(found);
    }

    let mut times = vec![t];
    times.extend((-1..=LONGEST).map(|k| t + 10_f64.powi(k)));
    let patient = Options { max_steps: MOST_STEPS, steps: Steps::Adaptive, ..*options };
    let solution = match simulate(&problem, &times, &patient) {
        Ok(solution) => solution,
        Err(failure) => *failure.partial,
    };
    // Later rows are closer to rest, unless the run ended early.
    for k in (0..solution.len()).rev() {
        if let Some(found) = search.rest(solution.y(k), solution.z(k), InitialGuess::Run)? {
            return Ok(found);
        }
    }
    let last = solution.len().checked_sub(1);
    let (ran, y, z) = last.map_or((0.0, start.y, search.z.clone()), |k| {
        (solution.times[k] - t, solution.y(k).to_vec(), solution.z(k).to_vec())
    });
    if let Some(found) = search.rest_close(&y, &z) {
        return Ok(found);
    }
    Err(search.failure(&y, &z, ran))
}

/// The origin of a guess.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum InitialGuess {
    /// The start values.
    Start,
    /// A run, whose modes hold.
    Run,
}

/// The search for a steady state.
struct SteadySearch<'a, S: SolvableSystem> {
    problem: &'a Problem<'a, S>,
    t: f64,
    /// Inputs without delays.
    u: Vec<f64>,
    /// Discrete numbers at the start.
    z: Vec<f64>,
    sizes: Vec<f64>,
    tolerances: Tolerances,
    equations: AlgebraicSystem<S>,
    jacobian: S::Jacobian,
    start: Vec<f64>,
    /// Whether conserved combinations may be held.
    may_hold: bool,
}

impl<'a, S: SolvableSystem> SteadySearch<'a, S> {
    fn new(
        problem: &'a Problem<'a, S>,
        t: f64,
        start: &[f64],
        options: &Options,
    ) -> Result<Self, IntegrateError> {
        let system = problem.system;
        let inputs = problem.inputs_read().map_err(IntegrateError::Inputs)?;
        let mut u = vec![0.0; inputs.len()];
        inputs.value(t, LimitSide::Right, &mut u);
        let mut sizes = vec![0.0; start.len()];
        unknown_sizes(system, start, &mut sizes);
        let mut z = discrete_numbers(system, problem.p, t);
        let mut e = vec![0.0; system.signature().discrete.transitions().count()];
        let point = EvaluationPoint { t, y: start, u: &u, p: problem.p, z: &[] };
        choose_start_modes(system, point, &mut e, &mut z);
        Ok(Self {
            problem,
            t,
            u,
            z,
            sizes,
            tolerances: Tolerances { rtol: options.rtol, atol: options.atol },
            equations: AlgebraicSystem::all(system),
            jacobian: S::Jacobian::zeros(system.signature().jacobian.len()),
            start: start.to_vec(),
            may_hold: false,
        })
    }

    fn point<'b>(&'b self, y: &'b [f64], z: &'b [f64]) -> EvaluationPoint<'b> {
        EvaluationPoint { t: self.t, y, u: self.u.as_slice(), p: self.problem.p, z }
    }

    /// A steady state from this guess: an isolated one, or one with conserved combinations held.
    fn rest(
        &mut self,
        guess: &[f64],
        z: &[f64],
        of: InitialGuess,
    ) -> Result<Option<SteadyState>, SteadyStateError> {
        if let Some(found) = self.search_from(guess, z.to_vec(), of) {
            match self.undetermined(&found.y, &found.z) {
                None => return Ok(Some(SteadyState { at: found, conserved: Vec::new() })),
                Some(error) if !self.may_hold => return Err(error),
                Some(_) => {}
            }
        }
        Ok(self.rest_held(guess, z, of, false))
    }

    /// The last row of a run, if it is at rest in a family of steady states.
    fn rest_close(&mut self, y: &[f64], z: &[f64]) -> Option<SteadyState> {
        self.rest_held(y, z, InitialGuess::Run, true)
    }

    /// A steady state with conserved combinations held at their values at the guess; with `close`, those that are
    /// conserved only close to it.
    fn rest_held(
        &mut self,
        guess: &[f64],
        z: &[f64],
        of: InitialGuess,
        close: bool,
    ) -> Option<SteadyState> {
        let knows_late = !self.problem.system.signature().delayed_unknowns.is_empty();
        if !self.may_hold || knows_late || self.undetermined(guess, z).is_none() {
            return None;
        }
        let mut z = self.at_start(z.to_vec());
        let mut e = vec![0.0; self.problem.system.signature().discrete.transitions().count()];
        let mut y = guess.to_vec();
        for _ in 0..MOST_SIDES {
            let families = self.held();
            let conserved = if close {
                families.conserved_close(guess, &z, &self.start)
            } else {
                families.conserved(guess, &z, &self.start)
            };
            let is_solved = !conserved.is_empty()
                && families.drift(&conserved, guess, &z).is_none()
                && families.solve(&conserved, &mut y, &z)
                && families.open(&conserved, &y, &z).is_none();
            if !is_solved {
                return None;
            }
            let rests = of == InitialGuess::Run && self.is_near(&y, guess);
            if !rests && (close || !self.holds(&y, &z, &mut e)) {
                let before = z.clone();
                choose_sides(self.problem.system, self.point(&y, &[]), &mut e, &mut z);
                if close || z == before {
                    return None;
                }
                continue;
            }
            select_states(self.problem.system, self.point(&y, &[]), &mut z, &mut e);
            return Some(SteadyState { at: self.seen_delayed(y, z), conserved });
        }
        None
    }

    fn held(&self) -> SteadyEquations<'_, S> {
        SteadyEquations { problem: self.problem, t: self.t, u: &self.u, sizes: &self.sizes }
    }

    /// Conditions on time as they are at t, regardless of how long the run was.
    fn at_start(&self, mut z: Vec<f64>) -> Vec<f64> {
        let n_automata = self.problem.system.signature().discrete.automata.len();
        z[n_automata..].copy_from_slice(&self.z[n_automata..]);
        z
    }

    /// A steady state from this guess, in modes that hold there.
    fn search_from(
        &mut self,
        guess: &[f64],
        z: Vec<f64>,
        of: InitialGuess,
    ) -> Option<OperatingPoint> {
        let system = self.problem.system;
        let mut z = self.at_start(z);
        let mut e = vec![0.0; system.signature().discrete.transitions().count()];
        let mut y = guess.to_vec();
        for _ in 0..MOST_SIDES {
            let place =
                AlgebraicPoint { t: self.t, u: self.u.as_slice(), p: self.problem.p, z: &z };
            let (jacobian, tolerances) = (self.jacobian.as_mut(), self.tolerances);
            let solved =
                self.equations.solve(system, place, &mut y, jacobian, &self.sizes, tolerances);
            solved.ok()?;
            if y.iter().any(|y| !y.is_finite()) {
                return None;
            }
            // A run may come to rest on a threshold.
            let rests = of == InitialGuess::Run && self.is_near(&y, guess);
            if rests || self.holds(&y, &z, &mut e) {
                self.polish(&mut y, &z);
                select_states(system, self.point(&y, &[]), &mut z, &mut e);
                return Some(self.seen_delayed(y, z));
            }
            let before = z.clone();
            choose_sides(system, self.point(&y, &[]), &mut e, &mut z);
            if z == before {
                return None;
            }
        }
        None
    }

    /// Whether Newton's method moved by no more than the error of a run.
    fn is_near(&self, y: &[f64], guess: &[f64]) -> bool {
        let weights = y.iter().zip(&self.sizes).map(|(y, size)| self.tolerances.weight(*y, *size));
        y.iter()
            .zip(guess)
            .zip(weights)
            .all(|((y, guess), weight)| (y - guess).abs() <= RUN * weight)
    }

    /// Iterates until only rounding is left, if possible.
    fn polish(&mut self, y: &mut Vec<f64>, z: &[f64]) {
        let mut polished = y.clone();
        let place = AlgebraicPoint { t: self.t, u: self.u.as_slice(), p: self.problem.p, z };
        let (system, jacobian) = (self.problem.system, self.jacobian.as_mut());
        let solved =
            self.equations.solve(system, place, &mut polished, jacobian, &self.sizes, POLISHED);
        if solved.is_ok() && polished.iter().all(|y| y.is_finite()) {
            *y = polished;
        }
    }

    /// Whether no transition out of these modes is pending.
    fn holds(&self, y: &[f64], z: &[f64], e: &mut [f64]) -> bool {
        let system = self.problem.system;
        let discrete = &system.signature().discrete;
        system.event_functions(self.point(y, z), e);
        let mut transitions = discrete.transitions().zip(e.iter());
        !transitions.any(|((automaton, transition), e)| {
            let decides = discrete.automata[automaton].kind.has_equations_by_mode();
            decides && z[automaton] == transition.from as f64 && transition.crossing.is_past(*e)
        })
    }

    /// The point as a run at rest would see it, with a constant past of delayed unknowns.
    fn seen_delayed(&self, y: Vec<f64>, z: Vec<f64>) -> OperatingPoint {
        let signature = self.problem.system.signature();
        let mut u = self.u.clone();
        let past = signature.past();
        let tau = delays(self.problem);
        let mut varying = vec![0.0; signature.varying_delays.len()];
        if !varying.is_empty() {
            self.problem.system.varying_delays(self.point(&y, &z), &mut varying);
        }
        for (k, delayed) in signature.delayed_unknowns.iter().enumerate() {
            let tau = if delayed.varies { varying[delayed.delay] } else { tau[delayed.delay] };
            u[past.held().start + k] = f64::from(u8::from(tau != 0.0));
            u[past.values().start + k] = y[delayed.unknown];
        }
        OperatingPoint { t: self.t, y, u, z }
    }

    fn failure(&mut self, y: &[f64], z: &[f64], ran: f64) -> SteadyStateError {
        if let Some(error) = self.undetermined(y, z) {
            let families = self.held();
            return families.drift(&families.conserved(y, z, &self.start), y, z).unwrap_or(error);
        }
        let signature = self.problem.system.signature();
        let mut f = vec![0.0; y.len()];
        self.problem.system.rhs(self.point(y, z), &mut f);
        let relative = |i: usize| (f[i] / self.sizes[i]).abs();
        let mut mass = vec![0.0; y.len()];
        self.problem.system.mass(self.point(y, z), &mut mass);
        let moving = (0..y.len()).filter(|i| mass[*i] != 0.0);
        let most = moving.max_by(|i, j| relative(*i).total_cmp(&relative(*j))).unwrap_or(0);
        let unit = signature.unknowns.unit(most);
        SteadyStateError::NotAtRest {
            t: self.t,
            ran,
            equation: signature.equations.get(most).to_string(),
            unknown: signature.unknowns.name(most).to_string(),
            rate: f[most] / unit.factor,
            unit: unit.symbol.to_string(),
        }
    }

    /// The error to report if ∂f/∂y is singular.
    fn undetermined(&mut self, y: &[f64], z: &[f64]) -> Option<SteadyStateError> {
        let system = self.problem.system;
        let signature = system.signature();
        let n = y.len();
        if n > super::MOST_UNKNOWNS {
            return None;
        }
        let (mut f, mut dfdt) = (S::Vector::zeros(n), S::Vector::zeros(n));
        let still = S::Inputs::zeros(signature.n_u());
        let mut jacobian = S::Jacobian::zeros(signature.jacobian.len());
        let (f, dfdt) = (f.as_mut(), dfdt.as_mut());
        system.linearize(self.point(y, z), still.as_ref(), f, jacobian.as_mut(), dfdt);
        let mut scaled = DMatrix::zeros(n, n);
        for ((row, column), value) in signature.jacobian.positions().zip(jacobian.as_ref()) {
            scaled[(row, column)] = value * self.sizes[column];
        }
        let (row, column) = singular::open(&scaled)?;
        let mut terms = vec![0.0; n];
        add_terms(&mut terms, &signature.jacobian, jacobian.as_ref(), y);
        add_terms(&mut terms, &signature.jacobian, jacobian.as_ref(), &self.sizes);
        let is_solved = f.iter().zip(&terms).all(|(f, terms)| f.abs() <= AT_REST * terms);
        Some(SteadyStateError::Undetermined {
            t: self.t,
            equation: signature.equations.get(row).to_string(),
            residual: if is_solved { 0.0 } else { f[row] },
            unknown: signature.unknowns.name(column).to_string(),
        })
    }
}
