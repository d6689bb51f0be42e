//! Choices and settings from outside a model file.

use crate::source::Span;
use crate::syntax::ast::{Expr, Name};

/// Choices and settings from outside the model file.
#[derive(Debug, Clone, Default)]
pub struct ModelOptions {
    /// Choices of variants; unnamed variants keep their first.
    pub variants: Vec<(Name, Name)>,
    /// New values of constants and parameters and start values of unknowns.
    pub settings: Vec<Setting>,
    /// Data columns. If they are known, an input that nothing reads is kept if it has a column, because additions to
    /// the model may read it, and left out otherwise.
    pub columns: Option<Vec<String>>,
    /// Place of the request that runs start at rest, if the model itself does not.
    pub starts_at_rest: Option<Span>,
}

/// `name = value`, given from outside; a plain number is in the declared unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The name.
    pub name: Name,
    /// Its new value.
    pub value: Expr,
}
