//! Profile likelihood of the innovations: the other estimates, including noise levels, are re-optimised, as in
//! [`crate::profiles`] for simulations.

use std::cell::Cell;

use super::LikelihoodSearch;
use super::prediction_error::{PredictionError, PredictionErrorProblem, minimised};
use crate::error::EstimateError;
use crate::intervals::along::{HeldMinimum, ProfilePath, one_by_one};
use crate::intervals::profile::{FAR, FAR_LOGARITHM, Profile};
use crate::minimise::trust_region::StoppingRule;
use crate::output_error::NEGLIGIBLE_REDUCTION;
use crate::variables::VariableScale;

/// A deviance is accurate enough if steps gain less than this: its threshold is 3.8.
const NEGLIGIBLE: f64 = 1e-4;

/// Limit on the evaluations of a point.
const MOST_EVALUATIONS: usize = 40;

/// The profiles of some estimates of this problem, in the order of `estimates`. If cancelled, returns those that are
/// complete ([`Profile::estimate`] identifies them).
///
/// # Errors
///
/// As [`prediction_error`](crate::filter::prediction_error()).
///
/// # Panics
///
/// If `found` is not a result of the problem, or an estimate is not one of it.
pub fn prediction_error_profiles(
    problem: &PredictionErrorProblem<'_>,
    found: &PredictionError,
    estimates: &[usize],
) -> Result<Vec<Profile>, EstimateError> {
    let search = LikelihoodSearch::new(problem)?;
    assert_eq!(search.first.len(), found.z.len(), "what was found is of the problem");
    let least = match search.better(problem.system, problem.threads, &found.z, f64::INFINITY) {
        Ok(at) => at.cost,
        Err(_) if problem.watch.is_stopped() => return Ok(Vec::new()),
        Err(failed) => return Err(failed.at_start()),
    };
    let along = LikelihoodProfile { problem, search, found, least };
    Ok(one_by_one(estimates, problem.watch, |j| along.profile(j)))
}

/// The profile along an estimate.
struct LikelihoodProfile<'a, 'p> {
    problem: &'a PredictionErrorProblem<'p>,
    search: LikelihoodSearch<'a>,
    found: &'a PredictionError,
    least: f64,
}

impl LikelihoodProfile<'_, '_> {
    fn profile(&self, j: usize) -> Profile {
        let Self { problem, search, found, .. } = self;
        let variables = &search.variables.all;
        let evaluations = Cell::new(0);
        let centre = found.z.clone();
        let of_variable =
            |i: usize, z: f64| variables.get(i).map_or(z, |variable| variable.value(z));
        let size = |(i, z): (usize, &f64)| variables.get(i).map_or(1.0, |v| v.slope(*z).abs());
        let sizes: Vec<f64> = centre.iter().enumerate().map(size).collect();
        let way = ProfilePath {
            i: j,
            bounds: variables[j].bounds(),
            reach: match variables[j].scale {
                VariableScale::Linear(_) => FAR * centre[j].abs().max(1.0),
                VariableScale::Logarithm => FAR_LOGARITHM,
            },
            std: found.estimates[j].std.map(|std| std / sizes[j]),
            centre,
            place: &|held, from, before| self.place(j, held, from, before, &evaluations),
            is_stopped: &|| problem.watch.is_stopped(),
        };
        let mut profile = Profile::along(&way, of_variable, &sizes, &evaluations);
        // Noise levels have no names of their own.
        let n = found.estimates.len();
        for terms in [&mut profile.with_lower, &mut profile.with_upper] {
            terms.retain(|term| term.estimate < n);
        }
        profile.at_lower.truncate(n);
        profile.at_upper.truncate(n);
        profile
    }

    /// The minimal deviance with the estimate fixed at a value; `None` if no minimum is found.
    fn place(
        &self,
        j: usize,
        held: f64,
        from: &HeldMinimum,
        before: Option<&HeldMinimum>,
        evaluations: &Cell<usize>,
    ) -> Option<HeldMinimum> {
        let Self { problem, search, least, .. } = self;
        let mut bounds = search.bounds();
        let mut z = match before {
            Some(before) => from.moved_on(j, held, before),
            None => from.z.clone(),
        };
        for (z, (low, high)) in z.iter_mut().zip(&bounds) {
            *z = z.clamp(*low, *high);
        }
        z[j] = held;
        bounds[j] = (held, held);
        let reduction = NEGLIGIBLE.max(NEGLIGIBLE_REDUCTION) / least.abs().max(1.0);
        let stopping = StoppingRule {
            reduction,
            evaluations: MOST_EVALUATIONS,
            flat: 0.0,
            ..problem.stopping
        };
        let minimum = minimised(search, problem, z, &bounds, &stopping, |_| ()).ok()?;
        evaluations.set(evaluations.get() + minimum.evaluations + 1);
        Some(HeldMinimum { deviance: minimum.at.cost() - least, z: minimum.x })
    }
}
