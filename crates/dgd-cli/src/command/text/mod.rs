//! Commands that read texts and compute nothing.

pub(crate) mod check;
pub(crate) mod emit;
pub(crate) mod explain;
pub(crate) mod fmt;
pub(crate) mod lsp;
pub(crate) mod man;
pub(crate) mod methods;
pub(crate) mod schema;
pub(crate) mod shells;
