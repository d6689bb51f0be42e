//! Coefficients of Rosenbrock methods.

use crate::integrate::methods::tableaux::LowerTriangle;

/// Coefficients of a stiffly accurate Rosenbrock method for M ẏ = f(t, y), transformed so that no
/// product with the Jacobian is needed.
///
/// ```text
///   (M/(h γ) − J) Uᵢ = f(t + αᵢ h, Yᵢ) + (M/h) Σⱼ cᵢⱼ Uⱼ + h γᵢ ∂f/∂t
///   Yᵢ = y + Σⱼ aᵢⱼ Uⱼ
///   y⁺ = Y_s + U_s,   local error ≈ U_s
///   y(t + θh) ≈ (1−θ) y + θ (y⁺ + (1−θ) (k₁ + θ k₂ + θ² k₃)),   kₗ = Σⱼ dₗⱼ Uⱼ
/// ```
///
/// J and ∂f/∂t are evaluated at (t, y). The last stage closes the step and its increment is the error estimate, which
/// makes the method stiffly accurate and the estimate reliable for algebraic unknowns; other methods do not fit this
/// type.
#[derive(Debug)]
pub struct RosenbrockTableau {
    /// γ, the same in all stages.
    pub gamma: f64,
    /// aᵢⱼ, a strictly lower triangle.
    pub a: LowerTriangle,
    /// cᵢⱼ, a strictly lower triangle.
    pub c: LowerTriangle,
    /// αᵢ, positions of the stages within the step.
    pub alpha: &'static [f64],
    /// γᵢ, weights of ∂f/∂t.
    pub gamma_sums: &'static [f64],
    /// From this stage on, counted from 0, Yᵢ = Yᵢ₋₁ + Uᵢ₋₁.
    pub closing: usize,
    /// dₗⱼ of the dense output.
    pub dense: [&'static [f64]; 3],
    /// Order of y⁺.
    pub order: u32,
    /// Order of the solution to which the error estimate belongs.
    pub estimate_order: u32,
    /// Order of the dense output.
    pub dense_order: u32,
}

impl RosenbrockTableau {
    /// Number of stages s.
    pub const fn stages(&self) -> usize {
        self.alpha.len()
    }

