//! Fits from several starting points, and the minima that they reach.
//!
//! A fit finds the minimum in whose basin it starts; [`points`] draws the starting points. Fits of models that switch
//! proceed over increasing horizons ([`horizons`]). N fits from random points also bound the minima that none of them
//! found: a basin with the fraction v of the sampled volume is missed by all with a probability of (1 − v)ᴺ, which is
//! below 5 % from v = 3/N on.

mod horizons;
mod next_switch;
pub(crate) mod points;

use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_runtime::RunMonitor;
use dgd_runtime::parallel::in_parallel_by_model;

use crate::error::EstimateError;
use crate::minimise::trust_region::Termination;
use crate::output_error::fit::Fit;
use crate::output_error::multi_start::horizons::fit_by_horizons;
use crate::output_error::multi_start::points::StartingPoints;
use crate::output_error::{OutputErrorProblem, Starts, fit};
use crate::progress::{Monitor, Progress, Total};

/// Fits whose deviances differ by less than this may be at the same minimum.
const SAME_DEVIANCE: f64 = 0.1;

/// They also differ in no estimate by more standard deviations than this: in one basin, a deviance that is 0.1 higher
/// is 0.32 standard deviations away.
const SAME_PLACE: f64 = 1.0;

/// The result of a starting point.
#[derive(Debug, Clone)]
pub enum PointEnd {
    /// The fit from there.
    Fitted(Box<Fit>),
    /// The fit failed.
    Failed(EstimateError),
    /// The search was cancelled before.
    LeftOut,
}

/// Fits from several points.
#[derive(Debug, Clone)]
pub struct MultiStart {
    /// Position of the starting point of the best fit.
    pub best: usize,
    /// The best fit.
    pub fit: Fit,
    /// The result of each point.
    pub ends: Vec<PointEnd>,
    /// Number of draws that could not be simulated, and were replaced.
    pub failed_draws: usize,
}

/// −ln 0.05: with an average of this many draws in a region, the probability of missing it is 5 %.
const SURE: f64 = 3.0;

/// A minimum, and the points that lead to it.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalMinimum {
    /// Positions of the points, the one with the lowest deviance first.
    pub points: Vec<usize>,
    /// Its deviance, relative to that of the best.
    pub above: f64,
}

impl MultiStart {
    /// The fit from a point, if there is one.
    pub fn fit_of(&self, point: usize) -> Option<&Fit> {
        match &self.ends[point] {
            PointEnd::Fitted(fit) => Some(fit),
            PointEnd::Failed(_) | PointEnd::LeftOut => None,
        }
    }

    /// The volume fraction of basins that would have been found with a probability of 95 %: 3/N, with N the number of
    /// points that reached a minimum, without the first, which was not drawn. `None` if that is 1 or more.
    pub fn found_volume(&self) -> Option<f64> {
        let reached = |k: &usize| self.fit_of(*k).is_some_and(|fit| fit.termination.is_converged());
        let drawn = (1..self.ends.len()).filter(reached).count();
        (drawn as f64 > SURE).then(|| SURE / drawn as f64)
    }

    /// The minima that were reached, the best first.
    ///
    /// Two fits are at the same one if their deviances differ by at most 0.1, and all estimates that the first
    /// determines by at most one standard deviation.
    pub fn minima(&self) -> Vec<LocalMinimum> {
        let mut fits: Vec<(usize, &Fit)> = (0..self.ends.len())
            .filter_map(|k| Some((k, self.fit_of(k)?)))
            .filter(|(_, fit)| fit.termination.is_converged())
            .collect();
        fits.sort_by(|(_, a), (_, b)| a.deviance.total_cmp(&b.deviance));
        let Some((_, best)) = fits.first() else { return Vec::new() };
        let least = best.deviance;
        let mut minima: Vec<(LocalMinimum, &Fit)> = Vec::new();
        for (k, fit) in fits {
            if let Some((minimum, _)) = minima.iter_mut().find(|(_, first)| is_same(first, fit)) {
                minimum.points.push(k);
            } else {
                let above = fit.deviance - least;
                minima.push((LocalMinimum { points: vec![k], above }, fit));
            }
        }
        minima.into_iter().map(|(minimum, _)| minimum).collect()
    }
}

fn is_same(first: &Fit, other: &Fit) -> bool {
    let near = |(a, b): (&crate::ParameterEstimate, &crate::ParameterEstimate)| {
        a.at_bound == b.at_bound
            && a.std.is_none_or(|std| (a.value - b.value).abs() <= SAME_PLACE * std)
    };
    other.deviance - first.deviance <= SAME_DEVIANCE
        && first.estimates.iter().zip(&other.estimates).all(near)
}

