//! Hover text: value, unit, doc, equation, dimension and uses; and inlay hints with units of `let`s.

use std::fmt::Write as _;

use dgd_compiler::expr::display::number;
use dgd_compiler::expr::intrinsics::INTRINSICS;
use dgd_compiler::model::typeset::latex;
use dgd_compiler::names::{NameTable, NamedItem, SymbolId, SymbolKind};
use dgd_compiler::source::{SourceId, SourceMap, Span};
use dgd_compiler::syntax::ast::{Ast, Item, ItemKind};
use dgd_compiler::syntax::{own_units, parse_what_is_sound, visit};
use dgd_compiler::units::describe;
use lsp_types::{
    Hover, HoverContents, HoverParams, InlayHint, InlayHintKind, InlayHintLabel, MarkupContent,
    MarkupKind,
};

use super::context::AnswerContext;
use crate::{dimensions, places};

pub(super) fn hover(params: &HoverParams, context: &AnswerContext<'_>) -> Option<Hover> {
    let analysis = context.analysis?;
    let byte = context.byte(params.text_document_position_params.position) as u32;
    let (names, sources) = context.files.names(&context.path);
    let mut text = String::new();
    let mut place = None;
    if let Some(one) = names.find_at(SourceId(0), byte) {
        place = Some(one.span);
        text = of_symbol(one.symbol, &names, &sources, context);
    } else if let Some((word, span)) = word_at(context.text(), byte)
        && let Some(function) = INTRINSICS.iter().find(|function| function.name == word)
    {
        place = Some(span);
        let _ = write!(text, "`{}`: {}", function.name, function.doc);
    } else if let Some((word, span)) = word_at(context.text(), byte)
        && let Some(unit) =
            own_units::declared(&analysis.asts).into_iter().find(|unit| unit.symbol == word)
    {
        place = Some(span);
        let _ = write!(text, "`{word}`: {} {}", number(unit.value), unit.unit);
    }
    // The innermost expression around the cursor.
    let dimensions = dimensions::all(analysis);
    let around = dimensions
        .iter()
        .filter(|(span, _)| span.source == SourceId(0) && span.start <= byte && byte <= span.end);
    if let Some((span, dimension)) = around.min_by_key(|(span, _)| span.end - span.start) {
        let expression = analysis.sources.text(*span);
        let sentence = format!("`{expression}` is in `{}`", describe(*dimension));
        text = if text.is_empty() { sentence } else { format!("{text}\n\n{sentence}") };
        place = place.or(Some(*span));
    }
    let place = place?;
    let bytes = place.start as usize..place.end as usize;
    Some(Hover {
        contents: HoverContents::Markup(MarkupContent { kind: MarkupKind::Markdown, value: text }),
        range: Some(places::range(context.text(), bytes, context.columns)),
    })
}

/// The word at a byte, with its span.
fn word_at(text: &str, byte: u32) -> Option<(&str, Span)> {
    let byte = byte as usize;
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let start = text[..byte]
        .rfind(|c| !is_word(c))
        .map_or(0, |at| at + text[at..].chars().next().map_or(1, char::len_utf8));
    let end = text[byte..].find(|c| !is_word(c)).map_or(text.len(), |at| byte + at);
    let span = Span { source: SourceId(0), start: start as u32, end: end as u32 };
    (start < end).then(|| (&text[start..end], span))
}

/// The declaration of a symbol, its doc comment, value and uses.
fn of_symbol(
    id: SymbolId,
    names: &NameTable,
    sources: &SourceMap,
    context: &AnswerContext<'_>,
) -> String {
    let symbol = names.symbol(id);
    let ast = parse_what_is_sound(symbol.declared.source, sources);
    let mut text = String::new();
    if let Some(item) = item_around(&ast, symbol.declared) {
        let written = sources.text(item.span);
        let _ = write!(text, "```dgd\n{}\n```", written.lines().next().unwrap_or_default());
        if !item.doc.is_empty() {
            let _ = write!(text, "\n\n{}", item.doc.join("\n"));
        }
    } else {
        let _ = write!(text, "{:?} `{}`", symbol.kind, symbol.name);
    }
    if let Some(value) = value_of(symbol, sources, context) {
        let _ = write!(text, "\n\n{value}");
    }
    let uses = names.uses_of(id).filter(|one| !one.declares);
    let mut files: Vec<&str> = Vec::new();
    let mut n_uses = 0;
    for one in uses {
        n_uses += 1;
        let name = sources.get(one.span.source).name.rsplit('/').next().unwrap_or_default();
        if !files.contains(&name) {
            files.push(name);
        }
    }
    let times = if n_uses == 1 { "once".to_owned() } else { format!("{n_uses} times") };
    let is_read_elsewhere = matches!(
        symbol.kind,
        SymbolKind::Equation | SymbolKind::Output | SymbolKind::Model | SymbolKind::Effect
    );
    let _ = match files.as_slice() {
        // Files outside the project may use it.
        [] if is_read_elsewhere => Ok(()),
        [] => write!(text, "\n\nNot used"),
        files => write!(text, "\n\nUsed {times}, in {}", files.join(", ")),
    };
    text
}

/// The innermost item around a span.
fn item_around(ast: &Ast, place: Span) -> Option<&Item> {
    let mut innermost = None;
    visit::items(&ast.items, &mut |item| {
        if item.span.start <= place.start && place.end <= item.span.end {
            innermost = Some(item);
        }
    });
    innermost
}

/// The value of a constant or parameter of the document, in its unit; the typeset equation of a label.
fn value_of(
    symbol: &NamedItem,
    sources: &SourceMap,
    context: &AnswerContext<'_>,
) -> Option<String> {
    let NamedItem { name, kind, declared } = symbol;
    if sources.get(declared.source).name != context.path {
        return None;
    }
    let analysis = context.analysis?;
    let model = analysis.model.as_ref()?;
    let constants = model.constants.iter().map(|one| (&one.declared, one.value));
    let parameters = model.parameters.iter().map(|one| (&one.declared, one.value));
    let entry = constants.chain(parameters).find(|(declared, _)| declared.name == *name);
    if let Some((declared, si)) = entry {
        let unit = &declared.unit;
        return Some(format!("= {} {}", unit.from_si(si), unit.symbol));
    }
    if *kind == SymbolKind::Equation {
        let equations = latex::equations(&analysis.asts, model, name);
        return Some(format!("$$\n{}\n$$", equations.join(" \\\\\n")));
    }
    let dimension = model.lets.iter().find(|one| one.name == *name).map(|one| one.dimension);
    dimension.map(|dimension| format!("in `{}`", describe(dimension)))
}

/// The units of `let`s without a declared unit.
pub(super) fn inlay_hints(context: &AnswerContext<'_>) -> Vec<InlayHint> {
    let Some(analysis) = context.analysis else { return Vec::new() };
    let mut hints = Vec::new();
    visit::items(&analysis.asts[0].items, &mut |item| {
        let ItemKind::Let { name, unit: None, value } = &item.kind else { return };
        let Some(dimension) = analysis.dimensions.get(&value.span) else { return };
        let range = places::range_of(name.span, &analysis.sources, context.columns);
        hints.push(InlayHint {
            position: range.end,
            label: InlayHintLabel::String(format!("[{}]", describe(*dimension))),
            kind: Some(InlayHintKind::TYPE),
            text_edits: None,
            tooltip: None,
            padding_left: Some(true),
            padding_right: None,
            data: None,
        });
    });
    hints
}
