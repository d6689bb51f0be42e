//! The parts of the rows that depend on a switch and have to be examined for it.
//!
//! A row passes a surface like the part that the surface changes if the rest of the row only adds something, scales, or
//! is a monotonic function. Then only the part is examined, and a row with many switches costs no more than as many
//! rows.

use crate::dae::Dae;
use crate::dae::hybrid::smoothness::SwitchSigns;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// For each expression of the rows, the expressions that read it.
pub(super) struct ExpressionReaders {
    /// Ids ascending, and for each the positions of its readers.
    ids: Vec<ExprId>,
    read_by: Vec<Vec<u32>>,
    /// The rows whose expression this is.
    rows: Vec<Vec<u32>>,
    /// Whether the rows jump, or have a corner, exactly where the expression does.
    is_plain: Vec<bool>,
    /// The last search that met each expression.
    met: Vec<u32>,
    search: u32,
}

impl ExpressionReaders {
    pub(super) fn from_dae(dae: &Dae) -> Self {
        let graph = &dae.graph;
        let roots: Vec<ExprId> = dae.rows().collect();
        let ids = graph.reachable(roots.iter().copied());
        let position = |id: &ExprId| ids.binary_search(id).unwrap_or_default();
        let mut read_by = vec![Vec::new(); ids.len()];
        let mut modes_only = vec![false; ids.len()];
        for (k, id) in ids.iter().enumerate() {
            let node = graph.node(*id);
            let reader = u32::try_from(k).unwrap_or(u32::MAX);
            let mut is_plain = true;
            for operand in node.operands() {
                let index = position(&operand);
                is_plain &= modes_only[index];
                if read_by[index].last() != Some(&reader) {
                    read_by[index].push(reader);
                }
            }
            modes_only[k] = match node {
                Node::Symbol(symbol) => matches!(symbol, Symbol::Discrete(_)),
                _ => is_plain,
            };
        }
        let mut rows = vec![Vec::new(); ids.len()];
        for (row, root) in roots.iter().enumerate() {
            rows[position(root)].push(u32::try_from(row).unwrap_or(u32::MAX));
        }
        let mut is_plain = vec![true; ids.len()];
        for k in (0..ids.len()).rev() {
            is_plain[k] = read_by[k].iter().all(|reader| {
                let reader = *reader as usize;
                is_plain[reader]
                    && passes_on(graph, ids[reader], ids[k], |id| modes_only[position(&id)])
            });
        }
        let met = vec![0; ids.len()];
        Self { ids, read_by, rows, is_plain, met, search: 0 }
    }

    /// The expressions to examine for a surface with these switches, and the rows that it changes.
    pub(super) fn affected(&mut self, signs: &SwitchSigns) -> (Vec<ExprId>, Vec<usize>) {
        self.search += 1;
        let switches = signs.keys().filter_map(|id| self.ids.binary_search(id).ok());
        let mut pending: Vec<usize> = switches.collect();
        let (mut whole, mut plain, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        let mut climbed = Vec::new();
        while let Some(k) = pending.pop() {
            if std::mem::replace(&mut self.met[k], self.search) == self.search {
                continue;
            }
            if self.is_plain[k] {
                plain.push(self.ids[k]);
                climbed.push(k);
            } else {
                pending.extend(self.read_by[k].iter().map(|reader| *reader as usize));
            }
        }
        while let Some(k) = climbed.pop() {
            if !self.rows[k].is_empty() {
                whole.push(self.ids[k]);
                rows.extend(self.rows[k].iter().map(|row| *row as usize));
            }
            for reader in &self.read_by[k] {
                let reader = *reader as usize;
                if std::mem::replace(&mut self.met[reader], self.search) != self.search {
                    climbed.push(reader);
                }
            }
        }
        rows.sort_unstable();
        whole.sort_unstable();
        // Changes of several parts may cancel.
        (if plain.len() == 1 { plain } else { whole }, rows)
    }
}

/// Whether `reader` changes like `operand` if its other operands are continuous.
fn passes_on(
    graph: &ExprGraph,
    reader: ExprId,
    operand: ExprId,
    modes_only: impl Fn(ExprId) -> bool,
) -> bool {
    match graph.node(reader) {
        Node::Add(..) | Node::Subtract(..) | Node::Negate(_) => true,
        Node::Multiply(a, b) => graph.value(a).is_some() || graph.value(b).is_some(),
        Node::Divide(a, b) => a == operand && graph.value(b).is_some(),
        // Functions whose slope is nowhere zero.
        Node::Call1(function, _) => {
            matches!(function.get().name, "exp" | "log" | "atan" | "sinh" | "tanh")
        }
        Node::Select(condition, ..) => condition != operand && modes_only(condition),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::ExpressionReaders;
    use crate::dae::{Dae, assemble};
    use crate::diagnostics::Diagnostics;
    use crate::expr::{ExprId, Node};
    use crate::model::{ModelOptions, resolve};
    use crate::source::{SourceMap, SourceText};
    use crate::syntax::parse;

    fn dae(row: &str) -> Dae {
        let text = format!(
            "model m\nstate x = 1\nstate y = 1\nequation x: der(x) = ({row})/2 [s]\nequation y: der(y) = x/1 [s]\n"
        );
        let main = SourceText { name: "m.dgd".to_owned(), text };
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let main = sources.add(main);
        let ast = parse(main, &sources, &mut diagnostics).expect("a readable model");
        let model = resolve(&[ast], &ModelOptions::default(), &mut diagnostics);
        assemble(&model.expect("a sound model"), &mut diagnostics).expect("a solvable model")
    }

    /// The calls of `abs`, and the expressions to examine for each.
    fn looked_at(dae: &Dae) -> Vec<(ExprId, Vec<ExprId>)> {
        let mut readers = ExpressionReaders::from_dae(dae);
        let nodes = dae.graph.listed(dae.rows()).into_iter();
        let calls = nodes.filter(
            |(_, node)| matches!(node, Node::Call1(function, _) if function.get().name == "abs"),
        );
        calls.map(|(id, _)| (id, readers.affected(&[(id, 1.0)].into_iter().collect()).0)).collect()
    }

    #[test]
    fn of_a_sum_only_the_term_of_the_switch_is_looked_at() {
        let mut row = "0".to_owned();
        for k in 0..50 {
            let _ = write!(row, " - 2*abs(x - {k})");
        }
        let dae = dae(&row);
        let found = looked_at(&dae);
        assert_eq!(found.len(), 50);
        for (call, looked_at) in found {
            assert_eq!(looked_at, [call]);
        }
    }

    #[test]
    fn what_may_make_a_switch_smooth_or_cancel_it_is_looked_at_too() {
        let dae = dae("x*abs(x) + y*abs(y - 1) - abs(y - 1)*3");
        for (call, looked_at) in looked_at(&dae) {
            assert_ne!(looked_at, [call]);
        }
    }
}
