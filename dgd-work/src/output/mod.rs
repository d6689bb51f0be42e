//! What results are made into: columns over time, figures, tables and numbers for people.

pub mod columns;
pub mod figure;
pub mod provenance;
pub mod quantity;
pub mod table;

pub use columns::{Kind, NamedColumn, TimeTable};
