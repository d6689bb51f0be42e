//! Readers of derivatives that do not determine them: outputs, start equations, event functions and resets.

use super::delays::ResolvedDelays;
use super::{AutomatonKind, DaeAutomaton, DaeOutput, DaeStartEquation, DaeTransition, Trigger};
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::{self, Model};
use crate::source::Span;

/// Replaces derivatives by the rows' right-hand sides.
pub(super) struct DerivativeReader<'a> {
    pub(super) model: &'a Model,
    /// ẏ of each unknown whose derivative is given in all modes.
    pub(super) rates: Vec<Option<ExprId>>,
    pub(super) graph: &'a mut ExprGraph,
    pub(super) diagnostics: &'a mut Diagnostics,
}

impl DerivativeReader<'_> {
    /// The model's outputs, `values` without derivatives.
    pub(super) fn outputs(
        &mut self,
        values: Vec<ExprId>,
        delays: &ResolvedDelays,
    ) -> Vec<DaeOutput> {
        let mut outputs = Vec::with_capacity(values.len());
        let delayed = values.into_iter().zip(&delays.of_outputs);
        for (output, (value, delay)) in self.model.outputs.iter().zip(delayed) {
            let declared = output.declared.clone();
            let what = || format!("output `{}`", declared.name);
            let value = self.open(value, declared.span, &what);
            outputs.push(DaeOutput { declared, value, noise: output.noise, delay: *delay });
        }
        outputs
    }

    /// The model's start equations without derivatives; the states that they determine are found later.
    pub(super) fn start_equations(&mut self, values: Vec<ExprId>) -> Vec<DaeStartEquation> {
        let mut equations = Vec::with_capacity(values.len());
        for (equation, rest) in self.model.start_equations.iter().zip(values) {
            let (name, span) = (equation.label.clone(), equation.span);
            let rest = self.open(rest, span, &|| format!("start equation `{name}`"));
            equations.push(DaeStartEquation { name, span, rest, unknown: 0 });
        }
        equations
    }

    /// The model's automata, event functions and resets without derivatives.
    pub(super) fn automata(
        &mut self,
        values: Vec<Vec<(ExprId, Vec<ExprId>)>>,
    ) -> Vec<DaeAutomaton> {
        let automata = self.model.automata.iter().zip(values);
        automata.map(|(automaton, values)| self.automaton(automaton, values)).collect()
    }

    /// The expression without derivatives; `what` names its reader.
    fn open(&mut self, value: ExprId, span: Span, what: &dyn Fn() -> String) -> ExprId {
        let rates = &self.rates;
        let opened = self.graph.substitute(value, |symbol| match symbol {
            Symbol::Derivative(i) => rates[i as usize],
            _ => None,
        });
        let symbols = self.graph.symbols(opened);
        let left = symbols.into_iter().find(|symbol| matches!(symbol, Symbol::Derivative(_)));
        if let Some(Symbol::Derivative(i)) = left {
            let unknown = &self.model.unknowns[i as usize].declared;
            let scope =
                if self.model.automata.is_empty() { "variant" } else { "variant or a mode" };
            let message =
                format!("{} reads der({}), which no equation gives", what(), unknown.name);
            self.diagnostics.error(
                Diagnostic::new(Code::UndeterminedDerivative, span, message)
                    .label(unknown.span, format!("algebraic in this {scope}")),
            );
        }
        opened
    }

    fn automaton(
        &mut self,
        automaton: &model::Automaton,
        values: Vec<(ExprId, Vec<ExprId>)>,
    ) -> DaeAutomaton {
        let transitions = automaton.transitions.iter().zip(values).map(|(transition, values)| {
            let (event, resets) = values;
            let what = || automaton.reader();
            let event = self.open(event, transition.span, &what);
            let resets = transition
                .resets
                .iter()
                .zip(resets)
                .map(|(reset, value)| (reset.unknown, self.open(value, reset.span, &what)));
            DaeTransition {
                from: transition.from.unwrap_or(automaton.modes.len()),
                to: transition.to,
                crossing: transition.crossing,
                trigger: match (automaton.origin, transition.from) {
                    (model::AutomatonOrigin::Every, _) => Trigger::Clock,
                    (_, Some(_)) => Trigger::Edge,
                    (_, None) => Trigger::Start,
                },
                event,
                resets: resets.collect(),
            }
        });
        let transitions = transitions.collect();
        let kind = match automaton.origin {
            model::AutomatonOrigin::Modes => AutomatonKind::Modes,
            model::AutomatonOrigin::When => AutomatonKind::When,
            model::AutomatonOrigin::Every => AutomatonKind::Every,
        };
        DaeAutomaton {
            kind,
            name: automaton.name.clone(),
            modes: automaton.modes.iter().map(|mode| mode.name.clone()).collect(),
            start: automaton.start,
            transitions,
        }
    }
}
