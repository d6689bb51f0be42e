//! Methods with several steps.

pub(in crate::integrate) mod bdf;
mod order;
