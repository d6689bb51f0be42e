//! Densities that a model declares.
//!
//! | file | of |
//! |---|---|
//! | `reading` | readings of an output |
//! | `process` | how far a state strays by itself |
//! | `prior` | a parameter before a fit |

pub(super) mod prior;
pub(super) mod process;
pub(super) mod reading;
