//! Where a discrepancy is.

#[path = "../support/mod.rs"]
mod support;

mod condition;
mod discrepancy;
mod unknown_input;
