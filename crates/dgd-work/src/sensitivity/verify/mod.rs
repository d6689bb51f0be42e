//! Compares sensitivities with finite differences of simulations on the user's own run.
//!
//! For each parameter the run is repeated with changed values (`moved.rs`) at tighter tolerances, and the differences
//! of the results are extrapolated to zero change, with an error estimate (`extrapolate.rs`). Each sensitivity is then
//! compared with its difference in units of
//!
//! ```text
//!   max((rtol + atol) · its scale, error of the difference)
//! ```
//!
//! The scale is the largest value of the sensitivity over the run, or the range of the unknown or output over the run
//! per size of the parameter, whichever is larger, because a derivative that is zero up to rounding is no more accurate
//! than that. The error of a sample's difference is taken to be at least the median over all samples, because it is
//! estimated from a few quotients that may agree by chance.
//!
//! Samples passed by a moved event or jump have no difference; they are left out and counted, and so are samples with a
//! difference too uncertain to compare, and those at a kink, where a sensitivity is one-sided.

mod extrapolate;
mod moved;
mod report;

use dgd_identify::Total as Count;
use dgd_runtime::{Direction, Observations, Options, Signature, Solution};

use crate::error::{Interruption, WorkError};
use crate::run::ModelRun;
use crate::session::TaskContext;
use extrapolate::{DifferenceDerivative, DifferenceQuotient, extrapolated};
use moved::{MovedRuns, moved};
pub use report::VerificationReport;
use report::{VerificationRow, WorstDisagreement};

/// Most units of deviation: tolerances apply to a single step, and the global error stays within a hundred of them.
const ALLOWED: f64 = 100.0;

/// A difference with an error above this fraction of the largest value is not compared.
const UNCERTAIN: f64 = 0.01;

/// Tolerances of the compared runs.
const TIGHT: f64 = 1e-10;

/// Something that has sensitivities: an unknown or an output, by index.
#[derive(Debug, Clone, Copy)]
pub(crate) enum VerifiedQuantity {
    Unknown(usize),
    Output(usize),
}

/// A solution and the outputs along it.
#[derive(Clone)]
pub(super) struct VerifiedTrajectory {
    pub(super) solution: Solution,
    pub(super) observations: Observations,
}

impl VerifiedQuantity {
    /// All unknowns, and the outputs that are not unknowns in another unit.
    pub(crate) fn all(signature: &Signature) -> Vec<VerifiedQuantity> {
        let is_unknown = |name: &str| signature.unknowns.iter().any(|x| x.name == name);
        let outputs = signature.outputs.iter().enumerate();
        let outputs = outputs.filter(|(_, x)| !is_unknown(&x.name) || x.delay.is_some());
        let outputs = outputs.map(|(i, _)| VerifiedQuantity::Output(i));
        (0..signature.unknowns.len()).map(VerifiedQuantity::Unknown).chain(outputs).collect()
    }

    fn name(self, signature: &Signature) -> String {
        match self {
            VerifiedQuantity::Unknown(i) => signature.unknowns.name(i).to_string(),
            VerifiedQuantity::Output(i) => signature.outputs[i].name.to_string(),
        }
    }

    fn value(self, of: &VerifiedTrajectory, k: usize) -> f64 {
        match self {
            VerifiedQuantity::Unknown(i) => of.solution.y(k)[i],
            VerifiedQuantity::Output(i) => of.observations.w(k)[i],
        }
    }

    fn derivative(self, of: &VerifiedTrajectory, j: usize, k: usize) -> f64 {
        let (solution, observations) = (&of.solution, &of.observations);
        match self {
            VerifiedQuantity::Unknown(i) => solution.s(k)[j * solution.n + i],
            VerifiedQuantity::Output(i) => observations.dw(k)[j * observations.n_w + i],
        }
    }

