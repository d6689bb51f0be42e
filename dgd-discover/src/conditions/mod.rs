//! What coincides with windows of time: windows and known quantities in, a condition out that holds in them
//! and nowhere else.
//!
//! [`Circumstances`] are what was known in the training recordings, [`condition()`] is the search and its test:
//! time in a grid of cells, and comparisons with thresholds in them.

mod circumstances;
mod comparison;
mod condition;
mod grid;
mod known;

pub(crate) use circumstances::Circumstances;
pub use condition::{Condition, ConditionKind, condition};
pub use known::{KnownKind, KnownQuantity};
