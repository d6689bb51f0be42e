//! The missing parts of a fit that was cancelled or did not converge, and cautions about the rest.

use std::fmt::Write as _;
use std::path::Path;

use dgd_compiler::argument::Argument;
use dgd_compiler::sentence;
use dgd_data::files::journal::RunJournal;
use dgd_identify::Termination;

use crate::error::TaskEnd;
use crate::result::fit::FitStatus;

/// The missing parts, as sentences; empty for a fit that converged.
#[derive(Debug, Default)]
pub(crate) struct IncompleteFit {
    words: Vec<String>,
    unconverged: Option<Unconverged>,
}

/// A search that ended by itself without converging.
#[derive(Debug)]
struct Unconverged {
    reason: String,
    /// Whether more evaluations would improve it.
    goes_on: bool,
}

impl IncompleteFit {
    /// For a search with this termination; `reason` explains why it did not converge, unless it was cancelled.
    pub(crate) fn from_termination(
        termination: Termination,
        reason: impl FnOnce() -> String,
    ) -> Self {
        if termination == Termination::Stopped {
            return Self::stopped();
        }
        if termination.is_converged() {
            return Self::default();
        }
        Self::unconverged(reason(), termination == Termination::EvaluationLimit)
    }

    /// The remark on a cancelled search.
    pub(crate) fn stopped() -> Self {
        let words = "stopped before it converged: these are the best values so far, and their \
                     standard deviations are not to be trusted";
        Self { words: vec![words.to_owned()], unconverged: None }
    }

    /// The remark on a search that did not converge; `goes_on` if more evaluations would improve it.
    pub(crate) fn unconverged(reason: String, goes_on: bool) -> Self {
        let words = format!(
            "not converged: {reason}; these are the best values that were found, and their standard \
             deviations are not to be trusted"
        );
        Self { words: vec![words], unconverged: Some(Unconverged { reason, goes_on }) }
    }

    pub(crate) fn push(&mut self, words: impl Into<String>) {
        self.words.push(words.into());
    }

    /// The outcome.
    pub(crate) fn status(&self) -> FitStatus {
        match (&self.unconverged, self.words.is_empty()) {
            (Some(_), _) => FitStatus::NotConverged,
            (None, true) => FitStatus::Done,
            (None, false) => FitStatus::Stopped,
        }
    }

    pub(crate) fn all(&self) -> &[String] {
        &self.words
    }

    /// A line for each missing part.
    pub(crate) fn push_text(&self, text: &mut String) {
        for words in &self.words {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{words}");
        }
    }

    /// The outcome of a fit; `written` is the folder of its result. The journal stays for a resumed run.
    pub(crate) fn ended(&self, journal: Option<&RunJournal>, written: Option<&Path>) -> TaskEnd {
        if self.words.is_empty() {
            return TaskEnd::Done;
        }
        let written = match written {
            Some(folder) => format!("; what there is, is in {}", folder.display()),
            None => String::new(),
        };
        let again = sentence!["; the same command with ", Argument::Resume];
        if let Some(Unconverged { reason, goes_on }) = &self.unconverged {
            let mut words = sentence![format!("{reason}{written}")];
            if let (Some(journal), true) = (journal, goes_on) {
                journal.leave();
                words.push(again);
                words.push(sentence![" and more ", Argument::Evaluations, " goes on from here"]);
            }
            return TaskEnd::Stopped(words);
        }
        let mut words = sentence![format!("stopped by Ctrl-C{written}")];
        if let Some(journal) = journal {
            journal.leave();
            words.push(again);
            words.push(" goes on from here");
        }
        TaskEnd::Interrupted(words)
    }
}
