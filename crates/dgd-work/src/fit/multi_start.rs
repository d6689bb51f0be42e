//! Fits from several starting points: their number, and the report on the minima.

use std::fmt::Write as _;

use dgd_compiler::argument::Argument;
use dgd_identify::{
    DrawnFrom, EstimateError, Fit, LocalMinimum, Loss, MultiStart, OutputErrorProblem, PointEnd,
    THRESHOLD, Termination, fit_from_drawn, fit_from_point, starting_points,
};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use crate::error::{SIMULATING, UsageError, WorkError};
use crate::fit::report::intervals::IntervalEstimates;
use crate::fit::report::left_out::IncompleteFit;
use crate::fit::report::outcome::digits_of;
use crate::output::quantity::{short, with_unit};
use crate::request::{Estimator, SearchRequest};
use crate::result::fit::{MinimumEntry, MultiStartResult, StartEntry, StartSpread, ValueEntry};

/// Estimates listed for another minimum, those furthest from the best first.
const MOST_TOLD: usize = 4;

/// Other minima listed in the text; `result.json` has all.
const MOST_MINIMA: usize = 5;

/// A deviance that is higher by less than this counts as equal.
const AS_GOOD: f64 = 0.01;

/// The random stream of starting points; replicates use the streams from 0.
const STREAM: u128 = 1 << 64;

impl SearchRequest {
    /// Checks, before anything is read, that the estimator supports several starting points.
    pub(crate) fn verify(self, estimator: Estimator) -> Result<(), WorkError> {
        if let Some(number) = self.start_point
            && number >= self.starts
        {
            return Err(UsageError::NoSuchStart { number, starts: self.starts }.into());
        }
        if self.spread != DrawnFrom::Values && self.starts < 2 {
            return Err(UsageError::SpreadOfOne.into());
        }
        if estimator.simulates() {
            return Ok(());
        }
        for (argument, is_given) in
            [(Argument::Loss, self.loss != Loss::Squares), (Argument::Starts, self.starts > 1)]
        {
            if is_given {
                let given = vec![argument.into()];
                return Err(UsageError::NeedsEstimator { given, estimators: SIMULATING }.into());
            }
        }
        Ok(())
    }

    /// The best fit from all points, or the fit from the requested one.
    pub(crate) fn fit(
        self,
        problem: &OutputErrorProblem<'_>,
        seed: u64,
    ) -> Result<MultiStartFits, EstimateError> {
        let mut random = Pcg64::new(u128::from(seed), STREAM);
        let count = self.starts as usize;
        let points = starting_points(problem, count, self.spread, || random.next_u64());
        let fits = match self.start_point {
            None => fit_from_drawn(problem, &points),
            Some(k) => fit_from_point(problem, &points, k as usize),
        }?;
        Ok(MultiStartFits { all: fits, spread: self.spread })
    }
}

/// The fits from all points.
pub(crate) struct MultiStartFits {
    pub all: MultiStart,
    spread: DrawnFrom,
}

/// The outcomes of all points.
pub(crate) struct Minima {
    searched: MultiStartFits,
    minima: Vec<LocalMinimum>,
}

impl Minima {
    /// `None` with a single point.
    pub(crate) fn from_fits(searched: MultiStartFits) -> Option<Self> {
        let minima = searched.all.minima();
        (searched.all.ends.len() > 1).then_some(Self { searched, minima })
    }

    fn all(&self) -> &MultiStart {
        &self.searched.all
    }

