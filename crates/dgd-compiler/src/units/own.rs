//! Units that a file declares: `unit stroke = 0.118 [l]`.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::dimension::Dimension;
use super::unit::Unit;

/// A unit that a file declares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnUnit {
    /// Its dimension.
    pub dimension: Dimension,
    /// Its size in SI units.
    pub factor: f64,
}

impl OwnUnit {
    /// A multiple of a unit. The offset of a unit such as °C is ignored.
    pub fn from_unit(value: f64, unit: &Unit) -> OwnUnit {
        OwnUnit { dimension: unit.dimension, factor: value * unit.factor }
    }
}

/// The units that a file declares and sees, by symbol.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OwnUnits(Option<Arc<BTreeMap<String, OwnUnit>>>);

impl OwnUnits {
    /// A set of these units.
    pub fn new(units: BTreeMap<String, OwnUnit>) -> OwnUnits {
        OwnUnits((!units.is_empty()).then(|| Arc::new(units)))
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// The unit with this symbol.
    pub fn get(&self, symbol: &str) -> Option<OwnUnit> {
        self.0.as_ref()?.get(symbol).copied()
    }

    /// All units, by symbol.
    pub fn iter(&self) -> impl Iterator<Item = (&str, OwnUnit)> {
        let pairs = self.0.iter().flat_map(|units| units.iter());
        pairs.map(|(symbol, unit)| (symbol.as_str(), *unit))
    }

    /// These units, and those of others with different symbols.
    #[must_use]
    pub fn and(&self, others: &OwnUnits) -> OwnUnits {
        let mut units = self.0.as_deref().cloned().unwrap_or_default();
        for (symbol, unit) in others.iter() {
            units.entry(symbol.to_owned()).or_insert(unit);
        }
        OwnUnits::new(units)
    }
}
