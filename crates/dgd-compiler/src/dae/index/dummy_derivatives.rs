//! Dummy derivatives: selects which of the unknowns tied together by constraints stay states.
//!
//! A constraint 0 = e(x) that was differentiated makes one of the x algebraic: its derivative is a dummy, an algebraic
//! unknown like others, and the constraint gives x itself. The pivot decides which x that can be: for k constraints,
//! the determinant of ∂e/∂x over the k chosen x.
//!
//! Constraints with the fewest unknowns of their own come first, so that blocks are as small as possible: a chain of
//! rods is as many blocks. A block has
//!
//! - one choice if a pivot is constant, or if there is no alternative,
//! - all choices otherwise: a pendulum's rod gives y while it hangs, and x while it passes the horizontal.
//!
//! # Source
//!
//! S. E. Mattsson and G. Söderlind, Index reduction in differential-algebraic equations using dummy
//! derivatives, SIAM J. Sci. Comput. 14 (1993) 677–692; the change between choices, S. E. Mattsson,
//! H. Olsson and H. Elmqvist, Dynamic selection of states in Dymola, Modelica Workshop 2000.

use std::collections::{BTreeMap, BTreeSet};

use super::identity::{is_constant, samples, tidied};
use super::pantelides::ReducedSystem;
use super::variables::UnknownList;
use crate::expr::{ExprGraph, ExprId, Symbol};

/// Blocks with more constraints, or more choices, are limited to one choice.
const MOST_CONSTRAINTS: usize = 4;
const MOST_CHOICES: usize = 20;
/// Pivots this close are equally good.
const EQUAL: f64 = 1e-9;

/// Constraints, and the unknowns that they can be solved for.
#[derive(Debug, Clone)]
pub(super) struct ConstraintBlock {
    /// Equations of the constraints, ascending.
    pub(super) equations: Vec<usize>,
    /// Positions of the constraints.
    pub(super) rows: Vec<usize>,
    /// The unknowns among which there is a choice.
    pub(super) candidates: Vec<u32>,
    /// At least one; with the first, the unknowns declared first stay states.
    pub(super) choices: Vec<DummySelection>,
}

/// The unknowns that constraints are solved for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct DummySelection {
    pub(super) dummies: Vec<u32>,
    /// The determinant, in units of the unknowns' sizes.
    pub(super) pivot: ExprId,
}

/// Rows of constraints that are solved together, and their unknowns that are in no earlier block.
struct ConstraintGroup {
    rows: Vec<usize>,
    candidates: Vec<u32>,
}

/// The blocks of the constraints, or the positions of constraints without enough unknowns. `typical` has values of
/// symbols near which a choice must hold if there are too many.
pub(super) fn blocks_of(
    graph: &mut ExprGraph,
    reduced: &ReducedSystem,
    variables: &UnknownList,
    typical: &dyn Fn(Symbol) -> f64,
) -> Result<Vec<ConstraintBlock>, Vec<usize>> {
    let mut blocks: Vec<ConstraintBlock> = Vec::new();
    for group in groups(graph, reduced)? {
        let block = block(graph, reduced, variables, typical, &group)?;
        let twin = blocks.iter_mut().find(|other| choose_alike(graph, other, &block));
        match twin {
            Some(twin) => {
                for (choice, other) in twin.choices.iter_mut().zip(block.choices) {
                    choice.dummies.extend(other.dummies);
                }
                twin.candidates.extend(block.candidates);
                twin.rows.extend(block.rows);
                twin.equations.extend(block.equations);
                twin.equations.sort_unstable();
                twin.equations.dedup();
            }
            None => blocks.push(block),
        }
    }
    Ok(blocks)
}

