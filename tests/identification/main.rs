//! Estimates from recordings, by every estimator.

#[path = "../support/examined.rs"]
mod examined;
#[path = "../support/recorded.rs"]
mod recorded;
#[path = "../support/mod.rs"]
mod support;

mod filtering;
mod filters;
mod filters_with_a_past;
mod nist;
mod output_error;
mod regression;
mod uncertainty;
