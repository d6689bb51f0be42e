//! Finds rows of one equation that differ only in the positions of their operands and results, and so are rounds of a
//! loop.
//!
//! The rows of an equation over several indices are families, one for each value of the outer ones; if its elements are
//! not consecutive they are single rows. Two consecutive rows are traversed in parallel. If the steps from each row to
//! the next are the same, one expression suffices for all, with positions that move by constant steps from round to
//! round.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use super::expressions::{PlacedNumber, SystemExpressions};
use super::{ProgramOperation, StridedPosition};
use crate::dae::Dae;
use crate::expr::curve::CurveId;
use crate::expr::hash::{HashMap, HashSet};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::source::Span;

/// Minimum number of rows that form rounds: two do not show a pattern.
const FEWEST: usize = 3;

/// One expression in each row.
pub(super) type RowStrand = Rc<[ExprId]>;

/// All rows of a function that are rounds.
#[derive(Debug, Default)]
pub(super) struct FunctionRounds {
    pub(super) loops: Vec<InRounds>,
    /// Their families.
    pub(super) families: BTreeSet<usize>,
}

/// Rows with a common pattern.
#[derive(Debug, Default)]
pub(super) struct InRounds {
    pub(super) rounds: u32,
    /// Number of passages in each.
    pub(super) count: u32,
    /// The results of the first row, their positions in the next row, and their values in each.
    pub(super) numbers: Vec<(PlacedNumber, usize, RowStrand)>,
    /// Expressions common to all passages of a round, operands first.
    pub(super) head: Vec<RowStrand>,
    /// Expressions that differ from passage to passage, operands first.
    pub(super) body: Vec<RowStrand>,
    /// Numbers in which rounds differ, as curves over all rounds, or over all passages.
    pub(super) listed: HashMap<RowStrand, CurveId>,
    /// Operands common to all rounds and passages.
    common: Vec<ExprId>,
}

impl FunctionRounds {
    /// Finds them among the numbers of a function; `kinds` are groups of related rows, from [`of_one_kind`].
    pub(super) fn find(
        expressions: &SystemExpressions<'_>,
        moving: &HashSet<ExprId>,
        kinds: &[Vec<usize>],
        numbers: impl Iterator<Item = PlacedNumber>,
    ) -> FunctionRounds {
        let mut plan = FunctionRounds::default();
        if kinds.is_empty() {
            return plan;
        }
        let mut rows: BTreeMap<usize, Vec<PlacedNumber>> = BTreeMap::new();
        for given in numbers {
            if let Some(family) = given.1.family {
                rows.entry(family).or_default().push(given);
            }
        }
        let mut alike: BTreeMap<(u32, u32), InRounds> = BTreeMap::new();
        for families in kinds {
            let families: Vec<usize> =
                families.iter().copied().filter(|family| rows.contains_key(family)).collect();
            for families in runs(&families, |a, b| expressions.steps(&rows[&a], &rows[&b])) {
                let [first, next] = [0, 1].map(|k| &rows[&families[k]]);
                let rounds = u32::try_from(families.len()).unwrap_or(u32::MAX);
                let count = first.iter().find_map(|(_, number)| number.rows).unwrap_or(1);
                let strands = alike.entry((count, rounds)).or_default();
                (strands.rounds, strands.count) = (rounds, count);
                strands.numbers.extend(first.iter().enumerate().map(|(k, given)| {
                    let values = families.iter().map(|family| rows[family][k].1.value);
                    (*given, next[k].1.place, values.collect())
                }));
                plan.families.extend(families);
            }
        }
        plan.loops.extend(alike.into_values().map(|rounds| rounds.planned(expressions, moving)));
        plan
    }

    /// Operands common to all rounds.
    pub(super) fn common(&self) -> impl Iterator<Item = ExprId> {
        self.loops.iter().flat_map(|rounds| rounds.common.iter().copied())
    }
}

