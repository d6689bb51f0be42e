//! The expressions of a system of which derivatives are taken, and the numbers of symbols in these.

use std::collections::BTreeMap;

use dgd_signature::{Direction, PastLayout, Pattern};

use super::functions::ResultKind;
use crate::dae::{self, Dae};
use crate::expr::graph::Comparison;
use crate::expr::hash::{HashMap, HashSet};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// The expressions of a system and the derivatives taken of them, each once.
pub(super) struct Derivation<'a> {
    pub(super) dae: &'a Dae,
    pub(super) directions: &'a [Direction],
    pub(super) past: PastLayout,
    pub(super) graph: ExprGraph,
    /// The model's names of expressions, from `let`s.
    pub(super) names: BTreeMap<ExprId, String>,
    /// w of the single outputs, then of the arrays.
    pub(super) w: Vec<ExprId>,
    /// Results made so far.
    pub(super) results: BTreeMap<ResultKind, Vec<ExprId>>,
    /// Patterns of the sparse results.
    pub(super) patterns: BTreeMap<ResultKind, Pattern>,
}

/// The rows of an expression in a list: a single row, or the first of a family with its length.
pub(super) type RowRange = (usize, Option<u32>);

impl<'a> Derivation<'a> {
    pub(super) fn new(dae: &'a Dae, directions: &'a [Direction], past: PastLayout) -> Self {
        let mut graph = dae.graph.clone();
        let arrays = dae.output_arrays.iter().map(|array| {
            let first = u32::try_from(array.first).unwrap_or(u32::MAX);
            let moves = array.count > 1;
            graph.symbol(if moves { Symbol::Swept(first) } else { Symbol::Unknown(first) })
        });
        let w = dae.outputs.iter().map(|output| output.value).chain(arrays).collect();
        Derivation {
            dae,
            directions,
            past,
            graph,
            names: dae.names.clone(),
            w,
            results: BTreeMap::new(),
            patterns: BTreeMap::new(),
        }
    }

    /// The roots with a/b replaced by a (1/b) if b depends neither on unknowns nor on the counter of a loop: 1/b is
    /// then computed before the unknowns are available, and only a product remains.
    pub(super) fn by_reciprocals(&mut self, roots: &[ExprId]) -> Vec<ExprId> {
        let mut moving = HashSet::default();
        let mut built: HashMap<ExprId, ExprId> = HashMap::default();
        for (id, node) in self.graph.listed(roots.iter().copied()) {
            if is_moving(node) || node.operands().any(|operand| moving.contains(&operand)) {
                moving.insert(id);
            }
            let here = match node {
                Node::Divide(a, b) if moving.contains(&a) && !moving.contains(&b) => {
                    let one = self.graph.constant(1.0);
                    let reciprocal = self.graph.divide(one, built[&b]);
                    self.graph.multiply(built[&a], reciprocal)
                }
                _ => self.graph.simplified(node.map(|operand| built[&operand])),
            };
            built.insert(id, here);
            if let Some(name) = self.names.get(&id).cloned() {
                self.names.entry(here).or_insert(name);
            }
        }
        roots.iter().map(|root| built[root]).collect()
    }

    /// Length of y.
    pub(super) fn n(&self) -> usize {
        self.dae.n()
    }

    /// f of the single unknowns, then of the families.
    pub(super) fn f(&self) -> Vec<ExprId> {
        let families = self.dae.families.iter().map(|family| family.rhs);
        self.dae.unknowns.iter().map(|unknown| unknown.rhs).chain(families).collect()
    }

    /// The rows of the expressions of [`Derivation::f`].
    pub(super) fn rows_of_f(&self) -> Vec<RowRange> {
        let families = self.dae.families.iter().map(|family| (family.first, family.count));
        rows(self.dae.unknowns.len(), families)
    }

    /// The family that contains a row.
    pub(super) fn family_of(&self, row: usize) -> Option<usize> {
        let families = &self.dae.families;
        let position = families.partition_point(|family| family.first <= row).checked_sub(1)?;
        (row < families[position].first + families[position].count as usize).then_some(position)
    }

    pub(super) fn w(&self) -> Vec<ExprId> {
        self.w.clone()
    }

    /// The rows of the expressions of `w`.
    pub(super) fn rows_of_w(&self) -> Vec<RowRange> {
        let counts = self.dae.output_arrays.iter().map(|array| array.count);
        rows(self.dae.outputs.len(), self.dae.first_of_output_arrays().zip(counts))
    }

    /// Length of w.
    pub(super) fn n_w(&self) -> usize {
        let arrays = self.dae.output_arrays.iter().map(|array| array.count as usize);
        self.dae.outputs.len() + arrays.sum::<usize>()
    }

    /// r, the residuals of the start equations.
    pub(super) fn start_rests(&self) -> Vec<ExprId> {
        self.dae.start_equations.iter().map(|equation| equation.rest).collect()
    }

