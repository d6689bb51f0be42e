//! The step that a quadratic model makes within bounds and within a radius.
//!
//! ```text
//!   minimise  gᵀδ + ½ δᵀH δ   over   lower ≤ δ ≤ upper,  ‖D δ‖ ≤ Δ
//! ```
//!
//! For each λ the minimum of the damped model on the box, H + λ D², is exact ([`box_quadratic`]), and its length
//! falls as λ grows; the λ at which it is Δ gives the solution. H may have negative curvature: λ begins where
//! H + λ D² has none. Lengths within a tenth of Δ are close enough.
//!
//! Moré, Sorensen, Computing a trust region step, SIAM J. Sci. Stat. Comput. 4 (1983) 553; a λ for a box as well
//! is the multiplier of the radius, the bounds having theirs in the active set.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::minimise::box_quadratic;

/// Damping that leaves a step what it is, and a singular matrix positive definite: well above the
/// rounding of sums, well below the squares of what is known of derivatives.
const NO_DAMPING: f64 = 1e-12;

/// Damping that keeps a step of a singular matrix from what rounding makes of combinations that nothing sees.
const MILD: f64 = 1e-8;

/// A longer step is taken where it promises more than a mildly damped one by this part.
const WORTH: f64 = 1e-3;

/// A length is that of the radius within this part of it.
const CLOSE: f64 = 0.1;

/// Most values of λ that are tried: halving alone takes a λ over sixteen decades to a length within a tenth.
const MOST: usize = 60;

/// The smallest λ that is told from none, as a part of the largest.
const SMALLEST: f64 = 1e-16;

/// A quadratic model on a box.
pub(super) struct Quadratic<'a> {
    pub h: DMatrix<f64>,
    pub g: &'a DVector<f64>,
    /// D², 0 for what never had influence.
    pub scale: &'a DVector<f64>,
    pub lower: DVector<f64>,
    pub upper: DVector<f64>,
}

impl Quadratic<'_> {
    /// ‖D δ‖.
    pub(super) fn length(&self, step: &DVector<f64>) -> f64 {
        let squares = step.iter().zip(self.scale.iter()).map(|(step, scale)| scale * step * step);
        squares.sum::<f64>().sqrt()
    }

    /// gᵀδ + ½ δᵀH δ.
    fn value(&self, step: &DVector<f64>) -> f64 {
        self.g.dot(step) + 0.5 * step.dot(&(&self.h * step))
    }

    /// The minimum on the box alone; `None` where the model has negative curvature.
    pub(super) fn full(&self) -> Option<DVector<f64>> {
        self.damped(NO_DAMPING)
    }

    /// The minimum of the damped model on the box; `None` where that is not positive definite.
    pub(super) fn damped(&self, damping: f64) -> Option<DVector<f64>> {
        box_quadratic::minimise(&self.with(damping), self.g, &self.lower, &self.upper)
    }

    /// The step within a radius; `None` of numbers that are not finite.
    pub(super) fn within(&self, radius: f64) -> Option<DVector<f64>> {
        let least = self.least_damping()?;
        let full = self.damped(least)?;
        let mut low = (0.0, self.length(&full));
        if low.1 <= (1.0 + CLOSE) * radius {
            let mild = self.damped(least.max(MILD))?;
            let is_worth = self.value(&full) < (1.0 + WORTH) * self.value(&mild);
            return Some(if is_worth { full } else { mild });
        }
        let sizes = self.g.iter().zip(self.scale.iter()).filter(|(_, scale)| **scale > 0.0);
        let slope = sizes.map(|(g, scale)| g * g / scale).sum::<f64>().sqrt();
        let most = slope / radius;
        if !most.is_finite() {
            return None;
        }
        let mut best = self.damped(least + most)?;
        let mut high = (most, self.length(&best));
        for k in 0..MOST {
            if high.1 >= (1.0 - CLOSE) * radius {
                break;
            }
            let between = if k % 2 == 0 { secant(low, high, radius) } else { None };
            let damping =
                between.unwrap_or_else(|| (f64::max(low.0, SMALLEST * most) * high.0).sqrt());
            let step = self.damped(least + damping)?;
            let length = self.length(&step);
            if length > (1.0 + CLOSE) * radius {
                low = (damping, length);
            } else {
                high = (damping, length);
                best = step;
            }
        }
        Some(best)
    }

    /// H + λ D², with 1 for what has no influence, and so no gradient.
    fn with(&self, damping: f64) -> DMatrix<f64> {
        let mut a = self.h.clone();
        for (i, scale) in self.scale.iter().enumerate() {
            a[(i, i)] += if *scale > 0.0 { damping * scale } else { 1.0 };
        }
        a
    }

    /// The least λ from which on H + λ D² is positive definite.
    fn least_damping(&self) -> Option<f64> {
        if self.with(NO_DAMPING).cholesky().is_some() {
            return Some(NO_DAMPING);
        }
        let size = |i: usize| if self.scale[i] > 0.0 { self.scale[i].sqrt() } else { 1.0 };
        let scaled = DMatrix::from_fn(self.h.nrows(), self.h.ncols(), |i, j| {
            self.h[(i, j)] / (size(i) * size(j))
        });
        if scaled.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let values = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?.eigenvalues;
        let (least, size) = (values.min(), values.amax());
        // A little more, so that rounding does not make it indefinite again.
        Some((-least).max(0.0) + 1e-6 * size + NO_DAMPING)
    }
}

