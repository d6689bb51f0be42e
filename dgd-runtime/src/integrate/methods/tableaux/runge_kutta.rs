//! Coefficients of explicit and singly diagonally implicit Runge–Kutta methods.

use crate::integrate::enclosure::PolynomialCoefficients;
use crate::integrate::methods::tableaux::{LowerTriangle, MAX_STAGES};
use crate::system::Storage;

/// Coefficients of a Runge–Kutta method whose first stage is at the start of the step and whose last stage closes it.
///
/// ```text
///   Y₁ = y,   Yᵢ = y + h Σⱼ aᵢⱼ kⱼ + h γ kᵢ,   kᵢ = f(t + cᵢ h, Yᵢ)
///   y⁺ = Y_s,   local error ≈ h Σ eᵢ kᵢ
///   y(t + θh) ≈ y + h Σᵢ bᵢ(θ) kᵢ,   bᵢ(θ) = Σₚ dᵢₚ θᵖ,   p = 1 … 4
/// ```
///
/// γ is zero for an explicit method. k_s is k₁ of the next step; for algebraic unknowns, whose slopes an implicit
/// method gets only from differences of stages, k₁ is Σ sᵢ kᵢ.
#[derive(Debug)]
pub struct RungeKuttaTableau {
    /// γ, the same in all stages but the first.
    pub gamma: f64,
    /// aᵢⱼ, a strictly lower triangle.
    pub a: LowerTriangle,
    /// cᵢ, positions of the stages within the step.
    pub c: &'static [f64],
    /// eᵢ, weights of the local error.
    pub error: &'static [f64],
    /// dᵢₚ of the dense output.
    pub dense: &'static [[f64; 4]],
    /// sᵢ; empty for an explicit method.
    pub end_slope: &'static [f64],
    /// Order of y⁺.
    pub order: u32,
    /// Order of the solution to which the error estimate belongs.
    pub estimate_order: u32,
    /// The method is stable for y' = λ y, λ < 0, as long as h |λ| is below this.
    pub stability: f64,
    /// Its stages written out for steps of a given size, if they are.
    pub equal_steps: Option<EqualSteps>,
}

/// Methods whose stages are written out for steps of a given size, with coefficients as constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EqualSteps {
    /// The stages of [`TSIT5`](super::TSIT5).
    Tsit5,
}

impl RungeKuttaTableau {
    /// Number of stages s.
    pub const fn stages(&self) -> usize {
        self.c.len()
    }

    /// y + h Σ bᵢ(θ) kᵢ.
    pub(in crate::integrate) fn interpolate<V: Storage>(
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

    /// The same for the i-th number, as coefficients in powers of θ. Returns their number.
    pub(in crate::integrate) fn polynomial<V: Storage>(
        &self,
        i: usize,
        h: f64,
        y: f64,
        k: &[V; MAX_STAGES],
        out: &mut PolynomialCoefficients,
    ) -> usize {
        out[..5].copy_from_slice(&[y, 0.0, 0.0, 0.0, 0.0]);
        for (weights, k) in self.dense.iter().zip(k) {
            for (out, weight) in out[1..5].iter_mut().zip(weights) {
                *out += h * weight * k.as_ref()[i];
            }
        }
        5
    }

    /// Sets `k[0]` to the slopes at the end of a step; `mass` repeats for every column.
    pub(in crate::integrate) fn advance<V: Storage>(&self, mass: &[f64], k: &mut [V; MAX_STAGES]) {
        let last = self.stages() - 1;
        if !self.end_slope.is_empty() && mass.contains(&0.0) {
            for position in 0..k[last].as_ref().len() {
                if mass[position % mass.len()] == 0.0 {
                    let slopes = self.end_slope.iter().zip(k.iter());
                    let slope = slopes.map(|(weight, k)| weight * k.as_ref()[position]).sum();
                    k[last].as_mut()[position] = slope;
                }
            }
        }
        k.swap(0, last);
    }

    /// Σ eᵢ h kᵢ.
    pub(in crate::integrate) fn local_error<V: Storage>(
        &self,
        h: f64,
        k: &[V; MAX_STAGES],
        out: &mut [f64],
    ) {
        out.fill(0.0);
        for (weight, k) in self.error.iter().zip(k) {
            for (out, k) in out.iter_mut().zip(k.as_ref()) {
                *out += h * weight * k;
            }
        }
    }
}

/// `out` ← y + h Σ wⱼ kⱼ.
pub(in crate::integrate) fn extrapolate<V: Storage>(
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::methods::catalogue::{METHODS, MethodKind};

    type Vector = Vec<f64>;

    fn tableaux() -> impl Iterator<Item = &'static RungeKuttaTableau> {
        METHODS.iter().filter_map(|method| match method.kind {
            MethodKind::Explicit(tableau) | MethodKind::Esdirk(tableau) => Some(tableau),
            MethodKind::Rosenbrock(_) | MethodKind::Bdf(_) | MethodKind::Taylor(_) => None,
        })
    }

