//! The part of a text kept for diagnostics, and the span of a cell in it.

use std::ops::Range;

use dgd_compiler::source::{SourceId, Span};

use crate::table::DataLocation;

/// The part of the text that diagnostics can show.
#[derive(Clone, Copy)]
pub(crate) struct ShownText {
    /// The kept text.
    pub(crate) source: SourceId,
    /// Whether it is the whole text, or only the lines down to the header.
    pub(crate) whole: bool,
}

impl ShownText {
    pub(crate) fn span(self, range: &Range<usize>) -> Span {
        let byte = |at| u32::try_from(at).unwrap_or(u32::MAX);
        Span { source: self.source, start: byte(range.start), end: byte(range.end) }
    }

    /// The location of a range in a row; the span of `header` if the row is not kept.
    pub(crate) fn place(self, range: &Range<usize>, line: usize, header: Span) -> DataLocation {
        if self.whole {
            DataLocation { span: self.span(range), line: None, row: None }
        } else {
            DataLocation { span: header, line: Some(line), row: None }
        }
    }
}
