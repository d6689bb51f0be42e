//! Orders functions for execution: first the values common to all rows, then a loop for the families of each length,
//! and one for the families that are rounds of another.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::expressions::{PlacedNumber, ResultNumber, SystemExpressions};
use super::rounds::{FunctionRounds, InRounds, RowStrand};
use super::{FunctionKind, Loop, LoopStore, ProgramFunction, ProgramOperation, ValueId};
use crate::expr::hash::{HashMap, HashSet};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// Puts expressions into execution order: operands first, in the order they were built. Rows of each of `kinds` belong
/// together.
pub(super) fn schedule(
    expressions: SystemExpressions<'_>,
    named: &BTreeMap<ExprId, String>,
    kinds: &[Vec<usize>],
    kind: FunctionKind,
    results: &[Vec<ResultNumber>],
) -> ProgramFunction {
    let graph = expressions.graph;
    let reachable = graph.reachable(results.iter().flatten().map(|number| number.value));
    let moving = moving(graph, &reachable);
    let numbers =
        || results.iter().enumerate().flat_map(|(r, result)| result.iter().map(move |n| (r, *n)));

    let rounds = FunctionRounds::find(&expressions, &moving, kinds, numbers());
    let is_no_round =
        |(_, number): &PlacedNumber| number.family.is_none_or(|f| !rounds.families.contains(&f));
    let order = if rounds.families.is_empty() {
        reachable
    } else {
        let values = numbers().filter(is_no_round).map(|(_, number)| number.value);
        graph.reachable(values.chain(rounds.common()))
    };

    let mut values: HashMap<ExprId, ValueId> =
        HashMap::with_capacity_and_hasher(order.len(), <_>::default());
    let mut body = Vec::with_capacity(order.len());
    let mut names = Vec::new();
    for id in order.iter().filter(|id| !moving.contains(id)) {
        let operation = expressions.operation(graph.node(*id), |operand| values[&operand]);
        let value = append(&mut body, 0, operation);
        values.insert(*id, value);
        if let Some(name) = named.get(id) {
            names.push((value, name.clone()));
        }
    }

    let mut by_count: BTreeMap<u32, Vec<PlacedNumber>> = BTreeMap::new();
    for given in numbers().filter(is_no_round) {
        if let Some(rows) = given.1.rows {
            by_count.entry(rows).or_default().push(given);
        }
    }
    let loops_of = LoopBuilder { expressions, moving: &moving, common: &values, begin: body.len() };
    let looped = by_count.into_iter().map(|(count, numbers)| loops_of.looped(count, &numbers));
    let in_rounds = rounds.loops.iter().map(|rounds| loops_of.in_rounds(rounds));
    let loops = looped.chain(in_rounds).collect();

    let mut singles: Vec<Vec<ResultNumber>> = vec![Vec::new(); results.len()];
    for (result, number) in
        numbers().filter(is_no_round).filter(|(_, number)| number.rows.is_none())
    {
        singles[result].push(number);
    }
    let places = |numbers: &Vec<ResultNumber>| {
        let is_dense = numbers.iter().enumerate().all(|(i, number)| number.place == i);
        (!is_dense).then(|| numbers.iter().map(|number| number.place).collect())
    };
    let length = |numbers: &Vec<ResultNumber>| {
        numbers.iter().map(|number| number.rows.map_or(1, |rows| rows as usize)).sum()
    };
    ProgramFunction {
        kind,
        names,
        places: singles.iter().map(places).collect(),
        lengths: results.iter().map(length).collect(),
        results: singles
            .iter()
            .map(|numbers| numbers.iter().map(|number| values[&number.value]).collect())
            .collect(),
        body,
        loops,
    }
}

/// The expressions that differ from row to row.
fn moving(graph: &ExprGraph, order: &[ExprId]) -> HashSet<ExprId> {
    let mut moving = HashSet::default();
    for &id in order {
        let node = graph.node(id);
        let moves = match node {
            Node::Symbol(symbol) => matches!(
                symbol,
                Symbol::Swept(_)
                    | Symbol::SweptSensitivity(_)
                    | Symbol::SweptParameter(..)
                    | Symbol::SweptInput(..)
                    | Symbol::SweptInputSlope(..)
                    | Symbol::Counter
            ),
            _ => node.operands().any(|operand| moving.contains(&operand)),
        };
        if moves {
            moving.insert(id);
        }
    }
    moving
}