    /// The outcome of the fit from a point in a word or two, for programs.
    fn end(end: &PointEnd) -> &'static str {
        match end {
            PointEnd::Fitted(fit) => fit.termination.name(),
            PointEnd::Failed(_) => "failed",
            PointEnd::LeftOut => "left out",
        }
    }

    /// The outcome of each point.
    fn ends(&self) -> Vec<StartEntry> {
        let least = self.all().fit.deviance;
        let entry = |(k, end): (usize, &PointEnd)| StartEntry {
            end: Self::end(end).to_owned(),
            deviance_above: self.all().fit_of(k).map(|fit| fit.deviance - least),
            minimum: self.minima.iter().position(|minimum| minimum.points.contains(&k)),
        };
        self.all().ends.iter().enumerate().map(entry).collect()
    }

    /// The smallest basin of attraction that the starting points would have hit with 95 % confidence, in words.
    fn found_volume_text(&self) -> Option<String> {
        let volume = short(100.0 * self.all().found_volume()?, 2);
        Some(format!(
            "a minimum that is reached from more than {volume} % of the volume the points were drawn from would have been \
             found, at 95 %"
        ))
    }

    /// Points whose fits were cancelled or not started because of Ctrl-C.
    fn unfinished(&self) -> usize {
        let is_unfinished = |end: &&PointEnd| match end {
            PointEnd::LeftOut => true,
            PointEnd::Fitted(fit) => fit.termination == Termination::Stopped,
            PointEnd::Failed(_) => false,
        };
        self.all().ends.iter().filter(is_unfinished).count()
    }

    /// The number of failed fits, and the first error.
    fn failed(&self) -> (usize, Option<&EstimateError>) {
        let mut errors = self.all().ends.iter().filter_map(|end| match end {
            PointEnd::Failed(error) => Some(error),
            PointEnd::Fitted(_) | PointEnd::LeftOut => None,
        });
        let first = errors.next();
        (errors.count() + usize::from(first.is_some()), first)
    }

    /// Points whose fits did not converge.
    fn lost(&self) -> usize {
        let is_lost = |end: &&PointEnd| match end {
            PointEnd::Fitted(fit) => {
                !fit.termination.is_converged() && fit.termination != Termination::Stopped
            }
            PointEnd::Failed(_) | PointEnd::LeftOut => false,
        };
        self.all().ends.iter().filter(is_lost).count()
    }

    /// Adds what was left out because of Ctrl-C.
    pub(crate) fn push_left_out(&self, left_out: &mut IncompleteFit) {
        let (unfinished, all) = (self.unfinished(), self.all().ends.len());
        if unfinished > 0 {
            left_out
                .push(format!("{unfinished} of {all} starting points were not fitted to the end"));
        }
    }

    /// The section of the result.
    pub(crate) fn entry(&self, outcome: &dyn IntervalEstimates) -> MultiStartResult {
        let minimum = |minimum: &LocalMinimum| {
            let fit = self.all().fit_of(minimum.points[0]);
            let estimates = fit.map_or(&[][..], |fit| &fit.estimates);
            let entry = |(i, estimate): (usize, &dgd_identify::ParameterEstimate)| {
                (outcome.name(i), ValueEntry::new(estimate.value, outcome.unit(i)))
            };
            MinimumEntry {
                points: minimum.points.clone(),
                deviance_above: Some(minimum.above),
                estimates: estimates.iter().enumerate().map(entry).collect(),
            }
        };
        MultiStartResult {
            points: self.all().ends.len(),
            spread: match self.searched.spread {
                DrawnFrom::Values => StartSpread::Values,
                DrawnFrom::Bounds => StartSpread::Bounds,
            },
            ends: self.ends(),
            found_volume: self.all().found_volume(),
            failed_draws: self.all().failed_draws,
            best: self.all().best,
            minima: self.minima.iter().map(minimum).collect(),
            failed: self.failed().0,
            without_minimum: self.lost(),
            left_out: self.unfinished(),
        }
    }

    /// A line for each minimum, and for the outcomes of the other points.
    pub(crate) fn push_text(&self, text: &mut String, outcome: &dyn IntervalEstimates) {
        let n_points = self.all().ends.len();
        // Writing to a string cannot fail.
        let mut minima = self.minima.iter();
        if let Some(best) = minima.next() {
            let led = best.points.len();
            let _ = writeln!(text, "{led} of {n_points} starting points led to this minimum");
        }
        for minimum in minima.by_ref().take(MOST_MINIMA) {
            let Some(fit) = self.all().fit_of(minimum.points[0]) else { continue };
            let above = short(minimum.above, 3);
            let how = match minimum.above {
                above if above < AS_GOOD => "as good".to_owned(),
                above if above < THRESHOLD => {
                    "which the data hardly distinguish from this one".to_owned()
                }
                _ => format!("a deviance of {above} above"),
            };
            let (led, places) = (minimum.points.len(), self.places(fit, outcome));
            let _ = writeln!(text, "{led} led to another one, {how}: {places}");
        }
        let others = minima.len();
        if others > 0 {
            let _ = writeln!(text, "the rest led to {others} more, all of them above these");
        }
        if let (failed @ 1.., Some(reason)) = self.failed() {
            let _ = writeln!(text, "{failed} of {n_points} could not be fitted: {reason}");
        }
        let lost = self.lost();
        if lost > 0 {
            let _ = writeln!(text, "{lost} of {n_points} did not converge");
        }
        let draws = self.all().failed_draws;
        if draws > 0 {
            let _ = writeln!(
                text,
                "{draws} points could not be simulated, and others were drawn near them instead"
            );
        }
        if let Some(words) = self.found_volume_text() {
            let _ = writeln!(text, "{words}");
        }
    }

    /// The estimates of another minimum that are furthest from the best.
    fn places(&self, other: &Fit, outcome: &dyn IntervalEstimates) -> String {
        let best = &self.all().fit.estimates;
        let distance = |i: usize| {
            let size = best[i].std.unwrap_or(best[i].value.abs()).max(f64::MIN_POSITIVE);
            (other.estimates[i].value - best[i].value).abs() / size
        };
        let mut order: Vec<usize> = (0..best.len()).collect();
        order.sort_by(|a, b| distance(*b).total_cmp(&distance(*a)));
        let listed = order.into_iter().take(MOST_TOLD).map(|i| {
            let (unit, estimate) = (outcome.unit(i), &other.estimates[i]);
            let std = estimate.std.map(|std| std / unit.factor);
            let value = digits_of(unit.from_si(estimate.value), std);
            format!("`{}` = {}", outcome.name(i), with_unit(value, &unit.symbol))
        });
        listed.collect::<Vec<_>>().join(", ")
    }
}
