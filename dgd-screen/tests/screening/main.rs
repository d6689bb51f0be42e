//! Planted faults, and none.

#[path = "../support/mod.rs"]
mod support;

mod faults;
mod motion;
mod noise;
mod residuals;
