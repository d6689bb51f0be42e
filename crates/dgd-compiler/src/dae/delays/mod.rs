//! Pushes delays down to names: delayed outputs, inputs and unknowns.
//!
//! A delayed expression is the same expression of its delayed variables: delay(f(x, u, p), τ) = f(delay(x, τ), delay(u,
//! τ), p), delay(time, τ) = time − τ, and delay(delay(x, a), b) = delay(x, a + b). Once only names are delayed,
//!
//! - an output whose variables are all delayed by τ is read at t − τ as a whole,
//! - any other delayed input becomes an input of its own, after the declared ones,
//! - any other delayed unknown becomes a symbol of its own.
//!
//! A delay that may jump by itself is an unknown of its own first ([`lags`]).

mod lags;
mod resolver;

use std::collections::BTreeMap;

pub(super) use self::lags::with_lags;
use self::resolver::DelayResolver;
use crate::dae::start_equations;
use crate::dae::transfer::{TransferredEquation, TransferredModel};
use crate::dae::{DaeDelayedUnknown, Delay, DelayedInput};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node};
use crate::model::{DeclarationHeader, Model};
use crate::source::Span;

/// The delays of a model after resolution.
#[derive(Debug, Default)]
pub(super) struct ResolvedDelays {
    pub(super) delays: Vec<Delay>,
    pub(super) varying: Vec<Delay>,
    pub(super) inputs: Vec<DelayedInput>,
    pub(super) unknowns: Vec<DaeDelayedUnknown>,
    /// For each output, the delay by which it is read as a whole.
    pub(super) of_outputs: Vec<Option<usize>>,
}

/// Replaces delays in all transferred expressions.
///
/// After this no expression holds a delay or a delayed value: delayed inputs are inputs, and delayed unknowns symbols
/// of their own.
pub(super) fn resolve(
    model: &Model,
    graph: &mut ExprGraph,
    transferred: &mut TransferredModel<'_>,
    diagnostics: &mut Diagnostics,
) -> Result<ResolvedDelays, ErrorReported> {
    let roots = roots(transferred);
    let nodes = graph.listed(roots);
    if !nodes.iter().any(|(_, node)| matches!(node, Node::Delay(..))) {
        let of_outputs = vec![None; transferred.outputs.len()];
        return Ok(ResolvedDelays { of_outputs, ..ResolvedDelays::default() });
    }
    let mut resolver = DelayResolver::new(model, std::mem::take(&mut transferred.lags));
    let Some(at_names) = resolver.push_down(graph, &nodes) else {
        return Err(too_many(model, diagnostics));
    };
    let mut replacing = DelayReplacement { model, graph, resolver, at_names, diagnostics };
    replacing.equations(&mut transferred.equations);
    replacing.transitions(&mut transferred.transitions);
    let starts = transferred.starts.iter_mut();
    let histories = transferred.histories.iter_mut().flatten();
    for value in starts.chain(histories).chain(&mut transferred.bounds) {
        replacing.known_beforehand(value);
    }
    let of_outputs = replacing.outputs(&mut transferred.outputs);
    replacing.start_equations(&mut transferred.start_equations);
    replacing.diagnostics.check()?;
    transferred.names = replacing.names(&transferred.names);
    let DelayResolver { delays, varying, inputs, unknowns, .. } = replacing.resolver;
    Ok(ResolvedDelays { delays, varying, inputs, unknowns, of_outputs })
}

/// All expressions, including those of names.
fn roots(transferred: &TransferredModel<'_>) -> Vec<ExprId> {
    let TransferredModel {
        equations,
        starts,
        histories,
        outputs,
        start_equations,
        transitions,
        bounds,
        names,
        ..
    } = transferred;
    let of_transitions = transitions.iter().flatten();
    let of_transitions =
        of_transitions.flat_map(|(event, resets)| [event].into_iter().chain(resets));
    let rests = equations.iter().map(|equation| &equation.rest);
    rests
        .chain(starts)
        .chain(histories.iter().flatten())
        .chain(outputs)
        .chain(start_equations)
        .chain(bounds)
        .chain(of_transitions)
        .chain(names.keys())
        .copied()
        .collect()
}

fn too_many(model: &Model, diagnostics: &mut Diagnostics) -> ErrorReported {
    let span = model.outputs.first().map(|output| output.declared.span);
    let span = span.or(model.equations.first().map(|e| e.span)).unwrap_or_default();
    let message = "delays of delays open too many expressions";
    diagnostics.error(
        Diagnostic::new(Code::ModelTooLarge, span, message)
            .help("delay each part once, by the sum of its delays"),
    )
}

