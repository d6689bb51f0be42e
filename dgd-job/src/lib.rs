//! Work on many wells, as pieces that any machine may do, and what their results say together.
//!
//! ```text
//!   job file ─ Job ─► pieces ─ Names ─► names ─┬─ run ──► child processes ─► Store: a result for each piece
//!                                             ├─ status: which have one
//!                                             └─ fleet ─► Fleet: tables and pages over all wells
//! ```
//!
//! A piece is one command line: a fit, a fit from one starting point, a few refits to resampled data, a profile, a search
//! for what is missing. Its name is a digest of the program, the model's texts, the data's bytes and the options, so that
//! a result that is there need not be computed again, whoever computed it. A result is there whole or not at all, and
//! nothing else says what has been done: no locks, leases, clocks or lists.
//!
//! Knows no arguments and prints nothing. Who computes a piece is given by the caller ([`work::serve`]).

pub mod fleet;
mod identity;
mod job;
mod name;
mod outcome;
mod piece;
mod status;
mod store;
pub mod work;

pub use identity::{Identity, Program};
pub use job::{Do, Job, JobError, Occasion, Well, bytes};
pub use name::Names;
pub use outcome::{Class, Outcome, document};
pub use piece::{Kind, Piece, shell};
pub use status::{Failure, Status, status};
pub use store::{Opens, Place, State, Store, is_elsewhere, set_opens};
