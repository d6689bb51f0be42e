//! How a command ends when it does not succeed.

use std::fmt;

use dgd_compiler::diagnostics::{Diagnostic, Diagnostics};
use dgd_compiler::source::Sources;
use dgd_work::{Ended, WorkError};

/// Why a command did not succeed; each kind has its exit code.
#[derive(Debug)]
pub(crate) enum CommandError {
    /// The model or the data has mistakes, which have been collected: 1.
    Diagnosed {
        /// The mistakes.
        diagnostics: Vec<Diagnostic>,
        /// Where they are.
        sources: Sources,
    },
    /// A file cannot be read or written, or `--check` found something: 1.
    Found(String),
    /// The command line asks for something that makes no sense: 2.
    Usage(String),
    /// The result, which has been written, has what was looked for: 1.
    Shown(String),
    /// The computation failed: 3.
    Computation(String),
    /// The computation stopped on its way, and what it reached has been written with the reason: 3.
    Stopped(String),
    /// Ctrl-C stopped it, and what it reached has been written: 130.
    Interrupted(String),
}

/// The exit code of what Ctrl-C ended: 128 and the number of the signal, as shells have it.
pub(crate) const INTERRUPTED: u8 = 130;

impl CommandError {
    /// What was diagnosed so far.
    pub(crate) fn diagnosed(diagnostics: &Diagnostics, sources: Sources) -> Self {
        let diagnostics = diagnostics.sorted().into_iter().cloned().collect();
        CommandError::Diagnosed { diagnostics, sources }
    }

    /// The same, where the result says so already.
    pub(crate) fn written(self) -> Self {
        match self {
            CommandError::Found(message) => CommandError::Shown(message),
            CommandError::Computation(message) => CommandError::Stopped(message),
            other => other,
        }
    }

    /// How a command ends whose work ended so.
    pub(crate) fn of(ended: Ended) -> Result<(), CommandError> {
        match ended {
            Ended::Done => Ok(()),
            Ended::Found(message) => Err(CommandError::Shown(message)),
            Ended::Interrupted(message) => Err(CommandError::Interrupted(message)),
            Ended::Stopped(message) => Err(CommandError::Stopped(message)),
            // A new way to end is never taken for success.
            other => Err(CommandError::Stopped(format!("{other:?}"))),
        }
    }

    /// The exit code promised for it.
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
        match error {
            WorkError::Diagnosed { diagnostics, sources } => {
                CommandError::Diagnosed { diagnostics, sources }
            }
            WorkError::Found(message) => CommandError::Found(message),
            WorkError::Usage(message) => CommandError::Usage(message),
            WorkError::Interrupted(message) => CommandError::Interrupted(message),
            // A new error counts as a failure of the work.
            other => CommandError::Computation(other.to_string()),
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
