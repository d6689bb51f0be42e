//! Parts of the result of a simulation.

use serde::{Deserialize, Serialize};

/// A change of mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "event"))]
pub struct EventEntry {
    /// Its time, s.
    pub t: f64,
    /// The automaton.
    pub modes: String,
    /// The mode before.
    pub from: String,
    /// The mode after.
    pub to: String,
}
