//! What becomes of a piece, and the document that says it.

use std::collections::BTreeMap;

use dgd_work::{Mistake, SCHEMA_VERSION, json_text};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::piece::Piece;
use crate::store::State;

/// What becomes of a piece.
#[derive(Debug)]
pub enum Outcome {
    /// It has a result.
    Done {
        /// The result for programs, as the command prints it.
        result: Value,
        /// Why the result is not what it should be, such as a fit that has not converged.
        stopped: Option<String>,
        /// What was remarked.
        remarks: Vec<String>,
        /// Files that the command would write besides, by name.
        files: BTreeMap<String, String>,
    },
    /// It has none.
    Failed {
        /// Why.
        class: Class,
        /// Why, in a sentence.
        message: String,
        /// The mistakes that have a place.
        mistakes: Vec<Mistake>,
    },
}

/// Classes of failures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// The model or the data has mistakes.
    Data,
    /// The options make no sense.
    Usage,
    /// The computation failed.
    Computation,
    /// A mistake of dgd itself.
    Mistake,
    /// The process that computed it was ended each time that it was tried.
    Ended,
    /// It needed more memory than a piece may have.
    Memory,
}

impl Outcome {
    /// A failure without places.
    pub fn failed(class: Class, message: impl Into<String>) -> Outcome {
        Outcome::Failed { class, message: message.into(), mistakes: Vec::new() }
    }

    /// Where its document belongs.
    pub fn state(&self) -> State {
        match self {
            Outcome::Done { .. } => State::Done,
            Outcome::Failed { .. } => State::Failed,
        }
    }
}

/// The text of a result: the same bytes whenever, by whomever and in whatever order it is computed.
pub fn document(name: &str, piece: &Piece, outcome: &Outcome) -> String {
    let of = json!({
        "name": name,
        "well": piece.well,
        "when": piece.when,
        "kind": piece.kind,
        "command": piece.command(),
    });
    let value = match outcome {
        Outcome::Done { result, stopped, remarks, files } => json!({
            "schema": SCHEMA_VERSION,
            "piece": of,
            "state": "done",
            "stopped": stopped,
            "remarks": remarks,
            "result": result,
            "files": files,
        }),
        Outcome::Failed { class, message, mistakes } => json!({
            "schema": SCHEMA_VERSION,
            "piece": of,
            "state": "failed",
            "class": class,
            "error": message,
            "mistakes": mistakes,
        }),
    };
    json_text(&value)
}
