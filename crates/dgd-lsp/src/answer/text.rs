//! Features of the document's text: outline, folding, formatting, semantic tokens and lenses.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::names::SymbolKind;
use dgd_compiler::source::{SourceId, SourceMap};
use dgd_compiler::syntax::ast::{Item, ItemKind, Name};
use dgd_compiler::syntax::{Token, TokenKind, layout, parse, tokens};
use lsp_types::{
    CodeLens, Command, DocumentSymbol, FoldingRange, FoldingRangeKind, SemanticToken,
    SemanticTokenType, SemanticTokens, TextEdit,
};

use super::context::AnswerContext;
use crate::places;

/// The token types, in the order of their numbers in the protocol.
pub(super) const TOKEN_TYPES: &[SemanticTokenType] = &[
    SemanticTokenType::COMMENT,
    SemanticTokenType::STRING,
    SemanticTokenType::NUMBER,
    SemanticTokenType::TYPE,
    SemanticTokenType::KEYWORD,
    SemanticTokenType::FUNCTION,
    SemanticTokenType::PARAMETER,
    SemanticTokenType::VARIABLE,
    SemanticTokenType::NAMESPACE,
    SemanticTokenType::ENUM_MEMBER,
    SemanticTokenType::EVENT,
];

pub(super) fn symbols(context: &AnswerContext<'_>) -> Vec<DocumentSymbol> {
    let Some(analysis) = context.analysis else { return Vec::new() };
    outline(&analysis.asts[0].items, &analysis.sources, context)
}

fn outline(
    items: &[Item],
    sources: &SourceMap,
    context: &AnswerContext<'_>,
) -> Vec<DocumentSymbol> {
    let mut entries = Vec::new();
    for item in items {
        let mut children = Vec::new();
        let (name, kind): (&Name, _) = match &item.kind {
            ItemKind::Constant { name, .. }
            | ItemKind::Size { name, .. }
            | ItemKind::Unit { name, .. } => (name, lsp_types::SymbolKind::CONSTANT),
            ItemKind::Parameter { name, .. } => (name, lsp_types::SymbolKind::PROPERTY),
            ItemKind::Input { name, .. } => (name, lsp_types::SymbolKind::INTERFACE),
            ItemKind::Unknown { name, .. }
            | ItemKind::Array { name, .. }
            | ItemKind::Let { name, .. } => (name, lsp_types::SymbolKind::VARIABLE),
            ItemKind::Function { name, .. } | ItemKind::Table { name, .. } => {
                (name, lsp_types::SymbolKind::FUNCTION)
            }
            ItemKind::Output { name, .. } => (name, lsp_types::SymbolKind::FIELD),
            ItemKind::Equation { label, .. } => (label, lsp_types::SymbolKind::EVENT),
            ItemKind::Part { name, .. } => (name, lsp_types::SymbolKind::MODULE),
            ItemKind::Variant { name, choices } | ItemKind::Modes { name, modes: choices, .. } => {
                for choice in choices {
                    children.extend(outline(&choice.items, sources, context));
                }
                (name, lsp_types::SymbolKind::ENUM)
            }
            ItemKind::For { counters, items } => {
                children = outline(items, sources, context);
                let Some(first) = counters.first() else { continue };
                (&first.index, lsp_types::SymbolKind::ARRAY)
            }
            ItemKind::Import { .. }
            | ItemKind::Binding { .. }
            | ItemKind::When(_)
            | ItemKind::Every { .. }
            | ItemKind::Start(_)
            | ItemKind::Saturate { .. } => continue,
        };
        let range = places::range_of(item.span, sources, context.columns);
        let selection = places::range_of(name.span, sources, context.columns);
        // The placeholder of an unreadable item may cover only its name.
        let range =
            lsp_types::Range::new(range.start.min(selection.start), range.end.max(selection.end));
        #[allow(deprecated)] // The field has no default.
        entries.push(DocumentSymbol {
            name: name.text.clone(),
            detail: (!item.doc.is_empty()).then(|| item.doc.join(" ")),
            kind,
            tags: None,
            deprecated: None,
            range,
            selection_range: selection,
            children: Some(children),
        });
    }
    entries
}

/// Commands to run with a model, above its first line: the editor runs `dgd COMMAND PATH`.
pub(super) fn lenses(context: &AnswerContext<'_>) -> Vec<CodeLens> {
    let Some(analysis) = context.analysis else { return Vec::new() };
    let Some(header) = &analysis.asts[0].model else { return Vec::new() };
    let range = places::range_of(header.name.span, &analysis.sources, context.columns);
    let lens = |(title, command): &(&str, &str)| CodeLens {
        range,
        command: Some(Command {
            title: (*title).to_owned(),
            command: (*command).to_owned(),
            arguments: Some(vec![context.path.clone().into()]),
        }),
        data: None,
    };
    RUNS.iter().map(lens).collect()
}

