//! What a fit that Ctrl-C stopped did not come to, and what is to be thought of the rest.

use std::fmt::Write as _;

use dgd_runtime::identify::Termination;

use crate::console::Console;
use crate::data::journal::RunJournal;
use crate::failure::CommandError;

/// What was left out, in the user's words; nothing where a fit was not stopped.
#[derive(Debug, Default)]
pub(crate) struct LeftOut(Vec<String>);

impl LeftOut {
    /// Of a search that ended so.
    pub(crate) fn of(termination: Termination) -> Self {
        if termination == Termination::Stopped { Self::stopped() } else { Self::default() }
    }

    /// Of a search that was stopped on its way.
    pub(crate) fn stopped() -> Self {
        Self(vec![
            "stopped before it converged: these are the best values so far, and their standard \
             deviations are not to be trusted"
                .to_owned(),
        ])
    }

    pub(crate) fn push(&mut self, words: impl Into<String>) {
        self.0.push(words.into());
    }

    /// Whether all was done.
    pub(crate) fn status(&self) -> &'static str {
        if self.0.is_empty() { "done" } else { "stopped" }
    }

    pub(crate) fn all(&self) -> &[String] {
        &self.0
    }

    /// A line for each.
    pub(crate) fn push_text(&self, text: &mut String) {
        for words in &self.0 {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{words}");
        }
    }

    /// How the command ends when all there is has been written.
    pub(crate) fn ended(
        &self,
        journal: Option<&RunJournal>,
        console: Console<'_>,
    ) -> Result<(), CommandError> {
        if self.0.is_empty() {
            return Ok(());
        }
        let written = match console.out() {
            Some(folder) => format!("; what there is, is in {}", folder.display()),
            None => String::new(),
        };
        let mut words = format!("stopped by Ctrl-C{written}");
        if let Some(journal) = journal {
            journal.leave();
            words += "; the same command with `--resume` goes on from here";
        }
        Err(CommandError::Interrupted(words))
    }
}
