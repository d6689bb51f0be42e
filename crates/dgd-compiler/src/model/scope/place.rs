//! Arrays and their positions among those of their kind.

use super::shape::ArrayShape;
use crate::diagnostics::ErrorReported;
use crate::syntax::ast::{ArrayAxis, ArrayKind, Expr, LoopCounter, Name, WrittenUnit};

/// The position of an array's elements among those of all arrays.
#[derive(Debug, Clone)]
pub(in crate::model) struct ArrayPlace<'a> {
    pub(in crate::model) name: &'a str,
    pub(in crate::model) first: u32,
    pub(in crate::model) shape: ArrayShape,
}

/// A `let` of a loop: an expression for each index.
#[derive(Debug, Clone)]
pub(in crate::model) struct LetArray<'a> {
    pub(in crate::model) name: &'a str,
    /// Names of the indices in `value`.
    pub(in crate::model) counters: &'a [LoopCounter],
    pub(in crate::model) shape: Result<ArrayShape, ErrorReported>,
    pub(in crate::model) unit: Option<&'a WrittenUnit>,
    pub(in crate::model) value: &'a Expr,
}

impl<'a> ArrayPlace<'a> {
    /// A place before sizes are known.
    pub(in crate::model) fn nowhere(name: &'a Name) -> Self {
        ArrayPlace { name: &name.text, first: 0, shape: ArrayShape::new(Vec::new()) }
    }

    pub(in crate::model) fn count(&self) -> u32 {
        self.shape.count().unwrap_or(0)
    }

    /// The name of the element at this position among those of all arrays.
    pub(in crate::model) fn element(&self, position: u32) -> Option<String> {
        let offset = position.checked_sub(self.first).filter(|offset| *offset < self.count())?;
        Some(format!("`{}{}`", self.name, self.shape.brackets(offset)))
    }
}

/// An array whose elements have values before a run, or from data.
#[derive(Debug, Clone)]
pub(in crate::model) struct Vector<'a> {
    pub(in crate::model) kind: ArrayKind,
    pub(in crate::model) name: &'a Name,
    pub(in crate::model) axes: &'a [ArrayAxis],
    pub(in crate::model) value: Option<&'a Expr>,
    /// The position of its elements among those of its kind, filled in once sizes are known.
    pub(in crate::model) place: Result<ArrayPlace<'a>, ErrorReported>,
}