/// Lenses, with the commands that editors must implement.
const RUNS: [(&str, &str); 3] = [
    ("Simulate", "dgd.simulate"),
    ("Sensitivity", "dgd.sensitivity"),
    ("Discover", "dgd.discover"),
];

/// The tokens of the document, including unreadable ones.
fn own_tokens(context: &AnswerContext<'_>) -> Vec<Token> {
    let Some(analysis) = context.analysis else { return Vec::new() };
    tokens(SourceId(0), &analysis.sources, &mut Diagnostics::default())
}

/// Folds blocks between braces, and comments of several lines.
pub(super) fn folding(context: &AnswerContext<'_>) -> Vec<FoldingRange> {
    let text = context.text();
    let line = |byte: u32| {
        let byte = byte as usize;
        places::range(text, byte..byte, context.columns).start.line
    };
    let mut ranges = Vec::new();
    let mut fold = |start, end, kind| {
        if start < end {
            let (start_line, end_line) = (start, end);
            ranges.push(FoldingRange { start_line, end_line, kind, ..Default::default() });
        }
    };
    let (mut open, mut remark) = (Vec::new(), None);
    for token in own_tokens(context) {
        match token.kind {
            TokenKind::OpenBrace => open.push(line(token.start)),
            TokenKind::CloseBrace => {
                if let Some(start) = open.pop() {
                    fold(start, line(token.start), None);
                }
            }
            TokenKind::Doc | TokenKind::Comment => {
                let this_line = line(token.start);
                remark = match remark {
                    Some((start, last)) if last + 1 == this_line => Some((start, this_line)),
                    Some((start, last)) => {
                        fold(start, last, Some(FoldingRangeKind::Comment));
                        Some((this_line, this_line))
                    }
                    None => Some((this_line, this_line)),
                };
            }
            _ => {}
        }
    }
    if let Some((start, last)) = remark {
        fold(start, last, Some(FoldingRangeKind::Comment));
    }
    ranges
}

/// The canonical layout; `None` if the text cannot be parsed.
pub(super) fn formatting(context: &AnswerContext<'_>) -> Option<Vec<TextEdit>> {
    let analysis = context.analysis?;
    let mut diagnostics = Diagnostics::default();
    parse(SourceId(0), &analysis.sources, &mut diagnostics).ok()?;
    let new = layout::format(SourceId(0), &analysis.sources, &mut diagnostics).ok()?;
    let text = context.text();
    if new == text {
        return Some(Vec::new());
    }
    Some(vec![TextEdit::new(places::range(text, 0..text.len(), context.columns), new)])
}

/// The type of each word, from the compiler rather than from its spelling.
pub(super) fn semantic_tokens(context: &AnswerContext<'_>) -> SemanticTokens {
    let text = context.text();
    let (names, _) = context.files.names(&context.path);
    let mut data = Vec::new();
    let mut before = (0, 0);
    for token in own_tokens(context) {
        let kind = match token.kind {
            TokenKind::Doc | TokenKind::Comment => 0,
            TokenKind::Text => 1,
            TokenKind::Number => 2,
            TokenKind::Unit => 3,
            TokenKind::Name => {
                let symbol_use = names.find_at(SourceId(0), token.start);
                match symbol_use
                    .filter(|one| one.span.start <= token.start && token.start < one.span.end)
                {
                    None if text[token.end as usize..].starts_with('(') => 5,
                    None => 4,
                    Some(one) => number(names.symbol(one.symbol).kind),
                }
            }
            _ => continue,
        };
        let bytes = token.start as usize..token.end as usize;
        let range = places::range(text, bytes.clone(), context.columns);
        let (line, column) = (range.start.line, range.start.character);
        let delta_start = if line == before.0 { column - before.1 } else { column };
        data.push(SemanticToken {
            delta_line: line - before.0,
            delta_start,
            length: context.columns.count(&text[bytes]) as u32,
            token_type: kind,
            token_modifiers_bitset: 0,
        });
        before = (line, column);
    }
    SemanticTokens { result_id: None, data }
}

/// The number of a symbol's type among [`TOKEN_TYPES`].
fn number(kind: SymbolKind) -> u32 {
    match kind {
        SymbolKind::Function => 5,
        SymbolKind::Argument
        | SymbolKind::Index
        | SymbolKind::Parameter
        | SymbolKind::Constant
        | SymbolKind::Size => 6,
        SymbolKind::Input
        | SymbolKind::State
        | SymbolKind::Unknown
        | SymbolKind::Let
        | SymbolKind::Output => 7,
        SymbolKind::Model | SymbolKind::Effect | SymbolKind::Part => 8,
        SymbolKind::Variant | SymbolKind::Choice | SymbolKind::Modes | SymbolKind::Mode => 9,
        SymbolKind::Equation => 10,
    }
}
