//! A model's expressions in the graph of its `Dae`: constants become numbers, and everything is simplified.

use std::collections::BTreeMap;

use super::hybrid::exact::exact_ticks;
use super::hybrid::time_conditions::{OnTime, time_conditions};
use super::{Clock, TimeCondition};
use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::Model;
use crate::source::Span;

/// An equation l = r, stored as 0 = r − l.
pub(super) struct TransferredEquation<'a> {
    pub(super) label: &'a str,
    pub(super) span: Span,
    /// r − l.
    pub(super) rest: ExprId,
    /// Derivatives that occur in it.
    pub(super) derivatives: Vec<u32>,
    /// Unknowns on which it depends through the delays of its delayed values.
    pub(super) by_delays: Vec<u32>,
}

impl TransferredEquation<'_> {
    /// Unknowns on which it depends, directly or in the form `rewritten`.
    pub(super) fn unknowns(&self, graph: &ExprGraph, rewritten: ExprId) -> Vec<u32> {
        let symbols = graph.symbols(rewritten).into_iter();
        let read = symbols.filter_map(|symbol| match symbol {
            Symbol::Unknown(i) => Some(i),
            _ => None,
        });
        let mut unknowns: Vec<u32> = read.chain(self.by_delays.iter().copied()).collect();
        unknowns.sort_unstable();
        unknowns.dedup();
        unknowns
    }
}

/// A model's expressions in the graph of its `Dae`.
pub(super) struct TransferredModel<'a> {
    /// The equations that always hold, then those of the modes, block by block, then those of loops.
    pub(super) equations: Vec<TransferredEquation<'a>>,
    pub(super) common: usize,
    /// For each block and mode, the range of its equations.
    pub(super) of_modes: Vec<Vec<(usize, usize)>>,
    /// Start values of single unknowns, then of arrays.
    pub(super) starts: Vec<ExprId>,
    /// Histories of unknowns before the start, in terms of time; conditions on time stay as they are.
    pub(super) histories: Vec<Option<ExprId>>,
    pub(super) outputs: Vec<ExprId>,
    /// r − l of the start equations.
    pub(super) start_equations: Vec<ExprId>,
    /// For each block and transition, left − right and the values of its resets.
    pub(super) transitions: Vec<Vec<(ExprId, Vec<ExprId>)>>,
    /// For each block, the first time and the period of an `every`.
    periods: Vec<Option<[ExprId; 2]>>,
    /// For each saturation, its bound.
    pub(super) bounds: Vec<ExprId>,
    pub(super) names: BTreeMap<ExprId, String>,
    /// Delays that are unknowns of their own, and the positions of these.
    pub(super) lags: BTreeMap<ExprId, u32>,
}

impl TransferredModel<'_> {
    /// Positions of the equations that hold in these modes.
    pub(super) fn holding(&self, modes: &[usize]) -> Vec<usize> {
        let of_modes = self.of_modes.iter().zip(modes).map(|(block, mode)| block[*mode]);
        (0..self.common).chain(of_modes.flat_map(|(begin, end)| begin..end)).collect()
    }

    /// Replaces conditions on time and steps driven by time with discrete numbers, from position `first` on; returns
    /// them with the clocks that drive them and periodic events.
    pub(super) fn take_time_conditions(
        &mut self,
        graph: &mut ExprGraph,
        first: usize,
    ) -> (Vec<TimeCondition>, Vec<Clock>) {
        let roots: Vec<ExprId> = self.expressions().map(|expression| *expression).collect();
        let OnTime { mut conditions, mut clocks, replacement } =
            time_conditions(graph, roots.iter().copied(), first);
        if !conditions.is_empty() {
            let roots: Vec<ExprId> = roots.into_iter().chain(self.names.keys().copied()).collect();
            let replaced = graph.replace(roots, &replacement);
            for expression in self.expressions() {
                *expression = replaced[expression];
            }
            let names = std::mem::take(&mut self.names);
            self.names = names.into_iter().map(|(id, name)| (replaced[&id], name)).collect();
        }
        let zero = graph.constant(0.0);
        for (automaton, period) in self.periods.iter().enumerate() {
            let Some(times) = *period else { continue };
            let exact = match times.map(|time| graph.value(time)) {
                [Some(first), Some(period)] => exact_ticks(first, period),
                _ => None,
            };
            let (condition, automaton) = (conditions.len(), Some(automaton));
            let (marks, follows) = (Vec::new().into(), false);
            clocks.push(Clock { condition, automaton, marks, follows, exact });
            conditions.extend(times.map(|at| TimeCondition { at, after: zero }));
        }
        (conditions, clocks)
    }

    /// All expressions except names.
    pub(super) fn expressions(&mut self) -> impl Iterator<Item = &mut ExprId> {
        let transitions = self.transitions.iter_mut().flatten();
        let equations = self.equations.iter_mut().map(|equation| &mut equation.rest);
        equations
            .chain(&mut self.starts)
            .chain(&mut self.outputs)
            .chain(&mut self.start_equations)
            .chain(&mut self.bounds)
            .chain(transitions.flat_map(|(event, resets)| std::iter::once(event).chain(resets)))
    }
}

