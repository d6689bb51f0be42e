//! The rate of an expression along a solution: ė = ∂e/∂t + ∂e/∂y f + ∂e/∂u u̇.
//!
//! Inputs are smooth between samples: held ones are constant there, and the slope of a linear one is constant.
//! Functions of a system read such a slope as that of a delayed input, with a delay of zero if the input is not
//! delayed.

use std::collections::BTreeMap;

use super::{Dae, DaeFamily, DaeUnknown, Delay, DelayedInput};
use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::{Interpolation, Model};

/// Varying quantities other than unknowns and time.
#[derive(Clone, Copy)]
pub(super) struct VaryingQuantities<'a> {
    pub(super) model: &'a Model,
    pub(super) delayed: &'a [DelayedInput],
}

impl VaryingQuantities<'_> {
    /// Whether an input, declared or delayed, changes between samples.
    fn is_linear(self, i: u32) -> bool {
        let declared = self.model.inputs.len();
        let input = match (i as usize).checked_sub(declared) {
            None => i as usize,
            Some(position) => match self.delayed.get(position) {
                Some(delayed) => delayed.input,
                // The slope of a delayed input is constant.
                None => return false,
            },
        };
        self.model.inputs[input].interpolation == Interpolation::Linear
    }

    /// ė; `None` if e reads an unknown that has no derivative in some mode, or a delayed value.
    pub(super) fn rate(
        self,
        graph: &mut ExprGraph,
        e: ExprId,
        rows: RowLayout<'_>,
    ) -> Option<ExprId> {
        let mut rate = graph.constant(0.0);
        for (symbol, slope) in self.terms(graph, e, rows)? {
            let term = match symbol {
                Symbol::Unknown(i) => graph.multiply(slope, rows.unknowns[i as usize].rhs),
                Symbol::Element(i) => {
                    let (_, family) = family_of(rows.families, i)?;
                    let passage = i - u32::try_from(family.first).unwrap_or(u32::MAX);
                    let rhs = at_passage(graph, family.rhs, passage);
                    graph.multiply(slope, rhs)
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

    /// The varying quantities in e, each with the slope of e; `None` unless all have a derivative.
    pub(super) fn terms(
        self,
        graph: &mut ExprGraph,
        e: ExprId,
        RowLayout { unknowns, families }: RowLayout<'_>,
    ) -> Option<Vec<(Symbol, ExprId)>> {
        let symbols = graph.symbols(e);
        if symbols.iter().any(|symbol| matches!(symbol, Symbol::DelayedUnknown(_))) {
            return None;
        }
        let varies: Vec<Symbol> = symbols
            .into_iter()
            .filter(|symbol| match symbol {
                Symbol::Time | Symbol::Unknown(_) | Symbol::Element(_) => true,
                Symbol::Input(i) => self.is_linear(*i),
                _ => false,
            })
            .collect();
        let position = |symbol| varies.iter().position(|other| *other == symbol);
        let slopes = graph.gradient(e, position);
        let has_derivative = |symbol: Symbol| match symbol {
            Symbol::Unknown(i) => graph.value(unknowns[i as usize].mass) == Some(1.0),
            Symbol::Element(i) => family_of(families, i).is_some_and(|(_, f)| f.differential),
            _ => true,
        };
        slopes
            .into_iter()
            .map(|(k, slope)| has_derivative(varies[k]).then_some((varies[k], slope)))
            .collect()
    }
}

/// The rows of single unknowns, then those of elements, numbered through all arrays.
#[derive(Clone, Copy)]
pub(super) struct RowLayout<'a> {
    pub(super) unknowns: &'a [DaeUnknown],
    pub(super) families: &'a [DaeFamily],
}

/// The family that determines an element, with its position.
pub(super) fn family_of(families: &[DaeFamily], element: u32) -> Option<(usize, &DaeFamily)> {
    let element = element as usize;
    let after = families.partition_point(|family| family.first <= element);
    let (position, family) = families.iter().enumerate().nth(after.checked_sub(1)?)?;
    (element < family.first + family.count as usize).then_some((position, family))
}

/// The expression of one passage; elements are numbered among those of all arrays.
pub(super) fn at_passage(graph: &mut ExprGraph, id: ExprId, passage: u32) -> ExprId {
    let mut replaced = BTreeMap::new();
    for symbol in graph.symbols(id) {
        let now = match symbol {
            Symbol::Swept(i) => graph.symbol(Symbol::Element(i + passage)),
            Symbol::SweptParameter(i, _) => graph.symbol(Symbol::Parameter(i + passage)),
            Symbol::SweptInput(i, _) => graph.symbol(Symbol::Input(i + passage)),
            Symbol::Counter => graph.constant(f64::from(passage)),
            _ => continue,
        };
        replaced.insert(symbol, now);
    }
    graph.substitute(id, |symbol| replaced.get(&symbol).copied())
}

/// Replaces slopes by inputs: after this no expression of the system contains a slope.
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
    let mut delayed: BTreeMap<u32, usize> = BTreeMap::new();
    for i in wanted {
        let position = (i as usize).checked_sub(declared).unwrap_or_else(|| {
            let delay = zero_delay(dae);
            dae.delayed_inputs.push(DelayedInput { input: i as usize, delay });
            dae.delayed_inputs.len() - 1
        });
        delayed.insert(i, position);
    }
    let first = declared + dae.delayed_inputs.len();
    let mut replaced = BTreeMap::new();
    for (i, position) in delayed {
        let input = u32::try_from(first + position).unwrap_or(u32::MAX);
        replaced.insert(Symbol::InputSlope(i), dae.graph.symbol(Symbol::Input(input)));
    }
    replace(dae, |symbol| replaced.get(&symbol).copied());
}

/// The position of a delay of zero.
fn zero_delay(dae: &mut Dae) -> usize {
    let zero = dae.graph.constant(0.0);
    dae.delays.iter().position(|delay| delay.tau == zero).unwrap_or_else(|| {
        dae.delays.push(Delay { tau: zero, text: "0".to_owned() });
        dae.delays.len() - 1
    })
}

/// All expressions that vary along a solution.
fn expressions(dae: &mut Dae) -> Vec<ExprId> {
    let mut expressions = Vec::new();
    dae.each_expression(&mut |_, id| expressions.push(*id));
    expressions
}

/// Replaces symbols in all expressions that vary along a solution.
fn replace(dae: &mut Dae, replacement: impl Fn(Symbol) -> Option<ExprId>) {
    dae.each_expression(&mut |graph, id| *id = graph.substitute(*id, &replacement));
    let names = std::mem::take(&mut dae.names);
    for (id, name) in names {
        let id = dae.graph.substitute(id, &replacement);
        dae.names.insert(id, name);
    }
}
