//! Why a piece of work was not done, and how one ended that has a result.

use std::error::Error;
use std::fmt;

use dgd_compiler::diagnostics::{Diagnostic, Diagnostics, render, suggestion};
use dgd_compiler::source::Sources;
use serde::Serialize;
use serde_json::{Value, json};

/// Why a piece of work has no result.
#[derive(Debug)]
#[non_exhaustive]
pub enum WorkError {
    /// The model or the data has mistakes, which have been collected.
    Diagnosed {
        /// The mistakes.
        diagnostics: Vec<Diagnostic>,
        /// Where they are.
        sources: Sources,
    },
    /// A file cannot be read or written, or does not hold what is asked of it.
    Found(String),
    /// What is asked for makes no sense.
    Usage(String),
    /// The computation failed.
    Computation(String),
    /// Who watches stopped it before there was a result.
    Interrupted(String),
}

/// Classes of mistakes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Class {
    /// The model or the data has mistakes: exit code 1 of the command line.
    Data,
    /// The request makes no sense: exit code 2.
    Usage,
    /// The computation failed, or was stopped before there was a result: exit code 3, or 130.
    Computation,
}

/// How a piece of work ended that has a result.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Ended {
    /// As it should.
    Done,
    /// The result has what was looked for: exit code 1 of the command line.
    Found(String),
    /// On its way, and the result is what it reached, with the reason: exit code 3.
    Stopped(String),
    /// Stopped by who watches, and the result is what it reached: exit code 130.
    Interrupted(String),
}

/// A mistake in a model or in data, for programs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Mistake {
    /// Its code, as `dgd explain` takes it.
    pub code: String,
    /// What is wrong.
    pub message: String,
    /// Where, the place that matters most first.
    pub places: Vec<Spot>,
    /// What to do.
    pub help: Option<String>,
    /// The same as a change of the text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fix: Option<Correction>,
}

/// A change of the text that sets a mistake right.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Correction {
    /// Whether `dgd check --fix` writes it.
    pub safe: bool,
    /// The places, and as `text` what stands there instead.
    pub edits: Vec<Spot>,
}

/// A place in a text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Spot {
    /// The file, as it was given.
    pub file: String,
    /// The line where it begins, from 1.
    pub line: usize,
    /// The column where it begins, from 1.
    pub column: usize,
    /// The line where it ends.
    pub end_line: usize,
    /// The column behind its end.
    pub end_column: usize,
    /// What is said of it.
    pub text: String,
}

impl Mistake {
    /// A diagnostic for programs.
    pub fn of(diagnostic: &Diagnostic, sources: &Sources) -> Self {
        let entry = render::entry(diagnostic, sources);
        let spot = |place: render::Location| Spot {
            file: place.file,
            line: place.line,
            column: place.column,
            end_line: place.end_line,
            end_column: place.end_column,
            text: place.text,
        };
        let places = entry.places.into_iter().map(spot).collect();
        let fix = entry.fix.map(|fix| Correction {
            safe: fix.is_safe,
            edits: fix.edits.into_iter().map(spot).collect(),
        });
        Mistake { code: entry.code, message: entry.message, places, help: entry.help, fix }
    }
}

impl WorkError {
    /// What was diagnosed so far.
    pub fn diagnosed(diagnostics: &Diagnostics, sources: Sources) -> Self {
        let diagnostics = diagnostics.sorted().into_iter().cloned().collect();
        WorkError::Diagnosed { diagnostics, sources }
    }

    /// Which class of mistake it is.
    pub fn class(&self) -> Class {
        match self {
            WorkError::Diagnosed { .. } | WorkError::Found(_) => Class::Data,
            WorkError::Usage(_) => Class::Usage,
            WorkError::Computation(_) | WorkError::Interrupted(_) => Class::Computation,
        }
    }

    /// The mistakes that have a place.
    pub fn mistakes(&self) -> Vec<Mistake> {
        match self {
            WorkError::Diagnosed { diagnostics, sources } => {
                diagnostics.iter().map(|diagnostic| Mistake::of(diagnostic, sources)).collect()
            }
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
                let all: Vec<&Diagnostic> = diagnostics.iter().collect();
                f.write_str(render::render(&all, sources, render::Style::Plain).trim_end())
            }
            WorkError::Found(message)
            | WorkError::Usage(message)
            | WorkError::Computation(message)
            | WorkError::Interrupted(message) => f.write_str(message),
        }
    }
}

impl Error for WorkError {}

/// What an unknown name was probably meant to be, or all names that there are.
pub fn meant(name: &str, known: &[&str]) -> String {
    match suggestion(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there is `{}`", known.join("`, `")),
    }
}
