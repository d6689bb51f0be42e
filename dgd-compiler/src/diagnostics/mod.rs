//! What is wrong with a text: where, in the user's words, and what would be right.

pub mod codes;
pub mod render;

use crate::source::Span;
pub use codes::Code;

/// One mistake, with everything needed to show it.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Which kind of mistake: a row of [`codes::CODES`].
    pub code: Code,
    /// What is wrong, lower case and without a full stop.
    pub message: String,
    /// Places concerned; the first is where the caret goes.
    pub labels: Vec<Label>,
    /// What would be accepted, or a likely correction.
    pub help: Option<String>,
}

/// A place and what there is to say about it (may be empty).
#[derive(Debug, Clone, PartialEq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// What to say there.
    pub text: String,
}

impl Diagnostic {
    /// A diagnostic at one place.
    pub fn new(code: Code, span: Span, message: impl Into<String>) -> Self {
        let label = Label { span, text: String::new() };
        Diagnostic { code, message: message.into(), labels: vec![label], help: None }
    }

    /// Says something at the main place.
    #[must_use]
    pub fn here(mut self, text: impl Into<String>) -> Self {
        self.labels[0].text = text.into();
        self
    }

    /// Points at another place.
    #[must_use]
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// Says what would be right.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }
}

/// Proof that at least one error has been reported.
///
/// Only [`Diagnostics::error`] makes one, so a stage that returns `Err(Reported)` cannot have
/// failed in silence, and its caller has nothing left to explain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reported(());

/// Collects the mistakes of one compilation.
#[derive(Debug, Clone, Default)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    reported: Option<Reported>,
}

impl Diagnostics {
    /// Reports a mistake. One and the same mistake at one place is kept once.
    pub fn error(&mut self, diagnostic: Diagnostic) -> Reported {
        if !self.list.contains(&diagnostic) {
            self.list.push(diagnostic);
        }
        self.reported = Some(Reported(()));
        Reported(())
    }

    /// `Err` if anything has been reported so far.
    pub fn check(&self) -> Result<(), Reported> {
        self.reported.map_or(Ok(()), Err)
    }

    /// What was reported, in the order of place.
    pub fn sorted(&self) -> Vec<&Diagnostic> {
        let mut all: Vec<_> = self.list.iter().collect();
        all.sort_by_key(|diagnostic| diagnostic.labels[0].span);
        all
    }
}
