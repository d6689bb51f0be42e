//! Effects that are hidden, and nothing hidden.

#[path = "../../examples/drilling_rig/mod.rs"]
mod drilling_rig;
#[path = "../support/examined.rs"]
mod examined;
#[path = "../support/nulls.rs"]
mod nulls;
#[path = "../support/renaming.rs"]
mod renaming;
#[path = "../support/servo.rs"]
mod servo;
#[path = "../support/transformed.rs"]
mod transformed;
#[path = "../support/uniform.rs"]
mod uniform;

use drilling_rig::random;

mod drilling;
mod elsewhere;
mod laws;
mod places;
mod plain;
mod templates;
mod terms;
mod uneven;
