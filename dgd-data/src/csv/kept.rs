//! The part of a text kept for diagnostics, and the place of a cell in it.

use std::ops::Range;

use dgd_compiler::source::{SourceId, Span};

use crate::table::Location;

/// What of the text diagnostics can show.
#[derive(Clone, Copy)]
pub(crate) struct Kept {
    /// The text that is kept.
    pub(crate) source: SourceId,
    /// Whether that is all of it, or only the lines down to the header.
    pub(crate) whole: bool,
}

impl Kept {
    pub(crate) fn span(self, range: &Range<usize>) -> Span {
        let byte = |at| u32::try_from(at).unwrap_or(u32::MAX);
        Span { source: self.source, start: byte(range.start), end: byte(range.end) }
    }

    /// A place in a row; `header` stands for it where the row is not kept.
    pub(crate) fn place(self, range: &Range<usize>, line: usize, header: Span) -> Location {
        if self.whole {
            Location { span: self.span(range), line: None, row: None }
        } else {
            Location { span: header, line: Some(line), row: None }
        }
    }
}
