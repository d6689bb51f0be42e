//! Values of items, after `=`.

use nom::Parser;
use nom::combinator::{cut, opt};
use nom::sequence::preceded;

use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{Expr, ExprKind};
use crate::syntax::parse::expression::{close, expression};
use crate::syntax::parse::lexical::TokenKind;
use crate::syntax::parse::tokens::{OPERATOR, ParseResult, Tokens, token};

/// `= …`, which is required.
pub(super) fn value(what: &'static str) -> impl Fn(Tokens<'_>) -> ParseResult<'_, Expr> {
    move |input| match input.first() {
        Some(TokenKind::Equal) => one_value(input.behind_first()),
        None => input.wrong(
            Diagnostic::new(Code::MissingValue, input.span(), format!("{what} needs a value"))
                .help("write `= …` behind it"),
        ),
        Some(_) => input.expected("`=`"),
    }
}

pub(super) fn optional_value(input: Tokens<'_>) -> ParseResult<'_, Option<Expr>> {
    opt(preceded(token(TokenKind::Equal, "`=`"), cut(one_value))).parse(input)
}

/// The value of a single item, not an array.
fn one_value(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    if input.first() != Some(TokenKind::Open) || !input.is_list() {
        return expression(input);
    }
    let (_, list) = array_value(input)?;
    let count = if let ExprKind::List(values) = &list.kind { values.len() } else { 1 };
    input.wrong(
        Diagnostic::new(Code::UnexpectedToken, list.span, format!("{count} values for one name"))
            .help(format!("an array has a range behind its name: `[1..{count}]`")),
    )
}

/// The value of an array: an expression, or a parenthesised list with one for each element.
pub(super) fn array_value(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    if input.first() != Some(TokenKind::Open) || !input.is_list() {
        return expression(input);
    }
    let mut rest = input.deeper()?.behind_first();
    let mut values = Vec::new();
    loop {
        let one;
        (rest, one) = array_value(rest)?;
        values.push(one);
        if rest.first() != Some(TokenKind::Comma) {
            break;
        }
        rest = rest.behind_first();
    }
    let (rest, _) = close(input.span(), rest.shallower())?;
    Ok((rest, Expr { span: input.span_to(&rest), kind: ExprKind::List(values) }))
}

/// Refuses a value for an input, whose values come from the data.
pub(super) fn no_value_of_input(rest: Tokens<'_>) -> ParseResult<'_, ()> {
    if rest.first() == Some(TokenKind::Equal) {
        let message = "an input has no value in the model";
        return rest.wrong(
            Diagnostic::new(Code::UnexpectedToken, rest.span(), message)
                .help("its values come from the data; a `constant` or `parameter` has one"),
        );
    }
    Ok((rest, ()))
}

/// An expression up to the end of the line.
pub(crate) fn last_value(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    let (rest, value) = expression(input)?;
    if rest.is_empty() { Ok((rest, value)) } else { rest.expected(OPERATOR) }
}
