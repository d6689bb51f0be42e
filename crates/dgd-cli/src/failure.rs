//! Failures of commands, and their exit codes.

use std::fmt;

use dgd_compiler::diagnostics::{Diagnostic, Diagnostics};
use dgd_compiler::source::SourceMap;
#[cfg(not(feature = "full"))]
use dgd_runtime::signature::FULL_BUILD;
use dgd_work::{MistakeClass, TaskEnd, WorkError};

use crate::command_line::option;

/// The reason why a command failed; each kind has its exit code.
#[derive(Debug)]
pub(crate) enum CommandError {
    /// The model or the data has mistakes: 1.
    Diagnosed {
        /// The mistakes.
        diagnostics: Vec<Diagnostic>,
        /// Where they are.
        sources: SourceMap,
    },
    /// A file cannot be read or written, or `--check` found a fault: 1.
    Found(String),
    /// The command line is invalid: 2.
    Usage(String),
    /// The written result contains a finding: 1.
    Shown(String),
    /// The computation failed: 3.
    Computation(String),
    /// The computation ended early, and the partial result was written with the reason: 3.
    Stopped(String),
    /// It was cancelled with Ctrl-C, and the partial result was written: 130.
    Interrupted(String),
}

/// The exit code after Ctrl-C: 128 plus the number of the signal, as in shells.
pub(crate) const INTERRUPTED: u8 = 130;

impl CommandError {
    /// The diagnostics so far.
    pub(crate) fn diagnosed(diagnostics: &Diagnostics, sources: SourceMap) -> Self {
        let diagnostics = diagnostics.sorted().into_iter().cloned().collect();
        CommandError::Diagnosed { diagnostics, sources }
    }

    /// This build lacks a part of the program; `instead` is a way without it.
    #[cfg(not(feature = "full"))]
    pub(crate) fn not_built(part: &str, instead: &str) -> Self {
        let mut message = format!(
            "this build of dgd has no {part}; the whole program is installed by `{FULL_BUILD}`"
        );
        if !instead.is_empty() {
            message = format!("{message}; {instead}");
        }
        CommandError::Usage(message)
    }

    /// The same failure after the result has reported it.
    pub(crate) fn written(self) -> Self {
        match self {
            CommandError::Found(message) => CommandError::Shown(message),
            CommandError::Computation(message) => CommandError::Stopped(message),
            other => other,
        }
    }

    /// Converts the outcome of a task.
    pub(crate) fn check(ended: TaskEnd) -> Result<(), CommandError> {
        match ended {
            TaskEnd::Done => Ok(()),
            TaskEnd::Found(words) => Err(CommandError::Shown(words.spelled(option))),
            TaskEnd::Interrupted(words) => Err(CommandError::Interrupted(words.spelled(option))),
            TaskEnd::Stopped(words) => Err(CommandError::Stopped(words.spelled(option))),
            // An unknown outcome is never taken for success.
            other => Err(CommandError::Stopped(format!("{other:?}"))),
        }
    }

    /// Its exit code.
    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            CommandError::Diagnosed { .. } | CommandError::Found(_) | CommandError::Shown(_) => 1,
            CommandError::Usage(_) => 2,
            CommandError::Computation(_) | CommandError::Stopped(_) => 3,
            CommandError::Interrupted(_) => INTERRUPTED,
        }
    }
}

impl From<WorkError> for CommandError {
    fn from(error: WorkError) -> Self {
        let words = error.spelled(option);
        match (error.class(), error) {
            (_, WorkError::Diagnosed { diagnostics, sources }) => {
                CommandError::Diagnosed { diagnostics, sources }
            }
            (_, WorkError::Interrupted(_)) => CommandError::Interrupted(words),
            (MistakeClass::Data, _) => CommandError::Found(words),
            (MistakeClass::Usage, _) => CommandError::Usage(words),
            // An unknown error counts as a failed computation.
            _ => CommandError::Computation(words),
        }
    }
}

impl From<dgd_data::files::WriteError> for CommandError {
    fn from(error: dgd_data::files::WriteError) -> Self {
        CommandError::Found(error.to_string())
    }
}

impl fmt::Display for CommandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CommandError::Diagnosed { diagnostics, .. } => {
                write!(f, "{} mistakes", diagnostics.len())
            }
            CommandError::Found(message)
            | CommandError::Shown(message)
            | CommandError::Usage(message)
            | CommandError::Computation(message)
            | CommandError::Stopped(message)
            | CommandError::Interrupted(message) => f.write_str(message),
        }
    }
}
