//! Rows of arrays as they are planned, and the columns that equations could determine.

use std::collections::BTreeSet;

use crate::expr::ExprId;
use crate::model::Model;

/// The equations that determine elements of arrays.
#[derive(Debug, Default)]
pub(in crate::dae) struct FamilyPlan {
    /// Positions of these equations among all.
    pub(in crate::dae) taken: BTreeSet<usize>,
    /// The rows made from them.
    pub(super) rows: Vec<PlannedRows>,
}

impl FamilyPlan {
    /// The rows' right-hand sides.
    pub(in crate::dae) fn expressions(&mut self) -> impl Iterator<Item = &mut ExprId> {
        self.rows.iter_mut().map(|row| &mut row.rhs)
    }
}

/// Consecutive elements with one row expression.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlannedRows {
    /// Position of the first among the elements of all arrays.
    pub(super) first: u32,
    pub(super) count: u32,
    /// Position of the equation among all.
    pub(super) equation: usize,
    /// The equation's passage for the first row.
    pub(super) from: u32,
    /// f, swept from the equation's first passage on.
    pub(super) rhs: ExprId,
    /// ẏ = f, else 0 = f.
    pub(super) differential: bool,
}

/// The columns that an equation, or a family of them, could determine.
#[derive(Debug)]
pub(super) struct ColumnCandidates {
    /// Position among all equations.
    pub(super) equation: usize,
    /// Number of passages.
    pub(super) count: u32,
    /// First columns; for columns that move with the loop, as many follow as there are passages.
    pub(super) columns: Vec<usize>,
}

/// Single unknowns are the first columns; elements of arrays follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColumnNumbering {
    pub(super) n_single: usize,
    pub(super) n_elements: usize,
}

impl ColumnNumbering {
    pub(super) fn element(self, position: u32) -> usize {
        self.n_single + position as usize
    }

    pub(super) fn len(self) -> usize {
        self.n_single + self.n_elements
    }
}

/// Passages of an equation and the columns that they determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FamilyAssignment {
    pub(super) equation: usize,
    pub(super) from: u32,
    pub(super) count: u32,
    pub(super) column: usize,
}

/// `p[3]` or `p[3..7]`.
pub(super) fn elements_name(model: &Model, first: u32, count: u32) -> String {
    let name = model.element_name(first);
    if count == 1 {
        return name;
    }
    let last = model.element_name(first + count - 1);
    let upper = last.rsplit_once('[').map_or("", |(_, upper)| upper);
    format!("{}..{upper}", name.trim_end_matches(']'))
}
