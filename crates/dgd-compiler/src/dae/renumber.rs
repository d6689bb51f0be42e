//! Moves conditions on time after the automata that choose states.

use super::TimeCondition;
use super::families::FamilyPlan;
use super::index::{ExplicitSystem, StateSelections};
use super::transfer::TransferredModel;
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// Moves conditions on time after the automata that choose states, once these are known.
pub(super) fn renumber(
    graph: &mut ExprGraph,
    systems: &mut [ExplicitSystem],
    transferred: &mut TransferredModel<'_>,
    plan: &mut FamilyPlan,
    conditions: &mut [TimeCondition],
    selections: &StateSelections,
) {
    let behind = u32::try_from(selections.sizes().count()).unwrap_or(u32::MAX);
    if behind == 0 {
        return;
    }
    let roots: Vec<ExprId> =
        expressions(systems, transferred, plan, conditions).map(|expression| *expression).collect();
    let mut replacement = HashMap::default();
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
    for expression in expressions(systems, transferred, plan, conditions) {
        *expression = replaced[expression];
    }
    let names = std::mem::take(&mut transferred.names);
    transferred.names = names.into_iter().map(|(id, name)| (replaced[&id], name)).collect();
}

fn expressions<'a>(
    systems: &'a mut [ExplicitSystem],
    transferred: &'a mut TransferredModel<'_>,
    plan: &'a mut FamilyPlan,
    conditions: &'a mut [TimeCondition],
) -> impl Iterator<Item = &'a mut ExprId> {
    systems
        .iter_mut()
        .flat_map(ExplicitSystem::expressions)
        .chain(transferred.expressions())
        .chain(plan.expressions())
        .chain(
            conditions.iter_mut().flat_map(|condition| [&mut condition.at, &mut condition.after]),
        )
}
