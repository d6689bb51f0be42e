//! What a request is answered from: the document, its analysis and the open files.

use dgd_compiler::source::{ColumnUnit, SourceId};
use lsp_types::Position;

use crate::analysis::Analysis;
use crate::files::OpenDocuments;
use crate::places;

/// The data for answers.
pub(crate) struct AnswerContext<'a> {
    /// The document of the request.
    pub(crate) path: String,
    pub(crate) files: &'a OpenDocuments,
    pub(crate) columns: ColumnUnit,
    pub(crate) analysis: Option<&'a Analysis>,
}

impl AnswerContext<'_> {
    /// The text of the document.
    pub(super) fn text(&self) -> &str {
        self.analysis.map_or("", |analysis| &analysis.sources.get(SourceId(0)).text)
    }

    pub(super) fn byte(&self, at: Position) -> usize {
        places::byte(self.text(), at, self.columns)
    }
}
