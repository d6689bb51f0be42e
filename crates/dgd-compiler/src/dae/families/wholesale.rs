//! Families matched as wholes: each loop's equation determines one run of elements.
//!
//! An equation with one candidate left takes it. If none is forced, a loop takes the elements that it names first. This
//! covers the usual models; [`super::elementwise`] handles the rest.

use super::intervals::ColumnIntervals;
use super::planned::{ColumnCandidates, FamilyAssignment};
use crate::dae::matching::maximum_matching;

/// An assignment of all equations to the free columns, if one is found.
pub(super) fn assign(
    rows: &[ColumnCandidates],
    mut free: ColumnIntervals,
    n_single: usize,
) -> Option<Vec<FamilyAssignment>> {
    let needed: usize = rows.iter().map(|row| row.count as usize).sum();
    if needed != free.len() {
        return None;
    }
    let mut matched = Vec::with_capacity(rows.len());
    let mut open: Vec<&ColumnCandidates> = rows.iter().collect();
    loop {
        let before = open.len();
        let mut stuck = false;
        open.retain(|row| {
            let mut possible =
                row.columns.iter().filter(|column| free.contains(**column, row.count as usize));
            match (possible.next(), possible.next()) {
                (Some(&column), None) => {
                    free.remove(column, row.count as usize);
                    matched.push(FamilyAssignment {
                        equation: row.equation,
                        from: 0,
                        count: row.count,
                        column,
                    });
                    false
                }
                // A single equation may tie states together.
                (None, _) if row.count == 1 => false,
                (None, _) => {
                    stuck = true;
                    true
                }
                (Some(_), Some(_)) => true,
            }
        });
        if stuck {
            return None;
        }
        if open.len() < before {
            continue;
        }
        let Some(at) = open.iter().position(|row| row.count > 1) else { break };
        let row = open.remove(at);
        let column = middle(row, &free)?;
        free.remove(column, row.count as usize);
        matched.push(FamilyAssignment {
            equation: row.equation,
            from: 0,
            count: row.count,
            column,
        });
    }

    // Single equations remain. Unmatched ones are counted with all others of single unknowns.
    let columns: Vec<usize> = free.iter().collect();
    let incidence: Vec<Vec<usize>> = open
        .iter()
        .map(|row| row.columns.iter().filter_map(|c| columns.binary_search(c).ok()).collect())
        .collect();
    let matching = maximum_matching(&incidence, columns.len());
    if matching.free_columns().any(|column| columns[column] >= n_single) {
        return None;
    }
    for (row, column) in open.iter().zip(&matching.of_row) {
        let Some(column) = column.map(|column| columns[column]) else { continue };
        matched.push(FamilyAssignment { equation: row.equation, from: 0, count: 1, column });
    }
    matched.retain(|assigned| assigned.column >= n_single);
    Some(matched)
}

/// The middle one of the runs of elements that a loop could determine: the run of `x[i]` in an equation that also reads
/// `x[i - 1]` and `x[i + 1]`.
fn middle(row: &ColumnCandidates, free: &ColumnIntervals) -> Option<usize> {
    let possible: Vec<usize> = row
        .columns
        .iter()
        .copied()
        .filter(|column| free.contains(*column, row.count as usize))
        .collect();
    possible.get((possible.len().max(1) - 1) / 2).copied()
}
