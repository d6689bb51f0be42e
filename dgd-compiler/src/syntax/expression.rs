//! Expressions.
//!
//! ```text
//! expression  = conjunction ("or" conjunction)*
//! conjunction = negation ("and" negation)*
//! negation    = "not" negation | comparison
//! comparison  = sum (("<" | "<=" | ">" | ">=") sum)?
//! sum         = product (("+" | "-") product)*
//! product     = sign (("*" | "/") sign)*
//! sign        = "-" sign | power
//! power       = operand ("^" sign)?
//! operand     = number unit? | name | name "(" list ")" | "(" expression ")"
//!             | "if" expression "then" expression "else" expression
//! ```
//!
//! Each rule is one plain function and looks one token ahead: nesting costs little stack, and
//! nothing is read twice.

use nom::Err;

use super::ast::{Comparison, Expr, ExprKind, Factor, Sign, Unit};
use super::lexical::{RESERVED, TokenKind};
use super::tokens::{Parsed, Tokens, name, nested, not_yet, word};
use crate::diagnostics::{Code, Diagnostic};
use crate::source::Span;

/// What an operand looks like to a user.
const OPERAND: &str = "an expression";

/// An expression, as far as it reaches.
pub(crate) fn expression(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, first) = conjunction(input)?;
    if !rest.starts_with_word("or") {
        return Ok((rest, first));
    }
    let next = |input: Tokens<'_>| input.starts_with_word("or").then_some(());
    let (rest, more) = chain(rest, next, conjunction)?;
    let all = std::iter::once(first).chain(more.into_iter().map(|((), operand)| operand));
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind: ExprKind::Or(all.collect()),
        },
    ))
}

fn conjunction(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, first) = negation(input)?;
    if !rest.starts_with_word("and") {
        return Ok((rest, first));
    }
    let next = |input: Tokens<'_>| input.starts_with_word("and").then_some(());
    let (rest, more) = chain(rest, next, negation)?;
    let all = std::iter::once(first).chain(more.into_iter().map(|((), operand)| operand));
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind: ExprKind::And(all.collect()),
        },
    ))
}

/// Operators with their right operands, as long as there is one more.
fn chain<'a, T>(
    mut input: Tokens<'a>,
    operator: fn(Tokens<'a>) -> Option<T>,
    operand: fn(Tokens<'a>) -> Parsed<'a, Expr>,
) -> Parsed<'a, Vec<(T, Expr)>> {
    let mut all = Vec::new();
    while let Some(sign) = operator(input) {
        let (rest, right) = committed(operand(input.behind_first()))?;
        all.push((sign, right));
        input = rest;
    }
    Ok((input, all))
}

/// Behind an operator there is no other reading: what fails is an error.
fn committed<T>(result: Parsed<'_, T>) -> Parsed<'_, T> {
    result.map_err(|error| match error {
        Err::Error(stop) => Err::Failure(stop),
        Err::Failure(_) | Err::Incomplete(_) => error,
    })
}

fn negation(input: Tokens<'_>) -> Parsed<'_, Expr> {
    if !input.starts_with_word("not") {
        return comparison(input);
    }
    let (rest, operand) = committed(nested(input.behind_first(), negation))?;
    let kind = ExprKind::Not(Box::new(operand));
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind,
        },
    ))
}

fn comparison(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, left) = sum(input)?;
    let Some(sign) = comparison_sign(rest) else {
        return Ok((rest, left));
    };
    let (rest, right) = committed(sum(rest.behind_first()))?;
    if comparison_sign(rest).is_some() {
        let message = "comparisons do not chain";
        return rest.wrong(
            Diagnostic::new(Code::E109, rest.span(), message)
                .label(input.span_to(&rest), "this is a comparison already")
                .help("join two comparisons: `a < b and b < c`"),
        );
    }
    let kind = ExprKind::Compare(sign, Box::new(left), Box::new(right));
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind,
        },
    ))
}

fn comparison_sign(input: Tokens<'_>) -> Option<Comparison> {
    match input.first()? {
        TokenKind::Less => Some(Comparison::Less),
        TokenKind::LessEqual => Some(Comparison::LessEqual),
        TokenKind::Greater => Some(Comparison::Greater),
        TokenKind::GreaterEqual => Some(Comparison::GreaterEqual),
        _ => None,
    }
}

fn sum(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, first) = product(input)?;
    let sign = |input: Tokens<'_>| match input.first()? {
        TokenKind::Plus => Some(Sign::Plus),
        TokenKind::Minus => Some(Sign::Minus),
        _ => None,
    };
    if sign(rest).is_none() {
        return Ok((rest, first));
    }
    let (rest, more) = chain(rest, sign, product)?;
    let all = std::iter::once((Sign::Plus, first)).chain(more).collect();
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind: ExprKind::Sum(all),
        },
    ))
}

fn product(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, first) = sign(input)?;
    let factor = |input: Tokens<'_>| match input.first()? {
        TokenKind::Star => Some(Factor::Times),
        TokenKind::Slash => Some(Factor::Over),
        _ => None,
    };
    if factor(rest).is_none() {
        return Ok((rest, first));
    }
    let (rest, more) = chain(rest, factor, sign)?;
    let all = std::iter::once((Factor::Times, first))
        .chain(more)
        .collect();
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind: ExprKind::Product(all),
        },
    ))
}

