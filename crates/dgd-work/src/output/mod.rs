//! Formats of results: columns over time, figures, tables and readable numbers.

pub(crate) mod agreement;
pub(crate) mod columns;
pub(crate) mod conserved;
pub(crate) mod figure;
mod json;
pub(crate) mod page;
pub(crate) mod provenance;
pub(crate) mod quantity;
pub mod result;
pub(crate) mod table;

pub use json::json_text;

pub(crate) use columns::{ColumnKind, NamedColumn, TimeTable};
