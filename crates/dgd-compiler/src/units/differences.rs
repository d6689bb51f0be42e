//! The unit of differences of values in a unit.

use super::catalogue::CATALOGUE;
use super::read::parse_unit;
use super::unit::Unit;

impl Unit {
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
        let rows = CATALOGUE.iter().map(|row| row.symbol);
        let mut units = unlabelled.into_iter().chain(rows).filter_map(|s| parse_unit(s).ok());
        let otherwise = || Unit { offset: 0.0, datum: None, ..self.clone() };
        units.find(is_plain).unwrap_or_else(otherwise)
    }
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
