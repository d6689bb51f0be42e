//! Functions put into execution order: what is the same for all rows first, then a loop for the
//! families of each length.

use std::collections::BTreeMap;

use dgd_signature::PastLayout;

use super::lower::operation;
use super::{Function, FunctionKind, Loop, Operation, Store, ValueId};
use crate::dae::Dae;
use crate::expr::hash::{HashMap, HashSet};
use crate::expr::{ExprId, Graph, Node, Symbol};

/// A number of a result, or one for each row of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Number {
    pub(super) value: ExprId,
    /// Its place, or that of the first row.
    pub(super) place: usize,
    /// Number of rows; none where it is a single number.
    pub(super) rows: Option<u32>,
}

/// Puts expressions into execution order: operands first, in the order they were built.
pub(super) fn schedule(
    graph: &Graph,
    named: &BTreeMap<ExprId, String>,
    dae: &Dae,
    past: PastLayout,
    kind: FunctionKind,
    results: &[Vec<Number>],
) -> Function {
    let order = graph.reachable(results.iter().flatten().map(|number| number.value));
    let moving = moving(graph, &order);

    let mut values: HashMap<ExprId, ValueId> =
        HashMap::with_capacity_and_hasher(order.len(), <_>::default());
    let mut body = Vec::with_capacity(order.len());
    let mut names = Vec::new();
    for id in order.iter().filter(|id| !moving.contains(id)) {
        let operation = operation(graph.node(*id), dae, past, |operand| values[&operand]);
        let value = append(&mut body, 0, operation);
        values.insert(*id, value);
        if let Some(name) = named.get(id) {
            names.push((value, name.clone()));
        }
    }

    let mut by_count: BTreeMap<u32, Vec<(usize, Number)>> = BTreeMap::new();
    for (result, numbers) in results.iter().enumerate() {
        for number in numbers {
            if let Some(rows) = number.rows {
                by_count.entry(rows).or_default().push((result, *number));
            }
        }
    }
    let loops_of = Loops { graph, dae, past, moving, common: &values, begin: body.len() };
    let loops =
        by_count.into_iter().map(|(count, numbers)| loops_of.looped(count, &numbers)).collect();

    let single = |numbers: &[Number]| -> Vec<Number> {
        numbers.iter().filter(|number| number.rows.is_none()).copied().collect()
    };
    let singles: Vec<Vec<Number>> = results.iter().map(|numbers| single(numbers)).collect();
    let places = |numbers: &Vec<Number>| {
        let is_dense = numbers.iter().enumerate().all(|(i, number)| number.place == i);
        (!is_dense).then(|| numbers.iter().map(|number| number.place).collect())
    };
    let length = |numbers: &Vec<Number>| {
        numbers.iter().map(|number| number.rows.map_or(1, |rows| rows as usize)).sum()
    };
    Function {
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

/// Those expressions that differ from row to row.
fn moving(graph: &Graph, order: &[ExprId]) -> HashSet<ExprId> {
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

/// What loops are made from.
struct Loops<'a> {
    graph: &'a Graph,
    dae: &'a Dae,
    past: PastLayout,
    /// Expressions that differ from row to row.
    moving: HashSet<ExprId>,
    /// Values that are the same for all rows.
    common: &'a HashMap<ExprId, ValueId>,
    /// Number of the first value of a loop.
    begin: usize,
}

impl Loops<'_> {
    /// The loop over all families of one length; each number belongs to the result of this position.
    fn looped(&self, count: u32, numbers: &[(usize, Number)]) -> Loop {
        let Loops { graph, dae, past, ref moving, common, begin } = *self;
        let order = graph.reachable(numbers.iter().map(|(_, number)| number.value));
        let mut body = Vec::new();
        let mut own: HashMap<ExprId, ValueId> = HashMap::default();
        for id in order.into_iter().filter(|id| moving.contains(id)) {
            let value = |operand: ExprId| {
                own.get(&operand).or_else(|| common.get(&operand)).copied().unwrap_or_else(|| {
                    unreachable!("operands come first, and what does not move is in the body")
                })
            };
            let operation = operation(graph.node(id), dae, past, value);
            let value = append(&mut body, begin, operation);
            own.insert(id, value);
        }
        let stores = numbers.iter().map(|(result, number)| Store {
            result: *result,
            first: number.place,
            value: own.get(&number.value).copied().unwrap_or_else(|| common[&number.value]),
        });
        Loop { count, stores: stores.collect(), body }
    }
}

fn append(body: &mut Vec<Operation>, begin: usize, operation: Operation) -> ValueId {
    let value = ValueId(u32::try_from(begin + body.len()).unwrap_or(u32::MAX));
    body.push(operation);
    value
}
