//! Orders of the unknowns in which a matrix has a narrow band.
//!
//! The Cuthill–McKee order lists unknowns level by level from one end of the graph of W + Wᵀ, neighbours with few
//! neighbours first; reversed it causes less fill-in. The ends are found as by George and Liu: from any unknown to one
//! of the farthest, until the distance no longer grows. Time and memory are proportional to the number of non-zeros.
//!
//! Source: George and Liu, *Computer Solution of Large Sparse Positive Definite Systems* (1981), §4.3.

use crate::system::Pattern;

/// Largest distances of non-zeros from the diagonal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Bandwidth {
    /// Below it.
    pub(super) lower: usize,
    /// Above it.
    pub(super) upper: usize,
}

/// The order of the unknowns, and of the rows with them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum UnknownOrder {
    /// The given order.
    Natural,
    /// Another order.
    Permuted {
        /// The unknown at each place.
        unknowns: Vec<u32>,
        /// The place of each unknown.
        places: Vec<u32>,
    },
}

impl UnknownOrder {
    /// The place of an unknown.
    #[inline]
    pub(super) fn place(&self, unknown: usize) -> usize {
        match self {
            Self::Natural => unknown,
            Self::Permuted { places, .. } => places[unknown] as usize,
        }
    }

    /// The unknown at a place.
    #[inline]
    pub(super) fn unknown(&self, place: usize) -> usize {
        match self {
            Self::Natural => place,
            Self::Permuted { unknowns, .. } => unknowns[place] as usize,
        }
    }
}

/// The given order or the reverse Cuthill–McKee order, whichever has the narrower band.
pub(super) fn narrowest(n: usize, places: &Pattern) -> (UnknownOrder, Bandwidth) {
    let natural = bandwidth(places, &UnknownOrder::Natural);
    // A tridiagonal matrix cannot be narrower.
    if natural.lower.max(natural.upper) <= 1 || u32::try_from(n).is_err() {
        return (UnknownOrder::Natural, natural);
    }
    let order = reverse_cuthill_mckee(&PatternGraph::new(n, places));
    let permuted = bandwidth(places, &order);
    if permuted.lower + permuted.upper < natural.lower + natural.upper {
        (order, permuted)
    } else {
        (UnknownOrder::Natural, natural)
    }
}

fn bandwidth(places: &Pattern, order: &UnknownOrder) -> Bandwidth {
    let mut width = Bandwidth { lower: 0, upper: 0 };
    places.for_each_place(|row, column| {
        let (row, column) = (order.place(row), order.place(column));
        width.lower = width.lower.max(row.saturating_sub(column));
        width.upper = width.upper.max(column.saturating_sub(row));
    });
    width
}

