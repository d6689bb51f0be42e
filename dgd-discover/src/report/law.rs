//! Reports a law.

use super::discovery::{FoundLaw, NearForm};
use crate::fit::Fitted;
use crate::law::Law;

/// A law with the constants of its last fit.
pub(crate) fn found_law(law: &Law, fitted: &Fitted) -> FoundLaw {
    let Law { inserted, near } = law;
    let near =
        near.iter().map(|(formula, ratio)| NearForm { formula: formula.clone(), ratio: *ratio });
    FoundLaw {
        terms: inserted.terms(fitted),
        ranges: inserted.ranges.clone(),
        near: near.collect(),
    }
}