    /// A with its diagonal.
    fn matrix(tableau: &RungeKuttaTableau) -> Vec<Vector> {
        let s = tableau.stages();
        let mut a: Vec<Vector> = tableau.a[..s].iter().map(|row| row[..s].to_vec()).collect();
        for (i, row) in a.iter_mut().enumerate().skip(1) {
            row[i] = tableau.gamma;
        }
        a
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    fn times(a: &[Vector], x: &[f64]) -> Vector {
        a.iter().map(|row| dot(row, x)).collect()
    }

    fn each(a: &[f64], b: &[f64]) -> Vector {
        a.iter().zip(b).map(|(a, b)| a * b).collect()
    }

    fn power(c: &[f64], exponent: i32) -> Vector {
        c.iter().map(|c| c.powi(exponent)).collect()
    }

    /// Rooted trees up to order 5: order, density, elementary weights of the stages. Hairer, Nørsett
    /// and Wanner, Solving ODEs I, table II.2.1.
    fn trees(a: &[Vector]) -> Vec<(u32, f64, Vector)> {
        let one = vec![1.0; a.len()];
        let c = times(a, &one);
        let (ac, ac2) = (times(a, &c), times(a, &power(&c, 2)));
        let (aac, cac) = (times(a, &ac), each(&c, &ac));
        vec![
            (1, 1.0, one),
            (2, 2.0, c.clone()),
            (3, 3.0, power(&c, 2)),
            (3, 6.0, ac.clone()),
            (4, 4.0, power(&c, 3)),
            (4, 8.0, cac.clone()),
            (4, 12.0, ac2.clone()),
            (4, 24.0, aac.clone()),
            (5, 5.0, power(&c, 4)),
            (5, 10.0, each(&c, &cac)),
            (5, 20.0, power(&ac, 2)),
            (5, 15.0, each(&c, &ac2)),
            (5, 30.0, each(&c, &aac)),
            (5, 20.0, times(a, &power(&c, 3))),
            (5, 40.0, times(a, &cac)),
            (5, 60.0, times(a, &ac2)),
            (5, 120.0, times(a, &aac)),
        ]
    }

    /// Rounding of sums of up to seven products of coefficients, which are up to 90 and have 16 digits.
    const ROUNDING: f64 = 1e-12;

    fn verify(b: &[f64], a: &[Vector], order: u32, theta: f64) {
        for (tree_order, density, weights) in trees(a) {
            if tree_order <= order {
                let expected = theta.powi(tree_order.try_into().unwrap()) / density;
                let found = dot(b, &weights);
                assert!((found - expected).abs() < ROUNDING, "{tree_order}: {found} {expected}");
            }
        }
    }

    #[test]
    fn stages_stand_where_their_rows_say() {
        for tableau in tableaux() {
            let s = tableau.stages();
            assert!(s <= MAX_STAGES && tableau.error.len() == s && tableau.dense.len() == s);
            for (sum, c) in times(&matrix(tableau), &vec![1.0; s]).iter().zip(tableau.c) {
                assert!((sum - c).abs() < ROUNDING, "{sum} {c}");
            }
        }
    }

    #[test]
    fn order_conditions_hold() {
        for tableau in tableaux() {
            let a = matrix(tableau);
            let b = a.last().unwrap();
            verify(b, &a, tableau.order, 1.0);
            let embedded: Vector = b.iter().zip(tableau.error).map(|(b, e)| b - e).collect();
            verify(&embedded, &a, tableau.estimate_order, 1.0);
        }
    }

    #[test]
    fn dense_output_has_order_four() {
        for tableau in tableaux() {
            let a = matrix(tableau);
            for theta in [0.1, 0.25, 0.5, 0.8, 1.0] {
                let weights: Vector = tableau
                    .dense
                    .iter()
                    .map(|d| (0..).zip(d).map(|(p, d)| d * f64::powi(theta, p + 1)).sum())
                    .collect();
                verify(&weights, &a, 4, theta);
            }
        }
    }

    #[test]
    fn implicit_methods_are_stiffly_stable() {
        for tableau in tableaux().filter(|tableau| tableau.gamma > 0.0) {
            let a = matrix(tableau);
            // Y = −A₂₂⁻¹ a₂₁ y at infinity, by forward substitution; R(∞) is its last element.
            let mut y: Vector = Vec::new();
            for row in &a[1..] {
                let i = y.len();
                y.push(-(row[0] + dot(&row[1..=i], &y)) / tableau.gamma);
            }
            let at_infinity = y.last().unwrap();
            assert!(at_infinity.abs() < ROUNDING, "{at_infinity}");
        }
    }

    #[test]
    fn slopes_at_the_end_are_of_order_three() {
        // Σ sᵢ kᵢ = ẏ⁺ for polynomials up to the third degree; and, as Σ sᵢ kᵢ consists of differences of stages, s =
        // Aᵀ W, so that k₁ has no weight of its own.
        for tableau in tableaux().filter(|tableau| !tableau.end_slope.is_empty()) {
            let (a, s) = (matrix(tableau), tableau.end_slope);
            for exponent in 0..3 {
                let slope = dot(s, &power(tableau.c, exponent));
                assert!((slope - 1.0).abs() < ROUNDING, "{exponent}: {slope}");
            }
            // Back substitution with A₂₂ᵀ.
            let n = a.len();
            let mut w = vec![0.0; n];
            for j in (1..n).rev() {
                let later: f64 = (j + 1..n).map(|i| w[i] * a[i][j]).sum();
                w[j] = (s[j] - later) / tableau.gamma;
            }
            let of_first: f64 = (1..n).map(|i| w[i] * a[i][0]).sum();
            assert!((of_first - s[0]).abs() < ROUNDING, "{of_first}");
        }
    }

    #[test]
    fn the_limit_of_stability_is_where_it_is_said() {
        // R(z) = 1 + z Σ bᵢ Yᵢ(z) for y' = λ y, z = h λ.
        for tableau in tableaux().filter(|tableau| tableau.stability.is_finite()) {
            let a = matrix(tableau);
            let growth = |z: f64| {
                let mut y: Vector = Vec::new();
                for row in &a {
                    y.push(1.0 + z * dot(&row[..y.len()], &y));
                }
                y.last().unwrap().abs()
            };
            assert!((1..100).all(|k| growth(-tableau.stability * f64::from(k) / 100.0) < 1.0));
            assert!(growth(-1.01 * tableau.stability) > 1.0);
        }
    }
}
