//! Multistep methods.

mod bdf;
mod order;

pub(in crate::integrate) use bdf::{Bdf, History, MAX_ORDER, error_constant};
