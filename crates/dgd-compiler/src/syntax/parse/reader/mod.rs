//! Reads the items of a file and of its blocks, each separately.

mod blocks;
mod function;
mod loops;
mod plain;
mod transitions;
mod unsound;

use super::lexical::{Token, TokenKind};
use super::notation::TokenDeclarations;
use super::tokens::{NESTING, ParseStop, Tokens, dotted, token, too_deep};
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::source::{SourceId, Span};
use crate::syntax::ast::{EffectHeader, Item, ModelHeader, Name};

/// An item that could not be read, as far as it affects others.
#[derive(Debug, Clone, PartialEq)]
pub struct UnreadableItem {
    /// Its place.
    pub span: Span,
    /// Names that it may have declared.
    pub names: Vec<String>,
    /// Whether it may have declared names that do not occur in it: an import.
    pub hides_all: bool,
}

impl UnreadableItem {
    /// An import that failed.
    pub(crate) fn import(span: Span) -> UnreadableItem {
        UnreadableItem { span, names: Vec::new(), hides_all: true }
    }
}

/// An unreadable item, and a possible replacement.
pub(super) type UnsoundItem = (UnreadableItem, Option<Item>);

/// Reads the items of a file and of its blocks.
pub(super) struct ItemReader<'a, 'd> {
    source: SourceId,
    text: &'a str,
    pub(in crate::syntax::parse) model: Option<ModelHeader>,
    pub(in crate::syntax::parse) effect: Option<EffectHeader>,
    /// Whether an item has been read.
    begun: bool,
    /// Items that could not be read.
    pub(in crate::syntax::parse) holes: Vec<UnsoundItem>,
    pub(in crate::syntax::parse) declared: TokenDeclarations<'a>,
    /// Positions of unclosed braces, in order.
    pub(in crate::syntax::parse) unclosed: Vec<u32>,
    diagnostics: &'d mut Diagnostics,
}

impl<'a, 'd> ItemReader<'a, 'd> {
    pub(in crate::syntax::parse) fn new(
        source: SourceId,
        text: &'a str,
        diagnostics: &'d mut Diagnostics,
    ) -> Self {
        let (model, effect, holes) = (None, None, Vec::new());
        let (declared, unclosed) = (TokenDeclarations::default(), Vec::new());
        ItemReader {
            source,
            text,
            model,
            effect,
            begun: false,
            holes,
            declared,
            unclosed,
            diagnostics,
        }
    }

    /// Splits `KEYWORD NAME { … } …` into the name, the content of the braces and the rest.
    pub(super) fn named_block(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
        nesting: u32,
    ) -> Option<(Name, &'a [Token], &'a [Token])> {
        let input = self.input(statement);
        if nesting >= NESTING {
            self.error(too_deep(input.span()));
            return None;
        }
        let (rest, name) = self.report(dotted(input.behind_first()))?;
        let (mut inside, behind) = self.block(&statement[statement.len() - rest.len()..])?;
        take_docs(&mut inside, docs);
        Some((name, inside, behind))
    }

    /// Takes the doc comment after a block; `above` are the doc comments at the end of the block that no item follows.
    pub(super) fn end_of_block(
        &mut self,
        above: &[Token],
        behind: &[Token],
        docs: &mut Vec<Token>,
    ) -> Option<()> {
        if let Some(doc) = above.first() {
            let message = "this doc comment belongs to nothing";
            self.error(Diagnostic::new(Code::DetachedDoc, self.span(*doc), message));
        }
        docs.extend(behind.iter().filter(|token| token.kind == TokenKind::Doc));
        if let Some(extra) = behind.iter().find(|token| token.kind != TokenKind::Doc) {
            let message = "expected the end of the line behind a block";
            self.error(Diagnostic::new(Code::UnexpectedToken, self.span(*extra), message));
            return None;
        }
        Some(())
    }

