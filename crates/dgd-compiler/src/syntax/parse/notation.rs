//! Derivatives and equations in the notation of other languages: `x' = …`, `dx/dt = …`, and equations without a label.

use std::collections::BTreeSet;

use super::item::is_keyword;
use super::lexical::{Token, TokenKind};
use crate::diagnostics::{Code, Diagnostic, Fix, FixEdit};
use crate::source::{SourceId, Span};

/// Items that can contain a derivative.
const WITH_FORMULAS: [&str; 3] = ["equation", "let", "output"];

/// Names that a file declares, judging by its tokens.
#[derive(Debug, Default)]
pub(super) struct TokenDeclarations<'a> {
    /// States and other unknowns.
    unknowns: BTreeSet<&'a str>,
    /// Labels of equations.
    labels: BTreeSet<&'a str>,
}

impl<'a> TokenDeclarations<'a> {
    /// The names declared by all tokens of a file.
    pub(super) fn collect(tokens: &[Token], text: &'a str) -> Self {
        let mut declared = TokenDeclarations::default();
        for [keyword, name] in tokens.array_windows() {
            if keyword.kind != TokenKind::Name || name.kind != TokenKind::Name {
                continue;
            }
            match keyword.text(text) {
                "state" | "unknown" => declared.unknowns.insert(name.text(text)),
                "equation" => declared.labels.insert(name.text(text)),
                _ => false,
            };
        }
        declared
    }

    /// A label for the equation of an unknown.
    fn label_for(&self, unknown: &str) -> String {
        let first = format!("der_{unknown}");
        let further = (2..).map(|n| format!("{first}_{n}"));
        let mut labels = std::iter::once(first.clone()).chain(further);
        labels.find(|label| !self.labels.contains(label.as_str())).unwrap_or(first)
    }
}

/// A diagnostic for an item in another notation; `None` if it is in that of the language, or ambiguous.
pub(super) fn foreign(
    item: &[Token],
    text: &str,
    source: SourceId,
    declared: &TokenDeclarations<'_>,
) -> Option<Diagnostic> {
    let first = item.first()?;
    let derivatives = derivatives(item, text, source, declared);
    let other = derivatives.iter().find(|derivative| derivative.is_foreign);
    let rewritten = || -> Vec<FixEdit> {
        let foreign = derivatives.iter().filter(|derivative| derivative.is_foreign);
        foreign.map(|one| FixEdit::replace(one.span, format!("der({})", one.of))).collect()
    };
    let keyword = first.text(text);
    if first.kind == TokenKind::Name && is_keyword(keyword) {
        // Without a mark, `dx/dt` may be a quotient, which is decided when all names are resolved.
        let marked = other.filter(|derivative| derivative.is_marked)?;
        let (of, written) = (marked.of, marked.written(text));
        let message = format!("a derivative is written `der({of})`, not `{written}`");
        let diagnostic = Diagnostic::new(Code::UnexpectedToken, marked.span, message);
        let is_fixed = WITH_FORMULAS.contains(&keyword);
        return Some(if is_fixed { diagnostic.fix(Fix::safe(rewritten())) } else { diagnostic });
    }
    let is_equation = item.iter().any(|token| token.kind == TokenKind::Equal);
    let has_label = item.iter().any(|token| token.kind == TokenKind::Colon);
    let derivative = derivatives.first().filter(|_| is_equation && !has_label)?;
    let label = declared.label_for(derivative.of);
    let message = "an equation begins with `equation` and a label";
    let mut diagnostic = Diagnostic::new(Code::NotAnItem, first.span(source), message);
    if let Some(other) = other.filter(|other| other.span.start != first.start) {
        diagnostic = diagnostic.label(other.span, format!("this is `der({})`", other.of));
    }
    let mut edits = rewritten();
    match edits.first_mut() {
        // One edit if the equation begins with the rewritten derivative.
        Some(edit) if edit.span.start == first.start => {
            edit.text = format!("equation {label}: {}", edit.text);
        }
        _ => edits
            .insert(0, FixEdit::insert_before(first.span(source), format!("equation {label}: "))),
    }
    Some(diagnostic.fix(Fix::safe(edits)))
}

/// A time derivative.
struct Derivative<'a> {
    span: Span,
    /// The differentiated name.
    of: &'a str,
    /// Whether it is in another language's notation.
    is_foreign: bool,
    /// Whether it can only be a derivative: `x'`.
    is_marked: bool,
}

impl Derivative<'_> {
    fn written<'t>(&self, text: &'t str) -> &'t str {
        &text[self.span.start as usize..self.span.end as usize]
    }
}

/// All derivatives of unknowns in an item.
fn derivatives<'a>(
    item: &[Token],
    text: &'a str,
    source: SourceId,
    declared: &TokenDeclarations<'_>,
) -> Vec<Derivative<'a>> {
    use TokenKind::{Close, Name, Open, Prime, Slash};
    let mut derivatives = Vec::new();
    for at in 0..item.len() {
        let rest = &item[at..];
        let kinds: Vec<TokenKind> = rest.iter().take(6).map(|token| token.kind).collect();
        let word = |k: usize| rest[k].text(text);
        let is_unknown = |name: &str| declared.unknowns.contains(name);
        let (of, length, is_foreign, is_marked) = match kinds.as_slice() {
            [Name, Prime, ..] => (word(0), 2, true, true),
            [Name, Slash, Name, ..] if word(2) == "dt" => {
                match word(0).strip_prefix('d').filter(|name| is_unknown(name)) {
                    Some(name) => (name, 3, true, false),
                    None => continue,
                }
            }
            [Name, Open, Name, Close, Slash, Name]
                if word(0) == "d" && word(5) == "dt" && is_unknown(word(2)) =>
            {
                (word(2), 6, true, false)
            }
            [Name, Open, Name, Close, ..] if word(0) == "der" => (word(2), 4, false, false),
            _ => continue,
        };
        let span = rest[0].span(source).join(rest[length - 1].span(source));
        derivatives.push(Derivative { span, of, is_foreign, is_marked });
    }
    derivatives
}
