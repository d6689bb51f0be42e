//! Finds the parameters that enter linearly.
//!
//! Residuals are linear in a set of parameters if no derivative with respect to one of the set changes when parameters
//! of the set are moved. This is tested by moving them, one at a time from two points, and comparing derivatives over
//! the samples: nonlinearity that the samples do not show is irrelevant to a regression on them.
//!
//! An equation with a common factor, such as ẏ = F(p)/M, is multiplied by it if more parameters then enter linearly.

use dgd_runtime::for_identify::parameter_size;
use dgd_runtime::model::Model;

use crate::regression::rows::{RegressionRows, RowOf};

/// Approximate number of samples at which derivatives are compared.
const COMPARED: usize = 200;
/// Derivatives that change by less than this fraction of their largest value are constant.
const ROUNDING: f64 = 1e-9;
/// Distance of points from the first one, and of moved parameters from the points, in sizes.
const SHIFTS: [f64; 2] = [0.0, 0.17];
const MOVE: f64 = 0.37;
/// Up to this many parameters the largest linear set is found by exhaustive search.
const MOST_TRIED: usize = 16;

/// For each free parameter, whether it is in the largest set in which all rows are linear. Sets the multipliers of rows
/// that this requires.
pub(crate) fn find_linear(
    system: &dyn Model,
    rows: &mut RegressionRows<'_>,
    p: &[f64],
) -> Vec<bool> {
    let n = rows.free.len();
    let points = SHIFTS.map(|shift| ResidualNeighbourhood::evaluate_around(system, rows, p, shift));
    let mut conflicts = Vec::new();
    for kind in 0..rows.kinds.len() {
        let plain = conflicts_of(&points, rows, kind, None);
        let mut kind_conflicts = plain.clone();
        let is_equation = matches!(rows.kinds[kind].of, RowOf::Equation(_));
        if !plain.is_empty() && is_equation {
            let factors = rows.kinds[kind].parameters.iter().map(|(j, _)| *j);
            let size = |found: &[(usize, usize)]| {
                largest_set(&table(n, found)).iter().filter(|member| **member).count()
            };
            let (mut best, mut most) = (None, size(&plain));
            for m in factors {
                let multiplied = conflicts_of(&points, rows, kind, Some(m));
                if size(&multiplied) > most {
                    most = size(&multiplied);
                    best = Some((m, multiplied));
                }
            }
            if let Some((m, multiplied)) = best {
                rows.kinds[kind].multiplier = Some(m);
                kind_conflicts = multiplied;
            }
        }
        conflicts.extend(kind_conflicts);
    }
    largest_set(&table(n, &conflicts))
}

/// Conflicts as a symmetric table.
fn table(n: usize, pairs: &[(usize, usize)]) -> Vec<Vec<bool>> {
    let mut table = vec![vec![false; n]; n];
    for (j, k) in pairs {
        table[*j][*k] = true;
        table[*k][*j] = true;
    }
    table
}

/// A kind of row in which a parameter does not enter linearly, whatever the others are.
pub(crate) fn where_nonlinear(
    system: &dyn Model,
    rows: &mut RegressionRows<'_>,
    p: &[f64],
    parameter: usize,
) -> usize {
    let points = SHIFTS.map(|shift| ResidualNeighbourhood::evaluate_around(system, rows, p, shift));
    let involved = |kind: &usize| {
        let conflicts = conflicts_of(&points, rows, *kind, rows.kinds[*kind].multiplier);
        conflicts.iter().any(|(j, k)| *j == parameter || *k == parameter)
    };
    (0..rows.kinds.len()).find(involved).unwrap_or(0)
}

/// Residuals and derivatives at a point and with each parameter moved.
struct ResidualNeighbourhood {
    p: Vec<f64>,
    at: Option<EvaluatedResiduals>,
    moved: Vec<(Vec<f64>, Option<EvaluatedResiduals>)>,
}

/// Residuals and derivatives over some samples, kind by kind, without multipliers.
struct EvaluatedResiduals {
    residuals: Vec<Vec<f64>>,
    slopes: Vec<Vec<f64>>,
}

impl ResidualNeighbourhood {
    fn evaluate_around(
        system: &dyn Model,
        rows: &mut RegressionRows<'_>,
        p: &[f64],
        shift: f64,
    ) -> Self {
        let free = rows.free;
        let mut centre = p.to_vec();
        for (k, i) in free.iter().enumerate() {
            // Not all by the same factor, which could hide quotients.
            centre[*i] = moved_by(system, *i, p[*i], shift * (1.0 + 0.1 * k as f64));
        }
        let moved_rows = EvaluatedResiduals::evaluate(rows, &centre);
        let moved = free.iter().map(|i| {
            let mut p = centre.clone();
            p[*i] = moved_by(system, *i, p[*i], MOVE);
            let evaluated = EvaluatedResiduals::evaluate(rows, &p);
            (p, evaluated)
        });
        Self { at: moved_rows, moved: moved.collect(), p: centre }
    }
}