    /// Splits `{ … } …` into the content of the braces and the rest.
    pub(super) fn block(&mut self, tokens: &'a [Token]) -> Option<(&'a [Token], &'a [Token])> {
        let input = self.input(tokens);
        let brace = token(TokenKind::OpenBrace, "`{`");
        self.report(brace(input))?;
        let inside = &tokens[1..];
        let mut open = 1_usize;
        for (i, token) in inside.iter().enumerate() {
            match token.kind {
                TokenKind::OpenBrace => open += 1,
                TokenKind::CloseBrace => open -= 1,
                _ => {}
            }
            if open == 0 {
                return Some((&inside[..i], &inside[i + 1..]));
            }
        }
        let message = "this `{` is not closed";
        self.error(Diagnostic::new(Code::UnmatchedBracket, self.span(tokens[0]), message));
        None
    }

    /// The lines of doc comments, without `///` and one blank after it.
    pub(super) fn doc_lines(&self, docs: &[Token]) -> Vec<String> {
        let line = |token: &Token| {
            let text = &token.text(self.text)[3..];
            text.strip_prefix(' ').unwrap_or(text).trim_end().to_owned()
        };
        docs.iter().map(line).collect()
    }

    pub(super) fn input(&self, tokens: &'a [Token]) -> Tokens<'a> {
        Tokens::new(tokens, self.text, self.source)
    }

    pub(super) fn span(&self, token: Token) -> Span {
        token.span(self.source)
    }

    pub(super) fn error(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.error(diagnostic);
    }

    /// Reports a parser's failure.
    pub(super) fn report<T>(
        &mut self,
        result: Result<T, nom::Err<Box<ParseStop<'_>>>>,
    ) -> Option<T> {
        match result {
            Ok(out) => Some(out),
            Err(nom::Err::Error(stop) | nom::Err::Failure(stop)) => {
                self.error(stop.into_diagnostic());
                None
            }
            Err(nom::Err::Incomplete(_)) => unreachable!("an item's tokens are all there"),
        }
    }
}

/// The tokens before the block of a line, without doc comments, and the block; `None` if there is an invalid token.
pub(super) fn head_and_block<'a>(
    line: &'a [Token],
    docs: &mut Vec<Token>,
) -> Option<(Vec<Token>, &'a [Token])> {
    let brace = line.iter().position(|token| token.kind == TokenKind::OpenBrace);
    let (head, block) = line.split_at(brace.unwrap_or(line.len()));
    let (doc, plain): (Vec<Token>, Vec<Token>) =
        head.iter().partition(|token| token.kind == TokenKind::Doc);
    docs.extend(doc);
    let is_sound = plain.iter().all(|token| token.kind != TokenKind::Invalid);
    is_sound.then_some((plain, block))
}

/// Moves doc comments up to the end of the line.
pub(super) fn take_docs(tokens: &mut &[Token], docs: &mut Vec<Token>) {
    while let Some((first, rest)) = tokens.split_first()
        && first.kind == TokenKind::Doc
    {
        docs.push(*first);
        *tokens = rest;
    }
}

/// Number of tokens of an item, including its block but not its line end; `None` if its block is unclosed.
pub(super) fn closed_length(tokens: &[Token], unclosed: &[u32]) -> Option<usize> {
    let mut open = 0_usize;
    for (i, token) in tokens.iter().enumerate() {
        match token.kind {
            TokenKind::OpenBrace if unclosed.binary_search(&token.start).is_ok() => return None,
            TokenKind::OpenBrace => open += 1,
            TokenKind::CloseBrace | TokenKind::Newline if open == 0 => return Some(i),
            TokenKind::CloseBrace => open -= 1,
            _ => {}
        }
    }
    Some(tokens.len())
}

/// Number of tokens of an item in a block, where all braces are closed.
pub(super) fn item_length(tokens: &[Token]) -> usize {
    closed_length(tokens, &[]).unwrap_or(tokens.len())
}
