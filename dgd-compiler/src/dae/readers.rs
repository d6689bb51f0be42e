//! What reads derivatives without determining them: outputs, event functions and resets.

use super::{Automaton, AutomatonKind, Transition, Trigger};
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::expr::{ExprId, Graph, Symbol};
use crate::model::{self, Model};
use crate::source::Span;

/// Puts the rows' right-hand sides in the place of derivatives.
pub(super) struct DerivativeReader<'a, F> {
    pub(super) model: &'a Model,
    pub(super) rate: F,
    pub(super) graph: &'a mut Graph,
    pub(super) diagnostics: &'a mut Diagnostics,
}

impl<F: Fn(Symbol) -> Option<ExprId>> DerivativeReader<'_, F> {
    /// The expression without derivatives; `what` reads it.
    pub(super) fn open(&mut self, value: ExprId, span: Span, what: &dyn Fn() -> String) -> ExprId {
        let opened = self.graph.substitute(value, &self.rate);
        let symbols = self.graph.symbols(opened);
        let left = symbols.into_iter().find(|symbol| matches!(symbol, Symbol::Derivative(_)));
        if let Some(Symbol::Derivative(i)) = left {
            let unknown = &self.model.unknowns[i as usize].declared;
            let scope =
                if self.model.automata.is_empty() { "variant" } else { "variant or a mode" };
            let message =
                format!("{} reads der({}), which no equation gives", what(), unknown.name);
            self.diagnostics.error(
                Diagnostic::new(Code::E406, span, message)
                    .label(unknown.span, format!("algebraic in this {scope}")),
            );
        }
        opened
    }
}

pub(super) fn automaton_of<F: Fn(Symbol) -> Option<ExprId>>(
    automaton: &model::Automaton,
    values: Vec<(ExprId, Vec<ExprId>)>,
    reader: &mut DerivativeReader<'_, F>,
) -> Automaton {
    let transitions = automaton.transitions.iter().zip(values).map(|(transition, values)| {
        let (event, resets) = values;
        let what = || automaton.reader();
        let event = reader.open(event, transition.span, &what);
        let resets =
            transition.resets.iter().zip(resets).map(|(reset, value)| {
                (reset.unknown as usize, reader.open(value, reset.span, &what))
            });
        Transition {
            from: transition.from.unwrap_or(automaton.modes.len()),
            to: transition.to,
            crossing: transition.crossing,
            trigger: if transition.from.is_some() { Trigger::Edge } else { Trigger::Start },
            event,
            resets: resets.collect(),
        }
    });
    let transitions = transitions.collect();
    let kind = match automaton.origin {
        model::Origin::Modes => AutomatonKind::Modes,
        model::Origin::When => AutomatonKind::When,
    };
    Automaton {
        kind,
        name: automaton.name.clone(),
        modes: automaton.modes.iter().map(|mode| mode.name.clone()).collect(),
        start: automaton.start,
        transitions,
    }
}