fn sign(input: Tokens<'_>) -> Parsed<'_, Expr> {
    if input.first() != Some(TokenKind::Minus) {
        return power(input);
    }
    let (rest, operand) = committed(nested(input.behind_first(), sign))?;
    let kind = ExprKind::Negate(Box::new(operand));
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind,
        },
    ))
}

fn power(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, base) = operand(input)?;
    if rest.first() != Some(TokenKind::Caret) {
        return Ok((rest, base));
    }
    let (rest, exponent) = committed(nested(rest.behind_first(), sign))?;
    let kind = ExprKind::Power(Box::new(base), Box::new(exponent));
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind,
        },
    ))
}

fn operand(input: Tokens<'_>) -> Parsed<'_, Expr> {
    match input.first() {
        Some(TokenKind::Number) => number(input),
        Some(TokenKind::Open) => group(input),
        Some(TokenKind::Name) => match input.first_text() {
            "if" => nested(input, conditional),
            "not" => input.wrong(
                Diagnostic::new(
                    Code::E105,
                    input.span(),
                    "`not` cannot stand inside a formula",
                )
                .help("put the condition into parentheses: `(not a < b)`"),
            ),
            word if RESERVED.contains(&word) => input.expected(OPERAND),
            _ if input.second() == Some(TokenKind::Open) => call(input),
            text => {
                let rest = input.behind_first();
                let kind = ExprKind::Name(text.to_owned());
                Ok((
                    rest,
                    Expr {
                        span: input.span(),
                        kind,
                    },
                ))
            }
        },
        Some(_) | None => input.expected(OPERAND),
    }
}

fn number(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let text = input.first_text();
    // The lexer has seen to it that this is a number within range.
    let Ok(value) = text.parse() else {
        return input.expected(OPERAND);
    };
    let rest = input.behind_first();
    let (rest, unit) = optional_unit(rest)?;
    let kind = ExprKind::Number {
        value,
        text: text.to_owned(),
        unit,
    };
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind,
        },
    ))
}

/// `[…]`, if there is one.
pub(crate) fn optional_unit(input: Tokens<'_>) -> Parsed<'_, Option<Unit>> {
    if input.first() != Some(TokenKind::Unit) {
        return Ok((input, None));
    }
    let (text, span) = (input.first_text(), input.span());
    let text = text[1..text.len() - 1].trim();
    if text.starts_with("unit(") {
        return input.wrong(not_yet(span, "units taken from a name are"));
    }
    Ok((
        input.behind_first(),
        Some(Unit {
            span,
            text: text.to_owned(),
        }),
    ))
}

fn group(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, inner) = committed(nested(input.behind_first(), expression))?;
    let rest = close(input.span(), rest)?.0;
    let kind = ExprKind::Group(Box::new(inner));
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind,
        },
    ))
}

/// The `)` of the `(` at `open`.
pub(crate) fn close(open: Span, input: Tokens<'_>) -> Parsed<'_, Span> {
    match input.first() {
        Some(TokenKind::Close) => Ok((input.behind_first(), input.span())),
        None => input.wrong(
            Diagnostic::new(Code::E115, open, "this `(` is not closed")
                .label(input.span(), "expected `)`"),
        ),
        Some(_) => committed(input.expected("`)` or an operator")),
    }
}

fn call(input: Tokens<'_>) -> Parsed<'_, Expr> {
    if input.starts_with_word("delay") {
        return input.wrong(not_yet(input.span(), "delays are"));
    }
    let (open, function) = name(input)?;
    let (rest, arguments) = nested(open.behind_first(), arguments)?;
    let rest = close(open.span(), rest)?.0;
    let kind = ExprKind::Call {
        function,
        arguments,
    };
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind,
        },
    ))
}

fn arguments(input: Tokens<'_>) -> Parsed<'_, Vec<Expr>> {
    if input.first() == Some(TokenKind::Close) {
        return Ok((input, Vec::new()));
    }
    let (mut input, first) = committed(expression(input))?;
    let mut all = vec![first];
    while input.first() == Some(TokenKind::Comma) {
        let (rest, next) = committed(expression(input.behind_first()))?;
        all.push(next);
        input = rest;
    }
    Ok((input, all))
}

fn conditional(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, condition) = committed(expression(input.behind_first()))?;
    if rest.first() == Some(TokenKind::Equal) {
        return rest.wrong(
            Diagnostic::new(
                Code::E109,
                rest.span(),
                "numbers are not compared for equality",
            )
            .help("use `<`, `<=`, `>` or `>=`"),
        );
    }
    let rest = committed(word("then", "`then` or an operator")(rest))?.0;
    let (rest, yes) = committed(expression(rest))?;
    let rest = committed(word("else", "`else` or an operator")(rest))?.0;
    let (rest, no) = committed(expression(rest))?;
    let kind = ExprKind::If(Box::new(condition), Box::new(yes), Box::new(no));
    Ok((
        rest,
        Expr {
            span: input.span_to(&rest),
            kind,
        },
    ))
}
