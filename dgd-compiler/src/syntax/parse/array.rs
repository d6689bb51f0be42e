//! Arrays: ranges and indices between brackets, and `for NAME in a..b { … }`.
//!
//! The lexer makes one token of what stands between brackets after a name. It is cut into tokens
//! of its own here.

use nom::Parser;

use super::expression::expression;
use super::lexical::{Token, TokenKind, tokens_within};
use super::tokens::{OPERATOR, Parsed, Stop, Tokens, name, token, too_deep, word};
use super::{Reader, item_length, take_docs};
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{Expr, ExprKind, Item, ItemKind, Name, Range};

/// Keywords of items that a loop can hold.
const IN_LOOPS: [&str; 2] = ["equation", "let"];

/// The element of an array, `p[i - 1]`: its name has been read, the brackets are the next token.
pub(crate) fn element<'a>(
    input: Tokens<'a>,
    brackets: Tokens<'a>,
    array: Name,
) -> Parsed<'a, Expr> {
    let (rest, index) = between_brackets(brackets.deeper()?, |inside| {
        let (rest, index) = expression(inside)?;
        if rest.is_empty() { Ok((rest, index)) } else { rest.expected(OPERATOR) }
    })?;
    let rest = rest.shallower();
    let span = input.span_to(&rest);
    let array = Box::new(Expr { span: array.span, kind: ExprKind::Name(array.text) });
    Ok((rest, Expr { span, kind: ExprKind::Element(array, Box::new(index)) }))
}

/// The range of a declared array, `[1..N]` or `[i in 1..N]`; its place is that of the brackets.
pub(crate) fn declared_range(input: Tokens<'_>) -> Parsed<'_, (Option<Name>, Range)> {
    let brackets = input.span();
    between_brackets(input, |inside| {
        let (rest, index) = if inside.second() == Some(TokenKind::Name) {
            let (rest, (index, _)) = (name, word("in", "`in` and a range")).parse(inside)?;
            (rest, Some(index))
        } else {
            (inside, None)
        };
        let (rest, range) = range(rest)?;
        let range = Range { span: brackets, ..range };
        if rest.is_empty() { Ok((rest, (index, range))) } else { rest.expected(OPERATOR) }
    })
}

/// `a..b`
fn range(input: Tokens<'_>) -> Parsed<'_, Range> {
    let dots = token(TokenKind::Range, "`..` and the last index");
    let (rest, (lower, _, upper)) = (expression, dots, expression).parse(input)?;
    Ok((rest, Range { span: input.span_to(&rest), lower, upper }))
}

/// Reads what stands between the brackets of the first token.
fn between_brackets<'a, T>(
    input: Tokens<'a>,
    read: impl for<'b> FnOnce(Tokens<'b>) -> Parsed<'b, T>,
) -> Parsed<'a, T> {
    let (within, mistakes) = tokens_within(input.span(), input.first_text());
    if let Some(mistake) = mistakes.into_iter().next() {
        return input.wrong(mistake);
    }
    let result = read(input.within(&within)).map(|(_, out)| out).map_err(explained);
    match result {
        Ok(out) => Ok((input.behind_first(), out)),
        Err(diagnostic) => input.wrong(diagnostic),
    }
}

/// What to tell the user where a parser stopped.
fn explained(stop: nom::Err<Box<Stop<'_>>>) -> Diagnostic {
    match stop {
        nom::Err::Error(stop) | nom::Err::Failure(stop) => stop.into_diagnostic(),
        nom::Err::Incomplete(_) => unreachable!("an item's tokens are all there"),
    }
}

impl<'a> Reader<'a, '_> {
    /// `for i in 1..N { equation mass[i]: … }`
    pub(super) fn loop_(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
        nesting: u32,
    ) -> Option<ItemKind> {
        let input = self.input(statement);
        if nesting >= super::NESTING {
            self.error(too_deep(input.span()));
            return None;
        }
        let (rest, (index, range)) = self.report(head(input.behind_first()))?;
        let (mut inside, behind) = self.block(&statement[statement.len() - rest.len()..])?;
        take_docs(&mut inside, docs);
        let mut items = Vec::new();
        let mut above = Vec::new();
        while let Some((first, rest)) = inside.split_first() {
            match first.kind {
                TokenKind::Newline => inside = rest,
                TokenKind::Doc => {
                    above.push(*first);
                    inside = rest;
                }
                _ => {
                    let (line, rest) = inside.split_at(item_length(inside));
                    let item = self.item_of_loop(line, std::mem::take(&mut above), &index);
                    if item.is_none() {
                        self.hole(line, nesting + 1);
                    }
                    items.extend(item);
                    inside = rest;
                }
            }
        }
        self.end_of_block(&above, behind, docs)?;
        Some(ItemKind::For { index, range, items })
    }

    /// `equation NAME[i]: …` or `let NAME[i] = …`: the item without its index, which is the loop's.
    fn item_of_loop(&mut self, line: &'a [Token], docs: Vec<Token>, index: &Name) -> Option<Item> {
        let first = line.first()?;
        let last = line.iter().rfind(|token| token.kind != TokenKind::Doc)?;
        let span = self.span(*first).to(self.span(*last));
        let keyword = first.text(self.text);
        let refused = if IN_LOOPS.contains(&keyword) {
            let bracket = line.get(2).filter(|token| token.kind == TokenKind::Index);
            let own = bracket.map(|token| token.text(self.text));
            let own = own.and_then(|text| text.strip_prefix('[')?.strip_suffix(']'));
            (own.map(str::trim) != Some(index.text.as_str())).then(|| {
                let at = line.get(2).or(line.get(1)).unwrap_or(first);
                let message =
                    format!("what stands in a loop over `{0}` ends in `[{0}]`", index.text);
                Diagnostic::new(Code::E131, self.span(*at), message)
                    .label(index.span, "the loop's index")
                    .help(format!("write `{keyword} NAME[{}]`", index.text))
            })
        } else {
            let message = format!("`{keyword}` cannot stand in a loop");
            Some(
                Diagnostic::new(Code::E131, self.span(*first), message)
                    .label(index.span, "the loop's index")
                    .help("a loop holds equations and `let`s; arrays are declared in front of it"),
            )
        };
        if let Some(diagnostic) = refused {
            self.error(diagnostic);
            return None;
        }
        let without_index: Vec<Token> =
            line.iter().enumerate().filter(|(i, _)| *i != 2).map(|(_, token)| *token).collect();
        let mut docs = docs;
        docs.extend(line.iter().filter(|token| token.kind == TokenKind::Doc));
        let kind = self.plain_item(&without_index, &docs, false, 1)?;
        Some(Item { span, doc: self.doc_lines(&docs), kind })
    }
}

/// `i in 1..N`
fn head(input: Tokens<'_>) -> Parsed<'_, (Name, Range)> {
    let (rest, (index, _, range)) =
        (name, word("in", "`in` and a range such as `1..N`"), range).parse(input)?;
    Ok((rest, (index, range)))
}
