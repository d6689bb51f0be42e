//! Tests of the search for discrepancies.

#[path = "../support/mod.rs"]
mod support;

mod condition;
mod discrepancy;
mod guess;
mod unknown_input;