/// Start values of single unknowns, then those of arrays.
fn starts(model: &Model) -> impl Iterator<Item = ExprId> {
    let arrays = model.arrays.iter().map(|array| array.unknown.start);
    model.unknowns.iter().map(|u| u.start).chain(arrays)
}

/// Histories of single unknowns, then those of arrays.
fn histories(model: &Model) -> impl Iterator<Item = Option<ExprId>> {
    let arrays = model.arrays.iter().map(|array| array.unknown.history);
    model.unknowns.iter().map(|u| u.history).chain(arrays)
}

/// All expressions of a model.
pub(super) fn roots(model: &Model) -> Vec<ExprId> {
    let transitions = || model.automata.iter().flat_map(|automaton| &automaton.transitions);
    model
        .equations_and_loops()
        .flat_map(|e| [e.left, e.right])
        .chain(starts(model))
        .chain(histories(model).flatten())
        .chain(model.outputs.iter().map(|o| o.value))
        .chain(model.start_equations.iter().flat_map(|e| [e.left, e.right]))
        .chain(transitions().flat_map(|t| [t.left, t.right]))
        .chain(transitions().flat_map(|t| t.resets.iter().map(|reset| reset.value)))
        .chain(model.automata.iter().filter_map(|automaton| automaton.period).flatten())
        .chain(model.saturations.iter().map(|saturation| saturation.bound))
        .collect()
}

/// Transfers all expressions into one simplified graph. `lags` are delays that are unknowns of their own.
pub(super) fn transfer<'a>(
    model: &'a Model,
    lags: &[(ExprId, u32)],
    graph: &mut ExprGraph,
) -> TransferredModel<'a> {
    let nodes = model.graph.listed(roots(model));
    let built = graph.rebuild(&nodes, |graph, symbol| match symbol {
        Symbol::Constant(i) => graph.constant(model.constants[i as usize].value),
        other => graph.symbol(other),
    });
    let equations = model
        .equations_and_loops()
        .map(|equation| {
            let rest = graph.subtract(built[&equation.right], built[&equation.left]);
            let derivatives = graph
                .symbols(rest)
                .into_iter()
                .filter_map(|symbol| match symbol {
                    Symbol::Derivative(i) => Some(i),
                    _ => None,
                })
                .collect();
            let (label, span) = (equation.label.as_str(), equation.span);
            TransferredEquation { label, span, rest, derivatives, by_delays: Vec::new() }
        })
        .collect();
    let start_equations = model.start_equations.iter();
    let start_equations =
        start_equations.map(|e| graph.subtract(built[&e.right], built[&e.left])).collect();
    let common = model.equations.len();
    let mut begin = common;
    let mut of_modes = Vec::new();
    for automaton in &model.automata {
        let ranges = automaton.modes.iter().map(|mode| {
            let end = begin + mode.equations.len();
            (std::mem::replace(&mut begin, end), end)
        });
        of_modes.push(ranges.collect());
    }
    let mut transitions = Vec::new();
    for automaton in &model.automata {
        let values = automaton.transitions.iter().map(|transition| {
            let event = graph.subtract(built[&transition.left], built[&transition.right]);
            (event, transition.resets.iter().map(|reset| built[&reset.value]).collect())
        });
        transitions.push(values.collect());
    }
    let names = model
        .lets
        .iter()
        .filter_map(|l| built.get(&l.value).map(|id| (*id, l.name.clone())))
        .filter(|(id, _)| graph.node(*id).operands().next().is_some())
        .collect();
    TransferredModel {
        equations,
        common,
        of_modes,
        starts: starts(model).map(|start| built[&start]).collect(),
        histories: histories(model).map(|history| history.map(|id| built[&id])).collect(),
        outputs: model.outputs.iter().map(|o| built[&o.value]).collect(),
        start_equations,
        transitions,
        periods: model
            .automata
            .iter()
            .map(|a| a.period.map(|times| times.map(|id| built[&id])))
            .collect(),
        bounds: model.saturations.iter().map(|saturation| built[&saturation.bound]).collect(),
        names,
        lags: lags.iter().map(|(tau, unknown)| (built[tau], *unknown)).collect(),
    }
}
