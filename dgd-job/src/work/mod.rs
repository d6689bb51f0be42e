//! Pieces of a job, computed one after another in child processes.
//!
//! ```text
//!   run ── lines of JSON ──► serve     a process that computes pieces and writes their results
//!    ▲                        │
//!    └──── a line for each ◄──┘        its parent's end is the end of its standard input, and ends it
//! ```
//!
//! What goes wrong with a piece stays in its process: a panic, an abort, memory without end. The piece then has a result
//! that says so, and the next one gets a new process.

mod child;
mod memory;
mod run;
mod serve;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::identity::Identity;
use crate::piece::Piece;

pub use memory::is_limited;
pub use run::{Plan, Share, Tally, run};
pub use serve::serve;

/// What a worker is asked, one line of JSON each.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ask {
    /// Which build it is.
    Identity,
    /// To do a piece.
    Perform(Box<Task>),
}

/// A piece and where it is done.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Task {
    /// Its name.
    pub name: String,
    /// The piece.
    pub piece: Piece,
    /// The folder that its paths are seen from.
    pub folder: PathBuf,
    /// Where its result belongs.
    pub into: PathBuf,
    /// Threads for it.
    pub threads: usize,
    /// Most memory for it, bytes.
    pub memory: Option<u64>,
    /// Why it is not tried again: a failure to be written.
    #[serde(default)]
    pub given_up: Option<String>,
}

/// What a worker answers.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// Which build it is.
    Identity(Identity),
    /// The piece has a result.
    Done(String),
    /// The piece has a result that says why it failed.
    Failed(String),
    /// The result cannot be written, or the question makes no sense.
    Refused(String),
}
