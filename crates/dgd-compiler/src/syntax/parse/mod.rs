//! Parsing: the text is split into tokens, the tokens into items, and every item is parsed separately.
//!
//! An error in one item therefore does not affect the next, and all errors of a file are reported at once.

mod expression;
mod index;
mod item;
pub(super) mod item_ends;
pub(super) mod lexical;
mod notation;
mod reader;
pub(super) mod tokens;

use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::source::{SourceId, SourceMap, Span};
use crate::syntax::ast::{Ast, Expr, ModelHeader, Name};
use item_ends::item_ends;
use lexical::{Token, TokenKind};
use notation::TokenDeclarations;
use reader::{ItemReader, UnsoundItem};

pub(super) use item::is_keyword;
pub use reader::UnreadableItem;

/// Reads a source.
///
/// The tree represents the text exactly; names and units are not resolved.
pub fn parse(
    source: SourceId,
    sources: &SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<Ast, ErrorReported> {
    // Errors of earlier sources do not concern this one.
    let (ast, _, own) = read(source, sources);
    for diagnostic in own.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    own.check()?;
    Ok(ast)
}

/// Reads the valid items of a source and skips the rest, for tools that continue after an error.
pub fn parse_what_is_sound(source: SourceId, sources: &SourceMap) -> Ast {
    read(source, sources).0
}

/// Reads a source with errors so that further errors in its valid items can be found: declarations replace the items
/// that could not be read, if their heads show what they declare.
pub fn parse_with_holes(
    source: SourceId,
    sources: &SourceMap,
    diagnostics: &mut Diagnostics,
) -> (Ast, Vec<UnreadableItem>) {
    let (mut ast, holes, own) = read(source, sources);
    for diagnostic in own.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    let stand_ins = holes.iter().filter_map(|(_, stand_in)| stand_in.clone());
    ast.items.extend(stand_ins);
    let letters = |span: Span| sources.text(span).chars().filter(|c| c.is_alphanumeric());
    let is_header =
        |hole: &UnreadableItem| letters(hole.span).collect::<String>().contains("model");
    if let Some((hole, _)) = holes.iter().find(|(hole, _)| ast.model.is_none() && is_header(hole)) {
        let text = hole.names.last().cloned().unwrap_or_default();
        ast.model = Some(ModelHeader { doc: Vec::new(), name: Name { text, span: hole.span } });
    }
    (ast, holes.into_iter().map(|(hole, _)| hole).collect())
}

/// The valid items, the invalid ones, and the errors.
fn read(source: SourceId, sources: &SourceMap) -> (Ast, Vec<UnsoundItem>, Diagnostics) {
    let mut problems = Diagnostics::default();
    let text = sources.get(source).text.as_str();
    let raw_tokens = lexical::tokens(source, sources, &mut problems);
    let ends = item_ends(&raw_tokens, text);
    let tokens: Vec<Token> = raw_tokens
        .into_iter()
        .zip(ends)
        .filter(|(token, ends_item)| match token.kind {
            TokenKind::Newline => *ends_item,
            kind => kind != TokenKind::Comment,
        })
        .map(|(token, _)| token)
        .collect();

    let mut reader = ItemReader::new(source, text, &mut problems);
    reader.declared = TokenDeclarations::collect(&tokens, text);
    reader.unclosed = unclosed(&tokens);
    let items = reader.items(&tokens, 0);
    let (model, effect, holes) = (reader.model, reader.effect, reader.holes);
    if items.is_empty() && model.is_none() && effect.is_none() && problems.check().is_ok() {
        let span = Span { source, start: 0, end: 0 };
        problems.error(Diagnostic::new(Code::EmptyFile, span, "there is nothing in this file"));
    }
    (Ast { source, model, effect, items, imports: Vec::new() }, holes, problems)
}

/// Reads `name = value`, a setting from outside a model file.
pub fn parse_setting(
    source: SourceId,
    sources: &SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<(Name, Expr), ErrorReported> {
    let mut problems = Diagnostics::default();
    let text = sources.get(source).text.as_str();
    let mut tokens = lexical::tokens(source, sources, &mut problems);
    tokens.retain(|token| token.kind != TokenKind::Newline);
    let mut reader = ItemReader::new(source, text, &mut problems);
    let setting = reader.setting(&tokens);
    for diagnostic in problems.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    problems.check()?;
    Ok(setting.unwrap_or_else(|| unreachable!("without a setting there is a diagnostic")))
}

/// Positions of unclosed braces, in order.
fn unclosed(tokens: &[Token]) -> Vec<u32> {
    let mut open = Vec::new();
    for token in tokens {
        match token.kind {
            TokenKind::OpenBrace => open.push(token.start),
            TokenKind::CloseBrace => drop(open.pop()),
            _ => {}
        }
    }
    open
}
