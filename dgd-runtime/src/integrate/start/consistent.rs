//! The start of a run: values that satisfy all equations, and modes that hold there.

use crate::algebraic::{AlgebraicPoint, AlgebraicSystem, CorrectionWeights, PieceAutomata};
use crate::discrete::state_selection::select_states;
use crate::discrete::{choose_sides, choose_start_modes, discrete_numbers, waiting};
use crate::error::{InitialError, IntegrateError};
use crate::integrate::drive::{InputCursor, InstantInputs};
use crate::linalg::Singular;
use crate::linalg::norm::Tolerances;
use crate::problem::{Options, Problem, unknown_sizes};
use crate::signal::LimitSide;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// A start that satisfies all equations.
#[derive(Debug, Clone, PartialEq)]
pub struct ConsistentStart {
    /// Unknowns.
    pub y: Vec<f64>,
    /// Their derivatives, including those of algebraic unknowns.
    pub ydot: Vec<f64>,
    /// Discrete numbers.
    pub z: Vec<f64>,
    /// Positions of the transitions whose conditions hold here: they act only after these have been false.
    pub waiting: Vec<usize>,
    /// Algebraic unknowns whose start values, as the model gives them, are not those of the equations; with these values.
    pub dropped: Vec<(usize, f64)>,
}

/// Start values at `t` that satisfy the algebraic equations, and their derivatives.
///
/// # Errors
///
/// [`IntegrateError::BadRequest`], [`IntegrateError::Inputs`] and [`IntegrateError::Initial`].
pub fn consistent_start<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    t: f64,
    options: &Options,
) -> Result<ConsistentStart, IntegrateError> {
    options.verify().map_err(IntegrateError::BadRequest)?;
    problem.verify().map_err(IntegrateError::BadRequest)?;
    if problem.system.signature().unknowns.n_algebraic() > 0 {
        problem.verify_factorisation().map_err(IntegrateError::BadRequest)?;
    }
    problem.inputs.cover(t, t).map_err(IntegrateError::Inputs)?;
    let system = problem.system;
    let signature = system.signature();
    let n = signature.unknowns.len();

    let inputs = problem.inputs_read().map_err(IntegrateError::Inputs)?;
    let segment = inputs.segment(inputs.segment_at(t, LimitSide::Right));
    let read = Problem { inputs: &inputs, ..*problem };
    let tolerances = Tolerances { rtol: options.rtol, atol: options.atol };
    let mut drive = InputCursor::new(&read, segment, t, 0, tolerances);
    let mut y = S::Vector::zeros(n);
    let mut z = discrete_numbers(system, problem.p, t);
    let mut u = S::Inputs::zeros(signature.n_u());
    u.as_mut().copy_from_slice(drive.evaluate(t, y.as_ref()));
    let point = EvaluationPoint { t, y: &[], u: u.as_ref(), p: problem.p, z: &z };
    start_values(problem, point, y.as_mut()).map_err(IntegrateError::Initial)?;
    S::find_start(problem, t, options, y.as_mut(), None).map_err(IntegrateError::Initial)?;
    let guesses = y.as_ref().to_vec();
    let mut e = vec![0.0; signature.discrete.transitions().count()];
    let point = EvaluationPoint { t, y: y.as_ref(), u: u.as_ref(), p: problem.p, z: &[] };
    choose_start_modes(system, point, &mut e, &mut z);
    select_states(system, point, &mut z, &mut e);
    choose_sides(system, point, &mut e, &mut z);
    let mut sizes = S::Vector::zeros(n);
    unknown_sizes(system, y.as_ref(), sizes.as_mut());

    let mut algebraic = AlgebraicSystem::new(system);
    let mut mass = S::Vector::zeros(n);
    let point = EvaluationPoint { t, y: &[], u: u.as_ref(), p: problem.p, z: &z };
    system.mass(point, mass.as_mut());
    algebraic.enter_modes(mass.as_ref());
    let mut jacobian = S::Jacobian::zeros(signature.jacobian.len());
    let mut pieces = PieceAutomata::new(&signature.discrete, n);
    if !pieces.is_empty() && !algebraic.is_empty() {
        let point = AlgebraicPoint { t, u: u.as_ref(), p: problem.p, z: &[] };
        let weights = CorrectionWeights { sizes: sizes.as_ref(), tolerances };
        let (y, jacobian) = (y.as_mut(), jacobian.as_mut());
        algebraic
            .solve_pieces(system, &mut pieces, point, &mut z, y, jacobian, weights)
            .map_err(IntegrateError::Initial)?;
    }
    let point =
        AlgebraicPoint { t, u: InstantInputs { drive: &mut drive, t }, p: problem.p, z: &z };
    algebraic
        .make_consistent(system, point, y.as_mut(), jacobian.as_mut(), sizes.as_ref(), tolerances)
        .map_err(IntegrateError::Initial)?;

    let (mut f, mut dfdt) = (S::Vector::zeros(n), S::Vector::zeros(n));
    drive.begin_history(t, y.as_ref(), None, sizes.as_ref());
    let (u, udot) = drive.with_slope(t, y.as_ref());
    let point = EvaluationPoint { t, y: y.as_ref(), u, p: problem.p, z: &z };
    system.linearize(point, udot, f.as_mut(), jacobian.as_mut(), dfdt.as_mut());
    let waiting = waiting(system, point, &mut e);
    algebraic
        .rates(&signature.jacobian, jacobian.as_ref(), f.as_mut(), dfdt.as_ref(), sizes.as_ref())
        .map_err(|Singular { row }| {
            algebraic.singular(system, point, row, jacobian.as_ref(), sizes.as_ref())
        })
        .map_err(IntegrateError::Initial)?;
    let is_off = |i: usize, given: f64| {
        let (y, size) = (y.as_ref()[i], sizes.as_ref()[i]);
        let bearable = tolerances.rtol * y.abs().max(given.abs()) + tolerances.atol * size;
        mass.as_ref()[i] == 0.0 && (y - given).abs() > bearable
    };
    let dropped = guesses.iter().copied().enumerate().filter(|(i, given)| is_off(*i, *given));
    let dropped = dropped.collect();
    Ok(ConsistentStart { y: y.as_ref().to_vec(), ydot: f.as_ref().to_vec(), z, waiting, dropped })
}

/// Writes the model's start values, with replacements, into `y`.
pub fn start_values<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    at: EvaluationPoint<'_>,
    y: &mut [f64],
) -> Result<(), InitialError> {
    problem.system.start(at, y);
    for &(i, value) in problem.start {
        y[i] = value;
    }
    match y.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(i) => Err(InitialError::StartNotFinite {
            unknown: problem.system.signature().unknowns.name(i).to_string(),
            t: at.t,
        }),
    }
}
