//! Late values and memory: the history of a run, where it is not smooth, and what another run goes on from.

pub(in crate::integrate) mod discontinuities;
pub(in crate::integrate) mod history;
mod kept_step;
pub(in crate::integrate) mod memory;
pub(in crate::integrate) mod moving_jump;
