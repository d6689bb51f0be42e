//! Units: what they are called, what they measure, how they convert.

pub mod catalogue;
pub mod dimension;

pub use dimension::{Dimension, Exponent};

/// A unit: `si = value * factor + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// As written, e.g. `kg/m^4`; `1` where nothing was written.
    pub symbol: String,
    /// What it measures.
    pub dimension: Dimension,
    /// SI units in one of it.
    pub factor: f64,
    /// SI value at its zero: 273.15 for °C. Used only where values cross the model's edge.
    pub offset: f64,
    /// Which zero a pressure is counted from, where the unit says so.
    pub datum: Option<Datum>,
}

/// The zero of a labelled pressure scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datum {
    /// From vacuum: `bara`, `psia`.
    Absolute,
    /// From the standard atmosphere: `barg`, `psig`.
    Gauge,
}
