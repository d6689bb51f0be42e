//! Changes of a text that set a mistake right.

use crate::source::{SourceId, Sources, Span};

/// A change of the text that sets a mistake right: what an editor can offer, and `dgd check --fix` can write.
#[derive(Debug, Clone, PartialEq)]
pub struct Fix {
    /// Its parts, which do not overlap.
    pub edits: Vec<Edit>,
    /// Whether it can be written without asking.
    pub safety: Safety,
}

/// A piece of text that takes the place of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edit {
    /// What is replaced; an empty span where something is put in.
    pub span: Span,
    /// What stands there instead.
    pub text: String,
}

/// Whether a fix can be written without asking.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Safety {
    /// The text could mean nothing else.
    Safe,
    /// A guess.
    Guess,
}

impl Edit {
    /// Replaces a piece.
    pub fn replace(span: Span, text: impl Into<String>) -> Self {
        Edit { span, text: text.into() }
    }

    /// Puts something in front of a place.
    pub fn before(span: Span, text: impl Into<String>) -> Self {
        Edit { span: Span { end: span.start, ..span }, text: text.into() }
    }

    /// Puts something behind a place.
    pub fn behind(span: Span, text: impl Into<String>) -> Self {
        Edit { span: Span { start: span.end, ..span }, text: text.into() }
    }
}

impl Fix {
    /// What can be written without asking.
    pub fn safe(edits: Vec<Edit>) -> Self {
        Fix { edits, safety: Safety::Safe }
    }

    /// Whether it can be written without asking.
    pub fn is_safe(&self) -> bool {
        self.safety == Safety::Safe
    }

    /// The line or lines as they should stand, without a comment at the end; nothing for a fix in several files.
    pub fn line(&self, sources: &Sources) -> Option<String> {
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

/// A text with these fixes, and how many of them there was place for: of two that touch one another the first counts.
///
/// The others can be written into the text that comes out, once it has been checked again.
pub fn written(text: &str, source: SourceId, fixes: &[&Fix]) -> (String, usize) {
    let mut taken: Vec<&Edit> = Vec::new();
    let mut n = 0;
    for fix in fixes {
        let touches = |edit: &Edit| {
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
fn write(text: &str, offset: usize, edits: &[&Edit]) -> String {
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
    use crate::source::Source;

    fn at(start: u32, end: u32) -> Span {
        Span { source: SourceId(0), start, end }
    }

    #[test]
    fn fixes_are_written_unless_they_touch() {
        let text = "let a\nlet b = a [m]  /// c\n";
        let swap = Fix::safe(vec![Edit::behind(at(10, 11), " [m]"), Edit::replace(at(15, 19), "")]);
        let mut sources = Sources::default();
        sources.add(Source { name: "a.dgd".into(), text: text.into() });
        assert_eq!(swap.line(&sources).as_deref(), Some("let b [m] = a"));
        let other = Fix::safe(vec![Edit::replace(at(10, 11), "c")]);
        let first = Fix::safe(vec![Edit::before(at(0, 3), "# ")]);
        let (out, n) = written(text, SourceId(0), &[&swap, &other, &first]);
        assert_eq!((out.as_str(), n), ("# let a\nlet b [m] = a  /// c\n", 2));
    }
}
