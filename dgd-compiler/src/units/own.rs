//! Units that a file declares: `unit stroke = 0.118 [l]`.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Dimension, Unit, parse_unit};
use crate::source::DeclaredUnit;

/// A unit that a file declares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OwnUnit {
    /// What it measures.
    pub dimension: Dimension,
    /// SI units in one of it.
    pub factor: f64,
}

impl OwnUnit {
    /// So many of a unit. Where that has a zero of its own, as °C, its differences count.
    pub fn of(value: f64, unit: &Unit) -> OwnUnit {
        OwnUnit { dimension: unit.dimension, factor: value * unit.factor }
    }
}

/// The units that a file declares and sees, by their symbols.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OwnUnits(Option<Arc<BTreeMap<String, OwnUnit>>>);

impl OwnUnits {
    /// These.
    pub fn new(units: BTreeMap<String, OwnUnit>) -> OwnUnits {
        OwnUnits((!units.is_empty()).then(|| Arc::new(units)))
    }

    /// Those that a model declares.
    pub fn declared(all: &[DeclaredUnit]) -> OwnUnits {
        let one = |of: &DeclaredUnit| {
            let unit = parse_unit(&of.unit).ok()?;
            Some((of.symbol.clone(), OwnUnit::of(of.value, &unit)))
        };
        OwnUnits::new(all.iter().filter_map(one).collect())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// The unit with this symbol.
    pub fn get(&self, symbol: &str) -> Option<OwnUnit> {
        self.0.as_ref()?.get(symbol).copied()
    }

    /// All, by their symbols.
    pub fn iter(&self) -> impl Iterator<Item = (&str, OwnUnit)> {
        let all = self.0.iter().flat_map(|units| units.iter());
        all.map(|(symbol, unit)| (symbol.as_str(), *unit))
    }

    /// These, and those of others whose symbols these do not have.
    #[must_use]
    pub fn and(&self, others: &OwnUnits) -> OwnUnits {
        let mut units = self.0.as_deref().cloned().unwrap_or_default();
        for (symbol, unit) in others.iter() {
            units.entry(symbol.to_owned()).or_insert(unit);
        }
        OwnUnits::new(units)
    }
}
