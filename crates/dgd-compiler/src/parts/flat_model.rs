//! A model without parts.

use std::borrow::Cow;

use crate::source::Span;
use crate::syntax::ast::Ast;

/// A model without parts.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatModel<'a> {
    /// The model's tree, in which parts are replaced by their items, then those of its libraries and of its parts'
    /// libraries.
    pub asts: Cow<'a, [Ast]>,
    /// The parts, each followed by its own.
    pub parts: Vec<InnerModel>,
    /// Number of items of each part of the model itself, in the order written.
    pub(super) lengths: Vec<usize>,
}

/// A model that is part of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InnerModel {
    /// Its name in the whole: `pump`, or `well.pump`.
    pub name: String,
    /// The model's name.
    pub model: String,
    /// Doc comment of the part.
    pub doc: Vec<String>,
    /// Place of its name in the enclosing model.
    pub span: Span,
}
