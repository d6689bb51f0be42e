//! Items in a loop that are written out for each index: equations in which an index moves by more than one, start
//! equations, saturations, `when` and `every`.

use std::fmt::Write as _;

use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::ExprId;
use crate::model::resolver::ModelResolver;
use crate::model::scope::{ArrayShape, LoopIndex};
use crate::model::{Automaton, Crossing, Equation};
use crate::syntax::ast::{Item, ItemKind, LoopCounter, StartRule};

/// Limit on the indices for which a loop is written out.
pub(super) const MOST_WRITTEN_OUT: u32 = 20_000;

impl<'a> ModelResolver<'a> {
    pub(super) fn each(
        &mut self,
        counters: &'a [LoopCounter],
        item: &'a Item,
        shape: &ArrayShape,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let count = shape.count().unwrap_or(u32::MAX);
        if count > MOST_WRITTEN_OUT {
            return Err(diagnostics.error(too_many(item, count)));
        }
        let mut automata: Vec<(u32, Automaton)> = Vec::new();
        for offset in 0..count {
            self.lowering.verify_size(item.span, diagnostics)?;
            self.lowering.indices = open(counters, shape, offset, false);
            match &item.kind {
                ItemKind::Equation { .. } => {
                    let Some(mut equation) = self.one(item, diagnostics)? else {
                        unreachable!("no index moves");
                    };
                    equation.label.push_str(&shape.brackets(offset));
                    self.model.equations.push(equation);
                }
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

    /// The equation at the open indices; `None` if an index moves by more than one.
    pub(super) fn one(
        &mut self,
        item: &'a Item,
        diagnostics: &mut Diagnostics,
    ) -> Result<Option<Equation>, ErrorReported> {
        let ItemKind::Equation { label, left, right, attributes } = &item.kind else {
            unreachable!("asked before");
        };
        self.lowering.strided = false;
        let equation = self.equation(item, label, [left, right], attributes, diagnostics)?;
        let strided = std::mem::take(&mut self.lowering.strided);
        if strided {
            self.lowering.forget_moving();
        }
        Ok((!strided).then_some(equation))
    }

    /// Merges two events into one that has both effects.
    fn join(
        &self,
        one: &mut Automaton,
        other: Automaton,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        for (transition, further) in one.transitions.iter_mut().zip(other.transitions) {
            for reset in further.resets {
                self.add_reset(&mut transition.resets, reset, diagnostics)?;
            }
        }
        Ok(())
    }
}

/// The indices of a loop at one of its passages; the last may move from there on.
pub(super) fn open<'a>(
    counters: &'a [LoopCounter],
    shape: &ArrayShape,
    offset: u32,
    moves: bool,
) -> Vec<LoopIndex<'a>> {
    let values = shape.indices(offset);
    let last = counters.len() - 1;
    let index = |(k, LoopCounter { index, .. }): (usize, &'a LoopCounter)| {
        let count = if moves && k == last { shape.row().count } else { 1 };
        LoopIndex { name: &index.text, first: values[k], count }
    };
    counters.iter().enumerate().map(index).collect()
}

/// The error for a loop with too many indices to be written out.
pub(super) fn too_many(item: &Item, count: u32) -> Diagnostic {
    let (message, help) = match item.kind {
        ItemKind::Equation { .. } => (
            format!(
                "an index moves by more than one here, and there are {count} equations to write out"
            ),
            format!(
                "where all indices move by one, as in `x[i-1]`, the equation is one for all; \
                 others are written out for up to {MOST_WRITTEN_OUT}"
            ),
        ),
        _ => (
            format!("this stands for {count} indices, each by itself"),
            format!("it can stand for up to {MOST_WRITTEN_OUT}"),
        ),
    };
    Diagnostic::new(Code::NotAKnownWholeNumber, item.span, message).help(help)
}

/// Whether two events of a loop are the same: one for each clock and for each watched expression.
fn watch_the_same(one: &Automaton, other: &Automaton) -> bool {
    let watched = |automaton: &Automaton| -> Vec<(ExprId, Crossing, ExprId)> {
        automaton.transitions.iter().map(|to| (to.left, to.crossing, to.right)).collect()
    };
    one.period == other.period && watched(one) == watched(other)
}
