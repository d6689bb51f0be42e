//! The step of a quadratic model within bounds and within a radius.
//!
//! ```text
//!   minimise  gᵀδ + ½ δᵀH δ   over   lower ≤ δ ≤ upper,  ‖D δ‖ ≤ Δ
//! ```
//!
//! For each λ the minimum of the damped model on the box, H + λ D², is exact ([`box_quadratic`]), and its length
//! decreases with λ; the λ at which it is Δ gives the solution. H may have negative curvature: λ starts where H + λ D²
//! has none. Lengths within a tenth of Δ suffice.
//!
//! Moré, Sorensen, Computing a trust region step, SIAM J. Sci. Stat. Comput. 4 (1983) 553; a λ for a box as well
//! is the multiplier of the radius, the bounds having theirs in the active set.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::problem::NormalEquations;
use crate::minimise::box_quadratic;

/// Damping that does not change a step but makes a singular matrix positive definite: well above the rounding error of
/// sums, well below the squared accuracy of derivatives.
const NO_DAMPING: f64 = 1e-12;

/// Damping that protects a step with a singular matrix from rounding errors in undetermined combinations.
const MILD: f64 = 1e-8;

/// A longer step is taken if its predicted reduction exceeds that of a mildly damped one by this fraction.
const WORTH: f64 = 1e-3;

/// Relative accuracy of a length compared with the radius.
const CLOSE: f64 = 0.1;

/// Limit on the values of λ: halving alone takes a λ over sixteen decades to a length within a tenth.
const MOST: usize = 60;

/// The smallest nonzero λ, relative to the largest.
const SMALLEST: f64 = 1e-16;

/// A quadratic model on a box.
pub(super) struct QuadraticModel<'a> {
    pub h: DMatrix<f64>,
    g: &'a DVector<f64>,
    /// Influence of each variable, diag(JᵀJ).
    influence: DVector<f64>,
    /// D², 0 for variables that never had influence.
    scale: &'a DVector<f64>,
    lower: DVector<f64>,
    upper: DVector<f64>,
}

impl<'a> QuadraticModel<'a> {
    /// At a point, with the curvature H and the scale D².
    pub(super) fn new(
        normal: &'a NormalEquations,
        h: DMatrix<f64>,
        scale: &'a DVector<f64>,
        lower: DVector<f64>,
        upper: DVector<f64>,
    ) -> Self {
        let influence = normal.information.diagonal();
        Self { h, g: &normal.gradient, influence, scale, lower, upper }
    }

    /// ‖D δ‖.
    pub(super) fn length(&self, step: &DVector<f64>) -> f64 {
        let squares = step.iter().zip(self.scale.iter()).map(|(step, scale)| scale * step * step);
        squares.sum::<f64>().sqrt()
    }

    /// gᵀδ + ½ δᵀH δ.
    fn value(&self, step: &DVector<f64>) -> f64 {
        self.g.dot(step) + 0.5 * step.dot(&(&self.h * step))
    }

    /// The minimum on the box alone; `None` for negative curvature.
    pub(super) fn full(&self) -> Option<DVector<f64>> {
        self.damped(NO_DAMPING)
    }

    /// The minimum with damping relative to influences.
    pub(super) fn damped(&self, damping: f64) -> Option<DVector<f64>> {
        self.minimum_with(damping, 0.0)
    }

    /// The minimum of H + λ D² on the box.
    fn held_back(&self, lambda: f64) -> Option<DVector<f64>> {
        self.minimum_with(NO_DAMPING, lambda)
    }

    /// Variables without influence have no gradient, so any curvature will do.
    fn minimum_with(&self, damping: f64, lambda: f64) -> Option<DVector<f64>> {
        let mut a = self.h.clone();
        for (i, (influence, scale)) in self.influence.iter().zip(self.scale.iter()).enumerate() {
            let added = if *influence > 0.0 { damping * influence } else { 1.0 };
            a[(i, i)] += added + lambda * scale;
        }
        box_quadratic::minimise(&a, self.g, &self.lower, &self.upper)
    }

