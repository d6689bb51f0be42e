//! A table as a sum of products of curves.

use crate::expr::ExprId;
use crate::expr::curve::CurveId;
use crate::model::Smoothness;
use crate::units::Dimension;

/// A table whose points have been read: its value is the sum of these terms.
#[derive(Debug, Clone)]
pub(in crate::model) struct ResolvedTable {
    pub(in crate::model::expression) terms: Vec<TableTerm>,
    pub(in crate::model::expression) dimension: Dimension,
    pub(in crate::model) smoothness: Vec<Smoothness>,
}

/// A product of curves of the first and of the second argument and of an ordinate.
#[derive(Debug, Clone, Copy)]
pub(in crate::model::expression) struct TableTerm {
    pub(in crate::model::expression) first: CurveId,
    pub(in crate::model::expression) second: Option<CurveId>,
    pub(in crate::model::expression) ordinate: Option<ExprId>,
}
