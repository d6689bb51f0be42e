//! Coefficients of Runge–Kutta methods, explicit and singly diagonally implicit ones.

use super::tableau::{MAX_STAGES, Triangle};
use crate::system::Storage;

/// Coefficients of a Runge–Kutta method whose first stage stands where the step starts and whose
/// last stage closes it.
///
/// ```text
///   Y₁ = y,   Yᵢ = y + h Σⱼ aᵢⱼ kⱼ + h γ kᵢ,   kᵢ = f(t + cᵢ h, Yᵢ)
///   y⁺ = Y_s,   local error ≈ h Σ eᵢ kᵢ
///   y(t + θh) ≈ y + h Σᵢ bᵢ(θ) kᵢ,   bᵢ(θ) = Σₚ dᵢₚ θᵖ,   p = 1 … 4
/// ```
///
/// γ is zero for an explicit method. k_s is k₁ of the next step.
#[derive(Debug)]
pub struct RungeKuttaTableau {
    /// γ, the same in all stages but the first.
    pub gamma: f64,
    /// aᵢⱼ, a strictly lower triangle.
    pub a: Triangle,
    /// cᵢ, where in the step a stage stands.
    pub c: &'static [f64],
    /// eᵢ, weights of the local error.
    pub error: &'static [f64],
    /// dᵢₚ of the dense output.
    pub dense: &'static [[f64; 4]],
    /// Order of y⁺.
    pub order: u32,
    /// Order of the solution that the error estimate belongs to.
    pub estimate_order: u32,
    /// The method is stable for y' = λ y, λ < 0, as long as h |λ| is below this.
    pub stability: f64,
}

impl RungeKuttaTableau {
    /// Number of stages s.
    pub const fn stages(&self) -> usize {
        self.c.len()
    }

    /// y + h Σ bᵢ(θ) kᵢ.
    pub(super) fn interpolate<V: Storage>(
        &self,
        theta: f64,
        h: f64,
        y: &[f64],
        k: &[V; MAX_STAGES],
        out: &mut [f64],
    ) {
        let mut weights = [0.0; MAX_STAGES];
        for (weight, [d1, d2, d3, d4]) in weights.iter_mut().zip(self.dense) {
            *weight = theta * (d1 + theta * (d2 + theta * (d3 + theta * d4)));
        }
        extrapolate(y, h, &k[..self.stages()], &weights, out);
    }

    /// Σ eᵢ h kᵢ.
    pub(super) fn local_error<V: Storage>(&self, h: f64, k: &[V; MAX_STAGES], out: &mut [f64]) {
        out.fill(0.0);
        for (weight, k) in self.error.iter().zip(k) {
            for (out, k) in out.iter_mut().zip(k.as_ref()) {
                *out += h * weight * k;
            }
        }
    }
}

/// `out` ← y + h Σ wⱼ kⱼ.
pub(super) fn extrapolate<V: Storage>(
    y: &[f64],
    h: f64,
    k: &[V],
    weights: &[f64; MAX_STAGES],
    out: &mut [f64],
) {
    out.copy_from_slice(y);
    for (weight, k) in weights.iter().zip(k) {
        let weight = h * weight;
        for (out, k) in out.iter_mut().zip(k.as_ref()) {
            *out += weight * k;
        }
    }
}
