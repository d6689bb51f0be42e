//! Random valid models, and oracles that find what dgd says wrongly of them.

pub mod case;
pub mod generated;
pub mod grammar;
pub mod oracle;
mod prepared;
mod random;
pub mod shrink;
mod truth;
