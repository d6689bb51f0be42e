//! Fits from several starting points, and the minima that they end in.
//!
//! A fit finds the minimum in whose valley it starts. Points are drawn by a Latin hypercube: with n of
//! them, each parameter has one in each n-th of its range,
//!
//! | parameter | range |
//! |---|---|
//! | with a prior | two standard deviations to both sides |
//! | with bounds on both sides of zero, or at zero | between its bounds, or its size where it has none |
//! | any other | from a tenth of its value to ten times of it, evenly in the logarithm, within its bounds |
//!
//! and the first point is the problem's own.
//!
//! Source: McKay, Beckman, Conover, A comparison of three methods for selecting values of input variables,
//! Technometrics 21 (1979) 239.

use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_runtime::for_identify::parameter_size;
use dgd_runtime::parallel::in_parallel_by_model;
use dgd_runtime::{Direction, Watched};

use crate::error::EstimateError;
use crate::minimise::levenberg_marquardt::Termination;
use crate::output_error::fit::Fit;
use crate::output_error::{OutputErrorProblem, Starts, fit};
use crate::progress::{Of, Progress, Watch};
use crate::random::Uniform;

/// Fits whose deviances differ by less may have ended in one minimum.
const SAME_DEVIANCE: f64 = 0.1;

/// And in no estimate differ by more standard deviations: in one valley, a deviance that is 0.1 higher is
/// 0.32 of one away.
const SAME_PLACE: f64 = 1.0;

/// How far a parameter may be from its value, as a factor.
const FACTOR: f64 = 10.0;

/// How far it may be from the mean of its prior, in standard deviations.
const OF_PRIOR: f64 = 2.0;

/// What became of a starting point.
#[derive(Debug, Clone)]
pub enum PointEnd {
    /// The fit from there.
    Fitted(Box<Fit>),
    /// There is none.
    Failed(EstimateError),
    /// The watch had stopped it before.
    LeftOut,
}

/// Fits from several points.
#[derive(Debug, Clone)]
pub struct MultiStart {
    /// Position of the point from which the best was found.
    pub best: usize,
    /// The best.
    pub fit: Fit,
    /// What became of each point.
    pub ends: Vec<PointEnd>,
}

/// A minimum, and the points from which it is found.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalMinimum {
    /// Positions of the points, that with the least deviance first.
    pub points: Vec<usize>,
    /// Its deviance over that of the best.
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

    /// The minima that were reached, the best first.
    ///
    /// Two fits are at the same one if their deviances are within 0.1, and all estimates that the first
    /// determines within a standard deviation.
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
    let near = |(a, b): (&crate::Estimate, &crate::Estimate)| {
        a.at_bound == b.at_bound
            && a.std.is_none_or(|std| (a.value - b.value).abs() <= SAME_PLACE * std)
    };
    other.deviance - first.deviance <= SAME_DEVIANCE
        && first.estimates.iter().zip(&other.estimates).all(near)
}

/// Fits from several points, and the best of them.
///
/// Each point gives values to some parameters, by position, SI; the others start as in `problem`. The best
/// is the fit with the least [`Fit::deviance`] of those that reached a minimum, the first of equals. Where
/// the watch of the problem stops it, that is the best so far, and the points that are left are not tried.
///
/// # Errors
///
/// That of the first point, where no fit from any point succeeds.
///
/// # Panics
///
/// Without points.
pub fn fit_from(
    problem: &OutputErrorProblem<'_>,
    points: &[Starts],
) -> Result<MultiStart, EstimateError> {
    assert!(!points.is_empty(), "a fit starts somewhere");
    // All but the system, of which each thread has one.
    let OutputErrorProblem { system, p, ref free, recordings, ref noise, ref priors, .. } =
        *problem;
    let OutputErrorProblem { loss, options, stopping, negligible_reduction, .. } = *problem;
    let (threads, keeping) = (problem.threads, problem.keeping);
    let (done, watch, silent) = (AtomicUsize::new(0), problem.watch, Silent(problem.watch));
    // A fit uses no more threads than it has recordings.
    let within = threads.div_ceil(points.len()).max(1);
    let ends = in_parallel_by_model(system, points.len(), threads, |system, k| {
        if k > 0 && watch.is_stopped() {
            return PointEnd::LeftOut;
        }
        let mut p = p.to_vec();
        for &(i, value) in &points[k] {
            p[i] = value;
        }
        let from_point = OutputErrorProblem {
            system,
            p: &p,
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
        let end = match fit(&from_point) {
            Ok(fit) => PointEnd::Fitted(Box::new(fit)),
            Err(error) if k > 0 && error.is_stopped() => PointEnd::LeftOut,
            Err(error) => PointEnd::Failed(error),
        };
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        watch.advanced(Progress { what: "starts", done, of: Of::Exactly(points.len()) });
        end
    });
    let fitted = ends.iter().enumerate().filter_map(|(k, end)| match end {
        PointEnd::Fitted(fit) => Some((k, fit.as_ref())),
        PointEnd::Failed(_) | PointEnd::LeftOut => None,
    });
    // One that was stopped on its way may be the best so far.
    let is_blocked =
        |fit: &Fit| !fit.termination.is_converged() && fit.termination != Termination::Stopped;
    let best = fitted.min_by(|(_, a), (_, b)| {
        is_blocked(a).cmp(&is_blocked(b)).then(a.deviance.total_cmp(&b.deviance))
    });
    if let Some((best, fit)) = best {
        return Ok(MultiStart { best, fit: fit.clone(), ends });
    }
    let first = ends.into_iter().find_map(|end| match end {
        PointEnd::Failed(error) => Some(error),
        PointEnd::Fitted(_) | PointEnd::LeftOut => None,
    });
    Err(first.unwrap_or(EstimateError::Stopped))
}

/// A watch that is not told how far single fits are.
#[derive(Debug)]
struct Silent<'a>(&'a dyn Watch);

