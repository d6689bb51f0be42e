//! Corners whose side is held during a step: those of algebraic equations.
//!
//! An algebraic equation with a corner, such as i = g max(v, 0), is one of two smooth equations. A step across the
//! corner goes astray, and Newton's iteration jumps between the two. If the corner depends on algebraic unknowns, a
//! discrete number therefore selects the piece, as for values that jump, and the runtime finds pieces and unknowns
//! together. But if a piece may be undefined beyond its end, as √x is below zero, the row stays as it is, and steps
//! just end at the corner.

use super::surfaces::SwitchingSurface;
use crate::dae::Dae;
use crate::dae::hybrid::smoothness::Continuity;
use crate::dae::rates::family_of;
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// The unknowns and rows that are algebraic in at least one mode.
pub(super) struct AlgebraicUnknowns {
    unknowns: Vec<bool>,
    families: Vec<bool>,
}

impl AlgebraicUnknowns {
    pub(super) fn from_dae(dae: &Dae) -> Self {
        let is_algebraic = |mass: ExprId| dae.graph.value(mass) != Some(1.0);
        Self {
            unknowns: dae.unknowns.iter().map(|unknown| is_algebraic(unknown.mass)).collect(),
            families: dae.families.iter().map(|family| !family.differential).collect(),
        }
    }

    fn is_unknown(&self, dae: &Dae, symbol: Symbol) -> bool {
        match symbol {
            Symbol::Unknown(i) => self.unknowns[i as usize],
            Symbol::Element(i) | Symbol::Swept(i) => {
                family_of(&dae.families, i).is_none_or(|(family, _)| self.families[family])
            }
            _ => false,
        }
    }

    /// Whether a row, in the order of [`Dae::rows`], is algebraic.
    fn is_row(&self, row: usize) -> bool {
        match row.checked_sub(self.unknowns.len()) {
            None => self.unknowns[row],
            Some(family) => self.families[family],
        }
    }

    /// Whether an expression reads an algebraic unknown.
    pub(super) fn is_read_by(&self, dae: &Dae, e: ExprId) -> bool {
        dae.graph.symbols(e).iter().any(|symbol| self.is_unknown(dae, *symbol))
    }

    /// Whether the corner of a surface is that of an algebraic equation whose pieces are defined everywhere.
    pub(super) fn holds(&self, dae: &Dae, rows: &[ExprId], surface: &SwitchingSurface) -> bool {
        surface.passage == Continuity::Corner
            && surface.rows.iter().any(|row| self.is_row(*row))
            && self.is_read_by(dae, surface.e)
            && surface.rows.iter().all(|row| is_total(&dae.graph, rows[*row]))
    }
}

/// Whether an expression is defined for all values of its varying symbols.
pub(super) fn is_total(graph: &ExprGraph, root: ExprId) -> bool {
    let mut moves: HashMap<ExprId, bool> = HashMap::default();
    for (id, node) in graph.listed([root]) {
        let here = match node {
            Node::Symbol(symbol) => !matches!(symbol, Symbol::Parameter(_)),
            _ => node.operands().any(|operand| moves[&operand]),
        };
        let is_partial = match node {
            Node::Call1(function, _) => {
                matches!(function.get().name, "sqrt" | "log" | "log10" | "asin" | "acos" | "lgamma")
            }
            Node::Call2(function, _, exponent) => {
                function.get().name == "^"
                    && graph.value(exponent).is_none_or(|exponent| exponent.fract() != 0.0)
            }
            _ => false,
        };
        if here && is_partial {
            return false;
        }
        moves.insert(id, here);
    }
    true
}
