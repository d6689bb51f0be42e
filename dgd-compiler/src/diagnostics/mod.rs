//! What is wrong with a text: where, in the user's words, and what would be right.

pub mod codes;
pub mod fix;
pub mod render;
mod suggestion;
mod visible;

use crate::source::Span;
pub use codes::Code;
pub use fix::{Edit, Fix};
pub use suggestion::suggestion;
pub use visible::visible;

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
    /// The same as a change of the text; the line that comes out is shown.
    pub fix: Option<Fix>,
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
        Diagnostic { code, message: message.into(), labels: vec![label], help: None, fix: None }
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

    /// Says how to write it instead.
    #[must_use]
    pub fn fix(mut self, fix: Fix) -> Self {
        self.fix = Some(fix);
        self
    }

    /// Says what would be right, where that is known.
    #[must_use]
    pub fn maybe_help(mut self, text: Option<String>) -> Self {
        self.help = text;
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

/// How many mistakes are kept. A text with more is not a model, and nobody reads on.
const KEPT: usize = 1000;

/// For how many mistakes the name that was meant is searched for, among all names: the search for each takes as long as
/// there are names.
const EXPLAINED: usize = 100;

/// Collects the mistakes of one compilation, up to a thousand of them.
#[derive(Debug, Clone, Default)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    reported: Option<Reported>,
}

impl Diagnostics {
    /// Reports a mistake. One and the same mistake at one place is kept once.
    pub fn error(&mut self, diagnostic: Diagnostic) -> Reported {
        if self.list.len() < KEPT && !self.list.contains(&diagnostic) {
            self.list.push(diagnostic);
        }
        self.reported = Some(Reported(()));
        Reported(())
    }

    /// Whether this mistake was reported at this place: a body is opened once a call, and what a message
    /// suggests is costly to find.
    pub(crate) fn said(&self, code: Code, place: Span) -> Option<Reported> {
        let known = |said: &&Diagnostic| said.code == code && said.labels[0].span == place;
        self.list.iter().find(known).map(|_| Reported(()))
    }

    /// `Err` if anything has been reported so far.
    pub fn check(&self) -> Result<(), Reported> {
        self.reported.map_or(Ok(()), Err)
    }

    /// The name that was probably meant, for a mistake that is to be reported; none once there are very many.
    pub fn suggestion<'a>(
        &self,
        name: &str,
        candidates: impl IntoIterator<Item = &'a str>,
    ) -> Option<&'a str> {
        if self.list.len() < EXPLAINED { suggestion(name, candidates) } else { None }
    }

    /// How many mistakes are kept so far.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// What was reported, in the order of place.
    pub fn sorted(&self) -> Vec<&Diagnostic> {
        let mut all: Vec<_> = self.list.iter().collect();
        all.sort_by_key(|diagnostic| diagnostic.labels[0].span);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_mistake_at_one_place_is_kept_once() {
        let mut diagnostics = Diagnostics::default();
        assert_eq!(diagnostics.check(), Ok(()));
        let reported = diagnostics.error(Diagnostic::new(Code::E201, Span::default(), "a"));
        diagnostics.error(Diagnostic::new(Code::E201, Span::default(), "a"));
        assert_eq!(diagnostics.check(), Err(reported));
        assert_eq!(diagnostics.sorted().len(), 1);
    }
}