/// Fits from several points, and the best of them.
///
/// Each point gives values to some parameters, by position, SI; the others start as in `problem`. The best is the fit
/// with the lowest [`Fit::deviance`] among those that reached a minimum, the first of ties. If cancelled, that is the
/// best so far, and the remaining points are not tried.
///
/// # Errors
///
/// That of the first point, if the fits from all points fail.
///
/// # Panics
///
/// Without points.
pub fn fit_from(
    problem: &OutputErrorProblem<'_>,
    points: &[Starts],
) -> Result<MultiStart, EstimateError> {
    assert!(!points.is_empty(), "a fit starts somewhere");
    fit_each(problem, points.len(), |_, k| Some((points[k].clone(), 0)))
}

/// [`fit_from`] with drawn points; a point that cannot be simulated is drawn again.
///
/// # Errors
///
/// As [`fit_from`].
pub fn fit_from_drawn(
    problem: &OutputErrorProblem<'_>,
    points: &StartingPoints,
) -> Result<MultiStart, EstimateError> {
    fit_each(problem, points.len(), |problem, k| points.simulated(problem, k))
}

/// [`fit_from_drawn`] from one of the points alone.
///
/// # Errors
///
/// As [`fit_from`].
pub fn fit_from_point(
    problem: &OutputErrorProblem<'_>,
    points: &StartingPoints,
    k: usize,
) -> Result<MultiStart, EstimateError> {
    fit_each(problem, 1, |problem, _| points.simulated(problem, k))
}

/// Fits from `count` points; `point` returns each, with its number of draws, in the thread that fits from it, or `None`
/// if cancelled.
fn fit_each(
    problem: &OutputErrorProblem<'_>,
    count: usize,
    point: impl Fn(&OutputErrorProblem<'_>, usize) -> Option<(Starts, usize)> + Sync,
) -> Result<MultiStart, EstimateError> {
    // Everything except the system, of which each thread has its own.
    let OutputErrorProblem { system, p, ref free, recordings, ref noise, ref priors, .. } =
        *problem;
    let OutputErrorProblem { loss, options, stopping, negligible_reduction, .. } = *problem;
    let (threads, keeping) = (problem.threads, problem.keeping);
    let (done, watch, silent) = (AtomicUsize::new(0), problem.watch, CancelOnly(problem.watch));
    // A fit uses no more threads than it has recordings.
    let within = threads.div_ceil(count).max(1);
    let ended = in_parallel_by_model(system, count, threads, |system, k| {
        if k > 0 && watch.is_stopped() {
            return (PointEnd::LeftOut, 0);
        }
        let of_thread = OutputErrorProblem {
            system,
            p,
            free: free.clone(),
            recordings,
            noise: noise.clone(),
            priors: priors.clone(),
            loss,
            options,
            stopping,
            negligible_reduction,
            threads: within,
            watch: &silent,
            keeping,
        };
        let Some((drawn, failed)) = point(&of_thread, k) else { return (PointEnd::LeftOut, 0) };
        let mut p = p.to_vec();
        for &(i, value) in &drawn {
            p[i] = value;
        }
        // A single start is at the given values.
        let fitted = if count == 1 { fit } else { fit_by_horizons };
        let end = match fitted(&OutputErrorProblem { p: &p, ..of_thread }) {
            Ok(fit) => PointEnd::Fitted(Box::new(fit)),
            Err(error) if k > 0 && error.is_stopped() => PointEnd::LeftOut,
            Err(error) => PointEnd::Failed(error),
        };
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        watch.advanced(Progress { what: "starts", done, of: Total::Exactly(count) });
        (end, failed)
    });
    let failed_draws = ended.iter().map(|(_, failed)| failed).sum();
    let ends: Vec<PointEnd> = ended.into_iter().map(|(end, _)| end).collect();
    let fitted = ends.iter().enumerate().filter_map(|(k, end)| match end {
        PointEnd::Fitted(fit) => Some((k, fit.as_ref())),
        PointEnd::Failed(_) | PointEnd::LeftOut => None,
    });
    // A cancelled fit may be the best so far.
    let is_blocked =
        |fit: &Fit| !fit.termination.is_converged() && fit.termination != Termination::Stopped;
    let best = fitted.min_by(|(_, a), (_, b)| {
        is_blocked(a).cmp(&is_blocked(b)).then(a.deviance.total_cmp(&b.deviance))
    });
    if let Some((best, fit)) = best {
        return Ok(MultiStart { best, fit: fit.clone(), ends, failed_draws });
    }
    let first = ends.into_iter().find_map(|end| match end {
        PointEnd::Failed(error) => Some(error),
        PointEnd::Fitted(_) | PointEnd::LeftOut => None,
    });
    Err(first.unwrap_or(EstimateError::Stopped))
}

/// Forwards cancellation, but not the progress of single fits.
#[derive(Debug)]
struct CancelOnly<'a>(&'a dyn Monitor);

impl Monitor for CancelOnly<'_> {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }

    fn watched(&self) -> Option<&'static RunMonitor> {
        self.0.watched()
    }
}
