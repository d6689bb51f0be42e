//! Pieces of a job, computed one after another in child processes.
//!
//! ```text
//!   run ── lines of JSON ──► serve     a process that computes pieces and writes their results
//!    ▲                        │
//!    └──── a line for each ◄──┘        it ends with its standard input, when its parent does
//! ```
//!
//! A failure stays in its process: a panic, an abort, an out-of-memory. The piece is then recorded as failed, and the
//! next one gets a new process.

mod child;
mod memory;
mod run;
mod serve;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::identity::BuildIdentity;
use crate::piece::Piece;

pub use memory::is_limited;
pub use run::{JobShare, RunPlan, RunTally, run};
pub use serve::serve;

/// A question to a worker, one line of JSON each.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WorkerQuestion {
    /// Asks for the build.
    Identity,
    /// Asks for the computation of a piece.
    Perform(Box<PieceTask>),
}

/// A piece and its settings.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PieceTask {
    /// Its name.
    pub name: String,
    /// The piece.
    pub piece: Piece,
    /// The folder to which its paths are relative.
    pub folder: PathBuf,
    /// Where its result is stored.
    pub into: PathBuf,
    /// Threads for it.
    pub threads: usize,
    /// Memory limit, bytes.
    pub memory: Option<u64>,
    /// The reason to record it as failed instead of computing it.
    #[serde(default)]
    pub given_up: Option<String>,
}

/// The answer of a worker.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WorkerAnswer {
    /// The build.
    Identity(BuildIdentity),
    /// The piece has a result.
    Done(String),
    /// The piece failed; its document has the reason.
    Failed(String),
    /// The result cannot be written, or the question is invalid.
    Refused(String),
}