impl Watch for Silent<'_> {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        self.0.is_stopped()
    }

    fn watched(&self) -> Option<&'static Watched> {
        self.0.watched()
    }
}

/// So many points to start from, that of the problem first.
///
/// `random` gives uniform 64-bit numbers.
pub fn starting_points(
    problem: &OutputErrorProblem<'_>,
    count: usize,
    random: impl FnMut() -> u64,
) -> Vec<Starts> {
    let mut uniform = Uniform(random);
    let drawn = count.saturating_sub(1);
    let mut points = vec![Starts::new(); drawn];
    let directions = problem.system.signature().directions.iter().zip(&problem.free);
    for (direction, is_free) in directions {
        let (&Direction::Parameter(i), true) = (direction, is_free) else { continue };
        let range = Range::of(problem, i);
        let mut strata: Vec<usize> = (0..drawn).collect();
        for k in (1..drawn).rev() {
            strata.swap(k, uniform.below(k + 1));
        }
        for (point, stratum) in points.iter_mut().zip(strata) {
            let place = (stratum as f64 + uniform.next()) / drawn as f64;
            point.push((i, range.at(place)));
        }
    }
    points.insert(0, Starts::new());
    points
}

/// Where a parameter may start, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Range {
    from: f64,
    until: f64,
    /// Whether it is even in the logarithm.
    by_factors: bool,
}

impl Range {
    fn of(problem: &OutputErrorProblem<'_>, i: usize) -> Self {
        let parameter = &problem.system.signature().parameters[i];
        let (lower, upper) = (parameter.lower, parameter.upper);
        let value = problem.p[i].clamp(lower, upper);
        let within = |from: f64, until: f64, by_factors| Self {
            from: from.clamp(lower, upper),
            until: until.clamp(lower, upper),
            by_factors,
        };
        if let Some(prior) = problem.priors.iter().find(|prior| prior.parameter == i) {
            let half = OF_PRIOR * prior.std;
            if parameter.log && prior.mean > 0.0 {
                let factor = 1.0 + half / prior.mean;
                return within(prior.mean / factor, prior.mean * factor, true);
            }
            return within(prior.mean - half, prior.mean + half, false);
        }
        let has_both_signs = lower < 0.0 && upper > 0.0 && (upper - lower).is_finite();
        if has_both_signs || value == 0.0 {
            let size = parameter_size(&problem.system, i);
            let or_size = |bound: f64, size: f64| if bound.is_finite() { bound } else { size };
            return within(or_size(lower, -size), or_size(upper, size), false);
        }
        let range = within(value / FACTOR, value * FACTOR, true);
        // A bound at zero, or beyond, has no logarithm.
        Self { by_factors: range.from * range.until > 0.0, ..range }
    }

    /// The value at a place between 0 and 1.
    fn at(&self, place: f64) -> f64 {
        let Self { from, until, by_factors } = *self;
        let value = if by_factors {
            from * (until / from).powf(place)
        } else {
            from + (until - from) * place
        };
        value.clamp(from.min(until), from.max(until))
    }
}
