//! Symbols that find their place late: slopes of inputs, and discrete numbers behind all automata.

use std::collections::HashMap;

use super::delays::Resolved;
use super::explicit::Explicit;
use super::state_selection::Selections;
use super::transfer::Transferred;
use super::{Delay, DelayedInput};
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
            | Symbol::Discrete(_) => None,
        };
        value.copied().unwrap_or(f64::NAN)
    }
}

/// Gives slopes of inputs and conditions on time their places, now that all automata and all
/// differentiated inputs are known.
///
/// The slope of an input is what a delayed input brings along: one that is zero late.
pub(super) fn settle(
    model: &Model,
    graph: &mut Graph,
    systems: &mut [Explicit],
    transferred: &mut Transferred<'_>,
    delays: &mut Resolved,
    selections: &Selections,
) {
    let roots: Vec<ExprId> =
        expressions(systems, transferred).map(|expression| *expression).collect();
    let symbols: Vec<(ExprId, Symbol)> = graph
        .listed(roots.iter().copied())
        .into_iter()
        .filter_map(|(id, node)| match node {
            Node::Symbol(symbol) => Some((id, symbol)),
            _ => None,
        })
        .collect();
    for &(_, symbol) in &symbols {
        if let Symbol::InputSlope(i) = symbol
            && (i as usize) < model.inputs.len()
        {
            let delay = without_delay(graph, delays);
            let wanted = DelayedInput { input: i as usize, delay };
            if !delays.inputs.contains(&wanted) {
                delays.inputs.push(wanted);
            }
        }
    }
    let mut replacement = HashMap::new();
    let behind = selections.sizes().count();
    for (id, symbol) in symbols {
        let place = match symbol {
            Symbol::InputSlope(i) => Symbol::Input(slope(model, delays, i)),
            Symbol::Discrete(k) if behind > 0 => {
                Symbol::Discrete(k + u32::try_from(behind).unwrap_or(u32::MAX))
            }
            _ => continue,
        };
        replacement.insert(id, graph.symbol(place));
    }
    if replacement.is_empty() {
        return;
    }
    let names: Vec<ExprId> = transferred.names.keys().copied().collect();
    let replaced = graph.replace(roots.into_iter().chain(names), &replacement);
    for expression in expressions(systems, transferred) {
        *expression = replaced[expression];
    }
    let names = std::mem::take(&mut transferred.names);
    transferred.names = names.into_iter().map(|(id, name)| (replaced[&id], name)).collect();
}

fn expressions<'a>(
    systems: &'a mut [Explicit],
    transferred: &'a mut Transferred<'_>,
) -> impl Iterator<Item = &'a mut ExprId> {
    systems.iter_mut().flat_map(Explicit::expressions).chain(transferred.expressions())
}

/// The delay of zero.
fn without_delay(graph: &mut Graph, delays: &mut Resolved) -> usize {
    let zero = graph.constant(0.0);
    let known = delays.delays.iter().position(|delay| delay.tau == zero);
    known.unwrap_or_else(|| {
        delays.delays.push(Delay { tau: zero, text: "0".to_owned() });
        delays.delays.len() - 1
    })
}

/// The place of the slope of an input, declared or delayed, among the inputs that equations read.
fn slope(model: &Model, delays: &Resolved, i: u32) -> u32 {
    let declared = model.inputs.len();
    let position = (i as usize).checked_sub(declared).or_else(|| {
        let is_it = |delayed: &DelayedInput| {
            delayed.input == i as usize && delays.delays[delayed.delay].text == "0"
        };
        delays.inputs.iter().position(is_it)
    });
    let Some(position) = position else { unreachable!("differentiated inputs have been added") };
    u32::try_from(declared + delays.inputs.len() + position).unwrap_or(u32::MAX)
}
