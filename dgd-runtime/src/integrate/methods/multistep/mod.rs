//! Multistep methods.

mod bdf;
mod order;

pub(in crate::integrate) use bdf::{Bdf, BdfHistory, MAX_ORDER, error_constant};
