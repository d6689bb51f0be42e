//! The commands, one file each.

pub(crate) mod adopt;
pub(crate) mod compare;
pub(crate) mod discover;
mod ensemble;
pub(crate) mod fit;
pub(crate) mod invert;
pub(crate) mod job;
pub(crate) mod linearize;
pub(crate) mod new;
pub(crate) mod screen;
pub(crate) mod sensitivity;
pub(crate) mod simulate;
mod text;
pub(crate) mod track;
pub(crate) mod watch;

pub(crate) use text::{check, emit, explain, fmt, lsp, man, methods, schema, shells};