    /// Evaluations of f in a step in addition to the linearisation, which includes that of the first stage.
    pub const fn evaluations(&self) -> usize {
        self.stages() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::methods::catalogue::{METHODS, MethodKind};
    use crate::integrate::methods::tableaux::MAX_STAGES;

    type Vector = Vec<f64>;
    type Matrix = Vec<Vector>;

    /// The method before its transformation: α, β = α + Γ, and b.
    struct Classical {
        alpha: Matrix,
        gamma: Matrix,
        beta: Matrix,
        b: Vector,
    }

    fn times(a: &Matrix, x: &[f64]) -> Vector {
        a.iter().map(|row| dot(row, x)).collect()
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    fn each(a: &[f64], b: &[f64]) -> Vector {
        a.iter().zip(b).map(|(a, b)| a * b).collect()
    }

    fn power(a: &[f64], exponent: i32) -> Vector {
        a.iter().map(|a| a.powi(exponent)).collect()
    }

    /// Row vector m Γ.
    fn from_left(m: &[f64], gamma: &Matrix) -> Vector {
        (0..m.len()).map(|j| m.iter().zip(gamma).map(|(m, row)| m * row[j]).sum()).collect()
    }

    /// Γ⁻¹ = 1/γ − c, a = α Γ⁻¹, m = b Γ⁻¹: Hairer and Wanner, Solving ODEs II, (IV.7.24).
    fn classical(tableau: &RosenbrockTableau) -> Classical {
        let s = tableau.stages();
        let mut gamma = vec![vec![0.0; s]; s];
        // Forward substitution with the lower triangle of Γ⁻¹.
        for (i, c) in tableau.c[..s].iter().enumerate() {
            for column in 0..=i {
                let unit = if i == column { 1.0 } else { 0.0 };
                let known: f64 = c.iter().zip(&gamma).map(|(c, row)| c * row[column]).sum();
                gamma[i][column] = tableau.gamma * (unit + known);
            }
        }
        let alpha: Matrix = tableau.a[..s].iter().map(|row| from_left(&row[..s], &gamma)).collect();
        let sum = |a: &Vector, g: &Vector| a.iter().zip(g).map(|(a, g)| a + g).collect();
        let beta = alpha.iter().zip(&gamma).map(|(a, g)| sum(a, g)).collect();
        let b = from_left(&closing(tableau), &gamma);
        Classical { alpha, gamma, beta, b }
    }

    /// m of y⁺ = y + Σ mⱼ Uⱼ: the last stage and its own increment.
    fn closing(tableau: &RosenbrockTableau) -> Vector {
        let s = tableau.stages();
        let mut m = tableau.a[s - 1][..s].to_vec();
        m[s - 1] = 1.0;
        m
    }

    /// For rooted trees up to `order`: (elementary weight, its required value). Hairer and Wanner, Solving ODEs II,
    /// tables IV.7.1 and IV.7.2.
    fn conditions(method: &Classical, b: &[f64], order: u32, theta: f64) -> Vec<(f64, f64)> {
        let Classical { alpha, beta, .. } = method;
        let one = vec![1.0; b.len()];
        let a = times(alpha, &one);
        let bt = times(beta, &one);
        let trees: [(u32, f64, Vector); 17] = [
            (1, 1.0, one.clone()),
            (2, 2.0, bt.clone()),
            (3, 3.0, power(&a, 2)),
            (3, 6.0, times(beta, &bt)),
            (4, 4.0, power(&a, 3)),
            (4, 8.0, each(&a, &times(alpha, &bt))),
            (4, 12.0, times(beta, &power(&a, 2))),
            (4, 24.0, times(beta, &times(beta, &bt))),
            (5, 5.0, power(&a, 4)),
            (5, 10.0, each(&power(&a, 2), &times(alpha, &bt))),
            (5, 20.0, power(&times(alpha, &bt), 2)),
            (5, 15.0, each(&a, &times(alpha, &power(&a, 2)))),
            (5, 30.0, each(&a, &times(alpha, &times(beta, &bt)))),
            (5, 20.0, times(beta, &power(&a, 3))),
            (5, 40.0, times(beta, &each(&a, &times(alpha, &bt)))),
            (5, 60.0, times(beta, &times(beta, &power(&a, 2)))),
            (5, 120.0, times(beta, &times(beta, &times(beta, &bt)))),
        ];
        trees
            .iter()
            .filter(|tree| tree.0 <= order)
            .map(|(order, density, weight)| {
                (dot(b, weight), theta.powi(i32::try_from(*order).unwrap()) / density)
            })
            .collect()
    }

    /// Rounding of sums of products of up to four coefficients, which are up to 150 and have 16 digits.
    const ROUNDING: f64 = 1e-10;

    fn tableaux() -> impl Iterator<Item = &'static RosenbrockTableau> {
        METHODS.iter().filter_map(|method| match method.kind {
            MethodKind::Rosenbrock(tableau) => Some(tableau),
            _ => None,
        })
    }

    #[test]
    fn lists_have_one_entry_per_stage() {
        for tableau in tableaux() {
            let s = tableau.stages();
            assert!(s <= MAX_STAGES && tableau.gamma_sums.len() == s);
            assert!(tableau.dense.iter().all(|d| d.len() == s));
        }
    }

    #[test]
    fn closing_stages_add_the_increment_before() {
        for tableau in tableaux() {
            for i in tableau.closing..tableau.stages() {
                let mut row = tableau.a[i - 1];
                row[i - 1] = 1.0;
                assert_eq!(tableau.a[i], row, "{i}");
            }
        }
    }

    #[test]
    fn stages_are_consistent_in_time() {
        for tableau in tableaux() {
            let method = classical(tableau);
            let one = vec![1.0; tableau.stages()];
            for (alpha, sum) in tableau.alpha.iter().zip(times(&method.alpha, &one)) {
                assert!((alpha - sum).abs() < ROUNDING, "{alpha} {sum}");
            }
            for (gamma, sum) in tableau.gamma_sums.iter().zip(times(&method.gamma, &one)) {
                assert!((gamma - sum).abs() < ROUNDING, "{gamma} {sum}");
            }
        }
    }

    #[test]
    fn order_conditions_hold() {
        for tableau in tableaux() {
            let method = classical(tableau);
            for (weight, value) in conditions(&method, &method.b, tableau.order, 1.0) {
                assert!((weight - value).abs() < ROUNDING, "{weight} {value}");
            }
            // ŷ = y⁺ − U_s
            let mut m = closing(tableau);
            m[tableau.stages() - 1] = 0.0;
            let b = from_left(&m, &method.gamma);
            for (weight, value) in conditions(&method, &b, tableau.estimate_order, 1.0) {
                assert!((weight - value).abs() < ROUNDING, "{weight} {value}");
            }
        }
    }

    #[test]
    fn conditions_of_index_one_hold() {
        // Σ bᵢ αᵢ αᵢⱼ ωⱼₖ αₖ² = 1/4 with ω = β⁻¹; the others follow from stiff accuracy.
        for tableau in tableaux() {
            let method = classical(tableau);
            let one = vec![1.0; tableau.stages()];
            let a = times(&method.alpha, &one);
            let omega = solve_lower(&method.beta, &power(&a, 2));
            let weight = dot(&method.b, &each(&a, &times(&method.alpha, &omega)));
            assert!((weight - 0.25).abs() < ROUNDING, "{weight}");
        }
    }

    #[test]
    fn the_method_is_stiffly_accurate() {
        // R(∞) = 1 − b β⁻¹ 1 = 0
        for tableau in tableaux() {
            let method = classical(tableau);
            let last = method.beta.last().unwrap();
            for (b, beta) in method.b.iter().zip(last) {
                assert!((b - beta).abs() < ROUNDING, "{b} {beta}");
            }
            let one = vec![1.0; tableau.stages()];
            let at_infinity = 1.0 - dot(&method.b, &solve_lower(&method.beta, &one));
            assert!(at_infinity.abs() < ROUNDING, "{at_infinity}");
        }
    }

    #[test]
    fn dense_output_has_its_order() {
        for tableau in tableaux() {
            let method = classical(tableau);
            let m = closing(tableau);
            for theta in [0.1, 0.25, 0.5, 0.8, 1.0] {
                let rest = 1.0 - theta;
                let weights: Vector = (0..m.len())
                    .map(|j| {
                        let [k1, k2, k3] = tableau.dense.map(|d| d[j]);
                        theta * (m[j] + rest * (k1 + theta * (k2 + theta * k3)))
                    })
                    .collect();
                let b = from_left(&weights, &method.gamma);
                for (weight, value) in conditions(&method, &b, tableau.dense_order, theta) {
                    assert!((weight - value).abs() < ROUNDING, "{theta}: {weight} {value}");
                }
            }
        }
    }

    fn solve_lower(l: &Matrix, b: &[f64]) -> Vector {
        let mut x: Vector = Vec::new();
        for (row, b) in l.iter().zip(b) {
            let i = x.len();
            x.push((b - dot(&row[..i], &x)) / row[i]);
        }
        x
    }
}
