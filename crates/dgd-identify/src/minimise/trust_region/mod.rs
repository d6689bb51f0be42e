//! Nonlinear least squares within bounds: Gauss–Newton steps within a trust region.
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
//! The caller provides JᵀJ, Jᵀr and Σ r²: residuals of long recordings are not stored. The step is the minimum on the
//! box and within the radius ([`subproblem`]), so a variable at its bound that is pushed outwards stays, and the others
//! converge as without it. For large residuals, S is the difference between JᵀJ and the Hessian ([`curvature`]).
//!
//! D lies halfway between Levenberg's 1, in whose metric variables of great influence hold back all others, and
//! Marquardt's diag(JᵀJ), in whose metric those of little influence are carried away, to their bounds and out of the
//! region where they matter.
//!
//! A step in a variable is limited by its reach ([`VariableRegion`]): a quadratic model does not apply to a logarithm
//! some decades away. It is also limited towards a remote bound: a search that gets there early rarely leaves it again.
//!
//! If no variable has any influence, except those at their bounds, the point may or may not be a minimum. If such a
//! plateau has a slope, the search follows it to the limits of the variables, as long as that reduces the sum.
//!
//! Σ r² may be −2 ln of a likelihood, with its exact gradient and with the information instead of JᵀJ; changes are then
//! compared with its squares because the rest has no natural zero.
//!
//! A trial that cannot be evaluated is a step that was too long: the radius becomes a quarter of it.
//!
//! Conn, Gould, Toint, Trust-Region Methods (2000), ch. 6 and 7; the size of the first step is that of Levenberg and
//! Marquardt's method as Madsen, Nielsen, Tingleff, Methods for Non-Linear Least Squares Problems (2004), §3.2 begin it.

mod curvature;
mod problem;
mod subproblem;

pub use problem::{Minimum, NormalEquations, StoppingRule, Termination, VariableRegion};

use nalgebra::DVector;

use crate::progress::{Monitor, NoMonitor};
use curvature::Curvature;
use subproblem::QuadraticModel;

/// The first radius is the length of the step with this damping, relative to diag(JᵀJ).
const FIRST_DAMPING: f64 = 1e-3;

/// The radius, relative to the step, after a trial that could not be evaluated.
const AFTER_FAILURE: f64 = 0.25;

/// Steps whose actual reduction is at most this fraction of the predicted one are too long for the model.
const POOR: f64 = 0.25;

/// From this fraction on, the radius is increased.
const GOOD: f64 = 0.75;

/// Fraction of D² that is kept when a variable's influence falls, so that a steep region passed by the search does not
/// hold it back forever.
const KEPT: f64 = 0.36;

/// Limit on a step towards a bound, as a fraction of the distance …
const TOWARDS_BOUND: f64 = 0.25;

/// … if the bound is further than this from a variable of size 1.
const FAR: f64 = 1.0;

/// Largest relative change of Σ r² by a variable of no influence that moves by 1.
const NO_INFLUENCE: f64 = 1e-20;

/// Minimises Σ r² from `x`, with the values `at` there.
///
/// `evaluate` returns Σ r² and its derivatives, with anything else that the caller needs at the minimum, or the reason
/// why the point cannot be evaluated. Variables should be of the order of 1: the step rule is absolute for smaller
/// ones. The caller moves a variable outside of its bounds to the nearer one before evaluating `at`.
///
/// # Panics
///
/// If lengths differ, or `x` is not within the bounds.
pub fn minimise<T: AsRef<NormalEquations>, E>(
    x: Vec<f64>,
    at: T,
    bounds: &[(f64, f64)],
    rule: &StoppingRule,
    evaluate: impl FnMut(&[f64]) -> Result<T, E>,
) -> Minimum<T, E> {
    let reach = vec![f64::INFINITY; x.len()];
    let region = VariableRegion { bounds, reach: &reach, leading: x.len() };
    minimise_watched(x, at, region, rule, &NoMonitor, evaluate)
}

/// [`minimise`] with steps of a limited size; `watch` may cancel it before any evaluation.
///
/// # Panics
///
/// As [`minimise`].
pub fn minimise_watched<T: AsRef<NormalEquations>, E>(
    x: Vec<f64>,
    at: T,
    region: VariableRegion<'_>,
    rule: &StoppingRule,
    watch: &dyn Monitor,
    mut evaluate: impl FnMut(&[f64]) -> Result<T, E>,
) -> Minimum<T, E> {
    assert_eq!(x.len(), region.bounds.len(), "one pair of bounds for each variable");
    assert_eq!(x.len(), region.reach.len(), "one reach for each variable");
    assert_eq!(x.len(), at.as_ref().gradient.len(), "length of the gradient");
    let within = |(x, (low, high)): (&f64, &(f64, f64))| low <= x && x <= high;
    assert!(x.iter().zip(region.bounds).all(within), "the start is within the bounds");
    let mut search = TrustRegionSearch::new(x, at, region, *rule);
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

/// A search in progress.
struct TrustRegionSearch<'a, T, E> {
    region: VariableRegion<'a>,
    rule: StoppingRule,
    first: Vec<f64>,
    minimum: Minimum<T, E>,
    /// D².
    scale: DVector<f64>,
    /// Δ; `None` before the first step.
    radius: Option<f64>,
    curvature: Curvature,
    /// Whether the current point was reached around failures, or failures lie ahead.
    near_failures: bool,
    /// The relative reduction of Σ r² predicted for the full step from the current point.
    promise: f64,
}

