//! Plain causes: wrong numbers and faults of recordings, which come before any effect.
//!
//! ```text
//!   the model's text ─► each constant, each parameter that is not estimated      (numbers)
//!                       start values that are held                                (starts)
//!                       and the rate of the clock                                 (own_values)
//!     ─► the model with it estimated, from its value and from those that
//!        a slip of the unit would give                                           (trial)
//!   the recordings   ─► columns in another unit, exchanged, held or not, times    (columns)
//!                       and columns that are stuck                                (stuck)
//!     ─► the model fitted to them without the fault                               (trial)
//!     ─► those that leave only noise, the likeliest first, with their twins      (judged)
//!   otherwise, recordings that differ in one thing                               (differ, own_values)
//! ```
//!
//! A cause is an answer only if it leaves no more than noise, and if no effect or law is clearly more likely.

mod column_fault;
mod columns;
mod differ;
mod groups;
mod judged;
mod model_number;
mod numbers;
mod own_values;
mod recorded_columns;
mod search;
mod starts;
mod stuck;
mod suspicion;
mod trial;

pub(crate) use column_fault::{ColumnFault, StuckColumn, between};
pub(crate) use groups::{DifferingValue, RecordingGroups};
pub(crate) use judged::{AnsweringCauses, PlainAnswer};
pub(crate) use model_number::ModelNumber;
pub(crate) use own_values::{RATE, is_brought};
pub(crate) use search::PlainSearch;
pub(crate) use suspicion::{FittedSuspicion, HeldStart, Suspicion};
