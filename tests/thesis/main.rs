//! The thesis' models, figures and numbers.

#[path = "../../examples/drilling_rig/mod.rs"]
mod drilling_rig;
#[path = "../support/exact.rs"]
mod exact;
#[path = "../../examples/field_rig/mod.rs"]
mod field_rig;
#[path = "../support/mod.rs"]
mod support;

mod field_data;
mod parts;
mod reduced_model;
mod rig;
mod u_tubing;
mod well;
