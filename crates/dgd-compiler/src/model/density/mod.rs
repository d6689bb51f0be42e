//! Densities that a model declares.
//!
//! | file | density of |
//! |---|---|
//! | `reading` | readings of an output |
//! | `process` | process noise of a state |
//! | `prior` | a parameter before a fit |

pub(super) mod prior;
pub(super) mod process;
pub(super) mod reading;
