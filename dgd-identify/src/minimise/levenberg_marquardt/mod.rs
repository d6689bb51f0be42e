//! Nonlinear least squares within bounds: Levenberg and Marquardt's method.
//!
//! ```text
//!   minimise  Σ r(x)²   over   lower ≤ x ≤ upper
//!
//!   (JᵀJ + λ D) δ = −Jᵀr,  within the bounds       D: largest diag(JᵀJ) met so far
//!   ρ = actual / predicted reduction of Σ r²
//!   ρ > 0: x ← x + δ,  λ ← λ max(1/3, 1 − (2ρ − 1)³),  ν ← 2
//!   else:              λ ← λ ν,  ν ← 2 ν
//! ```
//!
//! The caller gives JᵀJ, Jᵀr and Σ r²: residuals of long recordings are not kept. The step is the
//! minimum of the damped quadratic model on the box ([`super::box_quadratic`]), so that a variable
//! at its bound that is pushed outwards stays, and the others converge as without it.
//!
//! A step goes no further in a variable than its reach ([`Region`]): a quadratic model says nothing of what a
//! logarithm is some decades away. Where no variable has influence, but for those at their bounds, there is no
//! telling of a minimum: a plain has no slopes.
//!
//! A trial that cannot be evaluated is a step that went too far: it is rejected, and the damping
//! grows from no less than its first value.
//!
//! Madsen, Nielsen, Tingleff, Methods for Non-Linear Least Squares Problems, 2nd ed. (2004), §3.2;
//! scaling by Moré, The Levenberg-Marquardt Algorithm, LNM 630 (1978) 105, §6.

use nalgebra::{DMatrix, DVector};

use super::box_quadratic;
use crate::progress::{Unwatched, Watch};

/// Damping of the first step, and least damping after a trial that failed, relative to D.
const FIRST_DAMPING: f64 = 1e-3;

/// Beyond this damping a step is below rounding.
const MOST_DAMPING: f64 = 1e15;

/// Damping that leaves a step what it is, and a singular matrix positive definite: well above the
/// rounding of sums, well below the squares of what is known of derivatives.
const NO_DAMPING: f64 = 1e-12;

/// A sum of squares at a point, and what is known of it nearby.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalEquations {
    /// Σ r².
    pub cost: f64,
    /// Jᵀr.
    pub gradient: DVector<f64>,
    /// JᵀJ.
    pub information: DMatrix<f64>,
}

impl NormalEquations {
    /// A sum over nothing, in n variables.
    pub fn zeros(n: usize) -> Self {
        Self { cost: 0.0, gradient: DVector::zeros(n), information: DMatrix::zeros(n, n) }
    }

    /// The reduction of Σ r² that its quadratic model promises of a step: −(2 gᵀδ + δᵀJᵀJ δ).
    fn predicted_reduction(&self, step: &DVector<f64>) -> f64 {
        -(2.0 * self.gradient.dot(step) + step.dot(&(&self.information * step)))
    }
}

impl AsRef<NormalEquations> for NormalEquations {
    fn as_ref(&self) -> &NormalEquations {
        self
    }
}

/// When to stop. Each is enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StoppingRule {
    /// No free variable's column of J makes a larger cosine with r: |Jᵀr|ᵢ ≤ tol ‖Jᵢ‖ ‖r‖.
    pub gradient: f64,
    /// The full Gauss–Newton step would reduce Σ r² by no more than this part of it.
    pub reduction: f64,
    /// The full Gauss–Newton step moves no variable by more than this, or this part of its value.
    pub step: f64,
    /// Most evaluations.
    pub evaluations: usize,
    /// A variable that changes Σ r² by its own by no more than this part of it, when it is moved by 1, has no
    /// influence: ‖Jᵢ‖² ≤ flat ‖r‖². None is looked for at 0.
    pub flat: f64,
}

impl Default for StoppingRule {
    fn default() -> Self {
        Self { gradient: 1e-10, reduction: 1e-12, step: 1e-10, evaluations: 200, flat: 1e-13 }
    }
}

/// Where variables may be.
#[derive(Debug, Clone, Copy)]
pub struct Region<'a> {
    /// Bounds of each.
    pub bounds: &'a [(f64, f64)],
    /// How far a step goes at most in each.
    pub reach: &'a [f64],
    /// So many, the first ones, must have influence somewhere for a minimum; start values, which only move a
    /// solution, come behind them.
    pub leading: usize,
}

