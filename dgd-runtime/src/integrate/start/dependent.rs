//! Finds algebraic equations that are linearly dependent everywhere, and so determine fewer unknowns than there are
//! equations.
//!
//! ∂f_a/∂y_a is evaluated at several points around the start, with random unknowns and inputs, the given parameters,
//! and the modes that hold at the start. At a single point the matrix may be singular by chance, as for q|q| at q = 0;
//! dependent equations are so at every point.
//!
//! ```text
//!   Jᵀ c = 0:  equations with cᵢ ≠ 0 say one thing less than they are
//!   J v  = 0:  unknowns with vⱼ ≠ 0 may move along v
//! ```

use crate::discrete::state_selection::select_states;
use crate::discrete::{choose_sides, choose_start_modes, discrete_numbers};
use crate::problem::unknown_sizes;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Number of points.
const POINTS: usize = 8;
/// Minimum number of points with finite values.
const FEWEST: usize = 4;
/// Pivots below this fraction of the largest are rounding.
const NOTHING: f64 = 1e-11;
/// Maximum size of a system; larger ones take too long.
const MOST: usize = 300;

/// A minimal set of equations that depend on each other.
#[derive(Debug, Clone, PartialEq)]
pub struct DependentEquations {
    /// Rows, ascending, each with its factor: the weighted sum of their derivatives with respect to algebraic unknowns
    /// vanishes. The first factor is one.
    pub equations: Vec<(usize, f64)>,
    /// Algebraic unknowns that these equations do not determine, ascending.
    pub unknowns: Vec<usize>,
    /// Whether the factors are the same at all points.
    pub is_constant: bool,
}

/// The algebraic equations that are dependent with these parameters, SI, in the modes that hold at the start; empty if
/// that cannot be determined.
pub fn dependent_equations<S: SolvableSystem>(system: &S, p: &[f64]) -> Vec<DependentEquations> {
    if !system.signature().unknowns.is_empty() && p.len() == system.signature().parameters.len() {
        let mut draws = Xorshift64(0x9e37_79b9_7f4a_7c15);
        let mut dependents: Vec<Vec<DependentEquations>> = Vec::new();
        for point in 0..POINTS {
            match at_a_point(system, p, &mut draws, point) {
                PointResult::Nothing => {}
                PointResult::Regular => return Vec::new(),
                PointResult::Dependent(dependent) => dependents.push(dependent),
            }
        }
        if dependents.len() >= FEWEST {
            return common(dependents);
        }
    }
    Vec::new()
}

/// The sets that are dependent at all points.
fn common(found: Vec<Vec<DependentEquations>>) -> Vec<DependentEquations> {
    let rows =
        |one: &DependentEquations| one.equations.iter().map(|(row, _)| *row).collect::<Vec<_>>();
    let mut remaining = found.into_iter();
    let Some(mut first) = remaining.next() else { return Vec::new() };
    for other in remaining {
        first.retain_mut(|one| {
            let Some(same) = other.iter().find(|same| rows(same) == rows(one)) else {
                return false;
            };
            let mut factors = one.equations.iter().zip(&same.equations);
            one.is_constant &= factors.all(|((_, a), (_, b))| (a - b).abs() <= 1e-9 * a.abs());
            one.unknowns.retain(|unknown| same.unknowns.contains(unknown));
            true
        });
    }
    first.retain(|one| !one.unknowns.is_empty());
    first
}

/// The result at a point.
enum PointResult {
    /// Something is not finite there, or the system is too large.
    Nothing,
    /// The equations are independent.
    Regular,
    Dependent(Vec<DependentEquations>),
}

