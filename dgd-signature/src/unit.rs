//! A unit as a model declares it.

use crate::Text;

/// A unit as the model declares it: SI = value · factor + offset.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// As written.
    pub symbol: Text,
    /// SI units in one of it.
    pub factor: f64,
    /// SI value at its zero.
    pub offset: f64,
}

impl Unit {
    /// The value in this unit of one in SI.
    pub fn from_si(&self, si: f64) -> f64 {
        (si - self.offset) / self.factor
    }
}
