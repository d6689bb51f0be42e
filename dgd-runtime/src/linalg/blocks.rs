//! Algebraic equations in the order in which they can be solved: block lower triangular form.
//!
//! Row i belongs to unknown i, so that blocks are the strongly connected components of the graph with an edge from i to
//! each unknown that row i reads. Tarjan, SIAM J. Comput. 1 (1972) 146–160, gives them in order of dependence. Error
//! messages need it, since a mistake in one block spoils later ones but must be reported where it is; and poles, since
//! each block has its own.

use crate::system::Pattern;

/// Pivots below this fraction of their row make a block singular.
const SINGULAR: f64 = 1e-12;
/// The index of a row that has not been visited.
const OPEN: usize = usize::MAX;

/// The algebraic rows in blocks, each after those on which it depends, for the Jacobian with these non-zeros.
pub(crate) fn blocks(pattern: &Pattern, jacobian: &[f64], mass: &[f64]) -> Vec<Vec<usize>> {
    let mut reads: Vec<Vec<usize>> = vec![Vec::new(); mass.len()];
    for ((row, column), value) in pattern.positions().zip(jacobian) {
        if *value != 0.0 && row != column && mass[row] == 0.0 && mass[column] == 0.0 {
            reads[row].push(column);
        }
    }
    let mut index = vec![OPEN; mass.len()];
    let mut lowest = vec![OPEN; mass.len()];
    let mut is_waiting = vec![false; mass.len()];
    let (mut waiting, mut found, mut next) = (Vec::new(), Vec::new(), 0);
    for start in (0..mass.len()).filter(|row| mass[*row] == 0.0) {
        if index[start] != OPEN {
            continue;
        }
        // Rows on the current path, and how many of the unknowns that they read have been visited.
        let mut path = vec![(start, 0)];
        while let Some((row, looked_at)) = path.last_mut() {
            let row = *row;
            if index[row] == OPEN {
                (index[row], lowest[row]) = (next, next);
                next += 1;
                waiting.push(row);
                is_waiting[row] = true;
            }
            if let Some(&other) = reads[row].get(*looked_at) {
                *looked_at += 1;
                if index[other] == OPEN {
                    path.push((other, 0));
                } else if is_waiting[other] {
                    lowest[row] = lowest[row].min(index[other]);
                }
                continue;
            }
            path.pop();
            if let Some((above, _)) = path.last() {
                lowest[*above] = lowest[*above].min(lowest[row]);
            }
            if lowest[row] == index[row] {
                let position = waiting.iter().rposition(|other| *other == row).unwrap_or(0);
                let mut block = waiting.split_off(position);
                for row in &block {
                    is_waiting[*row] = false;
                }
                block.sort_unstable();
                found.push(block);
            }
        }
    }
    found
}

/// Whether the equations of a block do not determine its unknowns, which have these sizes.
pub(crate) fn is_singular(
    block: &[usize],
    pattern: &Pattern,
    jacobian: &[f64],
    sizes: &[f64],
) -> bool {
    let n = block.len();
    let mut rows = vec![vec![0.0; n]; n];
    for ((row, column), value) in pattern.positions().zip(jacobian) {
        if let (Ok(i), Ok(j)) = (block.binary_search(&row), block.binary_search(&column)) {
            rows[i][j] = *value * sizes[column];
        }
    }
    for row in &mut rows {
        let largest = row.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        for value in row {
            *value /= largest;
        }
    }
    for k in 0..n {
        let size = |row: &Vec<f64>| row[k].abs();
        let pivot = (k..n).max_by(|i, j| size(&rows[*i]).total_cmp(&size(&rows[*j]))).unwrap_or(k);
        rows.swap(k, pivot);
        // A row of zeros has become NaN.
        if rows[k][k].is_nan() || rows[k][k].abs() <= SINGULAR {
            return true;
        }
        let (above, below) = rows.split_at_mut(k + 1);
        for row in below {
            let quotient = row[k] / above[k][k];
            for (value, upper) in row[k..].iter_mut().zip(&above[k][k..]) {
                *value -= quotient * upper;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0 ← 1, 2 ↔ 3 ← 0, and 4 differential.
    fn example() -> (Pattern, Vec<f64>, [f64; 5]) {
        let entries =
            [(0, 0, 2.0), (1, 0, 1.0), (1, 1, 1.0), (2, 2, 1.0), (2, 3, 1.0), (3, 2, 1.0)];
        let more = [(3, 3, 1.0), (3, 0, 1.0), (0, 4, 1.0), (4, 1, 1.0)];
        let all: Vec<(usize, usize, f64)> = entries.into_iter().chain(more).collect();
        let pattern = Pattern::from_places(
            &all.iter().map(|(row, column, _)| (*row, *column)).collect::<Vec<_>>(),
        );
        (pattern, all.iter().map(|(_, _, value)| *value).collect(), [0.0, 0.0, 0.0, 0.0, 1.0])
    }

    #[test]
    fn blocks_come_behind_what_they_read() {
        let (pattern, jacobian, mass) = example();
        assert_eq!(blocks(&pattern, &jacobian, &mass), [vec![0], vec![1], vec![2, 3]]);
    }

    #[test]
    fn a_block_of_dependent_rows_is_singular() {
        let (pattern, jacobian, _) = example();
        assert!(is_singular(&[2, 3], &pattern, &jacobian, &[1.0; 5]));
        assert!(!is_singular(&[0], &pattern, &jacobian, &[1.0; 5]));
        assert!(is_singular(&[4], &pattern, &jacobian, &[1.0; 5]), "nothing on the diagonal");
    }
}
