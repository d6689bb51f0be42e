//! Nonlinear least squares within bounds: Gauss and Newton's steps within a trust region.
//!
//! ```text
//!   minimise  Σ r(x)²   over   lower ≤ x ≤ upper
//!
//!   gᵀδ + ½ δᵀH δ → min  within the bounds and ‖D δ‖ ≤ Δ      H: JᵀJ, or JᵀJ + S;  D²: √diag(JᵀJ), slowly forgotten
//!   ρ = actual / promised reduction of Σ r²
//!   ρ > 0: x ← x + δ;  Δ ← 2 ‖D δ‖ at least where ρ ≥ ¾,  ½ ‖D δ‖ where ρ < ¼
//!   else:              Δ ← ‖D δ‖ times where the sum is least along δ, 0.1 to 0.5
//! ```
//!
//! The caller gives JᵀJ, Jᵀr and Σ r²: residuals of long recordings are not kept. The step is the minimum on the
//! box and within the radius ([`subproblem`]), so that a variable at its bound that is pushed outwards stays, and
//! the others converge as without it. Where residuals are large, S is what JᵀJ lacks ([`curvature`]).
//!
//! D lies halfway between Levenberg's 1, in whose metric variables of great influence hold back all others, and
//! Marquardt's diag(JᵀJ), in whose metric those of little influence are carried away, to bounds and beyond where they
//! matter.
//!
//! A step goes no further in a variable than its reach ([`Region`]): a quadratic model says nothing of what a
//! logarithm is some decades away. Nor does it go far towards a bound that is far: what a search meets there early, it
//! seldom leaves again.
//!
//! Where no variable has any influence, except those at their bounds, the point may or may not be a minimum. If such a
//! plain slopes, the search follows the slope as far as variables reach, as long as that makes the sum smaller.
//!
//! Σ r² may be −2 ln of a likelihood, with its exact gradient and the information in the place of JᵀJ; changes are
//! compared with its squares then, as the rest has no zero of its own.
//!
//! A trial that cannot be evaluated is a step that went too far: the radius becomes a quarter of it.
//!
//! Conn, Gould, Toint, Trust-Region Methods (2000), ch. 6 and 7; the size of the first step is that of Levenberg and
//! Marquardt's method as Madsen, Nielsen, Tingleff, Methods for Non-Linear Least Squares Problems (2004), §3.2 begin it.

mod curvature;
mod problem;
mod subproblem;

pub use problem::{Minimum, NormalEquations, Region, StoppingRule, Termination};

use nalgebra::DVector;

use crate::progress::{Unwatched, Watch};
use curvature::Curvature;
use subproblem::Quadratic;

/// The first radius is the length of the step with this damping, relative to diag(JᵀJ).
const FIRST_DAMPING: f64 = 1e-3;

/// What the radius becomes, as a part of the step, after a trial that could not be evaluated.
const AFTER_FAILURE: f64 = 0.25;

/// Steps whose sum fell by this part of what was promised, or less, are too long for the model.
const POOR: f64 = 0.25;

/// And from this part on, it can be trusted further.
const GOOD: f64 = 0.75;

/// Share of D² that is kept where a variable's influence falls: a steep place that a search came by does not hold
/// it back for ever.
const KEPT: f64 = 0.36;

/// A step goes this part of the way to a bound at most …
const TOWARDS_BOUND: f64 = 0.25;

/// … that is further than this from a variable, whose size is 1.
const FAR: f64 = 1.0;

/// Share of Σ r² that a variable of no influence changes at most, where it moves by 1.
const NO_INFLUENCE: f64 = 1e-20;

/// Minimises Σ r² from `x`, where it is `at`.
///
/// `evaluate` gives Σ r² and its derivatives, and whatever else the caller wants to know of the
/// minimum, or why there is none at this point. Variables should be of the order of 1: the step
/// rule is absolute for smaller ones. A variable outside of its bounds is moved to the nearer one by
/// the caller, before `at` is evaluated.
///
/// # Panics
///
/// When lengths differ, or `x` is not within the bounds.
pub fn minimise<T: AsRef<NormalEquations>, E>(
    x: Vec<f64>,
    at: T,
    bounds: &[(f64, f64)],
    rule: &StoppingRule,
    evaluate: impl FnMut(&[f64]) -> Result<T, E>,
) -> Minimum<T, E> {
    let reach = vec![f64::INFINITY; x.len()];
    let region = Region { bounds, reach: &reach, leading: x.len() };
    minimise_watched(x, at, region, rule, &Unwatched, evaluate)
}