/// State of the replacement of delays.
struct DelayReplacement<'a> {
    model: &'a Model,
    graph: &'a mut ExprGraph,
    resolver: DelayResolver<'a>,
    /// The expressions with their delays pushed down to names.
    at_names: HashMap<ExprId, ExprId>,
    diagnostics: &'a mut Diagnostics,
}

impl DelayReplacement<'_> {
    fn equations(&mut self, equations: &mut [TransferredEquation<'_>]) {
        for equation in equations {
            let reader = format!("equation `{}`", equation.label);
            self.acting(&mut equation.rest, &reader, equation.span);
            equation.by_delays = self.resolver.unknowns_in_delays(self.graph, equation.rest);
        }
    }

    /// Event functions and the values of resets, by automata and transitions.
    fn transitions(&mut self, values: &mut [Vec<(ExprId, Vec<ExprId>)>]) {
        for (automaton, values) in self.model.automata.iter().zip(values) {
            let reader = automaton.reader();
            for (transition, (event, resets)) in automaton.transitions.iter().zip(values) {
                self.acting(event, &reader, transition.span);
                for (value, reset) in resets.iter_mut().zip(&transition.resets) {
                    self.acting(value, &reader, reset.span);
                }
            }
        }
    }

    /// An expression of the dynamics, which must not read delayed derivatives. `reader` names it in messages.
    fn acting(&mut self, value: &mut ExprId, reader: &str, span: Span) {
        match self.resolver.instantaneous(self.graph, self.at_names[value]) {
            Ok(now) => *value = now,
            Err(symbol) => {
                self.diagnostics.error(self.resolver.delayed_rate(symbol, reader, span));
            }
        }
        self.resolver.refuse_the_future(span, self.diagnostics);
    }

    /// Start values, histories and bounds.
    fn known_beforehand(&mut self, value: &mut ExprId) {
        let now = self.resolver.instantaneous(self.graph, self.at_names[value]);
        *value = now.unwrap_or_else(|_| unreachable!("what is known beforehand reads no unknowns"));
    }

    /// Refuses start equations that read a delayed unknown: there is no history to solve for before the start.
    fn start_equations(&mut self, values: &mut [ExprId]) {
        for (value, equation) in values.iter_mut().zip(&self.model.start_equations) {
            match self.resolver.instantaneous(self.graph, self.at_names[value]) {
                Ok(now) => *value = now,
                Err(_) => {
                    self.diagnostics.error(start_equations::reads_delayed(equation));
                }
            }
        }
    }

    /// The delays by which outputs are read as wholes.
    fn outputs(&mut self, values: &mut [ExprId]) -> Vec<Option<usize>> {
        let outputs = values.iter_mut().zip(&self.model.outputs);
        outputs.map(|(value, output)| self.output(value, &output.declared)).collect()
    }

    fn output(&mut self, value: &mut ExprId, declared: &DeclarationHeader) -> Option<usize> {
        let DelayReplacement { graph, resolver, at_names, diagnostics, .. } = self;
        let at_once = resolver.output(graph, at_names[value]);
        // A quantity read at several times is read now, and the run stores its past.
        let read = at_once.or_else(|read| {
            let now = resolver.instantaneous(graph, at_names[value]);
            now.map(|now| (now, None)).map_err(|_| read)
        });
        let mut delay = None;
        match read {
            Ok((read, delayed)) => (*value, delay) = (read, delayed),
            Err([a, b]) => {
                let (a, b) = (resolver.name(a), resolver.name(b));
                let read = if a == b { a } else { format!("{a} and {b}") };
                let message = format!("output `{}` reads {read} at different times", declared.name);
                diagnostics.error(
                    Diagnostic::new(Code::DerivativesAtSeveralTimes, declared.span, message)
                        .help("declare an `unknown` that equals the derivative, and delay that"),
                );
            }
        }
        resolver.refuse_the_future(declared.span, diagnostics);
        delay
    }

    /// The names of those expressions whose delayed values have all been resolved before.
    fn names(&mut self, names: &BTreeMap<ExprId, String>) -> BTreeMap<ExprId, String> {
        let mut kept = BTreeMap::new();
        for (id, name) in names {
            if let Some(id) = self.resolver.known(self.graph, self.at_names[id])
                && self.graph.node(id).operands().next().is_some()
            {
                kept.insert(id, name.clone());
            }
        }
        kept
    }
}
