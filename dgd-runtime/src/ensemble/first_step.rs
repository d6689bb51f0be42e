//! The initial step size of a member, chosen as in the integrator.

use super::lanes::Lanes;
use super::power::power;
use crate::linalg::norm::Tolerances;
use crate::problem::Problem;
use crate::signal::Segment;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// The start of a member.
#[derive(Clone, Copy)]
pub(super) struct MemberStart<'a> {
    pub(super) t: f64,
    pub(super) y: &'a [f64],
    /// Sizes of the unknowns.
    pub(super) sizes: &'a [f64],
    /// 1 for differential unknowns, 0 for the others.
    pub(super) mass: &'a [f64],
}

/// A step from the start that is small relative to the time in which the solution and its slope change.
///
/// ```text
///   h₀ = 0.01 ‖y‖ / ‖ẏ‖,  ‖ÿ‖ ≈ ‖f(t + h₀, y + h₀ f) − f‖ / h₀
///   h  = min(100 h₀, (0.01 / max(‖ẏ‖, ‖ÿ‖))^(1/k)),  k = 1 + order of the error estimate
/// ```
///
/// # Source
///
/// Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), §II.4.
pub(super) fn first_step<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    segment: Segment<'_>,
    start: MemberStart<'_>,
    tolerances: Tolerances,
    estimate_order: u32,
    span: f64,
) -> f64 {
    let Problem { system, p, .. } = *problem;
    let MemberStart { t: from, y, sizes, mass } = start;
    let n = y.len();
    let size = |values: &[f64]| tolerances.mean_square(values, y, y, sizes).sqrt();
    let mut u = S::Inputs::zeros(segment.u.len());
    let (mut slope, mut slope_new) = (S::Vector::zeros(n), S::Vector::zeros(n));
    let mut rhs = |t: f64, y: &[f64], f: &mut [f64]| {
        segment.value(t, u.as_mut());
        system.rhs(EvaluationPoint { t, y, u: u.as_ref(), p, z: &[] }, f);
        for (f, mass) in f.iter_mut().zip(mass) {
            *f *= mass;
        }
    };

    rhs(from, y, slope.as_mut());
    let (d0, d1) = (size(y), size(slope.as_ref()));
    let h0 = (0.01 * d0 / d1).min(span);
    let h0 = if h0 > 0.0 { h0 } else { 1e-6 * span };
    let mut euler = S::Vector::zeros(n);
    for ((euler, y), slope) in euler.as_mut().iter_mut().zip(y).zip(slope.as_ref()) {
        *euler = y + h0 * slope;
    }
    rhs(from + h0, euler.as_ref(), slope_new.as_mut());
    for (new, old) in slope_new.as_mut().iter_mut().zip(slope.as_ref()) {
        *new -= old;
    }
    let d2 = size(slope_new.as_ref()) / h0;
    let steepest = d1.max(d2);
    let exponent = 1.0 / f64::from(estimate_order + 1);
    let h = power(Lanes::splat(0.01 / steepest), exponent).0[0].min(100.0 * h0);
    // The solution is at rest, or the trial point is outside the model's domain.
    let moves = steepest > 0.0 && steepest.is_finite() && h > 0.0;
    match moves {
        true if h.is_finite() => h.min(span),
        _ if steepest == 0.0 => span,
        _ => 0.01 * h0,
    }
}
