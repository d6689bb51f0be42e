//! Combinations of modes: the systems of each, and the one system that they form together.

use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::graph::Comparison;
use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::{AutomatonOrigin, Model};

/// Every combination is matched separately, so their number is limited.
const MOST_COMBINATIONS: usize = 4096;

/// All combinations of the modes of some blocks, the last block's mode changing fastest.
#[derive(Debug, Clone)]
pub(super) struct ModeCombinations {
    /// Positions of the blocks among the automata, and their numbers of modes.
    blocks: Vec<(usize, usize)>,
    count: usize,
}

impl ModeCombinations {
    /// The combinations of the modes of these automata; `None` if there are too many.
    pub(super) fn enumerate(model: &Model, automata: impl Iterator<Item = usize>) -> Option<Self> {
        let blocks: Vec<(usize, usize)> =
            automata.map(|k| (k, model.automata[k].modes.len())).collect();
        let count =
            blocks.iter().try_fold(1_usize, |product, (_, size)| product.checked_mul(*size));
        let count = count.filter(|count| *count <= MOST_COMBINATIONS)?;
        Some(ModeCombinations { blocks, count })
    }

    /// Reports too many combinations.
    pub(super) fn too_many(model: &Model, diagnostics: &mut Diagnostics) -> ErrorReported {
        let equations = model.all_equations().map(|equation| equation.span);
        let span = equations.last().unwrap_or_default();
        let message = format!("more than {MOST_COMBINATIONS} combinations of modes");
        diagnostics.error(
            Diagnostic::new(Code::TooManyModes, span, message)
                .here("the last block")
                .help("put modes that change together into one `modes` block"),
        )
    }

    /// Number of combinations.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// The combinations, each with the mode of every block.
    pub(super) fn iter(&self) -> impl Iterator<Item = Vec<usize>> + '_ {
        (0..self.count).map(|combination| {
            let mut rest = combination;
            let mut modes = vec![0; self.blocks.len()];
            for (mode, (_, size)) in modes.iter_mut().zip(&self.blocks).rev() {
                *mode = rest % size;
                rest /= size;
            }
            modes
        })
    }

    /// The position of the combination in which all automata are in these modes.
    pub(super) fn position(&self, modes: &[usize]) -> usize {
        let blocks = self.blocks.iter();
        blocks.fold(0, |position, (automaton, size)| position * size + modes[*automaton])
    }

    /// The initial mode of each block.
    pub(super) fn start_modes(model: &Model) -> Vec<usize> {
        model.automata.iter().map(|automaton| automaton.start).collect()
    }

    /// One expression that equals, in every combination, the one given for it.
    ///
    /// Blocks that make no difference do not occur in it.
    pub(super) fn merge(&self, graph: &mut ExprGraph, mut values: Vec<ExprId>) -> ExprId {
        for (automaton, size) in self.blocks.iter().rev() {
            let chunks = values.chunks(*size);
            values = chunks.map(|modes| select(graph, *automaton, modes)).collect();
        }
        values[0]
    }
}

/// One expression that equals, in each mode of an automaton, the one given for it.
pub(super) fn select(graph: &mut ExprGraph, automaton: usize, values: &[ExprId]) -> ExprId {
    let position = u32::try_from(automaton).unwrap_or(u32::MAX);
    let (last, others) =
        values.split_last().unwrap_or_else(|| unreachable!("every automaton has modes"));
    let mut chosen = *last;
    for (mode, value) in others.iter().enumerate().rev() {
        let now = graph.symbol(Symbol::Discrete(position));
        let behind = graph.constant(mode as f64 + 0.5);
        let is_mode = graph.compare(Comparison::Less, now, behind);
        chosen = graph.select(is_mode, *value, chosen);
    }
    chosen
}

/// Describes a combination of the modes of some automata in messages; empty without modes.
pub(super) fn in_modes(
    model: &Model,
    automata: impl Iterator<Item = usize>,
    modes: &[usize],
) -> String {
    let names: Vec<String> = automata
        .map(|k| &model.automata[k])
        .zip(modes)
        .filter(|(automaton, _)| automaton.origin == AutomatonOrigin::Modes)
        .map(|(automaton, mode)| {
            format!("mode `{}` of `{}`", automaton.modes[*mode].name, automaton.name)
        })
        .collect();
    if names.is_empty() { String::new() } else { format!(" in {}", names.join(" and ")) }
}
