//! Units: symbols, dimensions and conversion.

pub mod catalogue;
pub mod dimension;
mod grammar;
mod mistaken;
mod own;
mod read;

pub use catalogue::{convert, describe, which_is_meant};
pub use dimension::{Dimension, Exponent};
pub use mistaken::mistaken;
pub use own::{OwnUnit, OwnUnits};
pub use read::{UnitError, UnitErrorKind, parse_unit, parse_unit_with, read_unit};

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

    /// The unit of differences of values in this unit: bar of `bara`, K of `°C`.
    #[must_use]
    pub fn of_differences(&self) -> Unit {
        if self.datum.is_none() && self.offset == 0.0 {
            return self.clone();
        }
        let is_plain = |unit: &Unit| {
            let alike = unit.dimension == self.dimension && unit.factor == self.factor;
            alike && unit.offset == 0.0 && unit.datum.is_none()
        };
        // The datum is the last letter: `bara`, `psig`.
        let labelled = self.datum.and_then(|_| self.symbol.char_indices().next_back());
        let unlabelled = labelled.map(|(last, _)| &self.symbol[..last]);
        let rows = catalogue::CATALOGUE.iter().map(|row| row.symbol);
        let mut units = unlabelled.into_iter().chain(rows).filter_map(|s| parse_unit(s).ok());
        let otherwise = || Unit { offset: 0.0, datum: None, ..self.clone() };
        units.find(is_plain).unwrap_or_else(otherwise)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_have_no_zero() {
        for (unit, differences) in [
            ("bara", "bar"),
            ("mbarg", "mbar"),
            ("psig", "psi"),
            ("°C", "K"),
            ("degF", "°R"),
            ("lpm", "lpm"),
            ("°C/m", "°C/m"),
        ] {
            let unit = parse_unit(unit).expect("a unit of the catalogue");
            let difference = unit.of_differences();
            assert_eq!(difference.symbol, differences);
            assert_eq!((difference.factor, difference.offset), (unit.factor, 0.0));
        }
    }
}