impl InRounds {
    /// Sorts its expressions.
    fn planned(
        mut self,
        expressions: &SystemExpressions<'_>,
        moving: &HashSet<ExprId>,
    ) -> InRounds {
        let mut strands: BTreeSet<RowStrand> = BTreeSet::new();
        let mut pending: Vec<RowStrand> =
            self.numbers.iter().map(|(.., values)| values.clone()).collect();
        while let Some(strand) = pending.pop() {
            if is_one(&strand) && !moving.contains(&strand[0]) {
                self.common.push(strand[0]);
            } else if !strands.contains(&strand) {
                pending.extend(expressions.operands(&strand));
                strands.insert(strand);
            }
        }
        // Operands are earlier expressions of a row.
        let mut passing: HashSet<RowStrand> = HashSet::default();
        for strand in strands {
            let listed = expressions.listed(&strand, self.count);
            let moves = match expressions.node(strand[0]) {
                Node::Symbol(_) => moving.contains(&strand[0]),
                node if listed.is_some() => matches!(node, Node::Curve(..)),
                _ => expressions.operands(&strand).any(|operand| passing.contains(&operand)),
            };
            if let Some(curve) = listed {
                self.listed.insert(Rc::clone(&strand), curve);
            }
            if moves {
                passing.insert(Rc::clone(&strand));
                self.body.push(strand);
            } else {
                self.head.push(strand);
            }
        }
        self
    }
}

/// Whether all rows have the same expression.
fn is_one(strand: &RowStrand) -> bool {
    strand.iter().all(|id| *id == strand[0])
}

/// Whether it is a number, or one for each passage, which rounds look up if they differ in it.
fn is_listed(graph: &ExprGraph, node: Node) -> bool {
    match node {
        Node::Constant(_) => true,
        Node::Curve(_, at) => graph.node(at) == Node::Symbol(Symbol::Counter),
        _ => false,
    }
}

/// Groups of rows that may form rounds: the families of each equation, and then, numbered after these, the rows of each
/// array with several indices.
pub(super) fn of_one_kind(dae: &Dae) -> Vec<Vec<usize>> {
    let mut kinds: BTreeMap<(Option<Span>, &str, u32), Vec<usize>> = BTreeMap::new();
    for (position, family) in dae.families.iter().enumerate() {
        kinds.entry((Some(family.span), "", family.count)).or_default().push(position);
    }
    for (position, array) in (dae.families.len()..).zip(&dae.arrays) {
        if let Some((name, _)) = array.name.split_once('[') {
            kinds.entry((None, name, array.count)).or_default().push(position);
        }
    }
    kinds.into_values().filter(|rows| rows.len() >= FEWEST).collect()
}

/// Runs of consecutive rows with the same step from each to the next.
fn runs<T: PartialEq>(rows: &[usize], step: impl Fn(usize, usize) -> Option<T>) -> Vec<Vec<usize>> {
    let steps: Vec<Option<T>> = rows.windows(2).map(|pair| step(pair[0], pair[1])).collect();
    let mut runs = Vec::new();
    let mut begin = 0;
    while begin + FEWEST <= rows.len() {
        let first = &steps[begin];
        let goes_on = |step: &&Option<T>| step.is_some() && *step == first;
        let end = begin + 1 + steps[begin..].iter().take_while(goes_on).count();
        if end - begin < FEWEST {
            begin += 1;
        } else {
            runs.push(rows[begin..end].to_vec());
            begin = end;
        }
    }
    runs
}

/// A step of a parallel traversal of two rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TraversalStep {
    /// Both are numbers, equal or different, one or one for each passage.
    Listed(bool),
    /// The pair of operations was met before: its number.
    Met(usize),
    /// Distance from the first position to the second; zero if equal and without a position.
    By(i64),
}

