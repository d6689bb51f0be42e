//! Finds the condition that coincides with time windows: windows and known quantities in, a condition that holds in
//! them and rarely elsewhere out.
//!
//! [`Circumstances`] are the known quantities of the training recordings; [`condition()`] is the search and its test,
//! which compares them with thresholds on a grid of time cells.

mod circumstances;
mod comparison;
mod condition;
mod grid;
mod known;
mod regime;

pub(crate) use circumstances::Circumstances;
pub use condition::{ConditionKind, WindowCondition, condition};
pub use known::{KnownKind, KnownQuantity};
pub(crate) use regime::ConditionRegime;
