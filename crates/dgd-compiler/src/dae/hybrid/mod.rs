//! Events: switches in rows, bounds, and conditions on time.

pub(super) mod exact;
mod lines;
pub(super) mod saturate;
mod smoothness;
pub(super) mod switches;
pub(super) mod time_conditions;