impl SystemExpressions<'_> {
    /// The operands of expressions of one form; none for numbers listed in rounds.
    pub(super) fn operands(&self, strand: &RowStrand) -> impl Iterator<Item = RowStrand> + use<> {
        let node = self.node(strand[0]);
        let is_listed = is_listed(self.graph, node) && !is_one(strand);
        let n = if is_listed { 0 } else { node.operands().count() };
        let operands: Vec<Vec<ExprId>> =
            strand.iter().map(|id| self.node(*id).operands().collect()).collect();
        (0..n).map(move |k| operands.iter().map(|of_row| of_row[k]).collect())
    }

    /// The steps from one row to the next; `None` if their forms differ.
    fn steps(&self, row: &[PlacedNumber], next: &[PlacedNumber]) -> Option<Vec<TraversalStep>> {
        if row.len() != next.len() {
            return None;
        }
        let mut steps = Vec::new();
        let mut met: HashMap<(ExprId, ExprId), usize> = HashMap::default();
        for ((result, number), (result_of_next, of_next)) in row.iter().zip(next) {
            if result != result_of_next || number.rows != of_next.rows {
                return None;
            }
            let [from, to] = [number.place, of_next.place].map(i64::try_from);
            steps.push(TraversalStep::By(to.ok()? - from.ok()?));
            let mut pending = vec![(number.value, of_next.value)];
            while let Some((a, b)) = pending.pop() {
                let [node, of_next] = [a, b].map(|id| self.node(id));
                let listed = [node, of_next].map(|node| is_listed(self.graph, node));
                if let (Node::Symbol(_), Node::Symbol(_)) = (node, of_next) {
                    steps.push(TraversalStep::By(i64::from(self.moved(node, of_next)?.by_round)));
                } else if listed[0] || listed[1] {
                    let of_passages = [node, of_next].map(|node| matches!(node, Node::Curve(..)));
                    if listed[0] != listed[1] || of_passages[0] != of_passages[1] {
                        return None;
                    }
                    steps.push(TraversalStep::Listed(of_passages[0]));
                } else if node.map(|_| a) != of_next.map(|_| a) {
                    return None;
                } else if let Some(k) = met.get(&(a, b)) {
                    steps.push(TraversalStep::Met(*k));
                } else {
                    met.insert((a, b), met.len());
                    pending.extend(node.operands().zip(of_next.operands()));
                }
            }
        }
        Some(steps)
    }

    /// The position that two symbols read, and its increment from one to the other; `None` if they read different
    /// arrays, or differ and have no position.
    fn moved(&self, symbol: Node, of_next: Node) -> Option<StridedPosition> {
        let (first, next) = match (self.load(symbol), self.load(of_next)) {
            (ProgramOperation::Load(a, i), ProgramOperation::Load(b, j)) if a == b => (i, j),
            (ProgramOperation::LoadSwept(a, i), ProgramOperation::LoadSwept(b, j)) if a == b => {
                (i.first, j.first)
            }
            (a, b) if a == b => (0, 0),
            _ => return None,
        };
        let by_round = i32::try_from(i64::from(next) - i64::from(first)).ok()?;
        Some(StridedPosition { first, by_round })
    }

    /// The operation of a symbol in rounds.
    pub(super) fn load_in_rounds(&self, strand: &RowStrand) -> ProgramOperation {
        let [symbol, of_next] = [0, 1].map(|k| self.node(strand[k]));
        match (self.load(symbol), self.moved(symbol, of_next)) {
            (ProgramOperation::Load(argument, _), Some(place)) => {
                ProgramOperation::LoadRound(argument, place)
            }
            (ProgramOperation::LoadSwept(argument, _), Some(place)) => {
                ProgramOperation::LoadSwept(argument, place)
            }
            (operation, _) => operation,
        }
    }

    /// The numbers in which rounds differ, one for each round or passage, as a curve over all; `None` if a strand is
    /// not a number.
    fn listed(&self, strand: &RowStrand, count: u32) -> Option<CurveId> {
        let node = self.node(strand[0]);
        if is_one(strand) || !is_listed(self.graph, node) {
            return None;
        }
        let numbers = strand.iter().flat_map(|id| match self.node(*id) {
            Node::Curve(curve, _) => (0..count).map(|k| curve.value(f64::from(k))).collect(),
            Node::Constant(bits) => vec![f64::from_bits(bits)],
            _ => unreachable!("rounds are of one form"),
        });
        let numbers: Vec<f64> = numbers.collect();
        let name = if let Node::Curve(curve, _) = node { &curve.get().name } else { "numbers" };
        Some(CurveId::of_numbers(name, &numbers, None))
    }
}
