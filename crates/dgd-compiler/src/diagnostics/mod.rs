//! Errors in a text: where, in the user's words, and how to correct them.

pub mod codes;
pub mod fix;
pub mod render;
mod suggestion;
mod visible;

use std::fmt::Display;

use crate::sentence::Sentence;
use crate::source::Span;
pub use codes::Code;
pub use fix::{Fix, FixEdit};
pub use suggestion::suggestion;
pub use visible::visible;

/// One error, with everything needed to show it.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// The kind of error: a row of [`codes::CODES`].
    pub code: Code,
    /// The message, lower case and without a full stop.
    pub message: String,
    /// Relevant places; the caret is at the first.
    pub labels: Vec<DiagnosticLabel>,
    /// The names that it is about.
    pub about: Vec<String>,
    /// The accepted form, or a likely correction.
    pub help: Option<Sentence>,
    /// The correction as an edit; the corrected line is shown.
    pub fix: Option<Box<Fix>>,
}

/// A place with a note, which may be empty.
#[derive(Debug, Clone, PartialEq)]
pub struct DiagnosticLabel {
    /// The place.
    pub span: Span,
    /// The note.
    pub text: String,
}

impl Diagnostic {
    /// A diagnostic at one place.
    pub fn new(code: Code, span: Span, message: impl Into<String>) -> Self {
        let label = DiagnosticLabel { span, text: String::new() };
        Diagnostic {
            code,
            message: message.into(),
            labels: vec![label],
            about: Vec::new(),
            help: None,
            fix: None,
        }
    }

    /// Adds a name that it is about: without the declaration of that name, this may not be an error.
    #[must_use]
    pub fn about(mut self, name: impl Display) -> Self {
        self.about.push(name.to_string());
        self
    }

    /// Adds a note at the main place.
    #[must_use]
    pub fn here(mut self, text: impl Into<String>) -> Self {
        self.labels[0].text = text.into();
        self
    }

    /// Adds a note at another place.
    #[must_use]
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(DiagnosticLabel { span, text: text.into() });
        self
    }

    /// Adds a fix.
    #[must_use]
    pub fn fix(mut self, fix: Fix) -> Self {
        self.fix = Some(Box::new(fix));
        self
    }

    /// Adds a help text, if there is one.
    #[must_use]
    pub fn maybe_help(mut self, text: Option<String>) -> Self {
        self.help = text.map(Sentence::from);
        self
    }

    /// Adds a help text.
    #[must_use]
    pub fn help(mut self, text: impl Into<Sentence>) -> Self {
        self.help = Some(text.into());
        self
    }
}

/// Proof that at least one error has been reported.
///
/// Only [`Diagnostics::error`] makes one, so a stage that returns `Err(Reported)` cannot have failed silently, and its
/// caller has nothing left to report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorReported(());

/// Limit on stored errors. A text with more is not a model.
const KEPT: usize = 1000;

/// Limit on the errors for which the intended name is searched among all names: each search takes time proportional to
/// their number.
const EXPLAINED: usize = 100;

/// Collects up to a thousand errors of one compilation.
#[derive(Debug, Clone, Default)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    reported: Option<ErrorReported>,
}

impl Diagnostics {
    /// Reports an error. Duplicates at one place are stored once.
    pub fn error(&mut self, diagnostic: Diagnostic) -> ErrorReported {
        if self.list.len() < KEPT && !self.list.contains(&diagnostic) {
            self.list.push(diagnostic);
        }
        self.reported = Some(ErrorReported(()));
        ErrorReported(())
    }

    /// Whether this error was reported at this place: a function body is expanded once for each call, and suggestions
    /// are expensive to find.
    pub(crate) fn said(&self, code: Code, place: Span) -> Option<ErrorReported> {
        let known = |said: &&Diagnostic| said.code == code && said.labels[0].span == place;
        self.list.iter().find(known).map(|_| ErrorReported(()))
    }

    /// `Err` if anything has been reported so far.
    pub fn check(&self) -> Result<(), ErrorReported> {
        self.reported.map_or(Ok(()), Err)
    }

    /// The probably intended name, for an error that is about to be reported; `None` once there are very many errors.
    pub fn suggestion<'a>(
        &self,
        name: &str,
        candidates: impl IntoIterator<Item = &'a str>,
    ) -> Option<&'a str> {
        if self.list.len() < EXPLAINED { suggestion(name, candidates) } else { None }
    }

    /// Number of errors stored so far.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// The reported errors, ordered by place.
    pub fn sorted(&self) -> Vec<&Diagnostic> {
        let mut sorted: Vec<_> = self.list.iter().collect();
        sorted.sort_by_key(|diagnostic| diagnostic.labels[0].span);
        sorted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_mistake_at_one_place_is_kept_once() {
        let mut diagnostics = Diagnostics::default();
        assert_eq!(diagnostics.check(), Ok(()));
        let reported = diagnostics.error(Diagnostic::new(Code::UnknownName, Span::default(), "a"));
        diagnostics.error(Diagnostic::new(Code::UnknownName, Span::default(), "a"));
        assert_eq!(diagnostics.check(), Err(reported));
        assert_eq!(diagnostics.sorted().len(), 1);
    }
}
