//! Profile likelihood: the range of an estimate when the others are re-optimised.
//!
//! ```text
//!   d(θᵢ) = min over the other estimates of Σ (e/σ)²  −  Σ (e/σ)² of the fit
//!   interval:  { θᵢ : d(θᵢ) ≤ χ²₁(0.95) = 1.959964² }
//! ```
//!
//! From the estimate outwards on each side, the others start at their last values, extrapolated ([`super::along`]). A
//! side that does not reach the threshold is unbounded: the data does not bound the estimate on that side, whatever its
//! standard deviation. σ is that of the fit throughout. For a loss other than squares, d is the rise of Σ ρ(e/σ) over
//! (H⁻¹ G H⁻¹)ᵢᵢ/(H⁻¹)ᵢᵢ ([`crate::noise::loss`]), so that it rises like 1/std² of the estimate.
//!
//! Sources: Venzon, Moolgavkar, A method for computing profile-likelihood-based confidence
//! intervals, Appl. Statist. 37 (1988) 87; Raue et al., Structural and practical identifiability
//! analysis of partially observed dynamical models by exploiting the profile likelihood,
//! Bioinformatics 25 (2009) 1923.

use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_runtime::parallel::in_parallel_by_model;

use crate::error::EstimateError;
use crate::intervals::along::{HeldMinimum, ProfilePath};
use crate::intervals::around::FitNeighbourhood;
use crate::journal::Journaled;
use crate::keep_by_fields;
use crate::minimise::trust_region::Termination;
use crate::output_error::OutputErrorProblem;
use crate::output_error::fit::Fit;
use crate::progress::{Progress, Total};
use crate::uncertainty::CombinationTerm;
use crate::variables::VariableScale;

/// χ²₁(0.95), the rise of the deviance at the ends of a 95 % interval.
pub const THRESHOLD: f64 = 3.841_458_820_694_124;

/// Limit on the simulations of a point.
const MOST_EVALUATIONS: usize = 60;

/// End of an unbounded side, in sizes of the estimate, or in units of 1 if that is larger.
pub(crate) const FAR: f64 = 1e3;

/// End of an unbounded side for a logarithm: a factor of a million.
pub(crate) const FAR_LOGARITHM: f64 = 13.8;

/// Estimates that change by less than this fraction of the largest relative change do not compensate.
const TAKES_PART: f64 = 0.1;

/// Estimates that change by less than this fraction of their value are constant.
const STAYS: f64 = 1e-3;

/// The end of one side of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProfileEnd {
    /// The deviance reaches its threshold at this value, SI: an end of the interval.
    Interval(f64),
    /// Not below the parameter's bound, this value.
    Bound(f64),
    /// Not up to this remote value: the data does not bound this side.
    Open(f64),
    /// Not up to this value, beyond which the model cannot be simulated.
    Unsimulated(f64),
}

impl ProfileEnd {
    /// The value, whatever its meaning.
    pub fn value(self) -> f64 {
        match self {
            Self::Interval(value)
            | Self::Bound(value)
            | Self::Open(value)
            | Self::Unsimulated(value) => value,
        }
    }
}

impl Journaled for ProfileEnd {
    fn write(&self, bytes: &mut Vec<u8>) {
        let kind: usize = match self {
            Self::Interval(_) => 0,
            Self::Bound(_) => 1,
            Self::Open(_) => 2,
            Self::Unsimulated(_) => 3,
        };
        (kind, self.value()).write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let (kind, value) = <(usize, f64)>::read(bytes)?;
        let kinds = [Self::Interval, Self::Bound, Self::Open, Self::Unsimulated];
        Some(kinds.get(kind)?(value))
    }
}

/// Deviance along an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Position among the estimates.
    pub estimate: usize,
    /// Values of the estimate, SI, ascending; that of the fit among them.
    pub values: Vec<f64>,
    /// d of each. A negative one means that the fit missed the minimum.
    pub deviance: Vec<f64>,
    /// The lower end.
    pub lower: ProfileEnd,
    /// The upper end.
    pub upper: ProfileEnd,
    /// All estimates at the lower end, SI.
    pub at_lower: Vec<f64>,
    /// All estimates at the upper end, SI.
    pub at_upper: Vec<f64>,
    /// The other estimates that compensate for this one at the lower end, with their changes relative to their sizes.
    /// Empty if they do not change.
    pub with_lower: Vec<CombinationTerm>,
    /// The compensating estimates at the upper end.
    pub with_upper: Vec<CombinationTerm>,
    /// Evaluations of all recordings.
    pub evaluations: usize,
}