/// Neighbours of each unknown in the pattern.
struct PatternGraph {
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl PatternGraph {
    fn new(n: usize, places: &Pattern) -> Self {
        let mut starts = vec![0_u32; n + 1];
        places.for_each_place(|row, column| {
            if row != column {
                starts[row + 1] += 1;
                starts[column + 1] += 1;
            }
        });
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut neighbours = vec![0; starts[n] as usize];
        // Filled from the back, so that each start ends up in the right place.
        let mut next = starts[1..].to_vec();
        places.for_each_place(|row, column| {
            if row != column {
                for (of, neighbour) in [(row, column), (column, row)] {
                    next[of] -= 1;
                    neighbours[next[of] as usize] = neighbour as u32;
                }
            }
        });
        drop(next);
        let mut kept = 0;
        let mut begin = 0;
        for i in 0..n {
            let end = starts[i + 1] as usize;
            neighbours[begin..end].sort_unstable();
            let first = kept;
            for k in begin..end {
                if kept == first || neighbours[kept - 1] != neighbours[k] {
                    neighbours[kept] = neighbours[k];
                    kept += 1;
                }
            }
            begin = end;
            starts[i + 1] = kept as u32;
        }
        neighbours.truncate(kept);
        Self { starts, neighbours }
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn neighbours(&self, i: u32) -> &[u32] {
        let i = i as usize;
        &self.neighbours[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    fn degree(&self, i: u32) -> usize {
        self.neighbours(i).len()
    }
}

/// Unknowns level by level, component by component, in reverse.
fn reverse_cuthill_mckee(graph: &PatternGraph) -> UnknownOrder {
    let n = graph.len();
    let mut search =
        BreadthFirst { graph, seen: vec![0; n], round: 0, listed: Vec::with_capacity(n) };
    for first in 0..n as u32 {
        if search.seen[first as usize] == BreadthFirst::DONE {
            continue;
        }
        let root = search.end_of_component(first);
        search.list(root);
    }
    let BreadthFirst { listed: mut unknowns, seen: mut places, .. } = search;
    unknowns.reverse();
    for (place, unknown) in unknowns.iter().enumerate() {
        places[*unknown as usize] = place as u32;
    }
    UnknownOrder::Permuted { unknowns, places }
}

/// Breadth-first searches, component by component.
struct BreadthFirst<'a> {
    graph: &'a PatternGraph,
    /// The last round in which each unknown was visited.
    seen: Vec<u32>,
    round: u32,
    /// Unknowns of finished components, then those of the current search.
    listed: Vec<u32>,
}

impl BreadthFirst<'_> {
    /// Round of unknowns whose component is finished.
    const DONE: u32 = u32::MAX;
    /// Maximum number of searches for an end; two or three are typical.
    const SEARCHES: usize = 8;

    /// An unknown from which the component has as many levels as can be found.
    fn end_of_component(&mut self, first: u32) -> u32 {
        let mut root = first;
        let mut longest = 0;
        for _ in 0..Self::SEARCHES {
            let begin = self.listed.len();
            let (levels, last) = self.levels(root);
            let farthest = self.listed[last..].iter().copied();
            let next = farthest.min_by_key(|i| self.graph.degree(*i)).unwrap_or(root);
            self.listed.truncate(begin);
            if levels <= longest {
                break;
            }
            longest = levels;
            root = next;
        }
        root
    }

    /// Lists the component of `root` by levels. Returns their number, and the start of the last.
    fn levels(&mut self, root: u32) -> (usize, usize) {
        self.round += 1;
        let (round, graph) = (self.round, self.graph);
        let mut begin = self.listed.len();
        self.seen[root as usize] = round;
        self.listed.push(root);
        let mut levels = 1;
        loop {
            let end = self.listed.len();
            for k in begin..end {
                for &neighbour in graph.neighbours(self.listed[k]) {
                    if self.seen[neighbour as usize] != round {
                        self.seen[neighbour as usize] = round;
                        self.listed.push(neighbour);
                    }
                }
            }
            if self.listed.len() == end {
                return (levels, begin);
            }
            begin = end;
            levels += 1;
        }
    }

    /// Lists the component of `root` permanently, neighbours with few neighbours first.
    fn list(&mut self, root: u32) {
        let graph = self.graph;
        let mut next = self.listed.len();
        self.seen[root as usize] = Self::DONE;
        self.listed.push(root);
        while let Some(&unknown) = self.listed.get(next) {
            next += 1;
            let first = self.listed.len();
            for &neighbour in graph.neighbours(unknown) {
                if self.seen[neighbour as usize] != Self::DONE {
                    self.seen[neighbour as usize] = Self::DONE;
                    self.listed.push(neighbour);
                }
            }
            self.listed[first..].sort_by_key(|i| graph.degree(*i));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_arrays_that_alternate_are_interleaved() {
        // p[i] reads q[i] and q[i+1], q[i] reads p[i−1] and p[i]; p comes before q.
        let m = 50;
        let mut places = Vec::new();
        for i in 0..m {
            places.push((i, m + i));
            places.push((m + i, i));
            if i + 1 < m {
                places.push((m + i, i + 1));
                places.push((i + 1, m + i));
            }
        }
        let pattern = Pattern::from_places(&places);
        let (order, width) = narrowest(2 * m, &pattern);
        assert_eq!(width, Bandwidth { lower: 1, upper: 1 });
        for unknown in 0..2 * m {
            assert_eq!(order.unknown(order.place(unknown)), unknown);
        }
    }

    #[test]
    fn components_follow_one_another() {
        // Two rings of six, their members alternating.
        let places: Vec<_> = (0..12_usize).map(|i| (i, (i + 2) % 12)).collect();
        let pattern = Pattern::from_places(&places);
        let (_, width) = narrowest(12, &pattern);
        assert_eq!(width.lower.max(width.upper), 2);
    }

    #[test]
    fn a_grid_is_as_wide_as_its_shorter_side() {
        let (rows, columns) = (7, 40);
        let at = |i: usize, j: usize| i * columns + j;
        let mut places = Vec::new();
        for i in 0..rows {
            for j in 0..columns {
                if i + 1 < rows {
                    places.push((at(i, j), at(i + 1, j)));
                }
                if j + 1 < columns {
                    places.push((at(i, j + 1), at(i, j)));
                }
            }
        }
        let n = rows * columns;
        let pattern = Pattern::from_places(&places);
        let (_, width) = narrowest(n, &pattern);
        // Levels are diagonals of the grid: at most 7 unknowns each.
        assert!(width.lower.max(width.upper) <= rows, "{width:?}");
    }
}
