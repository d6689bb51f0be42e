//! The compiler's diagnostics for the editor, and quick fixes.

use std::collections::HashMap;

use dgd_compiler::diagnostics::{Code, Diagnostic, DiagnosticLabel, Fix, FixEdit};
use dgd_compiler::source::{ColumnUnit, SourceId, SourceMap, Span};
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionParams, CodeActionResponse, DiagnosticRelatedInformation,
    DiagnosticSeverity, Location, NumberOrString, Position, Range, TextEdit, Uri, WorkspaceEdit,
};

use super::context::AnswerContext;
use super::conversions::{ConversionProposal, conversions};
use crate::analysis::Analysis;
use crate::places;

/// The diagnostics of a document, for the first choice of each variant and for others. Those in an imported file are
/// shown at the top of the document, with their location.
pub(crate) fn diagnostics(analysis: &Analysis, columns: ColumnUnit) -> Vec<lsp_types::Diagnostic> {
    let first = &analysis.diagnostics;
    let more = analysis.others.iter().filter(|other| !first.contains(other));
    first.iter().chain(more).map(|one| shown(one, &analysis.sources, columns)).collect()
}

fn shown(
    diagnostic: &Diagnostic,
    sources: &SourceMap,
    columns: ColumnUnit,
) -> lsp_types::Diagnostic {
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
    let related = |label: &DiagnosticLabel| {
        let location = places::location(label.span, sources, columns)?;
        let message = if label.text.is_empty() { "here".to_owned() } else { label.text.clone() };
        Some(DiagnosticRelatedInformation { location, message })
    };
    let elsewhere = (!is_own).then_some(first);
    let related_errors: Vec<_> = elsewhere.into_iter().chain(others).filter_map(related).collect();
    let top = Range::new(Position::new(0, 0), Position::new(0, 0));
    lsp_types::Diagnostic {
        range: if is_own { places::range_of(first.span, sources, columns) } else { top },
        severity: Some(DiagnosticSeverity::ERROR),
        code: Some(NumberOrString::String(diagnostic.code.to_string())),
        source: Some("dgd".to_owned()),
        message,
        related_information: (!related_errors.is_empty()).then_some(related_errors),
        ..Default::default()
    }
}

/// The diagnostic for a document on which the compiler crashed.
pub(crate) fn crashed() -> lsp_types::Diagnostic {
    lsp_types::Diagnostic {
        severity: Some(DiagnosticSeverity::WARNING),
        source: Some("dgd".to_owned()),
        message: "this text could not be checked: a mistake of dgd itself".to_owned(),
        ..Default::default()
    }
}

/// The word that a help text proposes as a replacement: "did you mean `x`?".
fn proposed(help: &str) -> Option<&str> {
    help.strip_prefix("did you mean `")?.strip_suffix("`?")
}

/// Quick fixes for the diagnostics in a range, and a combined fix of all safe ones in the document.
pub(super) fn actions(
    params: &CodeActionParams,
    context: &AnswerContext<'_>,
) -> CodeActionResponse {
    let Some(analysis) = context.analysis else { return Vec::new() };
    let wanted = |kind: &CodeActionKind| {
        let only = params.context.only.as_ref();
        only.is_none_or(|only| only.iter().any(|one| kind.as_str().starts_with(one.as_str())))
    };
    let mut actions = Vec::new();
    for diagnostic in analysis.diagnostics.iter().chain(&analysis.others) {
        let span = diagnostic.labels[0].span;
        let range = places::range_of(span, &analysis.sources, context.columns);
        // The cursor may be anywhere in the lines.
        let touches =
            range.start.line <= params.range.end.line && params.range.start.line <= range.end.line;
        if span.source == SourceId(0) && touches && wanted(&CodeActionKind::QUICKFIX) {
            actions.extend(of_mistake(diagnostic, analysis, context));
        }
    }
    if wanted(&CodeActionKind::SOURCE_FIX_ALL) {
        actions.extend(all_safe(analysis, context));
    }
    actions.into_iter().map(Into::into).collect()
}