keep_by_fields!(Profile {
    estimate,
    values,
    deviance,
    lower,
    upper,
    at_lower,
    at_upper,
    with_lower,
    with_upper,
    evaluations
});

impl Profile {
    /// The 95 % interval, SI; `None` for an unbounded side. A parameter's bound also ends it.
    pub fn interval(&self) -> (Option<f64>, Option<f64>) {
        let end = |end: ProfileEnd| match end {
            ProfileEnd::Interval(value) | ProfileEnd::Bound(value) => Some(value),
            ProfileEnd::Open(_) | ProfileEnd::Unsimulated(_) => None,
        };
        (end(self.lower), end(self.upper))
    }

    /// The profile along a path. `value` converts a variable to the estimate, SI; `sizes` are the scales of changes of
    /// the estimates, SI.
    pub(crate) fn along(
        way: &ProfilePath<'_>,
        value: impl Fn(usize, f64) -> f64,
        sizes: &[f64],
        evaluations: &Cell<usize>,
    ) -> Self {
        let (below, above) = (way.arm(-1.0), way.arm(1.0));
        let centre = HeldMinimum { z: way.centre.clone(), deviance: 0.0 };
        let estimates = |place: &HeldMinimum| -> Vec<f64> {
            place.z.iter().enumerate().map(|(i, z)| value(i, *z)).collect()
        };
        let mut places: Vec<&HeldMinimum> =
            below.places.iter().chain([&centre]).chain(&above.places).collect();
        places.sort_by(|a, b| a.z[way.i].total_cmp(&b.z[way.i]));
        let of_fit = estimates(&centre);
        let followers = |at: &[f64]| followers(way.i, &of_fit, at, sizes);
        let (at_lower, at_upper) = (estimates(&below.at), estimates(&above.at));
        Self {
            estimate: way.i,
            values: places.iter().map(|place| value(way.i, place.z[way.i])).collect(),
            deviance: places.iter().map(|place| place.deviance).collect(),
            lower: (below.end)(at_lower[way.i]),
            upper: (above.end)(at_upper[way.i]),
            with_lower: followers(&at_lower),
            with_upper: followers(&at_upper),
            at_lower,
            at_upper,
            evaluations: evaluations.get(),
        }
    }
}

/// The other estimates that changed with the i-th.
fn followers(i: usize, of_fit: &[f64], at: &[f64], sizes: &[f64]) -> Vec<CombinationTerm> {
    // An estimate may be zero, but not its size.
    let change = |j: usize| (at[j] - of_fit[j]) / sizes[j];
    let others = (0..at.len()).filter(|j| *j != i);
    let terms: Vec<CombinationTerm> =
        others.map(|j| CombinationTerm { estimate: j, change: change(j) }).collect();
    let largest = terms.iter().map(|term| term.change.abs()).fold(0.0, f64::max);
    let counts = |term: &CombinationTerm| term.change.abs() > (TAKES_PART * largest).max(STAYS);
    terms.into_iter().filter(counts).collect()
}

