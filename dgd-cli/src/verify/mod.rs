//! Sensitivities against differences of simulations, on the user's own run.
//!
//! For each parameter the run is repeated with other values of it (`moved.rs`), at tighter tolerances,
//! and the differences of what comes out are extrapolated to no change at all, with an estimate of
//! their own error (`extrapolate.rs`). Each sensitivity is then compared with its difference in units of
//!
//! ```text
//!   max((rtol + atol) · its largest value, error of the difference)
//! ```
//!
//! A sample that a moved event or jump passes has no difference, and is left out and counted; so is one
//! whose difference is too uncertain to say anything.

mod extrapolate;
mod moved;
mod report;

use dgd_runtime::{Direction, Observations, Options, Signature, Solution};

use crate::failure::CommandError;
use crate::run::Run;
use extrapolate::{Difference, extrapolated};
use moved::{Moved, moved};
pub(crate) use report::Report;
use report::{Row, Worst};

/// A sensitivity may differ by this many of its units: tolerances are of a single step, and over a run
/// the error stays within a hundred of them.
const ALLOWED: f64 = 100.0;

/// A difference whose own error is more than this fraction of the largest value says nothing.
const UNCERTAIN: f64 = 0.01;

/// Tolerances of the runs that are compared.
const TIGHT: f64 = 1e-10;

/// Something that has sensitivities: an unknown or an output, by position.
#[derive(Debug, Clone, Copy)]
enum Of {
    Unknown(usize),
    Output(usize),
}

/// A solution and the outputs along it.
#[derive(Clone)]
pub(super) struct Trajectory {
    pub(super) solution: Solution,
    pub(super) observations: Observations,
}

impl Of {
    /// All unknowns, and the outputs that are not one of them in another unit.
    fn all(signature: &Signature) -> Vec<Of> {
        let is_unknown = |name: &str| signature.unknowns.iter().any(|x| x.name == name);
        let outputs = signature.outputs.iter().enumerate();
        let outputs = outputs.filter(|(_, x)| !is_unknown(&x.name) || x.delay.is_some());
        let outputs = outputs.map(|(i, _)| Of::Output(i));
        (0..signature.unknowns.len()).map(Of::Unknown).chain(outputs).collect()
    }

    fn name(self, signature: &Signature) -> String {
        match self {
            Of::Unknown(i) => signature.unknowns.name(i).to_string(),
            Of::Output(i) => signature.outputs[i].name.to_string(),
        }
    }

    fn value(self, of: &Trajectory, k: usize) -> f64 {
        match self {
            Of::Unknown(i) => of.solution.y(k)[i],
            Of::Output(i) => of.observations.w(k)[i],
        }
    }

    fn derivative(self, of: &Trajectory, j: usize, k: usize) -> f64 {
        let (solution, observations) = (&of.solution, &of.observations);
        match self {
            Of::Unknown(i) => solution.s(k)[j * solution.n + i],
            Of::Output(i) => observations.dw(k)[j * observations.n_w + i],
        }
    }

    /// Its size, for what is zero all along.
    fn size(self, signature: &Signature, of: &Trajectory) -> f64 {
        let (declared, unit) = match self {
            Of::Unknown(i) => (signature.unknowns.nominal(i), signature.unknowns.unit(i)),
            Of::Output(i) => (None, &signature.outputs[i].unit),
        };
        let largest =
            || (0..of.solution.len()).fold(0.0, |m: f64, k| m.max(self.value(of, k).abs()));
        let size = declared.map_or_else(largest, f64::abs);
        if size > 0.0 && size.is_finite() { size } else { unit.factor.abs() }
    }
}

/// Compares all sensitivities of a run with differences.
pub(crate) fn against_differences(
    run: &Run,
    solution: &Solution,
    observations: &Observations,
) -> Result<Report, CommandError> {
    let signature = run.signature();
    let options = Options { rtol: TIGHT, atol: TIGHT, ..Options::default() };
    let given = Trajectory { solution: solution.clone(), observations: observations.clone() };
    let mut rows = Vec::new();
    for (j, direction) in signature.directions.iter().enumerate() {
        let size = direction_size(run, &given, j, *direction);
        let moved = moved(run, &given, *direction, size, &options)?;
        for of in Of::all(signature) {
            rows.push(compare(run, &given, &moved, of, j));
        }
    }
    Ok(Report { rows, allowed: ALLOWED })
}

/// How large the j-th parameter or start value is; for one that is zero and declares no size, as large
/// as it takes to change something by its own size.
fn direction_size(run: &Run, given: &Trajectory, j: usize, direction: Direction) -> f64 {
    let signature = run.signature();
    let (value, nominal) = match direction {
        Direction::Parameter(i) => (run.p[i], signature.parameters[i].nominal),
        Direction::Start(i) => (given.solution.y(0)[i], signature.unknowns.nominal(i)),
    };
    let size = if value == 0.0 { nominal.unwrap_or(0.0) } else { value };
    if size != 0.0 {
        return size.abs();
    }
    let sizes = Of::all(signature).into_iter().map(|of| {
        let slope = |k| of.derivative(given, j, k).abs();
        of.size(signature, given) / (0..given.solution.len()).map(slope).fold(0.0, f64::max)
    });
    let least = sizes.fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { signature.direction_unit(j).factor.abs() }
}

/// Compares one thing's sensitivity to one parameter at all times.
fn compare(run: &Run, given: &Trajectory, moved: &Moved, of: Of, j: usize) -> Row {
    let signature = run.signature();
    let times = &given.solution.times;
    let noise = TIGHT * of.size(signature, given);
    let found: Vec<(f64, Option<Difference>)> = (0..times.len())
        .map(|k| {
            let quotients = moved.quotients(k, noise, |trajectory| of.value(trajectory, k));
            (of.derivative(given, j, k), extrapolated(&quotients, moved.order))
        })
        .collect();
    let largest = found.iter().fold(0.0, |largest: f64, (s, difference)| {
        // NaN is no maximum.
        largest.max(s.abs()).max(difference.map_or(0.0, |difference| difference.value.abs()))
    });
    let tolerance = (run.options.rtol + run.options.atol) * largest;

    let mut row = Row {
        of: of.name(signature),
        to: signature.direction_name(j).into_owned(),
        largest,
        worst: None,
        uncertainty: 0.0,
        compared: 0,
        undefined: 0,
        passed: 0,
        uncertain: 0,
    };
    for (k, (s, difference)) in found.into_iter().enumerate() {
        // Undefined sensitivities have been reported with their cause.
        if s.is_nan() {
            row.undefined += 1;
            continue;
        }
        let Some(Difference { value, error }) = difference else {
            row.passed += 1;
            continue;
        };
        let apart = (s - value).abs();
        let ratio = if apart == 0.0 { 0.0 } else { apart / tolerance.max(error) };
        // One that is wrong beyond its uncertainty is wrong, however uncertain.
        if error > UNCERTAIN * largest + tolerance && ratio <= ALLOWED || error.is_nan() {
            row.uncertain += 1;
            continue;
        }
        row.compared += 1;
        row.uncertainty = row.uncertainty.max(error);
        if row.worst.as_ref().is_none_or(|worst| ratio > worst.ratio || ratio.is_nan()) {
            row.worst = Some(Worst { ratio, apart, at: times[k] });
        }
    }
    row
}
