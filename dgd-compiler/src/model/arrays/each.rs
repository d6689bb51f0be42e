//! What stands in a loop once for each index: start equations, saturations, `when` and `every`.

use std::fmt::Write as _;

use super::shape::Shape;
use super::sweep::{MOST_WRITTEN_OUT, open};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::ExprId;
use crate::model::resolve::Resolver;
use crate::model::{Automaton, Crossing};
use crate::syntax::ast::{Counter, Item, ItemKind, StartRule};

impl<'a> Resolver<'a> {
    pub(super) fn each(
        &mut self,
        counters: &'a [Counter],
        item: &'a Item,
        shape: &Shape,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), Reported> {
        let count = shape.count().unwrap_or(u32::MAX);
        if count > MOST_WRITTEN_OUT {
            let message = format!("this stands for {count} indices, each by itself");
            return Err(diagnostics.error(
                Diagnostic::new(Code::E230, item.span, message)
                    .help(format!("it can stand for up to {MOST_WRITTEN_OUT}")),
            ));
        }
        let mut automata: Vec<(u32, Automaton)> = Vec::new();
        for offset in 0..count {
            self.lowering.indices = open(counters, shape, offset, false);
            match &item.kind {
                ItemKind::Start(StartRule::Equation { label, left, right }) => {
                    let mut equation =
                        self.equation(item, label, [left, right], &[], diagnostics)?;
                    equation.label.push_str(&shape.brackets(offset));
                    self.model.start_equations.push(equation);
                }
                ItemKind::Saturate { name, indices, side, bound } => {
                    let saturation =
                        self.saturation(item, (name, indices), *side, bound, diagnostics)?;
                    self.model.saturations.push(saturation);
                }
                _ => {
                    let next = self.reacting(item, diagnostics)?;
                    match automata.last_mut().filter(|(_, last)| watch_the_same(last, &next)) {
                        Some((_, last)) => self.join(last, next, diagnostics)?,
                        None => automata.push((offset, next)),
                    }
                }
            }
        }
        let is_one = automata.len() == 1;
        self.model.automata.extend(automata.into_iter().map(|(offset, mut automaton)| {
            if !is_one {
                for (counter, at) in counters.iter().zip(shape.indices(offset)) {
                    let _ = write!(automaton.name, ", {} = {at}", counter.index.text);
                }
            }
            automaton
        }));
        Ok(())
    }

    /// One event that does what both do.
    fn join(
        &self,
        one: &mut Automaton,
        other: Automaton,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), Reported> {
        for (transition, further) in one.transitions.iter_mut().zip(other.transitions) {
            for reset in further.resets {
                self.add_reset(&mut transition.resets, reset, diagnostics)?;
            }
        }
        Ok(())
    }
}

/// Whether two events of a loop are one: of a clock there is one, and of each thing that is watched.
fn watch_the_same(one: &Automaton, other: &Automaton) -> bool {
    let watched = |automaton: &Automaton| -> Vec<(ExprId, Crossing, ExprId)> {
        automaton.transitions.iter().map(|to| (to.left, to.crossing, to.right)).collect()
    };
    one.period == other.period && watched(one) == watched(other)
}
