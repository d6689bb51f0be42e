//! Which pieces of a job are done, have failed, and are open.

use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;
use serde_json::{Value, json};

use crate::identity::Identity;
use crate::job::{Job, JobError};
use crate::name::Names;
use crate::piece::Piece;
use crate::store::{State, Store};

/// So many failures are told of in words.
const MOST_TOLD: usize = 20;

/// How far a job is.
#[derive(Debug, Clone)]
pub struct Status {
    /// How many pieces there are.
    pub pieces: usize,
    /// How many are done.
    pub done: usize,
    /// Those that failed.
    pub failures: Vec<Failure>,
    /// The numbers and names of those without a result.
    pub open: Vec<(usize, String)>,
    /// The build whose results are counted.
    pub identity: Identity,
}

/// A piece that failed.
#[derive(Debug, Clone, Serialize)]
pub struct Failure {
    /// Its number.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// The well.
    pub well: String,
    /// When its recordings were made.
    pub when: String,
    /// What was done.
    pub what: String,
    /// Why it failed.
    pub error: String,
    /// The command line that fails in the same way, in the folder of the job.
    pub command: String,
}

/// Asks the store for each piece of a job, as this build computes it.
///
/// # Errors
///
/// It cannot be said which results there are.
pub fn status(job: &Job, store: &Store, identity: &Identity) -> Result<Status, JobError> {
    let names = Names::new(&job.folder, identity);
    let there = store.all()?;
    let mut all = Status {
        pieces: job.len(),
        done: 0,
        failures: Vec::new(),
        open: Vec::new(),
        identity: identity.clone(),
    };
    for (index, piece) in job.pieces().enumerate() {
        let name = names.of(&piece);
        match there.get(&name) {
            Some(State::Done) => all.done += 1,
            Some(State::Failed) => all.failures.push(failure(index, name, &piece, store)?),
            None => all.open.push((index, name)),
        }
    }
    Ok(all)
}

fn failure(index: usize, name: String, piece: &Piece, store: &Store) -> Result<Failure, JobError> {
    let text = store.read(&name)?.map(|(_, text)| text).unwrap_or_default();
    let value: Value = serde_json::from_str(&text).unwrap_or_default();
    let error = value["error"].as_str().unwrap_or("its result cannot be read").to_owned();
    let (well, when) = (piece.well.clone(), piece.when.clone());
    let (what, command) = (piece.kind.to_string(), piece.command());
    Ok(Failure { index, name, well, when, what, error, command })
}

impl Status {
    /// For programs.
    pub fn to_json(&self, job: &Path, into: &Path) -> Value {
        let open = self.open.iter().map(|(index, name)| json!({ "index": index, "name": name }));
        json!({
            "job": job.display().to_string(),
            "into": into.display().to_string(),
            "identity": self.identity,
            "pieces": self.pieces,
            "done": self.done,
            "failed": self.failures.len(),
            "open": self.open.len(),
            "failures": self.failures,
            "open_pieces": open.collect::<Vec<Value>>(),
        })
    }

    /// For people.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{} pieces: {} done, {} failed, {} open\n",
            self.pieces,
            self.done,
            self.failures.len(),
            self.open.len()
        );
        // Writing to a string does not fail.
        for one in self.failures.iter().take(MOST_TOLD) {
            let first = one.error.lines().next().unwrap_or_default();
            let _ = writeln!(
                text,
                "failed: {} of {} at {}, number {}: {first}\n  {}",
                one.what, one.well, one.when, one.index, one.command
            );
        }
        if let Some(more @ 1..) = self.failures.len().checked_sub(MOST_TOLD) {
            let _ = writeln!(text, "and {more} more failures");
        }
        text
    }
}
