//! The outcome of a piece, and its JSON document.

use std::collections::BTreeMap;

use dgd_work::{Mistake, SCHEMA_VERSION, json_text};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::piece::Piece;
use crate::store::PieceState;
use crate::syntax::OptionSyntax;

/// The outcome of a piece.
#[derive(Debug)]
pub enum PieceOutcome {
    /// It has a result.
    Done {
        /// The result for programs, as the command prints it.
        result: Value,
        /// Why the result is incomplete, for example because a fit did not converge.
        stopped: Option<String>,
        /// Remarks.
        remarks: Vec<String>,
        /// Other files that the command would write, by name.
        files: BTreeMap<String, String>,
    },
    /// It has no result.
    Failed {
        /// The class of the failure.
        class: FailureClass,
        /// The reason, in a sentence.
        message: String,
        /// Diagnosed mistakes.
        mistakes: Vec<Mistake>,
    },
}

/// Classes of failures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureClass {
    /// The model or the data has mistakes.
    Data,
    /// The options are invalid.
    Usage,
    /// The computation failed.
    Computation,
    /// A bug in dgd.
    Mistake,
    /// Its process was terminated on every attempt.
    Ended,
    /// It exceeded its memory limit.
    Memory,
}

impl PieceOutcome {
    /// A failure without diagnosed mistakes.
    pub fn failed(class: FailureClass, message: impl Into<String>) -> PieceOutcome {
        PieceOutcome::Failed { class, message: message.into(), mistakes: Vec::new() }
    }

    /// The state under which its document is stored.
    pub fn state(&self) -> PieceState {
        match self {
            PieceOutcome::Done { .. } => PieceState::Done,
            PieceOutcome::Failed { .. } => PieceState::Failed,
        }
    }
}

/// What reports read of a document.
#[derive(Debug, Deserialize)]
#[serde(tag = "state", rename_all = "lowercase")]
pub(crate) enum PieceDocument {
    /// A result.
    Done {
        /// Why the result is incomplete.
        stopped: Option<String>,
        /// Of a fit or a discovery.
        result: Value,
    },
    /// A failure.
    Failed {
        /// The reason, in a sentence.
        error: String,
    },
}

impl PieceDocument {
    /// The document of a piece, or the reason why it has no result.
    pub(crate) fn read(text: &str) -> Result<(Option<String>, Value), String> {
        match serde_json::from_str(text) {
            Ok(PieceDocument::Done { stopped, result }) => Ok((stopped, result)),
            Ok(PieceDocument::Failed { error }) => Err(error),
            Err(error) => Err(format!("its result cannot be read: {error}")),
        }
    }
}

/// The text of a result: always the same bytes, wherever and in whatever order it is computed.
pub fn document(name: &str, piece: &Piece, outcome: &PieceOutcome, syntax: OptionSyntax) -> String {
    let identity = json!({
        "name": name,
        "well": piece.well,
        "when": piece.when,
        "kind": piece.kind,
        "command": piece.command(syntax),
    });
    let value = match outcome {
        PieceOutcome::Done { result, stopped, remarks, files } => json!({
            "schema": SCHEMA_VERSION,
            "piece": identity,
            "state": "done",
            "stopped": stopped,
            "remarks": remarks,
            "result": result,
            "files": files,
        }),
        PieceOutcome::Failed { class, message, mistakes } => json!({
            "schema": SCHEMA_VERSION,
            "piece": identity,
            "state": "failed",
            "class": class,
            "error": message,
            "mistakes": mistakes,
        }),
    };
    json_text(&value)
}
