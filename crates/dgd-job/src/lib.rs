//! Jobs on many wells, split into pieces that any machine can compute, and reports on their results.
//!
//! ```text
//!   job file ─ Job ─► pieces ─ Names ─► names ─┬─ run ──► child processes ─► Store: a result for each piece
//!                                             ├─ status: which pieces have a result
//!                                             └─ fleet ─► Fleet: tables and pages over all wells
//! ```
//!
//! A piece is one command line: a fit, a fit from one starting point, a few refits to resampled data, a profile, a
//! search for missing terms. Its name is a digest of the program, the model's texts, the data's bytes and the options,
//! so that an existing result need not be computed again, on whatever machine it was computed. A result is either
//! complete or absent, and is the only record of progress: there are no locks, leases, clocks or lists.
//!
//! This crate does not parse arguments or print. The caller provides the notation of options ([`OptionSyntax`]) and the
//! function that computes a piece ([`work::serve`]).

pub mod fleet;
mod identity;
mod job;
mod name;
mod outcome;
mod piece;
mod status;
mod store;
mod syntax;
pub mod work;

pub use identity::{BuildIdentity, ProgramFile};
pub use job::{Asset, ExpectedValue, Job, JobError, JobMistake, Period, PeriodTask, bytes};
pub use name::PieceKeys;
pub use outcome::{FailureClass, PieceOutcome, document};
pub use piece::{Piece, PieceKind, shell};
pub use status::{FailedPiece, JobStatus, status};
pub use store::{FleetStore, KeyValueStore, PieceState, StoreOpener, is_elsewhere, set_opens};
pub use syntax::{GivenWord, OptionSyntax};
