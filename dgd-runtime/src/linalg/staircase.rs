//! The ends of rows and columns of a banded matrix.

use super::order::UnknownOrder;
use crate::system::Pattern;

/// The steps in which a band ends, by place, after elimination with row exchanges.
#[derive(Debug, Clone)]
pub(super) struct Staircase {
    /// Last row of each column of L.
    bottoms: Vec<u32>,
    /// Last column that each row of U can reach: that of any row it may have been exchanged with.
    reaches: Vec<u32>,
    /// First row of each column of U.
    tops: Vec<u32>,
}

impl Staircase {
    pub(super) fn new(n: usize, places: &Pattern, order: &UnknownOrder) -> Self {
        let mut bottoms: Vec<u32> = (0..n as u32).collect();
        let mut ends = bottoms.clone();
        places.for_each_place(|row, column| {
            let (row, column) = (order.place(row), order.place(column));
            bottoms[column] = bottoms[column].max(row as u32);
            ends[row] = ends[row].max(column as u32);
        });
        // Rows still to be eliminated fill in below, and an exchanged row is longer than the others.
        let mut last = 0;
        for bottom in &mut bottoms {
            last = last.max(*bottom);
            *bottom = last;
        }
        let mut reaches = Vec::with_capacity(n);
        let (mut seen, mut end) = (0, 0);
        for bottom in &bottoms {
            for candidate in &ends[seen..=*bottom as usize] {
                end = end.max(*candidate);
            }
            seen = *bottom as usize + 1;
            reaches.push(end);
        }
        let mut tops = ends;
        let mut row = 0;
        for (column, top) in tops.iter_mut().enumerate() {
            while (reaches[row] as usize) < column {
                row += 1;
            }
            *top = row as u32;
        }
        Self { bottoms, reaches, tops }
    }

    /// Last row of column `k` of L.
    #[inline]
    pub(super) fn bottom(&self, k: usize) -> usize {
        self.bottoms[k] as usize
    }

    /// Last column of row `k` of U.
    #[inline]
    pub(super) fn reach(&self, k: usize) -> usize {
        self.reaches[k] as usize
    }

    /// First row of column `k` of U.
    #[inline]
    pub(super) fn top(&self, k: usize) -> usize {
        self.tops[k] as usize
    }

    /// Number of multiplications of an elimination, and of a solution.
    pub(super) fn work(&self) -> (f64, f64) {
        let steps = self.bottoms.iter().zip(&self.reaches).zip(0_u32..);
        let sizes = steps.map(|((bottom, reach), k)| (f64::from(bottom - k), f64::from(reach - k)));
        sizes.fold((0.0, 0.0), |(elimination, solution), (below, right)| {
            (elimination + (below + 1.0) * (right + 1.0), solution + below + right + 1.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_of_blocks_are_their_ends() {
        // Four blocks of three, each with its neighbours.
        let (b, blocks) = (3, 4);
        let n = b * blocks;
        let near = |i: usize, j: usize| (i / b).abs_diff(j / b) <= 1;
        let places: Vec<_> =
            (0..n).flat_map(|i| (0..n).filter(move |j| near(i, *j)).map(move |j| (i, j))).collect();
        let steps = Staircase::new(n, &Pattern::from_places(&places), &UnknownOrder::Natural);
        for k in 0..n {
            let block = k / b;
            assert_eq!(steps.bottom(k), (b * (block + 2)).min(n) - 1);
            assert_eq!(steps.reach(k), (b * (block + 3)).min(n) - 1);
            assert_eq!(steps.top(k), b * block.saturating_sub(2));
        }
    }
}