    /// The step within a radius; `None` if numbers are not finite.
    pub(super) fn within(&self, radius: f64) -> Option<DVector<f64>> {
        let (least, full) = if let Some(full) = self.full() {
            (0.0, full)
        } else {
            let least = self.least_damping()?;
            (least, self.held_back(least)?)
        };
        let mut low = (0.0, self.length(&full));
        if low.1 <= (1.0 + CLOSE) * radius {
            if least > 0.0 {
                return Some(full);
            }
            let mild = self.damped(MILD)?;
            let is_worth = self.value(&full) < (1.0 + WORTH) * self.value(&mild);
            return Some(if is_worth { full } else { mild });
        }
        let sizes = self.g.iter().zip(self.scale.iter()).filter(|(_, scale)| **scale > 0.0);
        let slope = sizes.map(|(g, scale)| g * g / scale).sum::<f64>().sqrt();
        let most = slope / radius;
        if !most.is_finite() {
            return None;
        }
        let mut best = self.held_back(least + most)?;
        let mut high = (most, self.length(&best));
        for k in 0..MOST {
            if high.1 >= (1.0 - CLOSE) * radius {
                break;
            }
            let between = if k % 2 == 0 { secant(low, high, radius) } else { None };
            let lambda =
                between.unwrap_or_else(|| (f64::max(low.0, SMALLEST * most) * high.0).sqrt());
            let step = self.held_back(least + lambda)?;
            let length = self.length(&step);
            if length > (1.0 + CLOSE) * radius {
                low = (lambda, length);
            } else {
                high = (lambda, length);
                best = step;
            }
        }
        Some(best)
    }

    /// The smallest λ from which on H + λ D² is positive definite.
    fn least_damping(&self) -> Option<f64> {
        let size = |i: usize| if self.scale[i] > 0.0 { self.scale[i].sqrt() } else { 1.0 };
        let scaled = DMatrix::from_fn(self.h.nrows(), self.h.ncols(), |i, j| {
            self.h[(i, j)] / (size(i) * size(j))
        });
        if scaled.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let values = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?.eigenvalues;
        let (least, size) = (values.min(), values.amax());
        // Slightly more, so that rounding errors do not make it indefinite again.
        Some((-least).max(0.0) + 1e-6 * size)
    }
}

/// λ at which the inverse length, interpolated linearly between two known values, is that of the radius.
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

    const SCALE: [f64; 2] = [2.0, 0.5];

    fn equations_at(g: [f64; 2]) -> NormalEquations {
        NormalEquations {
            gradient: DVector::from_row_slice(&g),
            information: DMatrix::from_diagonal(&DVector::from_row_slice(&SCALE)),
            ..NormalEquations::zeros(2)
        }
    }

    fn quadratic<'a>(
        at: &'a NormalEquations,
        h: [f64; 4],
        scale: &'a DVector<f64>,
        lower: [f64; 2],
        upper: [f64; 2],
    ) -> QuadraticModel<'a> {
        let h = DMatrix::from_row_slice(2, 2, &h);
        let (lower, upper) = (DVector::from_row_slice(&lower), DVector::from_row_slice(&upper));
        QuadraticModel::new(at, h, scale, lower, upper)
    }

    /// On a grid of the box and the ellipse nothing is clearly below the step found: with curvature of either sign, a
    /// nearly singular matrix, and with and without active bounds.
    #[test]
    fn no_point_of_box_and_radius_is_lower() {
        let at = equations_at([-1.0, 0.4]);
        let scale = DVector::from_row_slice(&SCALE);
        let g = &at.gradient;
        for h in [[2.0, 0.9, 0.9, 0.5], [2.0, 1.0, 1.0, 0.5], [-1.0, 0.3, 0.3, 0.5]] {
            for (lower, upper) in [([-FREE; 2], [FREE; 2]), ([-0.1, -0.2], [0.3, 9.0])] {
                for radius in [0.05, 0.4, 3.0] {
                    let model = quadratic(&at, h, &scale, lower, upper);
                    let step = model.within(radius).expect("finite");
                    let length = model.length(&step);
                    assert!(length <= 1.1 * radius, "{length} of {radius}");
                    let q = |d: &DVector<f64>| g.dot(d) + 0.5 * d.dot(&(&model.h * d));
                    let mut least = 0.0_f64;
                    for k in 0..=400 {
                        for j in 0..=40 {
                            let angle = std::f64::consts::TAU * f64::from(k) / 400.0;
                            // A radius that is a tenth smaller is equally good.
                            let part = 0.9 * radius * f64::from(j) / 40.0;
                            let point = DVector::from_row_slice(&[
                                part * angle.cos() / SCALE[0].sqrt(),
                                part * angle.sin() / SCALE[1].sqrt(),
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
        let at = equations_at([-1.0, 0.4]);
        let scale = DVector::from_row_slice(&SCALE);
        let model = quadratic(&at, [2.0, 0.0, 0.0, 0.5], &scale, [-FREE; 2], [FREE; 2]);
        let step = model.within(10.0).expect("finite");
        // Up to mild damping, a hundred millionth.
        assert!((step[0] - 0.5).abs() < 1e-7 && (step[1] + 0.8).abs() < 1e-7, "{step}");
    }
}