/// [`minimise`] with steps of a limited size, which `watch` may stop before any evaluation.
///
/// # Panics
///
/// As [`minimise`].
pub fn minimise_watched<T: AsRef<NormalEquations>, E>(
    x: Vec<f64>,
    at: T,
    region: Region<'_>,
    rule: &StoppingRule,
    watch: &dyn Watch,
    mut evaluate: impl FnMut(&[f64]) -> Result<T, E>,
) -> Minimum<T, E> {
    assert_eq!(x.len(), region.bounds.len(), "one pair of bounds for each variable");
    assert_eq!(x.len(), region.reach.len(), "one reach for each variable");
    assert_eq!(x.len(), at.as_ref().gradient.len(), "length of the gradient");
    let within = |(x, (low, high)): (&f64, &(f64, f64))| low <= x && x <= high;
    assert!(x.iter().zip(region.bounds).all(within), "the start is within the bounds");
    let mut search = Search::new(x, at, region, *rule);
    loop {
        search.forget_scale();
        let ended = search.converged().or_else(|| search.advance(watch, &mut evaluate));
        if let Some(termination) = ended {
            if termination == Termination::Flat && search.follow_plain(watch, &mut evaluate) {
                continue;
            }
            return Minimum { termination, ..search.minimum };
        }
    }
}

/// A search under way.
struct Search<'a, T, E> {
    region: Region<'a>,
    rule: StoppingRule,
    first: Vec<f64>,
    minimum: Minimum<T, E>,
    /// D².
    scale: DVector<f64>,
    /// Δ; nothing before the first step.
    radius: Option<f64>,
    curvature: Curvature,
    /// Whether the present point was reached around failures, or failures lie before it.
    near_failures: bool,
    /// What the full step from the present point promises, as a part of Σ r².
    promise: f64,
}

impl<'a, T: AsRef<NormalEquations>, E> Search<'a, T, E> {
    fn new(x: Vec<f64>, at: T, region: Region<'a>, rule: StoppingRule) -> Self {
        let n = x.len();
        let minimum = Minimum {
            x: x.clone(),
            at,
            iterations: 0,
            evaluations: 0,
            failures: 0,
            last_failure: None,
            termination: Termination::EvaluationLimit,
        };
        Self {
            region,
            rule,
            first: x,
            minimum,
            scale: DVector::zeros(n),
            radius: None,
            curvature: Curvature::new(n),
            near_failures: false,
            promise: f64::INFINITY,
        }
    }

    fn normal(&self) -> &NormalEquations {
        self.minimum.at.as_ref()
    }

    /// D² at the present point: no less than a part of what it was.
    fn forget_scale(&mut self) {
        let information = &self.minimum.at.as_ref().information;
        for (i, scale) in self.scale.iter_mut().enumerate() {
            *scale = information[(i, i)].sqrt().max(KEPT * *scale);
        }
    }

    /// Why the present point is the minimum, if it is.
    fn converged(&mut self) -> Option<Termination> {
        let (lower, upper) = self.room(|_, distance| distance);
        let normal = self.minimum.at.as_ref();
        if is_stationary(normal, &lower, &upper, self.rule.gradient) {
            return Some(self.or_flat(Termination::Gradient));
        }
        let mut model =
            Quadratic::new(normal, normal.information.clone(), &self.scale, lower, upper);
        let mut is_reduced = true;
        let mut is_still = true;
        self.promise = f64::INFINITY;
        let models = if self.curvature.is_used() { 2 } else { 1 };
        for k in 0..models {
            if k == 1 {
                model.h = self.curvature.hessian(normal);
            }
            let full = model.full()?;
            let promised = normal.promised(&full, &model.h);
            is_reduced &= promised <= self.rule.reduction * normal.squares();
            is_still &= is_small(&full, &self.minimum.x, self.rule.step);
            if k == 0 {
                self.promise = promised / normal.squares();
            }
        }
        if is_reduced {
            return Some(self.or_flat(Termination::Reduction));
        }
        is_still.then(|| self.or_flat(Termination::Step))
    }