fn at_a_point<S: SolvableSystem>(
    system: &S,
    p: &[f64],
    draws: &mut Xorshift64,
    point: usize,
) -> PointResult {
    let signature = system.signature();
    let n = signature.unknowns.len();
    // Several sizes are tried, since only the unit is known.
    let size = [1.0, 10.0, 0.1, 100.0][point % 4];
    let mut u: Vec<f64> = (0..signature.n_u()).map(|_| draws.between(0.1, 1.0)).collect();
    for (u, input) in u.iter_mut().zip(signature.inputs.iter()) {
        *u = input.unit.offset + *u * size * input.unit.factor;
    }
    let (mut y, mut sizes) = (vec![0.0; n], vec![0.0; n]);
    let mut z = discrete_numbers(system, p, 0.0);
    system.start(EvaluationPoint { t: 0.0, y: &[], u: &u, p, z: &z }, &mut y);
    if y.iter().any(|y| !y.is_finite()) {
        return PointResult::Nothing;
    }
    unknown_sizes(system, &y, &mut sizes);
    // Half of the time, on the same side of zero as the start.
    for (y, size) in y.iter_mut().zip(&sizes) {
        let side = if *y < 0.0 { -1.0 } else { 1.0 };
        let moved = if point.is_multiple_of(2) {
            side * draws.between(0.1, 0.5)
        } else {
            draws.between(-0.5, 0.5)
        };
        *y += moved * size;
    }
    let at_draw = EvaluationPoint { t: 0.0, y: &y, u: &u, p, z: &[] };
    let mut e = vec![0.0; signature.discrete.transitions().count()];
    choose_start_modes(system, at_draw, &mut e, &mut z);
    select_states(system, at_draw, &mut z, &mut e);
    choose_sides(system, at_draw, &mut e, &mut z);
    let point = EvaluationPoint { z: &z, ..at_draw };
    let mut mass = S::Vector::zeros(n);
    system.mass(point, mass.as_mut());
    let algebraic: Vec<usize> = (0..n).filter(|i| mass.as_ref()[*i] == 0.0).collect();
    if algebraic.is_empty() {
        return PointResult::Regular;
    }
    if algebraic.len() > MOST {
        return PointResult::Nothing;
    }
    let udot = vec![0.0; signature.n_u()];
    let (mut f, mut dfdt) = (S::Vector::zeros(n), S::Vector::zeros(n));
    let mut jacobian = S::Jacobian::zeros(signature.jacobian.len());
    system.linearize(point, &udot, f.as_mut(), jacobian.as_mut(), dfdt.as_mut());
    let mut place = vec![None; n];
    for (k, i) in algebraic.iter().enumerate() {
        place[*i] = Some(k);
    }
    let mut matrix = SquareMatrix::new(algebraic.len());
    signature.jacobian.for_each(jacobian.as_ref(), |row, column, value| {
        if let (Some(row), Some(k)) = (place[row], place[column]) {
            *matrix.entry(row, k) += value * sizes[column];
        }
    });
    if !matrix.is_finite() {
        return PointResult::Nothing;
    }
    match matrix.dependent(&algebraic) {
        None => PointResult::Regular,
        Some(found) => PointResult::Dependent(found),
    }
}

/// Positions of entries above rounding.
fn support(vector: &[f64]) -> Vec<usize> {
    let largest = vector.iter().fold(0.0, |largest: f64, v| largest.max(v.abs()));
    (0..vector.len()).filter(|i| vector[*i].abs() > 1e-8 * largest).collect()
}

/// A square matrix, row by row.
struct SquareMatrix {
    n: usize,
    values: Vec<f64>,
}

impl SquareMatrix {
    fn new(n: usize) -> Self {
        Self { n, values: vec![0.0; n * n] }
    }

    fn entry(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.values[row * self.n + column]
    }

    fn is_finite(&self) -> bool {
        self.values.iter().all(|value| value.is_finite())
    }

    /// Sets of rows that depend on each other, each with the columns that they do not determine; `None` if the matrix
    /// is regular. `names` are the names of rows and columns.
    fn dependent(self, names: &[usize]) -> Option<Vec<DependentEquations>> {
        let Self { n, values } = self;
        let transposed: Vec<f64> = (0..n * n).map(|k| values[(k % n) * n + k / n]).collect();
        let open: Vec<Vec<usize>> =
            null_space(n, values.clone())?.iter().map(|v| support(v)).collect();
        let of_rows = |c: Vec<f64>| {
            let rows = support(&c);
            let first = rows.first().map_or(1.0, |row| c[*row]);
            // A set of unknowns that these rows read.
            let reads = |k: &usize| rows.iter().any(|row| values[row * n + k] != 0.0);
            let mut columns: Vec<usize> =
                open.iter().filter(|set| set.iter().any(reads)).flatten().copied().collect();
            columns.sort_unstable();
            columns.dedup();
            DependentEquations {
                equations: rows.iter().map(|row| (names[*row], c[*row] / first)).collect(),
                unknowns: columns.into_iter().map(|k| names[k]).collect(),
                is_constant: true,
            }
        };
        Some(null_space(n, transposed)?.into_iter().map(of_rows).collect())
    }
}

