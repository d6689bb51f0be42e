//! Sets of columns as disjoint intervals.

use std::collections::BTreeMap;

/// Columns as disjoint runs, each with its begin and end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ColumnIntervals {
    runs: BTreeMap<usize, usize>,
    len: usize,
}

impl ColumnIntervals {
    /// All columns from `begin` up to `end`.
    pub(super) fn new(begin: usize, end: usize) -> Self {
        let runs = if begin < end { BTreeMap::from([(begin, end)]) } else { BTreeMap::new() };
        ColumnIntervals { runs, len: end.saturating_sub(begin) }
    }

    /// Number of columns.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Whether it contains all `count` columns from `first` on.
    pub(super) fn contains(&self, first: usize, count: usize) -> bool {
        self.run_at(first).is_some_and(|(_, end)| first + count <= end)
    }

    /// Removes columns, all of which it must contain.
    pub(super) fn remove(&mut self, first: usize, count: usize) {
        let Some((begin, end)) = self.run_at(first).filter(|(_, end)| first + count <= *end) else {
            return;
        };
        self.runs.remove(&begin);
        if begin < first {
            self.runs.insert(begin, first);
        }
        if first + count < end {
            self.runs.insert(first + count, end);
        }
        self.len -= count;
    }

    /// The columns, ascending.
    pub(super) fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.runs.iter().flat_map(|(begin, end)| *begin..*end)
    }

    fn run_at(&self, column: usize) -> Option<(usize, usize)> {
        let (begin, end) = self.runs.range(..=column).next_back()?;
        (column < *end).then_some((*begin, *end))
    }
}

#[cfg(test)]
mod tests {
    use super::ColumnIntervals;

    #[test]
    fn what_is_taken_out_of_the_middle_leaves_both_ends() {
        let mut columns = ColumnIntervals::new(2, 10);
        assert!(columns.contains(2, 8) && !columns.contains(2, 9) && !columns.contains(1, 1));
        columns.remove(4, 3);
        assert_eq!(columns.iter().collect::<Vec<_>>(), [2, 3, 7, 8, 9]);
        assert!(!columns.contains(3, 2) && columns.contains(7, 3));
        columns.remove(2, 2);
        columns.remove(9, 1);
        assert_eq!((columns.iter().collect::<Vec<_>>(), columns.len()), (vec![7, 8], 2));
    }
}
