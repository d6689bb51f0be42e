//! Delayed values and memory: the history of a run, its discontinuities, and the state from which another run
//! continues.

pub(in crate::integrate) mod discontinuities;
pub(in crate::integrate) mod history;
mod kept_step;
pub(in crate::integrate) mod memory;
pub(in crate::integrate) mod moving_jump;
