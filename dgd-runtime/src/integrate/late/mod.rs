//! What is read late, and what another run goes on from: the history of a run, and where it is not smooth.

pub(in crate::integrate) mod discontinuities;
pub(in crate::integrate) mod history;
mod kept_step;
pub(in crate::integrate) mod memory;
pub(in crate::integrate) mod moving_jump;