/// Fixes of one error, unambiguous ones first.
fn of_mistake(
    diagnostic: &Diagnostic,
    analysis: &Analysis,
    context: &AnswerContext<'_>,
) -> Vec<CodeAction> {
    let of_compiler = diagnostic.fix.iter().map(|fix| {
        let title = fix.line(&analysis.sources).map(|line| format!("Write `{line}`"));
        (title.unwrap_or_else(|| "Correct it".to_owned()), fix.edits.clone(), fix.is_safe())
    });
    let guessed = |(title, edits)| (title, edits, false);
    let word = word(diagnostic, analysis).map(|(title, edits)| (title, edits, true));
    let label = label(diagnostic, analysis).map(|(title, edits)| (title, edits, true));
    let others = conversions(diagnostic, analysis).into_iter().map(guessed);
    let proposals: Vec<_> = of_compiler.chain(word).chain(label).chain(others).collect();
    let shown = shown(diagnostic, &analysis.sources, context.columns);
    proposals
        .into_iter()
        .map(|(title, edits, is_preferred)| CodeAction {
            title,
            kind: Some(CodeActionKind::QUICKFIX),
            diagnostics: Some(vec![shown.clone()]),
            edit: Some(written(&edits, analysis, context.columns)),
            is_preferred: Some(is_preferred),
            ..Default::default()
        })
        .collect()
}

/// Replaces the marked word by the proposed one.
fn word(diagnostic: &Diagnostic, analysis: &Analysis) -> Option<ConversionProposal> {
    let help = diagnostic.help.as_ref()?.to_string();
    let word = proposed(&help)?;
    let span = diagnostic.labels[0].span;
    // For `pump.c`, a help text may concern only the part after the dot.
    let new = match analysis.sources.text(span).rsplit_once('.') {
        Some((part, _)) if !word.contains('.') => format!("{part}.{word}"),
        _ => word.to_owned(),
    };
    Some((format!("Write `{new}`"), vec![FixEdit::replace(span, new)]))
}

/// Adds a label to an equation without one.
fn label(diagnostic: &Diagnostic, analysis: &Analysis) -> Option<ConversionProposal> {
    let place = diagnostic.labels[0].span;
    let text = &analysis.sources.get(SourceId(0)).text;
    let position = place.start as usize;
    let start = text[..position].rfind('\n').map_or(0, |at| at + 1);
    let line = text[start..].lines().next()?;
    let indent = line.len() - line.trim_start().len();
    let formula = line.trim_start().strip_prefix("equation ")?;
    let code = formula.split(['#', '/']).next().unwrap_or_default();
    if diagnostic.code != Code::UnexpectedToken || code.contains(':') || !code.contains('=') {
        return None;
    }
    let unknown = code.split_once("der(").and_then(|(_, rest)| rest.split(')').next());
    let is_name = |name: &&str| name.chars().all(|c| c.is_alphanumeric() || c == '_');
    let first = unknown.filter(is_name).map_or("balance".to_owned(), |of| format!("der_{of}"));
    let is_taken = |label: &String| text.contains(&format!("equation {label}"));
    let further = (2..).map(|n| format!("{first}_{n}"));
    let label = std::iter::once(first.clone()).chain(further).find(|label| !is_taken(label))?;
    let behind = u32::try_from(start + indent + "equation ".len()).ok()?;
    let span = Span { start: behind, end: behind, ..place };
    Some((format!("Label it `{label}`"), vec![FixEdit::replace(span, format!("{label}: "))]))
}

/// All unambiguous corrections of the document.
fn all_safe(analysis: &Analysis, context: &AnswerContext<'_>) -> Option<CodeAction> {
    let fixes = analysis.diagnostics.iter().filter_map(|one| one.fix.as_deref());
    let safe: Vec<&Fix> = fixes.filter(|fix| fix.is_safe()).collect();
    let text = context.text();
    let (new, n) = dgd_compiler::diagnostics::fix::written(text, SourceId(0), &safe);
    let whole = Span { source: SourceId(0), start: 0, end: u32::try_from(text.len()).ok()? };
    (n > 0).then(|| CodeAction {
        title: "Write all safe corrections".to_owned(),
        kind: Some(CodeActionKind::SOURCE_FIX_ALL),
        edit: Some(written(&[FixEdit::replace(whole, new)], analysis, context.columns)),
        ..Default::default()
    })
}

/// Converts edits to the protocol's form.
#[allow(clippy::mutable_key_type)] // The protocol's own type.
fn written(edits: &[FixEdit], analysis: &Analysis, columns: ColumnUnit) -> WorkspaceEdit {
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for FixEdit { span, text } in edits {
        if let Some(Location { uri, range }) = places::location(*span, &analysis.sources, columns) {
            changes.entry(uri).or_default().push(TextEdit::new(range, text.clone()));
        }
    }
    WorkspaceEdit::new(changes)
}
