//! The simplex method of Nelder and Mead, within bounds.
//!
//! ```text
//!   x̄: mean of all vertices but the worst, x_w:      ξ(s) = x̄ + s (x̄ − x_w)
//!   reflect ξ(1); if it is the best, expand ξ(2); if it is no better than the second worst, contract
//!   to ξ(½), or ξ(−½) where it is not even better than the worst; if that fails, shrink to the best
//! ```
//!
//! Nelder, Mead, Computer Journal 7 (1965) 308, with the rules of acceptance and ordering of Lagarias, Reeds, Wright,
//! Wright, SIAM J. Optim. 9 (1998) 112. Points beyond a bound are moved to it, and where the function is undefined it
//! is infinite. After convergence a small simplex is set up at the best vertex and continued, to detect a simplex that
//! has become flat.

use crate::progress::{Monitor, Progress, Total};

/// The stopping rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimplexRule {
    /// All vertices are this close to the best, in each variable: absolutely, or relative to its value if that is
    /// larger than 1.
    pub size: f64,
    /// And the function varies among them by no more than this fraction of its value.
    pub spread: f64,
    /// Limit on evaluations.
    pub evaluations: usize,
}

impl Default for SimplexRule {
    fn default() -> Self {
        Self { size: 1e-9, spread: 1e-13, evaluations: 2000 }
    }
}

/// The result of the method.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplex {
    /// The best vertex.
    pub x: Vec<f64>,
    /// The function there.
    pub value: f64,
    /// Evaluations.
    pub evaluations: usize,
    /// Whether the simplex became as small as the rule requires.
    pub is_converged: bool,
}

/// Edges of the first simplex, relative to a variable's value, or absolute if that is zero, as in MATLAB's
/// `fminsearch`.
const FIRST_EDGE: f64 = 0.05;
const FIRST_EDGE_AT_ZERO: f64 = 0.00025;
/// Fraction of the requested size at which the function varies by rounding errors only.
const ROUNDED: f64 = 1e-3;
/// Edges of the simplex that checks the end.
const SECOND_EDGE: f64 = 1e-3;

/// Minimises a function from `x` on. Variables should be of the order of 1. If `watch` cancels it, the result is the
/// best vertex so far, not converged.
///
/// # Panics
///
/// If there is not one pair of bounds for each variable.
pub fn nelder_mead(
    x: &[f64],
    bounds: &[(f64, f64)],
    rule: &SimplexRule,
    watch: &dyn Monitor,
    mut function: impl FnMut(&[f64]) -> Option<f64>,
) -> Simplex {
    assert_eq!(x.len(), bounds.len(), "one pair of bounds for each variable");
    let mut search = SimplexSearch {
        bounds,
        evaluations: 0,
        // For each of the two simplexes.
        most: 2 * rule.evaluations,
        watch,
        function: &mut |x| match function(x) {
            Some(value) if !value.is_nan() => value,
            _ => f64::INFINITY,
        },
    };
    let first = search.run(x, FIRST_EDGE, rule);
    let second = search.run(&first.x, SECOND_EDGE, rule);
    let is_converged = first.is_converged && second.is_converged;
    let best = if second.value < first.value { second } else { first };
    Simplex { evaluations: search.evaluations, is_converged, ..best }
}

struct SimplexSearch<'a> {
    bounds: &'a [(f64, f64)],
    evaluations: usize,
    most: usize,
    watch: &'a dyn Monitor,
    function: &'a mut dyn FnMut(&[f64]) -> f64,
}

