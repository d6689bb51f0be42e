//! Records with planted faults, and without.

#[path = "../support/mod.rs"]
mod support;

mod faults;
mod motion;
mod noise;
mod residuals;
