//! Solutions of small systems written by hand.

#[path = "../support/mod.rs"]
mod support;

mod accuracy;
mod allocation;
mod failures;
mod jumps;
mod large;
mod per_sample;
mod singular;
mod stiff;
mod stopping;
