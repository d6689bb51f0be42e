//! Maximum matching of equations to unknowns.
//!
//! Hopcroft and Karp, SIAM J. Comput. 2 (1973) 225–231: phases of shortest augmenting paths, all of one length at a
//! time, so the time is O(E √V).

mod counts;
mod dulmage_mendelsohn;

pub(super) use counts::{more_places, quoted, verify_counts};

/// A maximum matching between rows and columns of an incidence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Matching {
    /// The column of each row.
    pub(super) of_row: Vec<Option<usize>>,
    /// The row of each column.
    pub(super) of_column: Vec<Option<usize>>,
}

impl Matching {
    /// Unmatched rows.
    pub(super) fn free_rows(&self) -> impl Iterator<Item = usize> + '_ {
        free(&self.of_row)
    }

    /// Unmatched columns.
    pub(super) fn free_columns(&self) -> impl Iterator<Item = usize> + '_ {
        free(&self.of_column)
    }
}

fn free(matched: &[Option<usize>]) -> impl Iterator<Item = usize> + '_ {
    matched.iter().enumerate().filter_map(|(i, m)| m.is_none().then_some(i))
}

/// Matches as many rows as can be, each to one of its columns.
pub(super) fn maximum_matching(incidence: &[Vec<usize>], n_columns: usize) -> Matching {
    let mut of_row = vec![None; incidence.len()];
    let mut of_column: Vec<Option<usize>> = vec![None; n_columns];
    loop {
        // Breadth first from the free rows: distance of each row in columns.
        let mut level = vec![usize::MAX; incidence.len()];
        let mut queue: Vec<usize> = free(&of_row).collect();
        for row in &queue {
            level[*row] = 0;
        }
        let mut reached_free_column = false;
        let mut next = 0;
        while let Some(&row) = queue.get(next) {
            next += 1;
            for &column in &incidence[row] {
                match of_column[column] {
                    None => reached_free_column = true,
                    Some(other) if level[other] == usize::MAX => {
                        level[other] = level[row] + 1;
                        queue.push(other);
                    }
                    Some(_) => {}
                }
            }
        }
        if !reached_free_column {
            return Matching { of_row, of_column };
        }
        // Depth first along rising levels: disjoint shortest paths.
        let mut cursor = vec![0; incidence.len()];
        let starts: Vec<usize> = free(&of_row).collect();
        for start in starts {
            let mut path = vec![start];
            while let Some(&row) = path.last() {
                let Some(&column) = incidence[row].get(cursor[row]) else {
                    path.pop();
                    continue;
                };
                cursor[row] += 1;
                match of_column[column] {
                    None => {
                        // Each row on the path takes the column at which it stopped.
                        for &row in &path {
                            let column = incidence[row][cursor[row] - 1];
                            of_row[row] = Some(column);
                            of_column[column] = Some(row);
                        }
                        break;
                    }
                    Some(other) if level[other] == level[row] + 1 => path.push(other),
                    Some(_) => {}
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_forced_choices_is_found() {
        // Row i may take column i or i + 1, the last row only its own: all must shift down.
        let n = 1000;
        let mut incidence: Vec<Vec<usize>> = (0..n - 1).map(|i| vec![i + 1, i]).collect();
        incidence.push(vec![n - 1]);
        let matching = maximum_matching(&incidence, n);
        assert_eq!(matching.free_rows().count(), 0);
        assert_eq!(matching.free_columns().count(), 0);
        for (row, column) in matching.of_row.iter().enumerate() {
            let column = column.expect("every row is matched");
            assert!(incidence[row].contains(&column));
            assert_eq!(matching.of_column[column], Some(row));
        }
    }

    #[test]
    fn what_cannot_be_matched_is_left_over() {
        let matching = maximum_matching(&[vec![0], vec![0], vec![1, 2]], 4);
        assert_eq!(matching.free_rows().collect::<Vec<_>>(), [1]);
        assert_eq!(matching.free_columns().count(), 2);
    }
}