    /// Its nominal size, for quantities that are zero throughout.
    fn size(self, signature: &Signature, of: &VerifiedTrajectory) -> f64 {
        let (declared, unit) = match self {
            VerifiedQuantity::Unknown(i) => {
                (signature.unknowns.nominal(i), signature.unknowns.unit(i))
            }
            VerifiedQuantity::Output(i) => (None, &signature.outputs[i].unit),
        };
        let largest =
            || (0..of.solution.len()).fold(0.0, |m: f64, k| m.max(self.value(of, k).abs()));
        let size = declared.map_or_else(largest, f64::abs);
        if size > 0.0 && size.is_finite() { size } else { unit.factor.abs() }
    }

    /// Its range over the run, and at least the resolution that follows from its size.
    fn range(self, run: &ModelRun, of: &VerifiedTrajectory) -> f64 {
        let values = || (0..of.solution.len()).map(|k| self.value(of, k));
        let most = values().fold(f64::NEG_INFINITY, f64::max);
        let least = values().fold(f64::INFINITY, f64::min);
        let resolution = run.options.rtol * self.size(run.signature(), of);
        if (most - least).is_finite() { resolution.max(most - least) } else { resolution }
    }
}

/// Compares the sensitivities of a run with differences.
pub(crate) fn against_differences(
    run: &ModelRun,
    solution: &Solution,
    observations: &Observations,
    all: &[VerifiedQuantity],
    session: TaskContext<'_>,
) -> Result<VerificationReport, WorkError> {
    let signature = run.signature();
    let watched = run.options.watched;
    let options = Options { rtol: TIGHT, atol: TIGHT, watched, ..Options::default() };
    let unmoved =
        VerifiedTrajectory { solution: solution.clone(), observations: observations.clone() };
    let mut rows = Vec::new();
    for (j, direction) in signature.directions.iter().enumerate() {
        let size = direction_size(run, &unmoved, j, *direction);
        let count = Count::Exactly(signature.directions.len());
        session.advanced("parameters compared", j, count);
        let moved = moved(run, &unmoved, *direction, size, &options)?;
        if session.listener.is_stopped() {
            return Err(Interruption::NoResult.into());
        }
        for count in all {
            rows.push(compare(run, &unmoved, &moved, *count, j, size));
        }
    }
    Ok(VerificationReport { rows, allowed: ALLOWED })
}

/// Size of the j-th parameter or initial value; for one that is zero without a declared size, the change that moves
/// some quantity by its own size.
fn direction_size(
    run: &ModelRun,
    given: &VerifiedTrajectory,
    j: usize,
    direction: Direction,
) -> f64 {
    let signature = run.signature();
    let (value, nominal) = match direction {
        Direction::Parameter(i) => (run.p[i], signature.parameters[i].nominal),
        Direction::Start(i) => (given.solution.y(0)[i], signature.unknowns.nominal(i)),
    };
    let size = if value == 0.0 { nominal.unwrap_or(0.0) } else { value };
    if size != 0.0 {
        return size.abs();
    }
    let sizes = VerifiedQuantity::all(signature).into_iter().map(|of| {
        let slope = |k| of.derivative(given, j, k).abs();
        of.size(signature, given) / (0..given.solution.len()).map(slope).fold(0.0, f64::max)
    });
    let least = sizes.fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { signature.direction_unit(j).factor.abs() }
}

