//! The system to be solved: M ẏ = f(t, y, u, p, z) with M(z) = diag(1 or 0), square and of index 1.
//!
//! z are the discrete numbers, which change at events only: the mode of each `modes` block, counted
//! from 0, then one for each condition on time, 1 where it holds and 0 where it does not.

mod assemble;
mod counts;
mod delays;
mod dulmage_mendelsohn;
mod dummy_derivatives;
mod explicit;
mod identity;
mod index_reduction;
mod linear_derivatives;
mod matching;
mod modes;
mod readers;
mod refusal;
mod state_selection;
mod symbols;
pub mod text;
mod time_conditions;
mod transfer;
mod variables;

use std::collections::BTreeMap;

use crate::expr::{ExprId, Graph};
use crate::model::{Crossing, Declared, Input, Parameter, Variant};
use crate::source::Span;
use crate::units::Unit;

pub use assemble::assemble;

/// What `assemble` promises:
///
/// - as many rows as unknowns, row i of unknown i: ẏᵢ = fᵢ where it is differential, else 0 = fᵢ,
/// - the algebraic rows determine the algebraic unknowns structurally: the index is 1 at most,
/// - both hold in every combination of modes, between which the rows choose by z,
/// - expressions are simplified and hold times, parameters, inputs, unknowns and discrete numbers
///   only; comparisons that parameters and time decide are discrete numbers,
/// - nothing in them is delayed: what arrives late is an input behind the declared ones, and what
///   is read late is an output with a delay.
///
/// A derivative that cannot be solved for row by row has become an algebraic unknown of its own,
/// named `der(x)`; a combination of derivatives that can be, the derivative of an unknown named as
/// the combination. Equations that only tied states together stand beside their derivatives, and
/// as many of the states have become algebraic; where which of them can be changes along a
/// solution, an automaton of kind [`AutomatonKind::States`] chooses.
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
    /// Distinct delays.
    pub delays: Vec<Delay>,
    /// Inputs u behind the declared ones: declared inputs that arrive late.
    pub delayed_inputs: Vec<DelayedInput>,
    /// Inputs that equations are differentiated through: they must not jump.
    pub differentiated_inputs: Vec<DifferentiatedInput>,
    /// Outputs; their values are expressions of `graph`.
    pub outputs: Vec<Output>,
    /// Names that the model gives to expressions.
    pub names: BTreeMap<ExprId, String>,
    /// What was chosen.
    pub variants: Vec<Variant>,
    /// `modes` blocks; the mode of the k-th is the k-th discrete number.
    pub automata: Vec<Automaton>,
    /// Conditions on time; their discrete numbers follow those of the modes.
    pub time_conditions: Vec<TimeCondition>,
}

/// A `modes` block: the equations are in the rows, what is left are its transitions.
#[derive(Debug, Clone)]
pub struct Automaton {
    /// Its name.
    pub name: String,
    /// What its modes are.
    pub kind: AutomatonKind,
    /// Names of its modes.
    pub modes: Vec<String>,
    /// The mode it starts in.
    pub start: usize,
    /// Which mode follows which, and when.
    pub transitions: Vec<Transition>,
}

/// What the modes of an automaton are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AutomatonKind {
    /// Those of a `modes` block.
    Modes,
    /// Which unknowns are states, of those that constraints tie together: the solution is the same
    /// in all of them.
    States,
}

/// A transition between modes, when the event function passes zero.
#[derive(Debug, Clone)]
pub struct Transition {
    /// Position of the mode that it leaves.
    pub from: usize,
    /// Position of the mode that it enters.
    pub to: usize,
    /// The event function.
    pub event: ExprId,
    /// In which direction it passes zero.
    pub crossing: Crossing,
    /// Unknowns that get a new value, and the values.
    pub resets: Vec<(usize, ExprId)>,
}

/// A condition that switches once, at a time of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeCondition {
    /// When; minus infinity where it has always been as it is.
    pub at: ExprId,
    /// Its discrete number from then on; before, the other of 0 and 1.
    pub after: ExprId,
}

/// How late something is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Delay {
    /// τ, of parameters only, s.
    pub tau: ExprId,
    /// As formulas write it.
    pub text: String,
}

/// An input u(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DelayedInput {
    /// Which of the declared inputs.
    pub input: usize,
    /// Which delay.
    pub delay: usize,
}

/// An input that an equation is differentiated through.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DifferentiatedInput {
    /// Which of the declared inputs.
    pub input: usize,
    /// Label of the equation.
    pub equation: String,
}

/// An output w(t) = E(t − τ).
#[derive(Debug, Clone)]
pub struct Output {
    /// Name, place, unit, doc.
    pub declared: Declared,
    /// E.
    pub value: ExprId,
    /// Standard deviation of the sensor's white error, SI.
    pub noise: Option<f64>,
    /// Which delay is τ; none is zero.
    pub delay: Option<usize>,
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
    /// Whether its row is ẏ = f in the modes it starts in; otherwise 0 = f.
    pub differential: bool,
    /// Its number on the diagonal of M, 1 or 0, by the modes.
    pub mass: ExprId,
    /// f.
    pub rhs: ExprId,
    /// Start value, a guess where it is algebraic.
    pub start: ExprId,
    /// Its start value is not estimated.
    pub fixed: bool,
    /// Label of the equation that the row comes from; all of them where modes have others.
    pub equation: String,
    /// Where the equation of the modes it starts in stands.
    pub span: Span,
}

impl Dae {
    /// What the i-th input is called, declared, delayed or the slope of a delayed one.
    ///
    /// # Panics
    ///
    /// If there is no such input.
    pub fn input_name(&self, i: usize) -> String {
        let name = |i: usize| &self.inputs[i].declared.name;
        match i.checked_sub(self.inputs.len()) {
            None => name(i).clone(),
            Some(late) if late >= self.delayed_inputs.len() => {
                let of = self.inputs.len() + late - self.delayed_inputs.len();
                format!("der({})", self.input_name(of))
            }
            Some(late) => {
                let DelayedInput { input, delay } = self.delayed_inputs[late];
                format!("delay({}, {})", name(input), self.delays[delay].text)
            }
        }
    }
}