/// λ where the inverse of the length, between two that are known taken as linear, is that of the radius.
fn secant(low: (f64, f64), high: (f64, f64), radius: f64) -> Option<f64> {
    let inverse = |length: f64| 1.0 / length;
    let part = (inverse(radius) - inverse(low.1)) / (inverse(high.1) - inverse(low.1));
    let between = low.0 + part * (high.0 - low.0);
    (low.0 < between && between < high.0).then_some(between)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: f64 = f64::INFINITY;

    fn quadratic<'a>(
        h: [f64; 4],
        g: &'a DVector<f64>,
        scale: &'a DVector<f64>,
        lower: [f64; 2],
        upper: [f64; 2],
    ) -> Quadratic<'a> {
        let h = DMatrix::from_row_slice(2, 2, &h);
        let (lower, upper) = (DVector::from_row_slice(&lower), DVector::from_row_slice(&upper));
        Quadratic { h, g, scale, lower, upper }
    }

    /// On a grid of the box and the ellipse nothing is clearly below the step found: with curvature of either
    /// sign, a nearly singular matrix, and bounds that hold something or nothing.
    #[test]
    fn no_point_of_box_and_radius_is_lower() {
        let g = DVector::from_row_slice(&[-1.0, 0.4]);
        let scale = DVector::from_row_slice(&[2.0, 0.5]);
        for h in [[2.0, 0.9, 0.9, 0.5], [2.0, 1.0, 1.0, 0.5], [-1.0, 0.3, 0.3, 0.5]] {
            for (lower, upper) in [([-FREE; 2], [FREE; 2]), ([-0.1, -0.2], [0.3, 9.0])] {
                for radius in [0.05, 0.4, 3.0] {
                    let model = quadratic(h, &g, &scale, lower, upper);
                    let step = model.within(radius).expect("finite");
                    let length = model.length(&step);
                    assert!(length <= 1.1 * radius, "{length} of {radius}");
                    let q = |d: &DVector<f64>| g.dot(d) + 0.5 * d.dot(&(&model.h * d));
                    let mut least = 0.0_f64;
                    for k in 0..=400 {
                        for j in 0..=40 {
                            let angle = std::f64::consts::TAU * f64::from(k) / 400.0;
                            // A radius that is a tenth less is as good.
                            let part = 0.9 * radius * f64::from(j) / 40.0;
                            let point = DVector::from_row_slice(&[
                                part * angle.cos() / scale[0].sqrt(),
                                part * angle.sin() / scale[1].sqrt(),
                            ]);
                            let is_inside =
                                (0..2).all(|i| lower[i] <= point[i] && point[i] <= upper[i]);
                            if is_inside {
                                least = least.min(q(&point));
                            }
                        }
                    }
                    assert!(least < 0.0);
                    let found = q(&step);
                    assert!(found <= least * (1.0 - 1e-9), "{found} {least} {h:?} {radius}");
                }
            }
        }
    }

    #[test]
    fn a_radius_that_holds_the_minimum_does_not_bind() {
        let g = DVector::from_row_slice(&[-1.0, 0.4]);
        let scale = DVector::from_row_slice(&[2.0, 0.5]);
        let model = quadratic([2.0, 0.0, 0.0, 0.5], &g, &scale, [-FREE; 2], [FREE; 2]);
        let step = model.within(10.0).expect("finite");
        // But for mild damping, a hundred millionth.
        assert!((step[0] - 0.5).abs() < 1e-7 && (step[1] + 0.8).abs() < 1e-7, "{step}");
    }
}
