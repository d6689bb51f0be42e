//! Edits that correct an error.

use crate::source::{SourceId, SourceMap, Span};

/// An edit of the text that corrects an error, for an editor to offer or `dgd check --fix` to apply.
#[derive(Debug, Clone, PartialEq)]
pub struct Fix {
    /// Its edits, which do not overlap.
    pub edits: Vec<FixEdit>,
    /// Whether it can be applied without confirmation.
    pub safety: FixSafety,
}

/// Replaces a piece of text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FixEdit {
    /// The replaced text; an empty span for an insertion.
    pub span: Span,
    /// The new text.
    pub text: String,
}

/// Whether a fix can be applied without confirmation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FixSafety {
    /// The text can mean nothing else.
    Safe,
    /// A guess.
    Guess,
}

impl FixEdit {
    /// Replaces a span.
    pub fn replace(span: Span, text: impl Into<String>) -> Self {
        FixEdit { span, text: text.into() }
    }

    /// Inserts text before a span.
    pub fn insert_before(span: Span, text: impl Into<String>) -> Self {
        FixEdit { span: Span { end: span.start, ..span }, text: text.into() }
    }

    /// Inserts text after a span.
    pub fn insert_after(span: Span, text: impl Into<String>) -> Self {
        FixEdit { span: Span { start: span.end, ..span }, text: text.into() }
    }
}

impl Fix {
    /// A fix that can be applied without confirmation.
    pub fn safe(edits: Vec<FixEdit>) -> Self {
        Fix { edits, safety: FixSafety::Safe }
    }

    /// Whether it can be applied without confirmation.
    pub fn is_safe(&self) -> bool {
        self.safety == FixSafety::Safe
    }

    /// The corrected line or lines, without a comment at the end; `None` for a fix in several files.
    pub fn line(&self, sources: &SourceMap) -> Option<String> {
        let first = self.edits.iter().map(|edit| edit.span).min()?;
        if self.edits.iter().any(|edit| edit.span.source != first.source) {
            return None;
        }
        let text = &sources.get(first.source).text;
        let last = self.edits.iter().map(|edit| edit.span.end as usize).max()?;
        let start = text[..first.start as usize].rfind('\n').map_or(0, |at| at + 1);
        let end = text[last..].find('\n').map_or(text.len(), |length| last + length);
        let line = write(&text[start..end], start, &self.edits.iter().collect::<Vec<_>>());
        let line = line.split(" #").next().and_then(|line| line.split("///").next());
        line.map(|line| line.trim().to_owned())
    }
}

/// The text with these fixes, and the number of fixes applied: of two that touch, the first is applied.
///
/// The others can be applied to the resulting text, once it has been checked again.
pub fn written(text: &str, source: SourceId, fixes: &[&Fix]) -> (String, usize) {
    let mut taken: Vec<&FixEdit> = Vec::new();
    let mut n = 0;
    for fix in fixes {
        let touches = |edit: &FixEdit| {
            taken
                .iter()
                .any(|other| edit.span.start <= other.span.end && other.span.start <= edit.span.end)
        };
        let is_here = fix.edits.iter().all(|edit| edit.span.source == source);
        if is_here && !fix.edits.iter().any(touches) {
            taken.extend(&fix.edits);
            n += 1;
        }
    }
    (write(text, 0, &taken), n)
}

/// A piece of a source that begins at `offset`, with these edits.
fn write(text: &str, offset: usize, edits: &[&FixEdit]) -> String {
    let mut edits = edits.to_vec();
    edits.sort_by_key(|edit| edit.span);
    let (mut out, mut at) = (String::with_capacity(text.len()), 0);
    for edit in edits {
        let (start, end) = (edit.span.start as usize - offset, edit.span.end as usize - offset);
        out.push_str(&text[at..start]);
        out.push_str(&edit.text);
        at = end;
    }
    out.push_str(&text[at..]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::SourceText;

    fn span_between(start: u32, end: u32) -> Span {
        Span { source: SourceId(0), start, end }
    }

    #[test]
    fn fixes_are_written_unless_they_touch() {
        let text = "let a\nlet b = a [m]  /// c\n";
        let swap = Fix::safe(vec![
            FixEdit::insert_after(span_between(10, 11), " [m]"),
            FixEdit::replace(span_between(15, 19), ""),
        ]);
        let mut sources = SourceMap::default();
        sources.add(SourceText { name: "a.dgd".into(), text: text.into() });
        assert_eq!(swap.line(&sources).as_deref(), Some("let b [m] = a"));
        let other = Fix::safe(vec![FixEdit::replace(span_between(10, 11), "c")]);
        let first = Fix::safe(vec![FixEdit::insert_before(span_between(0, 3), "# ")]);
        let (out, n) = written(text, SourceId(0), &[&swap, &other, &first]);
        assert_eq!((out.as_str(), n), ("# let a\nlet b [m] = a  /// c\n", 2));
    }
}
