//! Unknowns, parameters, inputs and outputs: names, units, sizes, bounds.

use crate::{Text, Unit};

/// An unknown of the system.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    /// Name in the model.
    pub name: Text,
    /// Declared unit.
    pub unit: Unit,
    /// Size for tolerances, SI; `None`: the magnitude of its start value.
    pub nominal: Option<f64>,
    /// Whether row i is ẏᵢ = fᵢ in the starting modes; otherwise 0 = fᵢ.
    pub differential: bool,
}

/// A parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name in the model.
    pub name: Text,
    /// Declared unit.
    pub unit: Unit,
    /// Declared value, SI.
    pub value: f64,
    /// Lower bound, SI; minus infinity without one.
    pub lower: f64,
    /// Upper bound, SI; infinity without one.
    pub upper: f64,
    /// Size for scaling, SI; `None`: its value, or 1 in the declared unit if that is zero.
    pub nominal: Option<f64>,
    /// Whether its logarithm is estimated.
    pub log: bool,
    /// Whether estimators leave it unchanged unless it is requested.
    pub fixed: bool,
}

/// Interpolation of an input between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// The sample holds until the next.
    Hold,
    /// A straight line to the next sample.
    Linear,
}

impl Interpolation {
    /// Its name in the source of a generated model.
    pub fn ident(self) -> &'static str {
        match self {
            Self::Hold => "Hold",
            Self::Linear => "Linear",
        }
    }
}

/// An input.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name in the model.
    pub name: Text,
    /// Declared unit.
    pub unit: Unit,
    /// Interpolation between samples.
    pub interpolation: Interpolation,
}

/// An output.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Name in the model.
    pub name: Text,
    /// Declared unit.
    pub unit: Unit,
    /// Standard deviation of the sensor's white error, SI.
    pub noise: Option<f64>,
    /// Its delay, by position: w(t) is the value of the model's output function at t − τ.
    pub delay: Option<usize>,
}
