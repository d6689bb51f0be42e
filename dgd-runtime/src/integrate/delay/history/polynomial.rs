//! The solution within a step, as a polynomial.
//!
//! Newton's form in the elapsed fraction θ of the step,
//!
//! ```text
//!   x(θ) = Σₖ cₖ Nₖ(θ),   Nₖ = Π_{j<k} (θ − θⱼ),   θ₀ = 0, θ₁ = 1
//! ```
//!
//! cₖ are the divided differences of values at the nodes. It is exact for dense output up to its degree, and bit for
//! bit at the beginning of the step.

/// Nodes of a step: the ends, then points between that are denser near the ends, in Leja order, so that divided
/// differences stay small. Degrees up to 6 are reproduced.
pub const NODES: [f64; 7] = [0.0, 1.0, 0.5, 0.9375, 0.0625, 0.75, 0.25];

/// Turns the values at the nodes, node by node, `n` numbers each, into divided differences.
pub(super) fn divide(values: &mut [f64], n: usize) {
    // c[i] ← (c[i] − c[i−1]) / (θᵢ − θᵢ₋ₖ) for k = 1, 2, …, from the last node down.
    for k in 1..NODES.len() {
        for i in (k..NODES.len()).rev() {
            let width = NODES[i] - NODES[i - k];
            let (before, here) = values.split_at_mut(i * n);
            for (here, before) in here[..n].iter_mut().zip(&before[(i - 1) * n..]) {
                *here = (*here - before) / width;
            }
        }
    }
}

/// Nₖ, Nₖ' and Nₖ'' at one θ.
#[derive(Debug, Clone, Copy)]
pub(super) struct BasisValues {
    value: [f64; NODES.len()],
    rate: [f64; NODES.len()],
    curvature: [f64; NODES.len()],
}

impl BasisValues {
    pub(super) fn evaluate(theta: f64) -> Self {
        let mut basis = Self {
            value: [0.0; NODES.len()],
            rate: [0.0; NODES.len()],
            curvature: [0.0; NODES.len()],
        };
        basis.value[0] = 1.0;
        for k in 1..NODES.len() {
            let distance = theta - NODES[k - 1];
            basis.value[k] = distance * basis.value[k - 1];
            basis.rate[k] = distance * basis.rate[k - 1] + basis.value[k - 1];
            basis.curvature[k] = distance * basis.curvature[k - 1] + 2.0 * basis.rate[k - 1];
        }
        basis
    }

    /// x, dx/dθ and d²x/dθ² of the i-th of `n` numbers with these divided differences.
    pub(super) fn read(&self, differences: &[f64], n: usize, i: usize) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (k, c) in differences.iter().skip(i).step_by(n).enumerate() {
            sums[0] += c * self.value[k];
            sums[1] += c * self.rate[k];
            sums[2] += c * self.curvature[k];
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// θ⁶ and 3 − θ⁴ with their derivatives, between and a little beyond the ends.
    #[test]
    fn a_polynomial_is_itself() {
        let x = |t: f64| [t.powi(6), 3.0 - t.powi(4)];
        let mut values: Vec<f64> = NODES.iter().flat_map(|t| x(*t)).collect();
        divide(&mut values, 2);
        for t in [0.0, 0.1, 0.37, 0.5, 0.99, 1.0, 1.01] {
            let basis = BasisValues::evaluate(t);
            let [a, b] = [0, 1].map(|i| basis.read(&values, 2, i));
            let expected = [
                [t.powi(6), 6.0 * t.powi(5), 30.0 * t.powi(4)],
                [3.0 - t.powi(4), -4.0 * t.powi(3), -12.0 * t.powi(2)],
            ];
            for (found, expected) in [a, b].iter().zip(expected) {
                for (found, expected) in found.iter().zip(expected) {
                    // Seven terms, each rounded by the condition of the nodes: below 100.
                    assert!((found - expected).abs() < 1e-12, "{t}: {found} {expected}");
                }
            }
        }
    }
}
