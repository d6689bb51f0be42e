//! The texts of a model, and places in them.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::sentence::argument::{Argument, Spelling};

/// A text, and its name for the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceText {
    /// Path, as shown in diagnostics; for the value of an argument, the name of the argument.
    pub name: String,
    /// The whole text.
    pub text: String,
}

/// Number of a source among the [`SourceMap`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct SourceId(pub u32);

/// A range of bytes of one source; `start == end` is a place between two characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Span {
    /// The source.
    pub source: SourceId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The smallest range that contains both; the first if they are in different sources.
    #[must_use]
    pub fn join(self, other: Span) -> Span {
        if self.source != other.source {
            return self;
        }
        Span {
            source: self.source,
            start: self.start.min(other.start),
            end: self.end.max(other.end),
        }
    }
}

/// A unit that a model declares, `unit stroke = 0.118 [l]`.
#[derive(Debug, Clone, PartialEq)]
pub struct DeclaredUnit {
    /// Its symbol.
    pub symbol: String,
    /// Its value, in `unit`.
    pub value: f64,
    /// A unit of the language.
    pub unit: String,
}

/// Every text of one compilation: the model's own first, then its imports, and values of arguments.
#[derive(Debug, Clone, Default)]
pub struct SourceMap {
    list: Vec<SourceText>,
    /// The sources that are values of arguments, not files.
    arguments: BTreeMap<SourceId, Argument>,
    /// Units that the model declares, for columns of data files.
    pub units: Vec<DeclaredUnit>,
}

impl SourceMap {
    /// Adds a source and returns its id.
    pub fn add(&mut self, source: SourceText) -> SourceId {
        self.list.push(source);
        SourceId(u32::try_from(self.list.len() - 1).unwrap_or(u32::MAX))
    }

    /// Adds the value of an argument, so that diagnostics can point to it.
    pub fn add_argument(&mut self, argument: Argument, text: String) -> SourceId {
        let id = self.add(SourceText { name: argument.name().to_owned(), text });
        self.arguments.insert(id, argument);
        id
    }

    /// The id of an argument's value that may have been added before, so that an error in it is reported once.
    pub fn add_argument_once(&mut self, argument: Argument, text: String) -> SourceId {
        let is_same = |id: &SourceId, of: &Argument| *of == argument && self.get(*id).text == text;
        let added = self.arguments.iter().find(|(id, of)| is_same(id, of)).map(|(id, _)| *id);
        added.unwrap_or_else(|| self.add_argument(argument, text))
    }

    /// The argument that a source is the value of; `None` for a file.
    pub fn argument(&self, id: SourceId) -> Option<Argument> {
        self.arguments.get(&id).copied()
    }

    /// The name of a source for the users of a face: its path, or its argument in parentheses.
    pub fn shown_name(&self, id: SourceId, spelling: Spelling) -> Cow<'_, str> {
        match self.argument(id) {
            Some(argument) => Cow::Owned(format!("({})", spelling(&argument.into()))),
            None => Cow::Borrowed(&self.get(id).name),
        }
    }

    /// The source with this id.
    pub fn get(&self, id: SourceId) -> &SourceText {
        &self.list[id.0 as usize]
    }

    /// All sources in the order they were added.
    pub fn iter(&self) -> impl Iterator<Item = &SourceText> {
        self.list.iter()
    }

    /// The sources that are files, in the order they were added.
    pub fn files(&self) -> impl Iterator<Item = &SourceText> {
        let ids = (0..).map(SourceId);
        let is_file = |id: &SourceId| !self.arguments.contains_key(id);
        ids.zip(&self.list).filter(move |(id, _)| is_file(id)).map(|(_, source)| source)
    }

    /// The text of a span.
    pub fn text(&self, span: Span) -> &str {
        &self.get(span.source).text[span.start as usize..span.end as usize]
    }

    /// Line and column of a span's start, both from 1; the column counts characters.
    pub fn line_column(&self, span: Span) -> (usize, usize) {
        let before = &self.get(span.source).text[..span.start as usize];
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        (before.matches('\n').count() + 1, ColumnUnit::Characters.count(&before[line_start..]) + 1)
    }
}

