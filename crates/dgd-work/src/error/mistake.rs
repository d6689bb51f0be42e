//! Mistakes in models and data, for programs.

use dgd_compiler::argument::{Argument, Spelling};
use dgd_compiler::diagnostics::{Diagnostic, render};
use dgd_compiler::source::SourceMap;
use serde::Serialize;

/// A mistake in a model or in data, for programs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Mistake {
    /// Its code, for `dgd explain`.
    pub code: String,
    /// The message.
    pub message: String,
    /// Its places, the most important first.
    pub places: Vec<TextSpot>,
    /// Advice.
    pub help: Option<String>,
    /// The fix as a change of the text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fix: Option<TextCorrection>,
}

/// A change of the text that fixes a mistake.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TextCorrection {
    /// Whether `dgd check --fix` writes it.
    pub safe: bool,
    /// The places, each with its replacement as `text`.
    pub edits: Vec<TextSpot>,
}

/// A place in a text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TextSpot {
    /// The file, as it was given, or the argument in parentheses.
    pub file: String,
    /// The name of the argument, if the text is the value of one.
    #[serde(skip)]
    pub argument: Option<&'static str>,
    /// The line where it begins, from 1.
    pub line: usize,
    /// The column where it begins, from 1.
    pub column: usize,
    /// The line where it ends.
    pub end_line: usize,
    /// The column after its end.
    pub end_column: usize,
    /// The label.
    pub text: String,
}

impl Mistake {
    /// A diagnostic for programs.
    pub fn from_diagnostic(
        diagnostic: &Diagnostic,
        sources: &SourceMap,
        spelling: Spelling,
    ) -> Self {
        let entry = render::entry(diagnostic, sources, spelling);
        let spot = |place: render::EditorLocation| TextSpot {
            file: place.file,
            argument: place.argument.map(Argument::name),
            line: place.line,
            column: place.column,
            end_line: place.end_line,
            end_column: place.end_column,
            text: place.text,
        };
        let places = entry.places.into_iter().map(spot).collect();
        let fix = entry.fix.map(|fix| TextCorrection {
            safe: fix.is_safe,
            edits: fix.edits.into_iter().map(spot).collect(),
        });
        Mistake { code: entry.code, message: entry.message, places, help: entry.help, fix }
    }
}
