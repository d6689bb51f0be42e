//! Runs a piece of a job as its command.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;

use clap::Parser;
use dgd_job::work::PieceTask;
use dgd_job::{FailureClass, Job, Piece, PieceOutcome};
use dgd_work::{Remarks, TaskContext, TaskEnd, WorkError, discover, fit};

use crate::args::{Cli, Command};
use crate::command_line::{OPTIONS, option};
use crate::crash;
use crate::scratch;

/// Extensions of a discovery's files that a result contains: texts for further use.
const TEXTS: [&str; 2] = [".dgd", ".diff"];

/// Checks that every piece is a valid command line before any is computed; the error gives the options.
pub(super) fn verify(job: &Job) -> Result<(), String> {
    let mut known = BTreeSet::new();
    for piece in job.pieces() {
        // Validity depends on the options only, not on the recordings.
        if known.insert((piece.kind.command(), piece.options.clone())) {
            parsed(&piece)?;
        }
    }
    Ok(())
}

/// The command of a piece, or the reason why it is invalid.
fn parsed(piece: &Piece) -> Result<Command, String> {
    let words = std::iter::once("dgd".to_owned()).chain(piece.words(OPTIONS)).map(OsString::from);
    let cli = Cli::try_parse_from(words).map_err(|error| {
        let text = error.to_string();
        let text = text.trim_start_matches("error: ").trim_end();
        format!("{} of `{}`: {text}", piece.kind, piece.well)
    })?;
    Ok(cli.command)
}

/// Computes a piece; a crash is an outcome as well.
pub(super) fn perform(task: &PieceTask) -> PieceOutcome {
    let computed = crash::caught(|| computed(task));
    computed.unwrap_or_else(|crash| PieceOutcome::failed(FailureClass::Mistake, crash.to_string()))
}

fn computed(task: &PieceTask) -> PieceOutcome {
    let piece = &task.piece;
    if let Some(memory) = task.memory {
        scratch::limit_pieces(memory);
    }
    let remarks = Remarks::new(option);
    let session =
        TaskContext::new(&remarks).with_seed(piece.seed).with_threads(task.threads.max(1));
    let performed = match parsed(piece) {
        Err(message) => return PieceOutcome::failed(FailureClass::Usage, message),
        Ok(Command::Fit(args)) => {
            let mut request = args.request(None);
            request.command = piece.command(OPTIONS);
            fit(&request, session).map(|fitted| {
                let files = BTreeMap::new();
                (fitted.to_json().clone(), stopped(fitted.ended(None)), files)
            })
        }
        Ok(Command::Discover(args)) => {
            let mut request = args.request(None);
            request.command = piece.command(OPTIONS);
            discover(&request, session)
                .and_then(|found| Ok((found.to_json(), None, texts(&found)?)))
        }
        Ok(_) => return PieceOutcome::failed(FailureClass::Usage, "this is not a piece of work"),
    };
    match performed {
        Ok((result, stopped, files)) => {
            PieceOutcome::Done { result, stopped, remarks: remarks.all(), files }
        }
        Err(error) => failed(&error),
    }
}

/// Why a result is incomplete.
fn stopped(ended: TaskEnd) -> Option<String> {
    match ended {
        TaskEnd::Done => None,
        TaskEnd::Found(words) | TaskEnd::Stopped(words) | TaskEnd::Interrupted(words) => {
            Some(words.spelled(option))
        }
        other => Some(format!("{other:?}")),
    }
}

/// The corrected model, described effects and laws.
fn texts(found: &dgd_work::DiscoveryResult) -> Result<BTreeMap<String, String>, WorkError> {
    let written = found.files()?.written.into_iter();
    let texts = written.filter(|(name, _)| TEXTS.iter().any(|ending| name.ends_with(ending)));
    Ok(texts.map(|(name, bytes)| (name, String::from_utf8_lossy(&bytes).into_owned())).collect())
}

fn failed(error: &WorkError) -> PieceOutcome {
    let class = match error.class() {
        dgd_work::MistakeClass::Data => FailureClass::Data,
        dgd_work::MistakeClass::Usage => FailureClass::Usage,
        _ => FailureClass::Computation,
    };
    let (message, mistakes) = (error.spelled(option), error.mistakes(option));
    PieceOutcome::Failed { class, message, mistakes }
}
