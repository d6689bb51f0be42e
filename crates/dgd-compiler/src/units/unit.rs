//! A unit, and conversion to SI.

use super::dimension::Dimension;

/// A unit: `si = value * factor + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// As written, e.g. `kg/m^4`; `1` if omitted.
    pub symbol: String,
    /// Its dimension.
    pub dimension: Dimension,
    /// Its size in SI units.
    pub factor: f64,
    /// SI value at its zero: 273.15 for °C. Used only at the model's interface.
    pub offset: f64,
    /// The datum of a pressure unit that specifies one.
    pub datum: Option<Datum>,
}

impl Unit {
    /// The unit of a plain number.
    pub fn one() -> Unit {
        Unit {
            symbol: "1".to_owned(),
            dimension: Dimension::ONE,
            factor: 1.0,
            offset: 0.0,
            datum: None,
        }
    }

    /// Converts a value from this unit to SI. The datum is ignored: inside a model, its equations decide whether a
    /// pressure is absolute.
    pub fn to_si(&self, value: f64) -> f64 {
        value * self.factor + self.offset
    }

    /// Converts a value from SI to this unit.
    pub fn from_si(&self, si: f64) -> f64 {
        (si - self.offset) / self.factor
    }
}

/// The datum of a pressure unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datum {
    /// Relative to vacuum: `bara`, `psia`.
    Absolute,
    /// Relative to the standard atmosphere: `barg`, `psig`.
    Gauge,
}
