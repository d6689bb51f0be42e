//! The status of a job: which pieces are done, have failed, or are open.

use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;
use serde_json::{Value, json};

use crate::identity::BuildIdentity;
use crate::job::{Job, JobError};
use crate::name::PieceKeys;
use crate::outcome::PieceDocument;
use crate::piece::Piece;
use crate::store::{FleetStore, PieceState};
use crate::syntax::OptionSyntax;

/// Failures listed in the text.
const MOST_TOLD: usize = 20;

/// The progress of a job.
#[derive(Debug, Clone)]
pub struct JobStatus {
    /// Number of pieces.
    pub pieces: usize,
    /// Number of pieces done.
    pub done: usize,
    /// Failed pieces.
    pub failures: Vec<FailedPiece>,
    /// Numbers and names of the pieces without a result.
    pub open: Vec<(usize, String)>,
    /// The build to which the results belong.
    pub identity: BuildIdentity,
}

/// A piece that failed.
#[derive(Debug, Clone, Serialize)]
pub struct FailedPiece {
    /// Its number.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// The well.
    pub well: String,
    /// The date of its recordings.
    pub when: String,
    /// Its task.
    pub what: String,
    /// The error.
    pub error: String,
    /// The command line that reproduces the failure, in the folder of the job.
    pub command: String,
}

/// Looks up the result of each piece of a job, as computed by this build.
///
/// # Errors
///
/// The results cannot be listed.
pub fn status(
    job: &Job,
    store: &FleetStore,
    identity: &BuildIdentity,
    syntax: OptionSyntax,
) -> Result<JobStatus, JobError> {
    let names = PieceKeys::new(&job.folder, identity, syntax);
    let there = store.all()?;
    let mut status = JobStatus {
        pieces: job.len(),
        done: 0,
        failures: Vec::new(),
        open: Vec::new(),
        identity: identity.clone(),
    };
    for (index, piece) in job.pieces().enumerate() {
        let name = names.key(&piece);
        match there.get(&name) {
            Some(PieceState::Done) => status.done += 1,
            Some(PieceState::Failed) => {
                status.failures.push(failure(index, name, &piece, (store, syntax))?);
            }
            None => status.open.push((index, name)),
        }
    }
    Ok(status)
}

fn failure(
    index: usize,
    name: String,
    piece: &Piece,
    (store, syntax): (&FleetStore, OptionSyntax),
) -> Result<FailedPiece, JobError> {
    let text = store.read(&name)?.map(|(_, text)| text).unwrap_or_default();
    let error = PieceDocument::read(&text).err().unwrap_or_default();
    let (well, when) = (piece.well.clone(), piece.when.clone());
    let (what, command) = (piece.kind.to_string(), piece.command(syntax));
    Ok(FailedPiece { index, name, well, when, what, error, command })
}

impl JobStatus {
    /// As JSON.
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

    /// As text.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{} pieces: {} done, {} failed, {} open\n",
            self.pieces,
            self.done,
            self.failures.len(),
            self.open.len()
        );
        // Writing to a string cannot fail.
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