/// A basis of the solutions of A v = 0, one for each free column of elimination with full pivoting. `None` if there is
/// no free column.
fn null_space(n: usize, mut a: Vec<f64>) -> Option<Vec<Vec<f64>>> {
    // Rows and columns are scaled alike, so that pivots are comparable.
    let mut scales = vec![1.0; n];
    for _ in 0..2 {
        for row in a.chunks_exact_mut(n) {
            let largest = row.iter().fold(0.0, |largest: f64, a| largest.max(a.abs()));
            if largest > 0.0 {
                for a in row {
                    *a /= largest;
                }
            }
        }
        for (column, scale) in scales.iter_mut().enumerate() {
            let entries = || (0..n).map(|row| row * n + column);
            let largest = entries().fold(0.0, |largest: f64, k| largest.max(a[k].abs()));
            if largest > 0.0 {
                *scale /= largest;
                for k in entries() {
                    a[k] /= largest;
                }
            }
        }
    }
    let mut columns: Vec<usize> = (0..n).collect();
    let mut rank = 0;
    while rank < n {
        let places = (rank..n).flat_map(|row| (rank..n).map(move |column| (row, column)));
        let size = |(row, column): &(usize, usize)| a[row * n + column].abs();
        // The first on a tie.
        let best =
            places.reduce(|best, place| if size(&place) > size(&best) { place } else { best });
        let Some((row, column)) = best.filter(|place| size(place) > NOTHING) else { break };
        for k in 0..n {
            a.swap(row * n + k, rank * n + k);
        }
        for k in 0..n {
            a.swap(k * n + column, k * n + rank);
        }
        columns.swap(column, rank);
        // Gauss–Jordan: above the pivot as well.
        let (pivot_row, pivot) = (a[rank * n..(rank + 1) * n].to_vec(), a[rank * n + rank]);
        for (_, row) in a.chunks_exact_mut(n).enumerate().filter(|(k, _)| *k != rank) {
            let factor = row[rank] / pivot;
            if factor != 0.0 {
                for (a, p) in row[rank..].iter_mut().zip(&pivot_row[rank..]) {
                    *a -= factor * p;
                }
                row[rank] = 0.0;
            }
        }
        rank += 1;
    }
    if rank == n {
        return None;
    }
    let of_column = |left_over: usize| {
        let mut v = vec![0.0; n];
        v[columns[left_over]] = scales[columns[left_over]];
        for k in 0..rank {
            v[columns[k]] = -a[k * n + left_over] / a[k * n + k] * scales[columns[k]];
        }
        v
    };
    Some((rank..n).map(of_column).collect())
}

/// Reproducible pseudo-random numbers (Vigna, xorshift64*).
struct Xorshift64(u64);

impl Xorshift64 {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11;
        low + (high - low) * bits as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize, values: &[f64]) -> SquareMatrix {
        SquareMatrix { n, values: values.to_vec() }
    }

    #[test]
    fn null_vectors_have_as_few_rows_as_can_be() {
        assert_eq!(matrix(2, &[1.0, 2.0, 3.0, 4.0]).dependent(&[0, 1]), None);
        // Far apart in size, and regular.
        assert_eq!(matrix(2, &[1e-20, 0.0, 1e9, 1e14]).dependent(&[0, 1]), None);
        let values = [1.0, 2.0, 0.0, 0.0, 5.0, 7.0, -2.0, -4.0, 0.0];
        let found = matrix(3, &values).dependent(&[4, 6, 8]).expect("it is singular");
        let [DependentEquations { equations, unknowns, .. }] = &found[..] else {
            panic!("{found:?}")
        };
        let [(4, 1.0), (8, half)] = equations[..] else { panic!("{equations:?}") };
        assert!((half - 0.5).abs() < 1e-14, "{half}");
        // The null vector (2, −1, 5/7) involves all three.
        assert_eq!(*unknowns, [4, 6, 8]);
    }

    #[test]
    fn sets_are_kept_apart() {
        // Two pairs of rows, each of a pair of columns.
        let values =
            [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 3.0, 5.0, 2.0, 2.0, 0.0, 0.0, 0.0, 0.0, 3.0, 5.0];
        let found = matrix(4, &values).dependent(&[0, 1, 2, 3]).expect("it is singular");
        let mut sets: Vec<(Vec<usize>, Vec<usize>)> = found
            .iter()
            .map(|one| (one.equations.iter().map(|(row, _)| *row).collect(), one.unknowns.clone()))
            .collect();
        sets.sort();
        assert_eq!(sets, [(vec![0, 2], vec![0, 1]), (vec![1, 3], vec![2, 3])]);
    }
}