/// Context for building loops.
struct LoopBuilder<'a> {
    expressions: SystemExpressions<'a>,
    /// Expressions that differ from row to row.
    moving: &'a HashSet<ExprId>,
    /// Values common to all rows.
    common: &'a HashMap<ExprId, ValueId>,
    /// Number of the first value of a loop.
    begin: usize,
}

impl LoopBuilder<'_> {
    /// The loop over all families of one length; each number comes with the position of its result.
    fn looped(&self, count: u32, numbers: &[PlacedNumber]) -> Loop {
        let LoopBuilder { expressions, moving, common, begin } = *self;
        let order = expressions.graph.reachable(numbers.iter().map(|(_, number)| number.value));
        let mut body = Vec::new();
        let mut numbered: HashMap<ExprId, ValueId> = HashMap::default();
        for id in order.into_iter().filter(|id| moving.contains(id)) {
            let value = |operand: ExprId| {
                numbered.get(&operand).or_else(|| common.get(&operand)).copied().unwrap_or_else(
                    || unreachable!("operands come first, and what does not move is in the body"),
                )
            };
            let operation = expressions.operation(expressions.node(id), value);
            let value = append(&mut body, begin, operation);
            numbered.insert(id, value);
        }
        let stores = numbers.iter().map(|(result, number)| LoopStore {
            result: *result,
            first: number.place,
            by_round: 0,
            value: numbered.get(&number.value).copied().unwrap_or_else(|| common[&number.value]),
        });
        Loop { rounds: 1, head: Vec::new(), count, stores: stores.collect(), body }
    }

    /// The loop of rows that are rounds.
    fn in_rounds(&self, rounds: &InRounds) -> Loop {
        let LoopBuilder { expressions, common, begin, .. } = *self;
        let mut numbered: HashMap<RowStrand, ValueId> = HashMap::default();
        let mut operations = Vec::with_capacity(rounds.head.len() + rounds.body.len());
        let value_of = |numbered: &HashMap<RowStrand, ValueId>, strand: &RowStrand| {
            numbered.get(strand).or_else(|| common.get(&strand[0])).copied().unwrap_or_else(|| {
                unreachable!("operands come first, and what is the same for all is in the body")
            })
        };
        // `position` selects the number of a round or passage among listed numbers.
        let operation = |numbered: &HashMap<RowStrand, ValueId>, strand: &RowStrand, position| {
            if let Some((curve, position)) = rounds.listed.get(strand).copied().zip(position) {
                return ProgramOperation::Curve(curve, position);
            }
            let node = expressions.node(strand[0]);
            if let Node::Symbol(_) = node {
                return expressions.load_in_rounds(strand);
            }
            let mut operands = expressions.operands(strand);
            let mut next = || {
                let operand = operands.next();
                value_of(
                    numbered,
                    &operand.unwrap_or_else(|| unreachable!("rounds are of one form")),
                )
            };
            expressions.operation(node, |_| next())
        };

        let round = (!rounds.listed.is_empty())
            .then(|| append(&mut operations, begin, ProgramOperation::Round));
        let of_passages = rounds.body.iter().any(|strand| rounds.listed.contains_key(strand));
        let passed = round.filter(|_| of_passages).map(|round| {
            let count = ProgramOperation::Constant(f64::from(rounds.count));
            let count = append(&mut operations, begin, count);
            append(&mut operations, begin, ProgramOperation::Multiply(round, count))
        });
        for strand in &rounds.head {
            let operation = operation(&numbered, strand, round);
            numbered.insert(Rc::clone(strand), append(&mut operations, begin, operation));
        }
        let head = operations.len();
        let position = passed.map(|passed| {
            let counter = append(&mut operations, begin, ProgramOperation::Counter);
            append(&mut operations, begin, ProgramOperation::Add(passed, counter))
        });
        for strand in &rounds.body {
            let operation = operation(&numbered, strand, position);
            numbered.insert(Rc::clone(strand), append(&mut operations, begin, operation));
        }
        let stores = rounds.numbers.iter().map(|((result, number), next, values)| LoopStore {
            result: *result,
            first: number.place,
            by_round: next.cast_signed() - number.place.cast_signed(),
            value: value_of(&numbered, values),
        });
        let stores = stores.collect();
        let body = operations.split_off(head);
        Loop { rounds: rounds.rounds, head: operations, count: rounds.count, body, stores }
    }
}

fn append(body: &mut Vec<ProgramOperation>, begin: usize, operation: ProgramOperation) -> ValueId {
    let value = ValueId(u32::try_from(begin + body.len()).unwrap_or(u32::MAX));
    body.push(operation);
    value
}