/// The profiles of some estimates of a fit to this problem, in the order of `estimates`, in the threads of the problem.
/// If cancelled, returns those that are complete ([`Profile::estimate`] identifies them).
///
/// # Errors
///
/// As [`fit`](crate::fit); or the problem cannot be simulated at the estimates of the fit.
///
/// # Panics
///
/// If the fit does not belong to the problem, or an estimate does not belong to the fit.
pub fn profiles(
    problem: &OutputErrorProblem<'_>,
    fit: &Fit,
    estimates: &[usize],
) -> Result<Vec<Profile>, EstimateError> {
    let around = FitNeighbourhood::new(problem, fit, MOST_EVALUATIONS)?;
    let first = around
        .evaluated(&around.problem(problem.system).unwatched(), &around.z)
        .map_err(EstimateError::Start)?;
    let least = first.as_ref().cost;
    let done = AtomicUsize::new(0);
    let complete =
        in_parallel_by_model(problem.system, estimates.len(), problem.threads, |system, k| {
            let problem = around.problem(system);
            let (i, worth) = (estimates[k], fit.worth(estimates[k]));
            let along = EstimateProfile { around: &around, problem: &problem, i, least, worth };
            let profile = around.kept(
                |digest| digest.debug(&("profile", estimates[k])),
                || {
                    let profile = along.profile(fit);
                    // A result that was found before this check may be incomplete.
                    if around.watch.is_stopped() {
                        Err(EstimateError::Stopped)
                    } else {
                        Ok(profile)
                    }
                },
            );
            let profile = profile.ok()?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let total = Total::Exactly(estimates.len());
            around.watch.advanced(Progress { what: "profiles", done, of: total });
            Some(profile)
        });
    Ok(complete.into_iter().flatten().collect())
}

/// The profile of one estimate: [`profiles`].
///
/// # Errors
///
/// As [`profiles`], and [`EstimateError::Stopped`].
///
/// # Panics
///
/// As [`profiles`].
pub fn profile(
    problem: &OutputErrorProblem<'_>,
    fit: &Fit,
    estimate: usize,
) -> Result<Profile, EstimateError> {
    profiles(problem, fit, &[estimate])?.pop().ok_or(EstimateError::Stopped)
}

/// The profile along one estimate.
struct EstimateProfile<'a> {
    around: &'a FitNeighbourhood<'a>,
    problem: &'a OutputErrorProblem<'a>,
    i: usize,
    /// Σ ρ(e/σ) of the fit.
    least: f64,
    /// Scale of a rise of that sum.
    worth: f64,
}

impl EstimateProfile<'_> {
    fn profile(&self, fit: &Fit) -> Profile {
        let start = self.around.z[self.i];
        let variables = &self.around.variables.all;
        let reach = match variables[self.i].scale {
            VariableScale::Linear(_) => FAR * start.abs().max(1.0),
            VariableScale::Logarithm => FAR_LOGARITHM,
        };
        let evaluations = Cell::new(0);
        let way = ProfilePath {
            i: self.i,
            centre: self.around.z.clone(),
            bounds: self.around.bounds[self.i],
            reach,
            std: fit.estimates[self.i].std.map(|std| std / variables[self.i].slope(start).abs()),
            place: &|held, from, other| self.place(held, from, other, &evaluations),
            is_stopped: &|| self.around.watch.is_stopped(),
        };
        let sizes: Vec<f64> = (0..fit.estimates.len()).map(|i| fit.size(i)).collect();
        Profile::along(&way, |i, z| variables[i].value(z), &sizes, &evaluations)
    }

    /// The minimal sum with the estimate fixed at a value; `None` if no minimum is found.
    fn place(
        &self,
        held: f64,
        from: &HeldMinimum,
        other: Option<&HeldMinimum>,
        evaluations: &Cell<usize>,
    ) -> Option<HeldMinimum> {
        let mut bounds = self.around.bounds.clone();
        bounds[self.i] = (held, held);
        let moved_on = other.map(|other| {
            let moved = from.moved_on(self.i, held, other).into_iter().zip(&bounds);
            moved.map(|(z, (low, high))| z.clamp(*low, *high)).collect()
        });
        let mut stayed = from.z.clone();
        stayed[self.i] = held;
        let mut best: Option<HeldMinimum> = None;
        for z in moved_on.into_iter().chain([stayed]) {
            evaluations.set(evaluations.get() + 1);
            let Ok(minimum) = self.around.minimum(self.problem, z, &bounds) else { continue };
            evaluations.set(evaluations.get() + minimum.evaluations);
            let is_converged = minimum.termination.is_converged();
            // Where events pass readings, the sum has kinks at which no step helps although slopes promise a reduction.
            if is_converged || minimum.termination == Termination::Stalled {
                let deviance = (minimum.at.as_ref().cost - self.least) * self.worth;
                if best.as_ref().is_none_or(|best| deviance < best.deviance) {
                    best = Some(HeldMinimum { z: minimum.x, deviance });
                }
            }
            if is_converged {
                break;
            }
        }
        best
    }
}
