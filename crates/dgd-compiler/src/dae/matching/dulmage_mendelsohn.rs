//! The over- and underdetermined parts of an incidence.
//!
//! A. L. Dulmage and N. S. Mendelsohn, Coverings of bipartite graphs, Canad. J. Math. 10 (1958) 517–534: the rows and
//! columns reachable by alternating paths from rows, or from columns, that a maximum matching leaves free. The parts do
//! not depend on the choice of the maximum matching.

use super::Matching;

/// Rows and columns that belong together, ascending.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct MatchingBlock {
    pub(super) rows: Vec<usize>,
    pub(super) columns: Vec<usize>,
}

/// The part with more rows than columns.
pub(super) fn overdetermined(incidence: &[Vec<usize>], matching: &Matching) -> MatchingBlock {
    let columns_of = |row: usize| incidence[row].iter().copied();
    let (rows, columns) = reached(matching.free_rows().collect(), columns_of, &matching.of_column);
    MatchingBlock { rows, columns }
}

/// The part with more columns than rows.
pub(super) fn underdetermined(incidence: &[Vec<usize>], matching: &Matching) -> MatchingBlock {
    let mut rows_of = vec![Vec::new(); matching.of_column.len()];
    for (row, columns) in incidence.iter().enumerate() {
        for column in columns {
            rows_of[*column].push(row);
        }
    }
    let of_column = |column: usize| rows_of[column].iter().copied();
    let (columns, rows) = reached(matching.free_columns().collect(), of_column, &matching.of_row);
    MatchingBlock { rows, columns }
}

/// Rows and columns reachable by alternating paths from `starts`: by any edge to the other side, and back by the
/// matching, `partner`.
fn reached<I: Iterator<Item = usize>>(
    starts: Vec<usize>,
    edges: impl Fn(usize) -> I,
    partner: &[Option<usize>],
) -> (Vec<usize>, Vec<usize>) {
    let mut nodes = starts;
    let mut others = Vec::new();
    let mut is_met = vec![false; partner.len()];
    let mut next = 0;
    while let Some(&at) = nodes.get(next) {
        next += 1;
        for other in edges(at) {
            if !is_met[other] {
                is_met[other] = true;
                others.push(other);
                // Without a partner the matching would not be maximum.
                nodes.extend(partner[other]);
            }
        }
    }
    nodes.sort_unstable();
    others.sort_unstable();
    (nodes, others)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dae::matching::maximum_matching;

    #[test]
    fn the_parts_are_those_of_a_small_example() {
        // Rows 0 and 1 share column 0, row 2 and column 1 match each other, row 3 has columns 2 and 3.
        let incidence = [vec![0], vec![0], vec![0, 1], vec![1, 2, 3]];
        let matching = maximum_matching(&incidence, 4);
        let over = overdetermined(&incidence, &matching);
        assert_eq!(over, MatchingBlock { rows: vec![0, 1], columns: vec![0] });
        let under = underdetermined(&incidence, &matching);
        assert_eq!(under, MatchingBlock { rows: vec![3], columns: vec![2, 3] });
    }
}
