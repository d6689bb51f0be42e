//! A linear model.

use serde::{Deserialize, Serialize};

use crate::output::provenance::Provenance;

/// `dgd linearize`: x' = A x + B u and y = C x + D u for small deviations from a point, in the declared units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "linearize"))]
#[non_exhaustive]
pub struct LinearizeDocument {
    /// Name of the model.
    pub model: String,
    /// Time of the point, s.
    pub t: f64,
    /// Whether the point is a steady state.
    pub steady: bool,
    /// The states.
    pub states: Vec<LinearStateEntry>,
    /// Inputs, delayed inputs and their slopes.
    pub inputs: Vec<LinearInputEntry>,
    /// The outputs.
    pub outputs: Vec<LinearOutputEntry>,
    /// Unknowns that follow from the states by equations.
    pub eliminated: Vec<EliminatedEntry>,
    /// Delayed unknowns.
    pub late: Vec<DelayedUnknownEntry>,
    /// Modes of automata, sides of switches and bounds.
    pub modes: Vec<LinearModeEntry>,
    /// Slopes of the states by the states.
    #[serde(rename = "A")]
    pub a: Vec<Vec<Option<f64>>>,
    /// Slopes of the states by the inputs.
    #[serde(rename = "B")]
    pub b: Vec<Vec<Option<f64>>>,
    /// Outputs by the states.
    #[serde(rename = "C")]
    pub c: Vec<Vec<Option<f64>>>,
    /// Outputs by the inputs.
    #[serde(rename = "D")]
    pub d: Vec<Vec<Option<f64>>>,
    /// Slopes of the states by the delayed unknowns.
    #[serde(rename = "A1")]
    pub a1: Vec<Vec<Option<f64>>>,
    /// Outputs by the delayed unknowns.
    #[serde(rename = "C1")]
    pub c1: Vec<Vec<Option<f64>>>,
    /// The delayed unknowns, before their delay, by the states.
    #[serde(rename = "E")]
    pub e: Vec<Vec<Option<f64>>>,
    /// The delayed unknowns, before their delay, by the inputs.
    #[serde(rename = "F")]
    pub f: Vec<Vec<Option<f64>>>,
    /// The delayed unknowns, before their delay, by the delayed unknowns.
    #[serde(rename = "G")]
    pub g: Vec<Vec<Option<f64>>>,
    /// Poles, the rightmost first.
    pub poles: Vec<PoleEntry>,
    /// Whether these are all poles; with delays there are infinitely many.
    pub all_poles: bool,
    /// Whether disturbances fade; null if that is unknown.
    pub stable: Option<bool>,
    /// Linear combinations of states that the equations conserve, held while the steady state was sought. Each has a
    /// pole at zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub conserved: Option<Vec<ConservedEntry>>,
    /// Stability beside what is conserved, with `conserved`.
    #[serde(flatten)]
    pub otherwise: Option<StabilityOtherwise>,
    /// Inputs, seed and versions.
    pub provenance: Provenance,
}

/// A state of a linear model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LinearStateEntry {
    /// The state and its value.
    #[serde(flatten)]
    pub quantity: PointEntry,
    /// Its slope at the point, in its unit per second.
    pub slope: f64,
}

/// A quantity and its value at the point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PointEntry {
    /// In the model.
    pub name: String,
    /// Symbol of the unit.
    pub unit: String,
    /// In the unit.
    pub value: f64,
}

/// An input of a linear model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LinearInputEntry {
    /// The input and its value.
    #[serde(flatten)]
    pub quantity: PointEntry,
    /// Name of the input of the model.
    pub input: String,
    /// Its delay, s.
    pub delay: f64,
    /// Whether it is the slope of that input.
    pub slope: bool,
}

/// An output of a linear model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LinearOutputEntry {
    /// The output and its value.
    #[serde(flatten)]
    pub quantity: PointEntry,
    /// Its delay, s.
    pub delay: f64,
}

/// An unknown that follows from the states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct EliminatedEntry {
    /// The unknown and its value.
    #[serde(flatten)]
    pub quantity: PointEntry,
    /// The equation.
    pub by: String,
}

/// A delayed unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct DelayedUnknownEntry {
    /// The delayed unknown and its value.
    #[serde(flatten)]
    pub quantity: PointEntry,
    /// The unknown.
    pub unknown: String,
    /// Its delay, s.
    pub delay: f64,
}

/// A mode at the point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LinearModeEntry {
    /// The automaton, switch or bound.
    pub modes: String,
    /// Its mode or side.
    pub mode: String,
}

/// A pole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PoleEntry {
    /// Real part, 1/s.
    pub re: f64,
    /// Imaginary part, 1/s.
    pub im: f64,
    /// s; null for a pole on the imaginary axis.
    pub time_constant: Option<f64>,
    /// Damping ratio; null for a pole at zero.
    pub damping: Option<f64>,
    /// s; null without oscillation.
    pub period: Option<f64>,
}

/// Stability beside what is conserved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct StabilityOtherwise {
    /// Whether disturbances fade that do not change what is conserved; null if that is unknown.
    pub stable_otherwise: Option<bool>,
}

/// A linear combination of states that the equations conserve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ConservedEntry {
    /// The state whose coefficient is 1.
    pub named_by: String,
    /// As a formula.
    pub combination: String,
    /// Symbol of the unit.
    pub unit: String,
    /// At the point, in the unit.
    pub value: f64,
    /// At the start; it differs from `value` if modes in between did not conserve it.
    pub at_start: f64,
    /// Its terms.
    pub terms: Vec<ConservedTerm>,
    /// Whether the inputs do not change it.
    pub whatever_inputs: bool,
    /// False if the conserved quantity is nonlinear, and this its linear part close to the point.
    pub linear: bool,
    /// An output that equals it up to a factor and a constant.
    pub output: Option<String>,
}

/// A term of a conserved combination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ConservedTerm {
    /// The state.
    pub state: String,
    /// Its coefficient.
    pub coefficient: f64,
    /// Unit of the coefficient.
    pub unit: String,
}