    /// e of each transition.
    pub(super) fn events(&self) -> Vec<ExprId> {
        self.transitions().map(|transition| transition.event).collect()
    }

    /// r of each transition.
    pub(super) fn resets(&self) -> Vec<ExprId> {
        self.transitions().flat_map(|t| t.resets.iter().map(|(_, value)| *value)).collect()
    }

    pub(super) fn transitions(&self) -> impl Iterator<Item = &'a dae::DaeTransition> {
        self.dae.automata.iter().flat_map(|automaton| &automaton.transitions)
    }

    pub(super) fn accumulate(
        &mut self,
        sums: &mut BTreeMap<usize, ExprId>,
        position: usize,
        term: ExprId,
    ) {
        let sum = match sums.get(&position) {
            Some(earlier) => self.graph.add(*earlier, term),
            None => term,
        };
        sums.insert(position, sum);
    }

    /// ∂yₖ/∂θⱼ as a symbol.
    pub(super) fn sensitivity(&mut self, k: usize, j: usize) -> ExprId {
        let position = j * self.n() + (k & !MOVING);
        let position = u32::try_from(position).unwrap_or(u32::MAX);
        let moves = k & MOVING != 0;
        self.graph.symbol(if moves {
            Symbol::SweptSensitivity(position)
        } else {
            Symbol::Sensitivity(position)
        })
    }

    /// A number in one row of a family, zero in the others.
    pub(super) fn in_row(&mut self, row: u32, value: ExprId) -> ExprId {
        let graph = &mut self.graph;
        let counter = graph.symbol(Symbol::Counter);
        let [below, above] = [-0.5, 0.5].map(|by| graph.constant(f64::from(row) + by));
        let begins = graph.compare(Comparison::Greater, counter, below);
        let goes_on = graph.compare(Comparison::Less, counter, above);
        let is_it = graph.intern(Node::And(begins, goes_on));
        let zero = graph.constant(0.0);
        graph.select(is_it, value, zero)
    }

    /// v̇ of a delayed input, itself an input: it is constant between the points at which inputs are not smooth.
    pub(super) fn rate_symbol(&mut self, position: usize) -> ExprId {
        let index = self.dae.inputs.len() + self.dae.delayed_inputs.len() + position;
        self.graph.symbol(Symbol::Input(u32::try_from(index).unwrap_or(u32::MAX)))
    }

    pub(super) fn tau(&self) -> Vec<ExprId> {
        self.dae.delays.iter().map(|delay| delay.tau).collect()
    }

    pub(super) fn varying_tau(&self) -> Vec<ExprId> {
        self.dae.varying_delays.iter().map(|delay| delay.tau).collect()
    }
}

/// Rows of single unknowns, then of families given by their first row and their length.
pub(super) fn rows(single: usize, behind: impl Iterator<Item = (usize, u32)>) -> Vec<RowRange> {
    let single = (0..single).map(|i| (i, None));
    single.chain(behind.map(|(first, count)| (first, (count > 1).then_some(count)))).collect()
}

/// Marks the position of an unknown that moves with the row of a family.
pub(super) const MOVING: usize = 1 << (usize::BITS - 1);

/// Whether a node changes from stage to stage or from row to row: unknowns, their sensitivities, their past values, and
/// the counter of a loop.
fn is_moving(node: Node) -> bool {
    use Symbol::{
        Counter, Past, Sensitivity, Swept, SweptInput, SweptInputSlope, SweptParameter,
        SweptSensitivity, Unknown,
    };
    let Node::Symbol(symbol) = node else { return false };
    matches!(
        symbol,
        Unknown(_)
            | Sensitivity(_)
            | Swept(_)
            | SweptSensitivity(_)
            | SweptParameter(..)
            | SweptInput(..)
            | SweptInputSlope(..)
            | Past(..)
            | Counter
    )
}

pub(super) fn unknown(symbol: Symbol) -> Option<usize> {
    match symbol {
        Symbol::Unknown(i) => Some(i as usize),
        Symbol::Swept(i) => Some(i as usize | MOVING),
        _ => None,
    }
}

pub(super) fn parameter(symbol: Symbol) -> Option<usize> {
    match symbol {
        Symbol::Parameter(i) => Some(i as usize),
        Symbol::SweptParameter(i, _) => Some(i as usize | MOVING),
        _ => None,
    }
}

pub(super) fn input(symbol: Symbol) -> Option<usize> {
    match symbol {
        Symbol::Input(i) => Some(i as usize),
        Symbol::SweptInput(i, _) => Some(i as usize | MOVING),
        _ => None,
    }
}

pub(super) fn time(symbol: Symbol) -> Option<usize> {
    (symbol == Symbol::Time).then_some(0)
}

pub(super) fn direction(directions: &[Direction]) -> impl Fn(Symbol) -> Option<usize> + '_ {
    |symbol| {
        let p = parameter(symbol)?;
        directions.iter().position(|direction| *direction == Direction::Parameter(p))
    }
}
