//! The system to be solved: M ẏ = f(t, y, u, p) with M = diag(1 or 0), square and of index 1.

mod assemble;
mod matching;
pub mod text;

use std::collections::BTreeMap;

use crate::expr::{ExprId, Graph};
use crate::model::{Input, Output, Parameter, Variant};
use crate::source::Span;
use crate::units::Unit;

pub use assemble::assemble;

/// What `assemble` promises:
///
/// - as many rows as unknowns, row i of unknown i: ẏᵢ = fᵢ where it is differential, else 0 = fᵢ,
/// - the algebraic rows determine the algebraic unknowns structurally: the index is 1 at most,
/// - expressions are simplified and hold times, parameters, inputs and unknowns only.
///
/// A derivative that cannot be solved for row by row has become an algebraic unknown of its own,
/// named `der(x)`.
#[derive(Debug, Clone)]
pub struct Dae {
    /// The model's name.
    pub name: String,
    /// The model's doc comment.
    pub doc: Vec<String>,
    /// All expressions.
    pub graph: Graph,
    /// Unknowns and their rows, as declared, then those that were added.
    pub unknowns: Vec<Unknown>,
    /// Parameters, as declared.
    pub parameters: Vec<Parameter>,
    /// Inputs, as declared.
    pub inputs: Vec<Input>,
    /// Outputs; their values are expressions of `graph`.
    pub outputs: Vec<Output>,
    /// Names that the model gives to expressions.
    pub names: BTreeMap<ExprId, String>,
    /// What was chosen.
    pub variants: Vec<Variant>,
}

/// An unknown and its row.
#[derive(Debug, Clone)]
pub struct Unknown {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Size for tolerances, SI.
    pub nominal: Option<f64>,
    /// Whether its row is ẏ = f; otherwise 0 = f.
    pub differential: bool,
    /// f.
    pub rhs: ExprId,
    /// Start value, a guess where it is algebraic.
    pub start: ExprId,
    /// Its start value is not estimated.
    pub fixed: bool,
    /// Label of the equation that the row comes from.
    pub equation: String,
    /// Where that equation stands.
    pub span: Span,
}