    /// Tries steps from the present point until one is taken, or says why there is none.
    fn advance(
        &mut self,
        watch: &dyn Watch,
        mut evaluate: impl FnMut(&[f64]) -> Result<T, E>,
    ) -> Option<Termination> {
        let (lower, upper) = self.room(|i, distance| self.stride(i, distance));
        let (mut trials, mut failed, mut is_switched) = (0, false, false);
        loop {
            let normal = self.minimum.at.as_ref();
            let h = self.curvature.hessian(normal);
            let model = Quadratic::new(normal, h, &self.scale, lower.clone(), upper.clone());
            let radius = match self.radius {
                Some(radius) => Some(radius),
                None => model.damped(FIRST_DAMPING).map(|step| model.length(&step)),
            };
            let step = radius.and_then(|radius| model.within(radius));
            let Some(step) = step else { return Some(self.stalled(&model)) };
            let promised = normal.promised(&step, &model.h);
            let is_nothing = is_small(&step, &self.minimum.x, self.rule.step)
                || trials > 0 && promised <= self.rule.reduction * normal.squares();
            if is_nothing {
                return Some(self.stalled(&model));
            }
            if self.minimum.evaluations >= self.limit() {
                return Some(Termination::EvaluationLimit);
            }
            if watch.is_stopped() {
                return Some(Termination::Stopped);
            }
            let length = model.length(&step);
            let trial = self.moved(&step);
            trials += 1;
            self.minimum.evaluations += 1;
            let at = match evaluate(&trial) {
                Ok(at) => at,
                // What was stopped on its way says nothing of the point.
                Err(_) if watch.is_stopped() => return Some(Termination::Stopped),
                Err(error) => {
                    (failed, self.near_failures) = (true, true);
                    self.minimum.failures += 1;
                    self.minimum.last_failure = Some(error);
                    self.radius = Some(AFTER_FAILURE * length);
                    continue;
                }
            };
            let normal = self.minimum.at.as_ref();
            let reduction = normal.cost - at.as_ref().cost;
            let gain = reduction / promised;
            let is_other_better = self.curvature.other_is_better(normal, &step, reduction);
            // NaN compares false.
            if reduction > 0.0 && gain > 0.0 {
                let radius = radius.unwrap_or(length);
                self.radius = Some(match gain {
                    gain if gain < POOR => 0.5 * length,
                    gain if gain < GOOD => radius,
                    _ => radius.max(2.0 * length),
                });
                self.curvature.learn(&step, normal, at.as_ref());
                if is_other_better {
                    self.curvature.switch();
                }
                self.minimum.x = trial;
                self.minimum.at = at;
                self.minimum.iterations += 1;
                self.near_failures = failed;
                return None;
            }
            if is_other_better && !is_switched {
                // The other model, within the same radius.
                is_switched = true;
                self.curvature.switch();
                self.radius = radius;
            } else {
                self.radius = Some(least_along(normal, at.as_ref(), &step) * length);
            }
        }
    }

    /// Follows the slope of a plain as far as variables reach; whether that made the sum smaller. The next step has a
    /// radius of its own.
    fn follow_plain(
        &mut self,
        watch: &dyn Watch,
        mut evaluate: impl FnMut(&[f64]) -> Result<T, E>,
    ) -> bool {
        let (lower, upper) = self.room(|i, distance| self.stride(i, distance));
        let normal = self.normal();
        let is_free = |i: usize| {
            let room = if normal.gradient[i] > 0.0 { -lower[i] } else { upper[i] };
            i < self.region.leading && room > 0.0
        };
        let slopes = (0..lower.len()).map(|i| if is_free(i) { -normal.gradient[i] } else { 0.0 });
        let slopes = DVector::from_iterator(lower.len(), slopes);
        let size = self.minimum.x.iter().zip(self.region.reach);
        let size = DVector::from_iterator(
            slopes.len(),
            size.map(|(x, reach)| reach.min(x.abs().max(1.0))),
        );
        let steepest = slopes.component_div(&size).amax();
        let is_allowed = self.minimum.evaluations < self.limit() && !watch.is_stopped();
        if !(steepest > 0.0 && is_allowed) {
            return false;
        }
        let step = (slopes / steepest).zip_zip_map(&lower, &upper, f64::clamp);
        let trial = self.moved(&step);
        self.minimum.evaluations += 1;
        let at = match evaluate(&trial) {
            Ok(at) => at,
            Err(error) => {
                self.minimum.failures += 1;
                self.minimum.last_failure = Some(error);
                return false;
            }
        };
        // NaN compares false.
        let is_lower = at.as_ref().cost < self.normal().cost;
        if is_lower {
            (self.minimum.x, self.minimum.at) = (trial, at);
            self.minimum.iterations += 1;
            self.radius = None;
        }
        is_lower
    }

    /// The present point moved by a step. A bound is met exactly, in spite of rounding.
    fn moved(&self, step: &DVector<f64>) -> Vec<f64> {
        let x = self.minimum.x.iter().zip(step.iter()).zip(self.region.bounds);
        x.map(|((x, step), (low, high))| (x + step).clamp(*low, *high)).collect()
    }

    /// Evaluations that are allowed.
    fn limit(&self) -> usize {
        let StoppingRule { evaluations, until_a_step, .. } = self.rule;
        if self.minimum.iterations == 0 && self.minimum.evaluations >= evaluations {
            return evaluations.max(until_a_step);
        }
        evaluations
    }

