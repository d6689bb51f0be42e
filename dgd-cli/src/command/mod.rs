//! The commands, one file each.

pub(crate) mod adopt;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod discover;
pub(crate) mod emit;
mod ensemble;
pub(crate) mod explain;
pub(crate) mod fit;
pub(crate) mod fmt;
pub(crate) mod invert;
pub(crate) mod linearize;
pub(crate) mod lsp;
pub(crate) mod methods;
pub(crate) mod screen;
pub(crate) mod sensitivity;
pub(crate) mod simulate;
pub(crate) mod track;