impl SimplexSearch<'_> {
    fn vertex(&mut self, mut x: Vec<f64>) -> (Vec<f64>, f64) {
        for (x, (low, high)) in x.iter_mut().zip(self.bounds) {
            *x = x.clamp(*low, *high);
        }
        self.evaluations += 1;
        let value = (self.function)(&x);
        let (done, of) = (self.evaluations, Total::AtMost(self.most));
        self.watch.advanced(Progress { what: "evaluations", done, of });
        (x, value)
    }

    fn first_simplex(&mut self, x: &[f64], edge: f64) -> Vec<(Vec<f64>, f64)> {
        let mut vertices = vec![self.vertex(x.to_vec())];
        for (j, (low, high)) in self.bounds.iter().enumerate() {
            let length = if x[j] == 0.0 { FIRST_EDGE_AT_ZERO } else { edge * x[j].abs() };
            // Away from the bound.
            let mut moved = x.to_vec();
            moved[j] = if x[j] + length <= *high { x[j] + length } else { x[j] - length };
            moved[j] = moved[j].clamp(*low, *high);
            vertices.push(self.vertex(moved));
        }
        vertices
    }

    fn run(&mut self, x: &[f64], edge: f64, rule: &SimplexRule) -> Simplex {
        let n = x.len();
        let until = self.evaluations + rule.evaluations;
        let mut vertices = self.first_simplex(x, edge);
        loop {
            // Stable: of equals the older comes first.
            vertices.sort_by(|a, b| a.1.total_cmp(&b.1));
            let is_converged = is_small(&vertices, rule);
            let is_ended = self.evaluations >= until || self.watch.is_stopped();
            if n == 0 || is_converged || is_ended {
                let (x, value) = vertices.swap_remove(0);
                return Simplex { x, value, evaluations: 0, is_converged: n == 0 || is_converged };
            }
            let centre: Vec<f64> = (0..n)
                .map(|j| vertices[..n].iter().map(|(x, _)| x[j]).sum::<f64>() / n as f64)
                .collect();
            let worst = vertices[n].0.clone();
            let along = |s: f64| -> Vec<f64> {
                centre.iter().zip(&worst).map(|(c, w)| c + s * (c - w)).collect()
            };
            let reflected = self.vertex(along(1.0));
            let accepted = if reflected.1 < vertices[0].1 {
                let expanded = self.vertex(along(2.0));
                Some(if expanded.1 < reflected.1 { expanded } else { reflected })
            } else if reflected.1 < vertices[n - 1].1 {
                Some(reflected)
            } else if reflected.1 < vertices[n].1 {
                let outside = self.vertex(along(0.5));
                (outside.1 <= reflected.1).then_some(outside)
            } else {
                let inside = self.vertex(along(-0.5));
                (inside.1 < vertices[n].1).then_some(inside)
            };
            if let Some(vertex) = accepted {
                vertices[n] = vertex;
                continue;
            }
            let best = vertices[0].0.clone();
            for vertex in &mut vertices[1..] {
                let shrunk = best.iter().zip(&vertex.0).map(|(b, x)| b + 0.5 * (x - b)).collect();
                *vertex = self.vertex(shrunk);
            }
        }
    }
}

fn is_small(vertices: &[(Vec<f64>, f64)], rule: &SimplexRule) -> bool {
    let (best, value) = &vertices[0];
    let all_within = |size: f64| {
        let near = |(x, best): (&f64, &f64)| (x - best).abs() <= size * best.abs().max(1.0);
        vertices[1..].iter().all(|(x, _)| x.iter().zip(best).all(near))
    };
    let is_flat = vertices[1..].iter().all(|(_, other)| other - value <= rule.spread * value.abs());
    all_within(rule.size) && (is_flat || all_within(ROUNDED * rule.size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::NoMonitor;

    const ANYWHERE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

    fn rosenbrock(x: &[f64]) -> f64 {
        100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)
    }

    #[test]
    fn the_valley_is_followed_to_its_end() {
        let rule = SimplexRule { spread: 1.0, ..SimplexRule::default() };
        let found =
            nelder_mead(&[-1.2, 1.0], &[ANYWHERE; 2], &rule, &NoMonitor, |x| Some(rosenbrock(x)));
        assert!(found.is_converged);
        assert!(found.x.iter().all(|x| (x - 1.0).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn a_bound_holds_and_values_that_are_none_are_avoided() {
        // On x₁ = 1/2 the valley's floor is x₂ = 1/4.
        let rule = SimplexRule::default();
        let bounds = [(-2.0, 0.5), ANYWHERE];
        let found = nelder_mead(&[-1.2, 1.0], &bounds, &rule, &NoMonitor, |x| Some(rosenbrock(x)));
        assert!((found.x[0] - 0.5).abs() < 1e-8 && (found.x[1] - 0.25).abs() < 1e-6, "{found:?}");
        let logarithm = |x: &[f64]| (x[0] > 0.0).then(|| (x[0] / 2.0).ln().powi(2));
        let rule = SimplexRule { spread: 1.0, ..rule };
        let found = nelder_mead(&[0.01], &[ANYWHERE], &rule, &NoMonitor, logarithm);
        assert!((found.x[0] - 2.0).abs() < 1e-6, "{found:?}");
    }
}
