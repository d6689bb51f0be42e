//! Combinations of modes: the systems that follow one another, and the one that they make together.

use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::graph::Comparison;
use crate::expr::{ExprId, Graph, Symbol};
use crate::model::{Model, Origin};

/// Every combination is matched by itself: their number must stay within bounds.
const MOST_COMBINATIONS: usize = 1024;

/// All combinations of modes, the last block's mode changing fastest.
#[derive(Debug, Clone)]
pub(super) struct Combinations {
    /// Number of modes of each block.
    sizes: Vec<usize>,
    count: usize,
}

impl Combinations {
    /// Those of the modes that the model declares.
    pub(super) fn of(model: &Model, diagnostics: &mut Diagnostics) -> Result<Self, Reported> {
        let sizes = model.automata.iter().map(|a| a.modes.len()).collect();
        Combinations::from_sizes(sizes, model, diagnostics)
    }

    /// These, and those of further automata.
    pub(super) fn and(
        &self,
        further: impl Iterator<Item = usize>,
        model: &Model,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self, Reported> {
        let sizes = self.sizes.iter().copied().chain(further).collect();
        Combinations::from_sizes(sizes, model, diagnostics)
    }

    fn from_sizes(
        sizes: Vec<usize>,
        model: &Model,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self, Reported> {
        let count = sizes.iter().try_fold(1_usize, |product, size| product.checked_mul(*size));
        if let Some(count) = count.filter(|count| *count <= MOST_COMBINATIONS) {
            return Ok(Combinations { sizes, count });
        }
        let declared = sizes.len() == model.automata.len();
        let equations = model.all_equations().map(|equation| equation.span);
        let span = equations.last().unwrap_or_default();
        let message = format!("more than {MOST_COMBINATIONS} combinations of modes");
        let diagnostic = Diagnostic::new(Code::E409, span, message);
        Err(diagnostics.error(if declared {
            diagnostic
                .here("the last block")
                .help("put modes that change together into one `modes` block")
        } else {
            diagnostic.help(
                "constraints between states have too many ways to choose among them; describe \
                 some of these parts by angles or lengths that are free",
            )
        }))
    }

    /// The combinations, each with the mode of every block.
    pub(super) fn iter(&self) -> impl Iterator<Item = Vec<usize>> + '_ {
        (0..self.count).map(|combination| {
            let mut rest = combination;
            let mut modes = vec![0; self.sizes.len()];
            for (mode, size) in modes.iter_mut().zip(&self.sizes).rev() {
                *mode = rest % size;
                rest /= size;
            }
            modes
        })
    }

    /// The position of a combination, given the mode of every block.
    pub(super) fn position(&self, modes: &[usize]) -> usize {
        let modes = modes.iter().zip(&self.sizes);
        modes.fold(0, |position, (mode, size)| position * size + mode)
    }

    /// The mode of each block that the model starts in.
    pub(super) fn start_modes(model: &Model) -> Vec<usize> {
        model.automata.iter().map(|automaton| automaton.start).collect()
    }

    /// One expression that is, in every combination, the one given for it.
    ///
    /// Blocks that make no difference do not occur in it.
    pub(super) fn merge(&self, graph: &mut Graph, mut values: Vec<ExprId>) -> ExprId {
        for (automaton, size) in self.sizes.iter().enumerate().rev() {
            let position = u32::try_from(automaton).unwrap_or(u32::MAX);
            values = values
                .chunks(*size)
                .map(|modes| {
                    let (last, others) =
                        modes.split_last().unwrap_or_else(|| unreachable!("every block has modes"));
                    let mut chosen = *last;
                    for (mode, value) in others.iter().enumerate().rev() {
                        let now = graph.symbol(Symbol::Discrete(position));
                        let behind = graph.constant(mode as f64 + 0.5);
                        let is_mode = graph.compare(Comparison::Less, now, behind);
                        chosen = graph.select(is_mode, *value, chosen);
                    }
                    chosen
                })
                .collect();
        }
        values[0]
    }
}

/// How messages speak of a combination: nothing where there are no modes.
pub(super) fn in_modes(model: &Model, modes: &[usize]) -> String {
    let names: Vec<String> = model
        .automata
        .iter()
        .zip(modes)
        .filter(|(automaton, _)| automaton.origin == Origin::Modes)
        .map(|(automaton, mode)| {
            format!("mode `{}` of `{}`", automaton.modes[*mode].name, automaton.name)
        })
        .collect();
    if names.is_empty() { String::new() } else { format!(" in {}", names.join(" and ")) }
}
