//! What is read late.

#[path = "../support/inline.rs"]
mod inline;
#[path = "../support/mod.rs"]
mod support;

mod delay_equations;
mod delays;
mod jumping_delays;
mod neutral_equations;
