//! A model with its parts expanded, under the names of its own file.

use std::collections::BTreeSet;

use super::flat_model::InnerModel;
use crate::source::SourceId;
use crate::syntax::ast::Item;

/// A model with its parts expanded, under the names of its own file.
#[derive(Debug, Clone, Default)]
pub(super) struct ExpandedModel {
    pub(super) items: Vec<Item>,
    pub(super) parts: Vec<InnerModel>,
    /// Names of constants and parameters whose values are arguments of parts.
    pub(super) set: BTreeSet<String>,
    /// Libraries that it or its parts see.
    pub(super) libraries: BTreeSet<SourceId>,
    /// Number of items of each of its own parts, in the order written.
    pub(super) lengths: Vec<usize>,
    /// Bytes of its text, plus a constant for each item.
    pub(super) size: usize,
}