impl<'a, T: AsRef<NormalEquations>, E> TrustRegionSearch<'a, T, E> {
    fn new(x: Vec<f64>, at: T, region: VariableRegion<'a>, rule: StoppingRule) -> Self {
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

    /// D² at the current point: at least a fraction of its last value.
    fn forget_scale(&mut self) {
        let information = &self.minimum.at.as_ref().information;
        for (i, scale) in self.scale.iter_mut().enumerate() {
            *scale = information[(i, i)].sqrt().max(KEPT * *scale);
        }
    }

    /// The reason why the current point is the minimum, if it is.
    fn converged(&mut self) -> Option<Termination> {
        let (lower, upper) = self.room(|_, distance| distance);
        let normal = self.minimum.at.as_ref();
        if is_stationary(normal, &lower, &upper, self.rule.gradient) {
            return Some(self.or_flat(Termination::Gradient));
        }
        let mut model =
            QuadraticModel::new(normal, normal.information.clone(), &self.scale, lower, upper);
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

    /// Tries steps from the current point until one is accepted, or returns the reason why there is none.
    fn advance(
        &mut self,
        watch: &dyn Monitor,
        mut evaluate: impl FnMut(&[f64]) -> Result<T, E>,
    ) -> Option<Termination> {
        let (lower, upper) = self.room(|i, distance| self.stride(i, distance));
        let (mut trials, mut failed, mut is_switched) = (0, false, false);
        loop {
            let normal = self.minimum.at.as_ref();
            let h = self.curvature.hessian(normal);
            let model = QuadraticModel::new(normal, h, &self.scale, lower.clone(), upper.clone());
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
            let value = match evaluate(&trial) {
                Ok(at) => at,
                // A cancelled trial gives no information about the point.
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
            let reduction = normal.cost - value.as_ref().cost;
            let gain = reduction / promised;
            let is_other_better = self.curvature.other_is_better(normal, &step, reduction);
            // False for NaN.
            if reduction > 0.0 && gain > 0.0 {
                let radius = radius.unwrap_or(length);
                self.radius = Some(match gain {
                    gain if gain < POOR => 0.5 * length,
                    gain if gain < GOOD => radius,
                    _ => radius.max(2.0 * length),
                });
                self.curvature.learn(&step, normal, value.as_ref());
                if is_other_better {
                    self.curvature.switch();
                }
                self.minimum.x = trial;
                self.minimum.at = value;
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
                self.radius = Some(least_along(normal, value.as_ref(), &step) * length);
            }
        }
    }

    /// Follows the slope of a plateau to the limits of the variables; returns whether that reduced the sum. The next
    /// step gets a new radius.
    fn follow_plain(
        &mut self,
        watch: &dyn Monitor,
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
        let value = match evaluate(&trial) {
            Ok(at) => at,
            Err(error) => {
                self.minimum.failures += 1;
                self.minimum.last_failure = Some(error);
                return false;
            }
        };
        // False for NaN.
        let is_lower = value.as_ref().cost < self.normal().cost;
        if is_lower {
            (self.minimum.x, self.minimum.at) = (trial, value);
            self.minimum.iterations += 1;
            self.radius = None;
        }
        is_lower
    }

    /// The current point moved by a step. Snaps to bounds in spite of rounding errors.
    fn moved(&self, step: &DVector<f64>) -> Vec<f64> {
        let x = self.minimum.x.iter().zip(step.iter()).zip(self.region.bounds);
        x.map(|((x, step), (low, high))| (x + step).clamp(*low, *high)).collect()
    }

    /// Limit on evaluations.
    fn limit(&self) -> usize {
        let StoppingRule { evaluations, until_a_step, .. } = self.rule;
        if self.minimum.iterations == 0 && self.minimum.evaluations >= evaluations {
            return evaluations.max(until_a_step);
        }
        evaluations
    }

    /// The termination if no step helps. If steps use JᵀJ + S because it predicts them better, it also decides whether
    /// a reduction remains.
    fn stalled(&self, model: &QuadraticModel<'_>) -> Termination {
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

    /// Largest steps of variables down and up; `part` gives the allowed fraction of the distance from a bound.
    fn room(&self, part: impl Fn(usize, f64) -> f64) -> (DVector<f64>, DVector<f64>) {
        let (x, bounds) = (&self.minimum.x, self.region.bounds);
        let down = |i: usize, _| -part(i, x[i] - bounds[i].0);
        let up = |i: usize, _| part(i, bounds[i].1 - x[i]);
        (DVector::from_fn(x.len(), down), DVector::from_fn(x.len(), up))
    }

    /// Largest step of a variable towards a bound at a distance. A variable without influence would have to move by ten
    /// decades to gain anything, and is limited to its size.
    fn stride(&self, i: usize, distance: f64) -> f64 {
        let normal = self.normal();
        let has_influence = normal.information[(i, i)] > NO_INFLUENCE * normal.squares();
        let size = if has_influence { f64::INFINITY } else { self.minimum.x[i].abs().max(1.0) };
        let towards = if distance > FAR { TOWARDS_BOUND * distance } else { distance };
        towards.min(self.region.reach[i]).min(size)
    }
}

/// The minimum of the sum along a rejected step, as a fraction of the step: from the slopes at both ends, or from the
/// slope at its start if the other is unknown.
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

/// Whether the point lies on a plateau: variables away from bounds have no influence, nor do those that have reached
/// their bound from elsewhere. Variables that never had influence are excluded because they are not determined.
pub(crate) fn is_flat(
    normal: &NormalEquations,
    part: f64,
    region: VariableRegion<'_>,
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
        let is_held = (lower[i] >= 0.0 && g >= 0.0) || (upper[i] <= 0.0 && g <= 0.0);
        is_held || g.abs() <= tolerance * normal.information[(i, i)].sqrt() * size
    })
}

#[cfg(test)]
mod tests;