/// Constraints in groups, each with unknowns of its own.
fn groups(graph: &ExprGraph, reduced: &ReducedSystem) -> Result<Vec<ConstraintGroup>, Vec<usize>> {
    let unknowns: Vec<BTreeSet<u32>> = reduced
        .constraints
        .iter()
        .map(|constraint| {
            let symbols = graph.symbols(constraint.rest).into_iter();
            symbols
                .filter_map(|symbol| match symbol {
                    Symbol::Unknown(i) => Some(i),
                    _ => None,
                })
                .collect()
        })
        .collect();
    let mut groups: Vec<ConstraintGroup> = Vec::new();
    let mut met: BTreeSet<u32> = BTreeSet::new();
    let mut open: Vec<usize> = (0..unknowns.len()).collect();
    while let Some(&first) = open.first() {
        // Of one order, the constraint with the fewest unknowns of its own.
        let order = reduced.constraints[first].order;
        let n_own = |row: usize| unknowns[row].difference(&met).count();
        let Some(row) = open
            .iter()
            .copied()
            .filter(|row| reduced.constraints[*row].order == order)
            .min_by_key(|row| n_own(*row))
        else {
            break;
        };
        open.retain(|other| *other != row);
        let mut group = ConstraintGroup {
            rows: vec![row],
            candidates: unknowns[row].difference(&met).copied().collect(),
        };
        while group.candidates.len() < group.rows.len() {
            // The nearest group that shares unknowns with this one is solved together with it.
            let shares = |other: &ConstraintGroup| {
                group
                    .rows
                    .iter()
                    .any(|row| other.candidates.iter().any(|i| unknowns[*row].contains(i)))
            };
            let Some(at) = groups.iter().rposition(shares) else { return Err(group.rows) };
            let other = groups.remove(at);
            group.rows.extend(other.rows);
            group.candidates.extend(other.candidates);
        }
        group.rows.sort_unstable();
        let lower: Vec<u32> = met.iter().copied().collect();
        met.extend(&unknowns[row]);
        sort_as_rates(graph, reduced, &lower, &mut group.candidates);
        groups.push(group);
    }
    Ok(groups)
}

/// Sorts unknowns like those whose derivatives they are, so that x, y and v_x, v_y are chosen alike.
fn sort_as_rates(
    graph: &ExprGraph,
    reduced: &ReducedSystem,
    lower: &[u32],
    candidates: &mut [u32],
) {
    let mut position: BTreeMap<u32, usize> = BTreeMap::new();
    for (at, x) in lower.iter().enumerate() {
        let Some(rate) = reduced.rates.get(x) else { continue };
        for symbol in graph.symbols(rate.value) {
            if let Symbol::Unknown(v) = symbol {
                position.entry(v).or_insert(at);
            }
        }
    }
    candidates.sort_by_key(|i| (position.get(i).copied().unwrap_or(usize::MAX), *i));
}

fn block(
    graph: &mut ExprGraph,
    reduced: &ReducedSystem,
    variables: &UnknownList,
    typical: &dyn Fn(Symbol) -> f64,
    ConstraintGroup { rows, candidates }: &ConstraintGroup,
) -> Result<ConstraintBlock, Vec<usize>> {
    let zero = graph.constant(0.0);
    let mut matrix: Vec<Vec<ExprId>> = Vec::with_capacity(rows.len());
    for row in rows {
        let mut entries = vec![zero; candidates.len()];
        let typical_value = |symbol| match symbol {
            Symbol::Unknown(i) => candidates.iter().position(|other| *other == i),
            _ => None,
        };
        for (column, slope) in graph.gradient(reduced.constraints[*row].rest, typical_value) {
            entries[column] = slope;
        }
        matrix.push(entries);
    }
    let sets = subsets(candidates.len(), rows.len());
    let (sets, is_chosen) = match sets {
        Some(sets) if rows.len() <= MOST_CONSTRAINTS => (sets, false),
        _ => (vec![best_columns(graph, &matrix, typical).ok_or_else(|| rows.clone())?], true),
    };
    let mut choices = Vec::new();
    for set in sets {
        let pivot = if is_chosen {
            graph.constant(1.0)
        } else {
            let columns: Vec<Vec<ExprId>> =
                matrix.iter().map(|row| set.iter().map(|c| row[*c]).collect()).collect();
            let determinant = determinant(graph, &columns);
            let size = relative_size(variables, candidates, &set);
            let size = graph.constant(size);
            let determinant = tidied(graph, determinant);
            graph.multiply(size, determinant)
        };
        if graph.value(pivot) != Some(0.0) {
            let dummies = set.iter().map(|column| candidates[*column]).collect();
            choices.push(DummySelection { dummies, pivot });
        }
    }
    if let Some(best) = best_constant(graph, &choices, typical) {
        choices = vec![choices.swap_remove(best)];
    }
    if choices.is_empty() {
        return Err(rows.clone());
    }
    let mut equations: Vec<usize> =
        rows.iter().map(|row| reduced.constraints[*row].equation).collect();
    equations.sort_unstable();
    equations.dedup();
    Ok(ConstraintBlock { equations, rows: rows.clone(), candidates: candidates.clone(), choices })
}

/// The subsets of k of n columns, those of the last columns first; `None` if there are too many.
fn subsets(n: usize, k: usize) -> Option<Vec<Vec<usize>>> {
    let mut subsets = Vec::new();
    // The complement of a subset, in lexicographic order.
    let rest = n - k;
    let mut kept: Vec<usize> = (0..rest).collect();
    loop {
        if subsets.len() == MOST_CHOICES {
            return None;
        }
        subsets.push((0..n).filter(|column| !kept.contains(column)).collect());
        let Some(at) = (0..rest).rev().find(|at| kept[*at] < k + at) else { return Some(subsets) };
        kept[at] += 1;
        for later in at + 1..rest {
            kept[later] = kept[later - 1] + 1;
        }
    }
}

