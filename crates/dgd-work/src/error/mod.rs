//! Errors of tasks without a result, and the outcomes of those with one.

mod computation;
mod mistake;
mod unusable;
mod usage;

use std::error::Error;
use std::fmt;

use dgd_compiler::argument::{Spelling, neutral};
use dgd_compiler::diagnostics::{Diagnostic, Diagnostics, render, suggestion};
use dgd_compiler::sentence;
use dgd_compiler::sentence::Sentence;
use dgd_compiler::source::SourceMap;
use serde::Serialize;
use serde_json::{Value, json};

pub use computation::ComputationError;
pub use mistake::{Mistake, TextCorrection, TextSpot};
pub use unusable::{OutputPart, UnusableFile};
pub(crate) use usage::SIMULATING;
pub use usage::UsageError;

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
    Unusable(Box<UnusableFile>),
    /// The request is invalid.
    Usage(Box<UsageError>),
    /// The computation failed.
    Computation(Box<ComputationError>),
    /// The task was cancelled before it had a result.
    Interrupted(Interruption),
    /// A contender of a comparison has no result.
    Contender {
        /// Its name.
        name: String,
        /// The cause.
        error: Box<WorkError>,
    },
}

/// How far a task was when it was cancelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interruption {
    /// Before the first row of a run.
    NoRow,
    /// Before the first simulation of a fit.
    NoSimulation,
    /// Before the result.
    NoResult,
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
    Found(Sentence),
    /// It ended early, and the result is as far as it got, with the reason: exit code 3.
    Stopped(Sentence),
    /// It was cancelled, and the result is as far as it got: exit code 130.
    Interrupted(Sentence),
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
            WorkError::Diagnosed { .. } | WorkError::Unusable(_) => MistakeClass::Data,
            WorkError::Usage(_) => MistakeClass::Usage,
            WorkError::Computation(_) | WorkError::Interrupted(_) => MistakeClass::Computation,
            WorkError::Contender { error, .. } => error.class(),
        }
    }

    /// The mistakes that have a place, with the arguments as a face writes them.
    pub fn mistakes(&self, spelling: Spelling) -> Vec<Mistake> {
        match self {
            WorkError::Diagnosed { diagnostics, sources } => diagnostics
                .iter()
                .map(|diagnostic| Mistake::from_diagnostic(diagnostic, sources, spelling))
                .collect(),
            WorkError::Contender { error, .. } => error.mistakes(spelling),
            WorkError::Unusable(_)
            | WorkError::Usage(_)
            | WorkError::Computation(_)
            | WorkError::Interrupted(_) => Vec::new(),
        }
    }

    /// For programs: `diagnostics`, or `error`, with the arguments as a face writes them.
    pub fn to_json(&self, spelling: Spelling) -> Value {
        match self {
            WorkError::Diagnosed { .. } => json!({ "diagnostics": self.mistakes(spelling) }),
            _ => json!({ "error": self.spelled(spelling) }),
        }
    }

    /// The error in words; diagnostics are drawn without colours.
    pub fn spelled(&self, spelling: Spelling) -> String {
        match self {
            WorkError::Diagnosed { diagnostics, sources } => {
                let all: Vec<&Diagnostic> = diagnostics.iter().collect();
                let style = render::RenderStyle::Plain;
                render::render_spelled(&all, sources, style, spelling).trim_end().to_owned()
            }
            _ => self.sentence().spelled(spelling),
        }
    }

    /// The error in words, without diagnostics.
    pub fn sentence(&self) -> Sentence {
        match self {
            WorkError::Diagnosed { diagnostics, .. } => {
                format!("{} mistakes", diagnostics.len()).into()
            }
            WorkError::Unusable(error) => error.sentence(),
            WorkError::Usage(error) => error.sentence(),
            WorkError::Computation(error) => error.sentence(),
            WorkError::Interrupted(interruption) => interruption.sentence(),
            WorkError::Contender { name, error } => {
                sentence![format!("`{name}`: "), error.sentence()]
            }
        }
    }
}

impl Interruption {
    fn sentence(self) -> Sentence {
        match self {
            Interruption::NoRow => {
                "stopped by Ctrl-C before the first row: there is nothing to keep"
            }
            Interruption::NoSimulation => {
                "stopped by Ctrl-C before the first simulation had ended: there is nothing to keep"
            }
            Interruption::NoResult => "stopped by Ctrl-C",
        }
        .into()
    }
}

impl From<UsageError> for WorkError {
    fn from(error: UsageError) -> Self {
        WorkError::Usage(Box::new(error))
    }
}

impl From<UnusableFile> for WorkError {
    fn from(error: UnusableFile) -> Self {
        WorkError::Unusable(Box::new(error))
    }
}

impl From<ComputationError> for WorkError {
    fn from(error: ComputationError) -> Self {
        WorkError::Computation(Box::new(error))
    }
}

impl From<Interruption> for WorkError {
    fn from(interruption: Interruption) -> Self {
        WorkError::Interrupted(interruption)
    }
}

impl From<dgd_data::files::WriteError> for WorkError {
    fn from(error: dgd_data::files::WriteError) -> Self {
        UnusableFile::Write(error).into()
    }
}

/// With the arguments as a library names them.
impl fmt::Display for WorkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spelled(neutral))
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

/// Names between backticks, with commas.
pub(crate) fn named(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
