//! Symbols that find their place late, and what they stand for beforehand.

use std::collections::HashMap;

use super::explicit::Explicit;
use super::families::Plan;
use super::state_selection::Selections;
use super::transfer::Transferred;
use crate::expr::{ExprId, Graph, Node, Symbol};
use crate::model::Model;

/// Values of symbols as the model declares them, for choices that have to be made beforehand.
pub(super) struct Typical {
    parameters: Vec<f64>,
    starts: Vec<f64>,
}

impl Typical {
    pub(super) fn of(model: &Model, graph: &Graph, starts: &[ExprId]) -> Self {
        let parameters = model.parameters.iter().map(|parameter| parameter.value).collect();
        let mut typical = Typical { parameters, starts: Vec::new() };
        let values = starts.iter().map(|start| graph.evaluate(*start, &|s| typical.value(s)));
        typical.starts = values.collect();
        typical
    }

    /// The value at the start; not a number where it is not known beforehand.
    pub(super) fn value(&self, symbol: Symbol) -> f64 {
        let value = match symbol {
            Symbol::Parameter(i) => self.parameters.get(i as usize),
            Symbol::Unknown(i) => self.starts.get(i as usize),
            Symbol::Time => Some(&0.0),
            Symbol::Constant(_)
            | Symbol::Input(_)
            | Symbol::InputSlope(_)
            | Symbol::Derivative(_)
            | Symbol::Sensitivity(_)
            | Symbol::Late(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Element(_)
            | Symbol::Swept(_)
            | Symbol::ElementRate(_)
            | Symbol::SweptRate(_)
            | Symbol::SweptSensitivity(_)
            | Symbol::Counter
            | Symbol::Past(..)
            | Symbol::Discrete(_) => None,
        };
        value.copied().unwrap_or(f64::NAN)
    }
}

/// Moves conditions on time behind the automata that choose states, now that these are known.
pub(super) fn settle(
    graph: &mut Graph,
    systems: &mut [Explicit],
    transferred: &mut Transferred<'_>,
    plan: &mut Plan,
    selections: &Selections,
) {
    let behind = u32::try_from(selections.sizes().count()).unwrap_or(u32::MAX);
    if behind == 0 {
        return;
    }
    let roots: Vec<ExprId> =
        expressions(systems, transferred, plan).map(|expression| *expression).collect();
    let mut replacement = HashMap::new();
    for (id, node) in graph.listed(roots.iter().copied()) {
        if let Node::Symbol(Symbol::Discrete(k)) = node {
            replacement.insert(id, graph.symbol(Symbol::Discrete(k + behind)));
        }
    }
    if replacement.is_empty() {
        return;
    }
    let names: Vec<ExprId> = transferred.names.keys().copied().collect();
    let replaced = graph.replace(roots.into_iter().chain(names), &replacement);
    for expression in expressions(systems, transferred, plan) {
        *expression = replaced[expression];
    }
    let names = std::mem::take(&mut transferred.names);
    transferred.names = names.into_iter().map(|(id, name)| (replaced[&id], name)).collect();
}

fn expressions<'a>(
    systems: &'a mut [Explicit],
    transferred: &'a mut Transferred<'_>,
    plan: &'a mut Plan,
) -> impl Iterator<Item = &'a mut ExprId> {
    systems
        .iter_mut()
        .flat_map(Explicit::expressions)
        .chain(transferred.expressions())
        .chain(plan.expressions())
}