/// Why the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// The residuals are orthogonal to every free column of J.
    Gradient,
    /// A Gauss–Newton step promises nothing any more.
    Reduction,
    /// A Gauss–Newton step goes nowhere any more.
    Step,
    /// No step, however small, makes the sum smaller: it is not evaluated exactly enough to go on.
    Stalled,
    /// Every step that promises something leads where nothing can be evaluated.
    Blocked,
    /// On a plain, where nothing that is estimated has influence but perhaps at bounds: whether there is a
    /// minimum elsewhere cannot be told.
    Flat,
    /// The allowed evaluations were not enough.
    EvaluationLimit,
    /// Who watched it asked to stop ([`Watch`]); the best so far was kept.
    Stopped,
}

impl Termination {
    /// Whether a minimum was found, as exactly as it can be evaluated.
    pub fn is_converged(self) -> bool {
        match self {
            Self::Gradient | Self::Reduction | Self::Step | Self::Stalled => true,
            Self::Blocked | Self::Flat | Self::EvaluationLimit | Self::Stopped => false,
        }
    }

    /// One word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gradient => "gradient",
            Self::Reduction => "reduction",
            Self::Step => "step",
            Self::Stalled => "stalled",
            Self::Blocked => "blocked",
            Self::Flat => "flat",
            Self::EvaluationLimit => "evaluation limit",
            Self::Stopped => "stopped",
        }
    }
}

/// Where the iteration ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum<T, E> {
    /// The variables.
    pub x: Vec<f64>,
    /// What was evaluated there.
    pub at: T,
    /// Accepted steps.
    pub iterations: usize,
    /// Evaluations, failed ones included, without that at the start.
    pub evaluations: usize,
    /// Trials that could not be evaluated.
    pub failures: usize,
    /// Why the last of them could not.
    pub last_failure: Option<E>,
    /// Why it ended.
    pub termination: Termination,
}

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
    let Region { bounds, reach, .. } = region;
    assert_eq!(x.len(), bounds.len(), "one pair of bounds for each variable");
    assert_eq!(x.len(), reach.len(), "one reach for each variable");
    assert_eq!(x.len(), at.as_ref().gradient.len(), "length of the gradient");
    let within = |(x, (low, high)): (&f64, &(f64, f64))| low <= x && x <= high;
    assert!(x.iter().zip(bounds).all(within), "the start is within the bounds");

    let n = x.len();
    let first = x.clone();
    let mut minimum = Minimum {
        x,
        at,
        iterations: 0,
        evaluations: 0,
        failures: 0,
        last_failure: None,
        termination: Termination::EvaluationLimit,
    };
    let mut scale = DVector::zeros(n);
    let (mut damping, mut growth) = (FIRST_DAMPING, 2.0);
    // Whether the present point was reached around failures, or failures lie before it.
    let mut near_failures = false;
    loop {
        let normal = minimum.at.as_ref();
        widen(&mut scale, &normal.information);
        let lower = DVector::from_fn(n, |i, _| bounds[i].0 - minimum.x[i]);
        let upper = DVector::from_fn(n, |i, _| bounds[i].1 - minimum.x[i]);
        let is_flat = is_flat(normal, rule.flat, region, &minimum.x, &first);
        let or_flat = |found: Termination| if is_flat { Termination::Flat } else { found };
        if is_stationary(normal, &lower, &upper, rule.gradient) {
            minimum.termination = or_flat(Termination::Gradient);
            return minimum;
        }
        if let Some(full) = step(normal, &scale, NO_DAMPING, &lower, &upper) {
            if normal.predicted_reduction(&full) <= rule.reduction * normal.cost {
                minimum.termination = or_flat(Termination::Reduction);
                return minimum;
            }
            if is_small(&full, &minimum.x, rule.step) {
                minimum.termination = or_flat(Termination::Step);
                return minimum;
            }
        }

        // Trials from this point, until one is accepted.
        let reach = |i: usize| {
            let size = minimum.x[i].abs().max(1.0);
            if has_influence(normal, i) { reach[i] } else { reach[i].min(size) }
        };
        let lower = DVector::from_fn(n, |i, _| lower[i].max(-reach(i)));
        let upper = DVector::from_fn(n, |i, _| upper[i].min(reach(i)));
        let mut failed = false;
        loop {
            let normal = minimum.at.as_ref();
            let step = step(normal, &scale, damping, &lower, &upper);
            // A step that is small because of its damping does not mean convergence.
            if step.as_ref().is_some_and(|step| is_small(step, &minimum.x, rule.step))
                || damping > MOST_DAMPING
            {
                minimum.termination = if near_failures {
                    Termination::Blocked
                } else {
                    or_flat(Termination::Stalled)
                };
                return minimum;
            }
            let Some(step) = step else {
                damping *= growth;
                growth *= 2.0;
                continue;
            };
            if minimum.evaluations >= rule.evaluations {
                return minimum;
            }
            if watch.is_stopped() {
                minimum.termination = Termination::Stopped;
                return minimum;
            }
            minimum.evaluations += 1;
            let trial: Vec<f64> = minimum
                .x
                .iter()
                .zip(step.iter())
                .zip(bounds)
                .map(|((x, step), (low, high))| (x + step).clamp(*low, *high))
                .collect();
            match evaluate(&trial) {
                Ok(at) => {
                    let reduction = normal.cost - at.as_ref().cost;
                    let gain = reduction / normal.predicted_reduction(&step);
                    // NaN compares false.
                    if reduction > 0.0 && gain > 0.0 {
                        damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
                        damping = damping.max(NO_DAMPING);
                        growth = 2.0;
                        minimum.x = trial;
                        minimum.at = at;
                        minimum.iterations += 1;
                        near_failures = failed;
                        break;
                    }
                    damping *= growth;
                }
                // What was stopped on its way says nothing of the point.
                Err(_) if watch.is_stopped() => {
                    minimum.termination = Termination::Stopped;
                    return minimum;
                }
                Err(error) => {
                    (failed, near_failures) = (true, true);
                    minimum.failures += 1;
                    minimum.last_failure = Some(error);
                    damping = damping.max(FIRST_DAMPING) * growth;
                }
            }
            growth *= 2.0;
        }
    }
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
    let is_lost = |i: usize| normal.information[(i, i)] <= part * normal.cost;
    let has_some = |i: usize| normal.information[(i, i)] > 0.0;
    let is_held = |i: usize| x[i] <= region.bounds[i].0 || x[i] >= region.bounds[i].1;
    part > 0.0
        && (0..region.leading).any(|i| is_lost(i) && (x[i] != first[i] || has_some(i)))
        && (0..region.leading).all(|i| is_held(i) || is_lost(i))
}

