//! A unit as a model declares it.

use crate::Text;

/// A unit as the model declares it: SI = value · factor + offset.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Its symbol, as written.
    pub symbol: Text,
    /// Number of SI units in one of it.
    pub factor: f64,
    /// SI value of its zero.
    pub offset: f64,
}

impl Unit {
    /// Converts a value from SI to this unit.
    pub fn from_si(&self, si: f64) -> f64 {
        (si - self.offset) / self.factor
    }
}