/// Unit in which columns are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnUnit {
    /// Bytes of UTF-8.
    Utf8,
    /// Units of UTF-16; a character beyond the first plane has two.
    Utf16,
    /// Characters.
    Characters,
}

impl ColumnUnit {
    /// Number of columns of a text without line ends.
    pub fn count(self, text: &str) -> usize {
        match self {
            ColumnUnit::Utf8 => text.len(),
            ColumnUnit::Utf16 => text.chars().map(char::len_utf16).sum(),
            ColumnUnit::Characters => text.chars().count(),
        }
    }

    /// The number of bytes of the first `columns` columns of a line, or of the whole line if it is shorter. A column
    /// within a character counts as the one before it.
    fn bytes(self, line: &str, columns: usize) -> usize {
        let mut passed = 0;
        for (at, c) in line.char_indices() {
            passed += self.count(&line[at..at + c.len_utf8()]);
            if passed > columns {
                return at;
            }
        }
        line.len()
    }
}

/// Starts of the lines of a text, to convert between bytes and lines and columns, which are counted from 0.
#[derive(Debug, Clone)]
pub struct LineStarts {
    starts: Vec<usize>,
}

impl LineStarts {
    /// The lines of a text.
    pub fn from_text(text: &str) -> LineStarts {
        let behind_ends = text.match_indices('\n').map(|(at, _)| at + 1);
        LineStarts { starts: std::iter::once(0).chain(behind_ends).collect() }
    }

    /// Line and column of a byte of this text.
    pub fn position(&self, text: &str, byte: usize, columns: ColumnUnit) -> (usize, usize) {
        let mut byte = byte.min(text.len());
        while !text.is_char_boundary(byte) {
            byte -= 1;
        }
        let line = self.starts.partition_point(|start| *start <= byte) - 1;
        (line, columns.count(&text[self.starts[line]..byte]))
    }

    /// The byte of this text at a line and column; the end of the line or text if these are shorter.
    pub fn byte(&self, text: &str, line: usize, column: usize, columns: ColumnUnit) -> usize {
        let Some(&start) = self.starts.get(line) else { return text.len() };
        let end = self.starts.get(line + 1).map_or(text.len(), |next| next - 1);
        let line = text[start..end].strip_suffix('\r').unwrap_or(&text[start..end]);
        start + columns.bytes(line, column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_greek_and_wide_letters_lead_back_to_their_bytes() {
        let text = "let τ = 1\r\nΔp 𝜌x # end\n";
        let lines = LineStarts::from_text(text);
        for (byte, _) in text.char_indices().filter(|(_, c)| !matches!(c, '\r' | '\n')) {
            for columns in [ColumnUnit::Utf8, ColumnUnit::Utf16, ColumnUnit::Characters] {
                let (line, column) = lines.position(text, byte, columns);
                assert_eq!(lines.byte(text, line, column, columns), byte, "{columns:?}");
            }
        }
        let x = text.find('x').expect("it is there");
        assert_eq!(lines.position(text, x, ColumnUnit::Utf8), (1, 8));
        assert_eq!(lines.position(text, x, ColumnUnit::Utf16), (1, 5));
        assert_eq!(lines.position(text, x, ColumnUnit::Characters), (1, 4));
        // Inside a letter of two units, beyond a line, and beyond the text.
        assert_eq!(lines.byte(text, 1, 4, ColumnUnit::Utf16), text.find('𝜌').expect("it is there"));
        assert_eq!(
            lines.byte(text, 0, 99, ColumnUnit::Utf16),
            text.find('\r').expect("it is there")
        );
        assert_eq!(lines.byte(text, 9, 0, ColumnUnit::Utf16), text.len());
    }
}
