//! From the text of a `.dgd` model to a program: syntax, units, structure, derivatives, Rust tokens.
//!
//! Does no I/O, prints nothing, and never panics on user input. [`pipeline`] gives an overview.

pub mod codegen;
pub mod dae;
pub mod diagnostics;
pub mod effects;
pub mod expr;
pub mod model;
pub mod names;
pub mod parts;
pub mod pipeline;
pub mod program;
pub mod sentence;
pub mod source;
pub mod syntax;
#[cfg(test)]
mod tank;
pub mod units;

pub use sentence::argument;
