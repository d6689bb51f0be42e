//! Indices and ranges between brackets, and counters such as `i in 1..N`.
//!
//! The lexer makes one token of brackets after a name. Here it is split into its own tokens.

use nom::Parser;
use nom::multi::separated_list1;

use super::expression::{close, expression};
use super::lexical::{TokenKind, tokens_within};
use super::tokens::{OPERATOR, ParseResult, ParseStop, Tokens, dotted, name, token, word};
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{
    ArrayAxis, Expr, ExprKind, LoopCounter, Name, NumberRange, Reduction, ReductionOperation,
};

/// The element of an array, `p[i - 1]` or `T[i][j]`, after its name: the brackets are the next tokens.
pub(crate) fn element<'a>(
    input: Tokens<'a>,
    brackets: Tokens<'a>,
    array: Name,
) -> ParseResult<'a, Expr> {
    let mut element = Expr { span: array.span, kind: ExprKind::Name(array.text) };
    let mut rest = brackets;
    while rest.first() == Some(TokenKind::Index) {
        let index;
        (rest, index) = one_index(rest)?;
        let kind = ExprKind::Element(Box::new(element), Box::new(index));
        element = Expr { span: input.span_to(&rest), kind };
    }
    if let Some((moved, _)) = index_at_the_end(input) {
        let message = "the index of a part stands at the end";
        let diagnostic = Diagnostic::new(Code::UnexpectedToken, input.span_to(&rest), message);
        return input.wrong(diagnostic.help(format!("write `{moved}`")));
    }
    Ok((rest, element))
}

/// `[i - 1]`
fn one_index(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    let (rest, index) = between_brackets(input.deeper()?, |inside| {
        let (rest, index) = expression(inside)?;
        if rest.is_empty() { Ok((rest, index)) } else { rest.expected(OPERATOR) }
    })?;
    Ok((rest.shallower(), index))
}

/// `[1][j]`, or nothing.
pub(crate) fn indices(input: Tokens<'_>) -> ParseResult<'_, Vec<Expr>> {
    all_brackets(input, one_index)
}

/// `[1..N][j in 1..M]`, or nothing.
pub(crate) fn axes(input: Tokens<'_>) -> ParseResult<'_, Vec<ArrayAxis>> {
    all_brackets(input, declared_axis)
}

/// Reads all consecutive brackets.
fn all_brackets<'a, T>(
    input: Tokens<'a>,
    read: impl Fn(Tokens<'a>) -> ParseResult<'a, T>,
) -> ParseResult<'a, Vec<T>> {
    let (mut rest, mut all) = (input, Vec::new());
    while rest.first() == Some(TokenKind::Index) {
        let one;
        (rest, one) = read(rest)?;
        all.push(one);
    }
    Ok((rest, all))
}

/// `sum(… for i in 1..N)` after its keyword and its body: `for` is the next token.
pub(crate) fn reduction<'a>(
    word: &Name,
    open: Tokens<'a>,
    body: Expr,
    input: Tokens<'a>,
) -> ParseResult<'a, ExprKind> {
    let Some((_, kind)) = ReductionOperation::ALL.iter().find(|(known, _)| *known == word.text)
    else {
        let known: Vec<&str> = ReductionOperation::ALL.iter().map(|(known, _)| *known).collect();
        let message = format!("`{}` does not go over indices", word.text);
        return input.wrong(
            Diagnostic::new(Code::UnexpectedToken, input.span(), message)
                .help(format!("`for` stands in one of: {}", known.join(", "))),
        );
    };
    let (rest, counters) = counters(input.behind_first())?;
    let (rest, _) = close(open.span(), rest)?;
    let reduction = Reduction { kind: *kind, word: word.span, body, counters };
    Ok((rest, ExprKind::Reduce(Box::new(reduction))))
}

/// A range of a declared array, `[1..N]` or `[i in 1..N]`; its place is that of the brackets.
pub(crate) fn declared_axis(input: Tokens<'_>) -> ParseResult<'_, ArrayAxis> {
    let brackets = input.span();
    between_brackets(input, |inside| {
        let (rest, index) = if inside.second() == Some(TokenKind::Name) {
            let (rest, (index, _)) = (name, word("in", "`in` and a range")).parse(inside)?;
            (rest, Some(index))
        } else {
            (inside, None)
        };
        if !rest.left_has(TokenKind::Range) {
            let message = "an array has a range between its brackets";
            return rest.wrong(
                Diagnostic::new(Code::UnexpectedToken, brackets, message)
                    .help(format!("write `[1..{}]`", rest.written())),
            );
        }
        let (rest, range) = range(rest)?;
        let range = NumberRange { span: brackets, ..range };
        if rest.first() == Some(TokenKind::Comma) {
            let message = "each index has brackets of its own";
            let help = format!(
                "write `[{}][{}]`",
                inside.written_to(&rest),
                rest.behind_first().written()
            );
            return rest
                .wrong(Diagnostic::new(Code::UnexpectedToken, rest.span(), message).help(help));
        }
        if rest.is_empty() {
            Ok((rest, ArrayAxis { index, range }))
        } else {
            rest.expected(OPERATOR)
        }
    })
}

/// `a..b`
fn range(input: Tokens<'_>) -> ParseResult<'_, NumberRange> {
    let dots = token(TokenKind::Range, "`..` and the last index");
    let (rest, (lower, _, upper)) = (expression, dots, expression).parse(input)?;
    Ok((rest, NumberRange { span: input.span_to(&rest), lower, upper }))
}

/// Reads the content of the brackets of the first token.
fn between_brackets<'a, T>(
    input: Tokens<'a>,
    read: impl for<'b> FnOnce(Tokens<'b>) -> ParseResult<'b, T>,
) -> ParseResult<'a, T> {
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

/// The diagnostic for a parser's failure.
fn explained(stop: nom::Err<Box<ParseStop<'_>>>) -> Diagnostic {
    match stop {
        nom::Err::Error(stop) | nom::Err::Failure(stop) => stop.into_diagnostic(),
        nom::Err::Incomplete(_) => unreachable!("an item's tokens are all there"),
    }
}

/// `PART.NAME[i]` for a written `PART[i].NAME`, and the written text.
pub(crate) fn index_at_the_end(input: Tokens<'_>) -> Option<(String, String)> {
    let (rest, part) = name(input).ok()?;
    let (behind, indices) = indices(rest).ok()?;
    if indices.is_empty() || behind.first() != Some(TokenKind::Dot) {
        return None;
    }
    let brackets = rest.written_to(&behind);
    let (rest, inner) = dotted(behind.behind_first()).ok()?;
    let more = rest.written();
    let more = if more.is_empty() { String::new() } else { format!(" {more}") };
    Some((format!("{}.{}{brackets}", part.text, inner.text), more))
}

/// `i in 1..N, j in 1..M`
pub(crate) fn counters(input: Tokens<'_>) -> ParseResult<'_, Vec<LoopCounter>> {
    let comma = token(TokenKind::Comma, "`,` and another index");
    separated_list1(comma, counter).parse(input)
}

/// `i in 1..N`
fn counter(input: Tokens<'_>) -> ParseResult<'_, LoopCounter> {
    let (rest, (index, _, range)) =
        (name, word("in", "`in` and a range such as `1..N`"), range).parse(input)?;
    Ok((rest, LoopCounter { index, range }))
}