    /// What it means that no step helps. Where steps are made with what JᵀJ lacks, because that foretells them better,
    /// it is also what says whether there is anything to gain.
    fn stalled(&self, model: &Quadratic<'_>) -> Termination {
        let normal = self.normal();
        let promises_nothing = |full: DVector<f64>| {
            normal.promised(&full, &model.h) <= self.rule.reduction * normal.squares()
        };
        if self.near_failures {
            Termination::Blocked
        } else if self.promise <= self.rule.accuracy
            || self.curvature.is_used() && model.full().is_some_and(promises_nothing)
        {
            self.or_flat(Termination::Reduction)
        } else {
            self.or_flat(Termination::Stalled)
        }
    }

    fn or_flat(&self, found: Termination) -> Termination {
        let Self { rule, region, minimum, first, .. } = self;
        if is_flat(self.normal(), rule.flat, *region, &minimum.x, first) {
            return Termination::Flat;
        }
        found
    }

    /// How far variables may go down and up: `part` of a variable's distance from a bound.
    fn room(&self, part: impl Fn(usize, f64) -> f64) -> (DVector<f64>, DVector<f64>) {
        let (x, bounds) = (&self.minimum.x, self.region.bounds);
        let down = |i: usize, _| -part(i, x[i] - bounds[i].0);
        let up = |i: usize, _| part(i, bounds[i].1 - x[i]);
        (DVector::from_fn(x.len(), down), DVector::from_fn(x.len(), up))
    }

    /// How far a step goes at most in a variable towards a bound at a distance. One without influence would have to
    /// move by ten decades to gain anything, and goes no further than its size.
    fn stride(&self, i: usize, distance: f64) -> f64 {
        let normal = self.normal();
        let has_influence = normal.information[(i, i)] > NO_INFLUENCE * normal.squares();
        let size = if has_influence { f64::INFINITY } else { self.minimum.x[i].abs().max(1.0) };
        let towards = if distance > FAR { TOWARDS_BOUND * distance } else { distance };
        towards.min(self.region.reach[i]).min(size)
    }
}

/// Where the sum is least along a step that did not make it smaller, as a part of the step: by the slopes at both
/// ends, or that at its beginning alone where the other is not known.
fn least_along(before: &NormalEquations, after: &NormalEquations, step: &DVector<f64>) -> f64 {
    let slope = 2.0 * before.gradient.dot(step);
    let rise = after.cost - before.cost;
    let parabola = -slope / (2.0 * (rise - slope));
    let cubic = || {
        let end = 2.0 * after.gradient.dot(step);
        let first = slope + end - 3.0 * rise;
        let second = (first * first - slope * end).sqrt();
        1.0 - (end + second - first) / (end - slope + 2.0 * second)
    };
    let is_whole = before.is_whole && after.is_whole;
    let least = [is_whole.then(cubic), Some(parabola)];
    let least = least.into_iter().flatten().find(|part| part.is_finite());
    least.unwrap_or(AFTER_FAILURE).clamp(0.1, 0.5)
}

/// Whether the point lies on a plain: what is not at a bound has no influence, nor what has come to its bound
/// from elsewhere. What never had any is not meant: that is not determined.
pub(crate) fn is_flat(
    normal: &NormalEquations,
    part: f64,
    region: Region<'_>,
    x: &[f64],
    first: &[f64],
) -> bool {
    let is_lost = |i: usize| normal.information[(i, i)] <= part * normal.squares();
    let has_some = |i: usize| normal.information[(i, i)] > 0.0;
    let is_held = |i: usize| x[i] <= region.bounds[i].0 || x[i] >= region.bounds[i].1;
    part > 0.0
        && (0..region.leading).any(|i| is_lost(i) && (x[i] != first[i] || has_some(i)))
        && (0..region.leading).all(|i| is_held(i) || is_lost(i))
}

fn is_small(step: &DVector<f64>, x: &[f64], tolerance: f64) -> bool {
    x.iter().zip(step.iter()).all(|(x, step)| step.abs() <= tolerance * x.abs().max(1.0))
}

/// Whether the gradient vanishes for every variable that is not held by a bound.
fn is_stationary(
    normal: &NormalEquations,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    tolerance: f64,
) -> bool {
    let size = normal.squares().sqrt();
    (0..normal.gradient.len()).all(|i| {
        let g = normal.gradient[i];
        let held = (lower[i] >= 0.0 && g >= 0.0) || (upper[i] <= 0.0 && g <= 0.0);
        held || g.abs() <= tolerance * normal.information[(i, i)].sqrt() * size
    })
}

#[cfg(test)]
mod tests;