/// Compares the sensitivity of one quantity to one parameter at all times.
fn compare(
    run: &ModelRun,
    given: &VerifiedTrajectory,
    moved: &MovedRuns,
    of: VerifiedQuantity,
    j: usize,
    size: f64,
) -> VerificationRow {
    let signature = run.signature();
    let times = &given.solution.times;
    let noise = TIGHT * of.size(signature, given);
    let pairs: Vec<(f64, Option<DifferenceDerivative>)> = (0..times.len())
        .map(|k| {
            let quotients = moved.quotients(k, noise, |trajectory| of.value(trajectory, k));
            (of.derivative(given, j, k), extrapolated(&quotients, moved.order))
        })
        .collect();
    let largest = pairs.iter().fold(0.0, |largest: f64, (s, difference)| {
        // NaN is never the maximum.
        largest.max(s.abs()).max(difference.map_or(0.0, |difference| difference.value.abs()))
    });
    let scale = largest.max(of.range(run, given) / size);
    let tolerance = (run.options.rtol + run.options.atol) * scale;
    let usual = median(pairs.iter().filter_map(|(_, difference)| Some(difference.as_ref()?.error)));

    let mut row = VerificationRow {
        of: of.name(signature),
        to: signature.direction_name(j).into_owned(),
        scale,
        worst: None,
        uncertainty: 0.0,
        compared: 0,
        undefined: 0,
        passed: 0,
        uncertain: 0,
        kinks: 0,
    };
    for (k, (s, difference)) in pairs.into_iter().enumerate() {
        // Undefined sensitivities have been reported with their cause.
        if s.is_nan() {
            row.undefined += 1;
            continue;
        }
        let Some(DifferenceDerivative { value, error }) = difference else {
            row.passed += 1;
            continue;
        };
        let error = error.max(usual);
        let apart = (s - value).abs();
        let ratio = if apart == 0.0 { 0.0 } else { apart / tolerance.max(error) };
        // A deviation beyond the uncertainty counts, however large that is; equal values count as compared.
        let is_uncertain = error > UNCERTAIN * largest + tolerance && apart != 0.0;
        if is_uncertain && ratio <= ALLOWED || error.is_nan() {
            row.uncertain += 1;
            continue;
        }
        if ratio > ALLOWED
            && let Some(sides) = moved.one_sided(k, noise, |trajectory| of.value(trajectory, k))
            && is_one_side(s, &sides, tolerance, UNCERTAIN * largest)
        {
            row.kinks += 1;
            continue;
        }
        row.compared += 1;
        row.uncertainty = row.uncertainty.max(error);
        if row.worst.as_ref().is_none_or(|worst| ratio > worst.ratio || ratio.is_nan()) {
            row.worst = Some(WorstDisagreement { ratio, apart, at: times[k] });
        }
    }
    row
}

/// Whether the two sides of a kink have differences of their own, and the sensitivity matches one of them.
fn is_one_side(
    s: f64,
    sides: &[Vec<DifferenceQuotient>; 2],
    tolerance: f64,
    uncertain: f64,
) -> bool {
    let [Some(lower), Some(higher)] = sides.each_ref().map(|side| extrapolated(side, 1)) else {
        return false;
    };
    let is_kink = (higher.value - lower.value).abs() > higher.error + lower.error;
    let is_of = |side: DifferenceDerivative| {
        side.error <= uncertain + tolerance
            && (s - side.value).abs() <= ALLOWED * tolerance.max(side.error)
    };
    is_kink && (is_of(lower) || is_of(higher))
}

/// The median of some numbers; 0 for none.
fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut numbers: Vec<f64> = numbers.filter(|number| number.is_finite()).collect();
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quotients on both sides of a function at 0.
    fn sides(f: impl Fn(f64) -> f64) -> [Vec<DifferenceQuotient>; 2] {
        [-1.0, 1.0].map(|sign| {
            let quotient = |k: i32| {
                let h = sign * 0.1 * 0.5f64.powi(k);
                DifferenceQuotient { value: (f(h) - f(0.0)) / h, noise: 1e-12 }
            };
            (0..4).map(quotient).collect()
        })
    }

    #[test]
    fn at_a_kink_the_slope_of_either_side_is_right_and_no_other() {
        let kink = sides(|x| x.sin() + x.abs());
        for (slope, is_right) in [(0.0, true), (2.0, true), (1.0, false), (3.0, false)] {
            assert_eq!(is_one_side(slope, &kink, 1e-8, 1e-2), is_right, "{slope}");
        }
        // Without a kink, no other slope is one-sided.
        let smooth = sides(f64::sin);
        assert!(!is_one_side(0.9, &smooth, 1e-8, 1e-2));
        assert!(!is_one_side(1.1, &smooth, 1e-8, 1e-2));
    }
}