impl EvaluatedResiduals {
    fn evaluate(rows: &mut RegressionRows<'_>, p: &[f64]) -> Option<Self> {
        let samples: usize = rows.known.iter().map(|known| known.times.len()).sum();
        let stride = samples.div_ceil(COMPARED).max(1);
        let n_kinds = rows.kinds.len();
        let multipliers: Vec<_> =
            rows.kinds.iter_mut().map(|kind| kind.multiplier.take()).collect();
        let mut evaluated =
            Self { residuals: vec![Vec::new(); n_kinds], slopes: vec![Vec::new(); n_kinds] };
        let visited = rows.visit_every(stride, p, &mut |row| {
            evaluated.residuals[row.kind].push(row.residual);
            evaluated.slopes[row.kind].extend_from_slice(row.slopes);
        });
        for (kind, multiplier) in rows.kinds.iter_mut().zip(multipliers) {
            kind.multiplier = multiplier;
        }
        visited.is_ok().then_some(evaluated)
    }

    /// The derivatives of a kind with respect to parameter j of n, multiplied by the m-th, which is `factor`.
    fn derivatives(
        &self,
        kind: usize,
        j: usize,
        n: usize,
        multiplier: Option<(usize, f64)>,
    ) -> impl Iterator<Item = f64> + '_ {
        let rows = self.slopes[kind].chunks_exact(n).zip(&self.residuals[kind]);
        rows.map(move |(slopes, residual)| match multiplier {
            None => slopes[j],
            Some((m, factor)) => factor * slopes[j] + if j == m { *residual } else { 0.0 },
        })
    }
}

/// A parameter moved by a fraction of its size, within its bounds.
fn moved_by(system: &dyn Model, i: usize, value: f64, part: f64) -> f64 {
    let parameter = &system.signature().parameters[i];
    let step = part * parameter_size(&system, i);
    let within = |value: &f64| parameter.lower <= *value && *value <= parameter.upper;
    // If the bounds leave no room for the step, to the more distant one.
    let further = if parameter.upper - value >= value - parameter.lower {
        parameter.upper
    } else {
        parameter.lower
    };
    [value + step, value - step].into_iter().find(within).unwrap_or(further)
}

/// Pairs (j, k) of parameters for which the derivatives of a kind with respect to the j-th change with the k-th.
fn conflicts_of(
    points: &[ResidualNeighbourhood],
    rows: &RegressionRows<'_>,
    kind: usize,
    multiplier: Option<usize>,
) -> Vec<(usize, usize)> {
    let n = rows.free.len();
    let with = |p: &[f64]| multiplier.map(|m| (m, p[rows.free[m]]));
    let read = || (0..n).filter(|j| rows.kinds[kind].has_parameter(*j));
    let mut conflicts = Vec::new();
    for ResidualNeighbourhood { p, at, moved } in points {
        for k in read() {
            let (p_moved, evaluated) = &moved[k];
            for j in read() {
                let (Some(at), Some(moved)) = (at, evaluated) else {
                    conflicts.push((j, k));
                    continue;
                };
                let before = at.derivatives(kind, j, n, with(p));
                let after = moved.derivatives(kind, j, n, with(p_moved));
                let (mut change, mut size) = (0.0f64, 0.0f64);
                for (before, after) in before.zip(after) {
                    change = change.max((after - before).abs());
                    size = size.max(before.abs()).max(after.abs());
                }
                if change > ROUNDING * size {
                    conflicts.push((j, k));
                }
            }
        }
    }
    conflicts
}

/// The largest set without a conflict, the first of several; for many parameters one that cannot be extended.
fn largest_set(conflicts: &[Vec<bool>]) -> Vec<bool> {
    let n = conflicts.len();
    let fits = |set: &[bool], j: usize| !(0..n).any(|k| (set[k] || k == j) && conflicts[j][k]);
    let mut best = vec![false; n];
    // Parameters with the fewest conflicts first.
    let mut order: Vec<usize> = (0..n).filter(|j| !conflicts[*j][*j]).collect();
    order.sort_by_key(|j| conflicts[*j].iter().filter(|conflict| **conflict).count());
    for j in order {
        best[j] = fits(&best, j);
    }
    if n > MOST_TRIED {
        return best;
    }
    let size = |set: &[bool]| set.iter().filter(|member| **member).count();
    let first_is_high = |bits: usize| (0..n).map(|j| bits >> (n - 1 - j) & 1 == 1).collect();
    for bits in (0..1_usize << n).rev() {
        if bits.count_ones() as usize <= size(&best) {
            continue;
        }
        let set: Vec<bool> = first_is_high(bits);
        if (0..n).all(|j| !set[j] || fits(&set, j)) {
            best = set;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_set_is_found_where_a_greedy_choice_is_not() {
        // A star 0–1, 0–2 and a parameter that conflicts with itself.
        let mut conflicts = vec![vec![false; 4]; 4];
        for (j, k) in [(0, 1), (1, 0), (0, 2), (2, 0), (3, 3)] {
            conflicts[j][k] = true;
        }
        assert_eq!(largest_set(&conflicts), [false, true, true, false]);
        assert_eq!(largest_set(&[vec![false; 1]]), [true]);
        // b1 b2: the first of two.
        assert_eq!(largest_set(&[vec![false, true], vec![true, false]]), [true, false]);
    }
}
