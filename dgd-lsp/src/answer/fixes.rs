//! Diagnostics of the compiler as the editor shows them, and quick fixes.

use std::collections::HashMap;

use dgd_compiler::diagnostics::{Diagnostic, Label};
use dgd_compiler::source::{Columns, SourceId, Sources};
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionParams, CodeActionResponse, DiagnosticRelatedInformation,
    DiagnosticSeverity, NumberOrString, Position, Range, TextEdit, WorkspaceEdit,
};

use super::Context;
use crate::analysis::Analysis;
use crate::places;

/// What is wrong with a document, by the first choice of each variant and by others. What is wrong in an imported
/// file stands at the top of the document, with its place.
pub(crate) fn diagnostics(
    analysis: &Analysis,
    others: &[Diagnostic],
    columns: Columns,
) -> Vec<lsp_types::Diagnostic> {
    let own = &analysis.diagnostics;
    let more = others.iter().filter(|other| !own.contains(other));
    own.iter().chain(more).map(|one| shown(one, &analysis.sources, columns)).collect()
}

fn shown(diagnostic: &Diagnostic, sources: &Sources, columns: Columns) -> lsp_types::Diagnostic {
    let [first, others @ ..] = diagnostic.labels.as_slice() else {
        unreachable!("a diagnostic has a place")
    };
    let is_own = first.span.source == SourceId(0);
    let mut message = diagnostic.message.clone();
    if !first.text.is_empty() {
        message = format!("{message}\n{}", first.text);
    }
    if let Some(help) = &diagnostic.help {
        message = format!("{message}\nhelp: {help}");
    }
    let related = |label: &Label| {
        let location = places::location(label.span, sources, columns)?;
        let message = if label.text.is_empty() { "here".to_owned() } else { label.text.clone() };
        Some(DiagnosticRelatedInformation { location, message })
    };
    let elsewhere = (!is_own).then_some(first);
    let all: Vec<_> = elsewhere.into_iter().chain(others).filter_map(related).collect();
    let top = Range::new(Position::new(0, 0), Position::new(0, 0));
    lsp_types::Diagnostic {
        range: if is_own { places::range_of(first.span, sources, columns) } else { top },
        severity: Some(DiagnosticSeverity::ERROR),
        code: Some(NumberOrString::String(diagnostic.code.to_string())),
        source: Some("dgd".to_owned()),
        message,
        related_information: (!all.is_empty()).then_some(all),
        ..Default::default()
    }
}

/// What is said of a document on which the compiler crashed.
pub(crate) fn crashed() -> lsp_types::Diagnostic {
    lsp_types::Diagnostic {
        severity: Some(DiagnosticSeverity::WARNING),
        source: Some("dgd".to_owned()),
        message: "this text could not be checked: a mistake of dgd itself".to_owned(),
        ..Default::default()
    }
}

/// The word that a help proposes in the place of what is marked: "did you mean `x`?".
fn proposed(help: &str) -> Option<&str> {
    help.strip_prefix("did you mean `")?.strip_suffix("`?")
}

/// Quick fixes of what is wrong in a range.
pub(super) fn actions(params: &CodeActionParams, context: &Context<'_>) -> CodeActionResponse {
    let Some(analysis) = context.analysis else { return Vec::new() };
    let mut actions = Vec::new();
    for diagnostic in &analysis.diagnostics {
        let span = diagnostic.labels[0].span;
        if span.source != SourceId(0) {
            continue;
        }
        let range = places::range_of(span, &analysis.sources, context.columns);
        let touches = range.start <= params.range.end && params.range.start <= range.end;
        let Some(word) = diagnostic.help.as_deref().and_then(proposed).filter(|_| touches) else {
            continue;
        };
        let text = analysis.sources.text(span);
        // Of `pump.c`, a help may be about what stands behind the point only.
        let new = match text.rsplit_once('.') {
            Some((part, _)) if !word.contains('.') => format!("{part}.{word}"),
            _ => word.to_owned(),
        };
        let edit = TextEdit::new(range, new.clone());
        let uri = params.text_document.uri.clone();
        actions.push(
            CodeAction {
                title: format!("Write `{new}`"),
                kind: Some(CodeActionKind::QUICKFIX),
                diagnostics: Some(vec![shown(diagnostic, &analysis.sources, context.columns)]),
                edit: Some(WorkspaceEdit::new(HashMap::from([(uri, vec![edit])]))),
                is_preferred: Some(true),
                ..Default::default()
            }
            .into(),
        );
    }
    actions
}
