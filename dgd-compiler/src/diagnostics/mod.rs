//! What is wrong with a text: where, in the user's words, and what would be right.

pub mod codes;
pub mod fix;
pub mod render;
mod visible;

use crate::source::Span;
pub use codes::Code;
pub use fix::{Edit, Fix};
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

/// The candidate a name was probably meant to be, if there is a likely one.
///
/// A likely name differs from it by few slips: a letter wrong, missing, too many, or swapped
/// with its neighbour, one slip for every three letters. Upper and lower case count as half a slip
/// for the whole name. Among equals the first in alphabetical order is taken.
pub fn suggestion<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let letters: Vec<char> = name.chars().collect();
    let lower: Vec<char> = name.to_lowercase().chars().collect();
    // In half slips.
    let limit = 2 * letters.len().div_ceil(3).min(4);
    candidates
        .into_iter()
        .filter(|candidate| *candidate != name)
        .filter(|candidate| {
            // Length bounds the distance from below, without looking at letters.
            2 * candidate.chars().count().abs_diff(letters.len()) <= limit
        })
        .filter_map(|candidate| {
            let other: Vec<char> = candidate.chars().collect();
            let other_lower: Vec<char> = candidate.to_lowercase().chars().collect();
            let slips = (2 * edit_distance(&letters, &other))
                .min(2 * edit_distance(&lower, &other_lower) + 1);
            // Replacing every letter is not a slip.
            (slips <= limit && slips < 2 * letters.len()).then_some((slips, candidate))
        })
        .min()
        .map(|(_, candidate)| candidate)
}

/// Insertions, deletions, replacements and swaps of neighbours that lead from `a` to `b`
/// (optimal string alignment).
fn edit_distance(a: &[char], b: &[char]) -> usize {
    // rows[i % 3][j]: distance of the first i letters of a and the first j of b
    let mut rows = [vec![0; b.len() + 1], (0..=b.len()).collect(), vec![0; b.len() + 1]];
    for i in 1..=a.len() {
        let [before, above, mut row] = rows;
        row[0] = i;
        for j in 1..=b.len() {
            let replaced = above[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(above[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        rows = [above, row, before];
    }
    rows[1][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_count_slips() {
        for (a, b, expected) in
            [("", "abc", 3), ("kitten", "sitting", 3), ("lmp", "lpm", 1), ("same", "same", 0)]
        {
            let letters = |s: &str| s.chars().collect::<Vec<_>>();
            assert_eq!(edit_distance(&letters(a), &letters(b)), expected, "{a} {b}");
        }
    }

    #[test]
    fn likely_names_are_suggested_and_others_are_not() {
        let names = ["q_ssp", "q_boost", "h_r", "rho", "g"];
        assert_eq!(suggestion("q_spp", names), Some("q_ssp"));
        assert_eq!(suggestion("Rho", names), Some("rho"));
        assert_eq!(suggestion("boost", ["q_boost", "roost"]), Some("roost"));
        assert_eq!(suggestion("pressure", names), None);
        assert_eq!(suggestion("x", names), None);
        assert_eq!(suggestion("ab", ["aa", "bb", "ac"]), Some("aa"));
    }

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
