//! Finds declarations and uses of a name, and renames it, in all files of the project.

use std::collections::HashMap;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::expr::intrinsics::IntrinsicId;
use dgd_compiler::names::{NameTable, NameUse};
use dgd_compiler::source::{SourceId, SourceMap, SourceText};
use dgd_compiler::syntax::ast::ItemKind;
use dgd_compiler::syntax::parse;
use lsp_types::{
    GotoDefinitionParams, Location, PrepareRenameResponse, ReferenceParams, RenameParams,
    TextDocumentPositionParams, TextEdit, Uri, WorkspaceEdit,
};

use super::context::AnswerContext;
use crate::places;

/// The names of the project, and the use at a position.
fn found(
    at: &TextDocumentPositionParams,
    context: &AnswerContext<'_>,
) -> Option<(NameTable, SourceMap, NameUse)> {
    let byte = context.byte(at.position) as u32;
    let (names, sources) = context.files.names(&context.path);
    let one = *names.find_at(SourceId(0), byte)?;
    Some((names, sources, one))
}

pub(super) fn definition(
    params: &GotoDefinitionParams,
    context: &AnswerContext<'_>,
) -> Option<Vec<Location>> {
    let (names, sources, one) = found(&params.text_document_position_params, context)?;
    let declared = names.uses_of(one.symbol).filter(|one| one.declares);
    Some(declared.filter_map(|one| places::location(one.span, &sources, context.columns)).collect())
}

pub(super) fn references(
    params: &ReferenceParams,
    context: &AnswerContext<'_>,
) -> Option<Vec<Location>> {
    let (names, sources, one) = found(&params.text_document_position, context)?;
    let with_declarations = params.context.include_declaration;
    let uses = names.uses_of(one.symbol).filter(|one| with_declarations || !one.declares);
    Some(uses.filter_map(|one| places::location(one.span, &sources, context.columns)).collect())
}

pub(super) fn prepare(
    params: &TextDocumentPositionParams,
    context: &AnswerContext<'_>,
) -> Option<PrepareRenameResponse> {
    let (_, sources, one) = found(params, context)?;
    let range = places::range_of(one.span, &sources, context.columns);
    Some(PrepareRenameResponse::Range(range))
}

#[allow(clippy::mutable_key_type)] // The protocol's own type.
pub(super) fn rename(
    params: &RenameParams,
    context: &AnswerContext<'_>,
) -> Result<Option<WorkspaceEdit>, String> {
    let Some((names, sources, one)) = found(&params.text_document_position, context) else {
        return Err("nothing here is a name of the model".to_owned());
    };
    let new = params.new_name.trim();
    verify(new, &one, &names, &sources)?;
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for one in names.uses_of(one.symbol) {
        if let Some(Location { uri, range }) = places::location(one.span, &sources, context.columns)
        {
            changes.entry(uri).or_default().push(TextEdit::new(range, new.to_owned()));
        }
    }
    Ok(Some(WorkspaceEdit::new(changes)))
}

/// Checks that a symbol can have this name: it is valid, and free wherever the symbol is named.
fn verify(new: &str, one: &NameUse, names: &NameTable, sources: &SourceMap) -> Result<(), String> {
    let is_taken =
        matches!(new, "time" | "pi" | "der" | "delay") || IntrinsicId::find(new).is_some();
    if !is_name(new) || is_taken {
        return Err(format!("`{new}` cannot be a name of the model"));
    }
    for place in names.uses_of(one.symbol) {
        let source = place.span.source;
        let readable = names.readable_in(source);
        let of_file = names.uses_in(source).map(|other| other.symbol);
        let mut others = readable.into_iter().chain(of_file).filter(|id| *id != one.symbol);
        if others.any(|id| names.symbol(id).name == new) {
            let file = sources.get(source).name.rsplit('/').next().unwrap_or_default();
            return Err(format!("something in {file} is called `{new}` already"));
        }
    }
    Ok(())
}

/// Whether a text is a valid name, without dots.
fn is_name(text: &str) -> bool {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let line = format!("let {text} = 1");
    let id = sources.add(SourceText { name: String::new(), text: line });
    let parsed = parse(id, &sources, &mut diagnostics);
    parsed.is_ok_and(|ast| match ast.items.as_slice() {
        [only] => matches!(&only.kind, ItemKind::Let { name, unit: None, .. } if name.text == text),
        _ => false,
    } && !text.contains('.'))
}
