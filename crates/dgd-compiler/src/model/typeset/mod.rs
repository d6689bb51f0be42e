//! Typesetting of a model's equations: built once as formulas, written in several languages.

pub mod formula;
pub mod latex;
pub mod markdown;
pub mod mathml;
