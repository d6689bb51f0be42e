//! How fast an expression changes along a solution: ė = ∂e/∂t + ∂e/∂y f + ∂e/∂u u̇.
//!
//! Inputs are smooth between samples: those that hold do not change there, and the slope of a linear
//! one is constant. Functions of a system read such a slope as that of an input that arrives late,
//! by zero where the input itself does not.

use std::collections::BTreeMap;

use super::{Dae, Delay, DelayedInput, Unknown};
use crate::expr::{ExprId, Graph, Symbol};
use crate::model::{Interpolation, Model};

/// What varies besides unknowns and time.
#[derive(Clone, Copy)]
pub(super) struct Varying<'a> {
    pub(super) model: &'a Model,
    pub(super) delayed: &'a [DelayedInput],
}

impl Varying<'_> {
    /// Whether an input, declared or delayed, changes between samples.
    fn is_linear(self, i: u32) -> bool {
        let declared = self.model.inputs.len();
        let of = match (i as usize).checked_sub(declared) {
            None => i as usize,
            Some(late) => match self.delayed.get(late) {
                Some(late) => late.input,
                // The slope of a delayed input is constant.
                None => return false,
            },
        };
        self.model.inputs[of].interpolation == Interpolation::Linear
    }

    /// ė; nothing where e reads an unknown that has no derivative in some mode, an element of an
    /// array, or something late.
    pub(super) fn rate(self, graph: &mut Graph, e: ExprId, unknowns: &[Unknown]) -> Option<ExprId> {
        let is_unknown =
            |symbol: &Symbol| matches!(symbol, Symbol::Element(_) | Symbol::DelayedUnknown(_));
        if graph.symbols(e).iter().any(is_unknown) {
            return None;
        }
        let varies: Vec<Symbol> = graph
            .symbols(e)
            .into_iter()
            .filter(|symbol| match symbol {
                Symbol::Time | Symbol::Unknown(_) => true,
                Symbol::Input(i) => self.is_linear(*i),
                _ => false,
            })
            .collect();
        let position = |symbol| varies.iter().position(|other| *other == symbol);
        let mut rate = graph.constant(0.0);
        for (k, slope) in graph.gradient(e, position) {
            let term = match varies[k] {
                Symbol::Unknown(i) => {
                    let unknown = &unknowns[i as usize];
                    if graph.value(unknown.mass) != Some(1.0) {
                        return None;
                    }
                    graph.multiply(slope, unknown.rhs)
                }
                Symbol::Input(i) => {
                    let along = graph.symbol(Symbol::InputSlope(i));
                    graph.multiply(slope, along)
                }
                _ => slope,
            };
            rate = graph.add(rate, term);
        }
        Some(rate)
    }
}

/// Puts inputs in the place of slopes: after this no expression of the system holds a slope.
pub(super) fn take_slopes(dae: &mut Dae) {
    let mut wanted: Vec<u32> = Vec::new();
    for root in expressions(dae) {
        for symbol in dae.graph.symbols(root) {
            if let Symbol::InputSlope(i) = symbol
                && !wanted.contains(&i)
            {
                wanted.push(i);
            }
        }
    }
    if wanted.is_empty() {
        return;
    }
    wanted.sort_unstable();
    let declared = dae.inputs.len();
    let mut late: BTreeMap<u32, usize> = BTreeMap::new();
    for i in wanted {
        let position = (i as usize).checked_sub(declared).unwrap_or_else(|| {
            let delay = zero_delay(dae);
            dae.delayed_inputs.push(DelayedInput { input: i as usize, delay });
            dae.delayed_inputs.len() - 1
        });
        late.insert(i, position);
    }
    let first = declared + dae.delayed_inputs.len();
    let mut replaced = BTreeMap::new();
    for (i, position) in late {
        let input = u32::try_from(first + position).unwrap_or(u32::MAX);
        replaced.insert(Symbol::InputSlope(i), dae.graph.symbol(Symbol::Input(input)));
    }
    replace(dae, |symbol| replaced.get(&symbol).copied());
}

/// The position of the delay that is none.
fn zero_delay(dae: &mut Dae) -> usize {
    let zero = dae.graph.constant(0.0);
    dae.delays.iter().position(|delay| delay.tau == zero).unwrap_or_else(|| {
        dae.delays.push(Delay { tau: zero, text: "0".to_owned() });
        dae.delays.len() - 1
    })
}

/// All expressions that change along a solution.
fn expressions(dae: &mut Dae) -> Vec<ExprId> {
    let mut all = Vec::new();
    dae.each_expression(&mut |_, id| all.push(*id));
    all
}

/// Replaces symbols in everything that changes along a solution.
fn replace(dae: &mut Dae, replacement: impl Fn(Symbol) -> Option<ExprId>) {
    dae.each_expression(&mut |graph, id| *id = graph.substitute(*id, &replacement));
    let names = std::mem::take(&mut dae.names);
    for (id, name) in names {
        let id = dae.graph.substitute(id, &replacement);
        dae.names.insert(id, name);
    }
}
