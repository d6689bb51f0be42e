//! What results are made into: columns over time, figures, tables and numbers for people.

pub(crate) mod agreement;
pub(crate) mod columns;
pub(crate) mod figure;
pub(crate) mod page;
pub(crate) mod provenance;
pub(crate) mod quantity;
pub(crate) mod table;

pub(crate) use columns::{Kind, NamedColumn, TimeTable};