fn is_small(step: &DVector<f64>, x: &[f64], tolerance: f64) -> bool {
    x.iter().zip(step.iter()).all(|(x, step)| step.abs() <= tolerance * x.abs().max(1.0))
}

/// D: the largest diagonal of JᵀJ met so far. What has no influence has the size 1 and no gradient.
fn widen(scale: &mut DVector<f64>, information: &DMatrix<f64>) {
    for (i, scale) in scale.iter_mut().enumerate() {
        *scale = scale.max(information[(i, i)]);
    }
}

/// Whether a variable changes anything beyond rounding. What does not would have to move by ten decades to gain
/// anything, and goes no further than its size in one step.
fn has_influence(normal: &NormalEquations, i: usize) -> bool {
    normal.information[(i, i)] > NO_INFLUENCE * normal.cost
}

/// The minimum of the damped model within what the bounds leave.
fn step(
    normal: &NormalEquations,
    scale: &DVector<f64>,
    damping: f64,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
) -> Option<DVector<f64>> {
    let mut a = normal.information.clone();
    for (i, scale) in scale.iter().enumerate() {
        a[(i, i)] += if *scale > 0.0 { damping * scale } else { 1.0 };
    }
    box_quadratic::minimise(&a, &normal.gradient, lower, upper)
}

/// Whether the gradient vanishes for every variable that is not held by a bound.
fn is_stationary(
    normal: &NormalEquations,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    tolerance: f64,
) -> bool {
    let size = normal.cost.sqrt();
    (0..normal.gradient.len()).all(|i| {
        let g = normal.gradient[i];
        let held = (lower[i] >= 0.0 && g >= 0.0) || (upper[i] <= 0.0 && g <= 0.0);
        held || g.abs() <= tolerance * normal.information[(i, i)].sqrt() * size
    })
}

#[cfg(test)]
mod tests;
