//! Errors of tasks without a result, and the outcomes of those with one.

use std::error::Error;
use std::fmt;

use dgd_compiler::diagnostics::{Diagnostic, Diagnostics, render, suggestion};
use dgd_compiler::source::SourceMap;
use serde::Serialize;
use serde_json::{Value, json};

/// The reason why a task has no result.
#[derive(Debug)]
#[non_exhaustive]
pub enum WorkError {
    /// The model or the data has mistakes, which have been collected.
    Diagnosed {
        /// The mistakes.
        diagnostics: Vec<Diagnostic>,
        /// Where they are.
        sources: SourceMap,
    },
    /// A file cannot be read or written, or does not hold the requested content.
    Found(String),
    /// The request is invalid.
    Usage(String),
    /// The computation failed.
    Computation(String),
    /// The task was cancelled before it had a result.
    Interrupted(String),
}

/// Classes of mistakes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum MistakeClass {
    /// The model or the data has mistakes: exit code 1 of the command line.
    Data,
    /// The request is invalid: exit code 2.
    Usage,
    /// The computation failed, or was stopped before there was a result: exit code 3, or 130.
    Computation,
}

/// The outcome of a task that has a result.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum TaskEnd {
    /// It completed.
    Done,
    /// The search found something to report: exit code 1 of the command line.
    Found(String),
    /// It ended early, and the result is as far as it got, with the reason: exit code 3.
    Stopped(String),
    /// It was cancelled, and the result is as far as it got: exit code 130.
    Interrupted(String),
}

/// A mistake in a model or in data, for programs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Mistake {
    /// Its code, for `dgd explain`.
    pub code: String,
    /// The message.
    pub message: String,
    /// Its places, the most important first.
    pub places: Vec<TextSpot>,
    /// Advice.
    pub help: Option<String>,
    /// The fix as a change of the text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fix: Option<TextCorrection>,
}

/// A change of the text that fixes a mistake.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TextCorrection {
    /// Whether `dgd check --fix` writes it.
    pub safe: bool,
    /// The places, each with its replacement as `text`.
    pub edits: Vec<TextSpot>,
}

/// A place in a text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TextSpot {
    /// The file, as it was given.
    pub file: String,
    /// The line where it begins, from 1.
    pub line: usize,
    /// The column where it begins, from 1.
    pub column: usize,
    /// The line where it ends.
    pub end_line: usize,
    /// The column after its end.
    pub end_column: usize,
    /// The label.
    pub text: String,
}

impl Mistake {
    /// A diagnostic for programs.
    pub fn from_diagnostic(diagnostic: &Diagnostic, sources: &SourceMap) -> Self {
        let entry = render::entry(diagnostic, sources);
        let spot = |place: render::EditorLocation| TextSpot {
            file: place.file,
            line: place.line,
            column: place.column,
            end_line: place.end_line,
            end_column: place.end_column,
            text: place.text,
        };
        let places = entry.places.into_iter().map(spot).collect();
        let fix = entry.fix.map(|fix| TextCorrection {
            safe: fix.is_safe,
            edits: fix.edits.into_iter().map(spot).collect(),
        });
        Mistake { code: entry.code, message: entry.message, places, help: entry.help, fix }
    }
}

impl WorkError {
    /// The diagnostics so far.
    pub fn diagnosed(diagnostics: &Diagnostics, sources: SourceMap) -> Self {
        let diagnostics = diagnostics.sorted().into_iter().cloned().collect();
        WorkError::Diagnosed { diagnostics, sources }
    }

    /// The class of the mistake.
    pub fn class(&self) -> MistakeClass {
        match self {
            WorkError::Diagnosed { .. } | WorkError::Found(_) => MistakeClass::Data,
            WorkError::Usage(_) => MistakeClass::Usage,
            WorkError::Computation(_) | WorkError::Interrupted(_) => MistakeClass::Computation,
        }
    }

    /// The mistakes that have a place.
    pub fn mistakes(&self) -> Vec<Mistake> {
        match self {
            WorkError::Diagnosed { diagnostics, sources } => diagnostics
                .iter()
                .map(|diagnostic| Mistake::from_diagnostic(diagnostic, sources))
                .collect(),
            _ => Vec::new(),
        }
    }

    /// For programs: `diagnostics`, or `error`.
    pub fn to_json(&self) -> Value {
        match self {
            WorkError::Diagnosed { .. } => json!({ "diagnostics": self.mistakes() }),
            WorkError::Found(message)
            | WorkError::Usage(message)
            | WorkError::Computation(message)
            | WorkError::Interrupted(message) => json!({ "error": message }),
        }
    }
}

impl From<dgd_data::files::WriteError> for WorkError {
    fn from(error: dgd_data::files::WriteError) -> Self {
        WorkError::Found(error.to_string())
    }
}

/// As the command line prints it, without colours.
impl fmt::Display for WorkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WorkError::Diagnosed { diagnostics, sources } => {
                let collected: Vec<&Diagnostic> = diagnostics.iter().collect();
                f.write_str(
                    render::render(&collected, sources, render::RenderStyle::Plain).trim_end(),
                )
            }
            WorkError::Found(message)
            | WorkError::Usage(message)
            | WorkError::Computation(message)
            | WorkError::Interrupted(message) => f.write_str(message),
        }
    }
}

impl Error for WorkError {}

/// The likely intended name for an unknown one, or all known names.
pub fn meant(name: &str, known: &[&str]) -> String {
    match suggestion(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there is `{}`", known.join("`, `")),
    }
}