/// The determinant of a small matrix, by its first row.
fn determinant(graph: &mut ExprGraph, matrix: &[Vec<ExprId>]) -> ExprId {
    let Some((first, others)) = matrix.split_first() else { return graph.constant(1.0) };
    let mut sum = graph.constant(0.0);
    for (column, entry) in first.iter().enumerate() {
        if graph.value(*entry) == Some(0.0) {
            continue;
        }
        let without = |row: &Vec<ExprId>| {
            let mut row = row.clone();
            row.remove(column);
            row
        };
        let minor: Vec<Vec<ExprId>> = others.iter().map(without).collect();
        let minor = determinant(graph, &minor);
        let term = graph.multiply(*entry, minor);
        sum = if column % 2 == 0 { graph.add(sum, term) } else { graph.subtract(sum, term) };
    }
    sum
}

/// The product of the sizes of the chosen unknowns; 1 if all candidates are of one kind.
fn relative_size(variables: &UnknownList, candidates: &[u32], set: &[usize]) -> f64 {
    let unknown = |i: u32| &variables.unknowns[i as usize];
    let dimension = candidates.first().map(|i| unknown(*i).unit.dimension);
    let alike =
        |i: &u32| unknown(*i).nominal.is_none() && Some(unknown(*i).unit.dimension) == dimension;
    if candidates.iter().all(alike) {
        return 1.0;
    }
    let size = |i: u32| unknown(i).nominal.unwrap_or(unknown(i).unit.factor.abs());
    set.iter().map(|column| size(candidates[*column])).product()
}

/// The best of the choices with a pivot that never changes, the first of equal ones.
fn best_constant(
    graph: &ExprGraph,
    choices: &[DummySelection],
    typical: &dyn Fn(Symbol) -> f64,
) -> Option<usize> {
    let mut best: Option<(usize, f64)> = None;
    for (at, choice) in choices.iter().enumerate() {
        if is_constant(graph, choice.pivot) {
            let size = graph.evaluate(choice.pivot, typical).abs();
            if size > best.map_or(0.0, |(_, size)| size * (1.0 + EQUAL)) {
                best = Some((at, size));
            }
        }
    }
    best.map(|(at, _)| at)
}

/// Columns with a well-conditioned minor at typical values, by elimination with full pivoting; `None` if there are
/// fewer than rows.
fn best_columns(
    graph: &ExprGraph,
    matrix: &[Vec<ExprId>],
    typical: &dyn Fn(Symbol) -> f64,
) -> Option<Vec<usize>> {
    let at_typical = |id: &ExprId| {
        let value = graph.evaluate(*id, typical);
        if value.is_finite() && value != 0.0 { value } else { samples(graph, *id)[0] }
    };
    let mut values: Vec<Vec<f64>> =
        matrix.iter().map(|row| row.iter().map(at_typical).collect()).collect();
    let mut chosen = Vec::new();
    for first in 0..values.len() {
        let places = (first..values.len())
            .flat_map(|row| (0..values[row].len()).map(move |column| (row, column)));
        let (row, column) = places
            .filter(|(_, column)| !chosen.contains(column))
            .max_by(|(r, c), (i, j)| values[*r][*c].abs().total_cmp(&values[*i][*j].abs()))?;
        let pivot = values[row][column];
        if pivot == 0.0 || !pivot.is_finite() {
            return None;
        }
        values.swap(first, row);
        let line = values[first].clone();
        for other in &mut values[first + 1..] {
            let quotient = other[column] / pivot;
            for (entry, above) in other.iter_mut().zip(&line) {
                *entry -= quotient * above;
            }
        }
        chosen.push(column);
    }
    chosen.sort_unstable();
    Some(chosen)
}

/// Whether the pivots of two blocks are in proportion, so that one choice serves both.
fn choose_alike(graph: &ExprGraph, a: &ConstraintBlock, b: &ConstraintBlock) -> bool {
    if a.choices.len() < 2 || a.choices.len() != b.choices.len() {
        return false;
    }
    let quotients: Vec<[f64; 3]> = a
        .choices
        .iter()
        .zip(&b.choices)
        .map(|(a, b)| {
            let (a, b) = (samples(graph, a.pivot), samples(graph, b.pivot));
            [b[0] / a[0], b[1] / a[1], b[2] / a[2]]
        })
        .collect();
    let close = |a: f64, b: f64| (a - b).abs() <= EQUAL * a.abs();
    quotients.iter().all(|q| (0..3).all(|k| close(quotients[0][k], q[k])))
}
