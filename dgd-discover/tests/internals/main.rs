//! Where a discrepancy is.

#[path = "../support/mod.rs"]
mod support;

mod condition;
mod discrepancy;
mod guess;
mod unknown_input;
