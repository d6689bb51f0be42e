//! Declarations of arrays, from their ranges on.

use nom::Parser;
use nom::combinator::cut;

use super::attribute::attributes;
use super::values::{array_value, no_value_of_input};
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{ArrayKind, ItemKind, Name, WrittenUnit};
use crate::syntax::parse::expression::optional_unit;
use crate::syntax::parse::index::declared_axis;
use crate::syntax::parse::lexical::TokenKind;
use crate::syntax::parse::tokens::{ParseResult, Tokens};

/// The rest of an array's declaration, from its brackets on.
pub(super) fn declared<'a>(
    declared: ArrayKind,
    name: Name,
    allowed: &[&str],
    what: &'static str,
    input: Tokens<'a>,
) -> ParseResult<'a, ItemKind> {
    let (mut rest, first) = declared_axis(input)?;
    let mut axes = vec![first];
    while rest.first() == Some(TokenKind::Index) && rest.first_text().contains("..") {
        let axis;
        (rest, axis) = declared_axis(rest)?;
        axes.push(axis);
    }
    let (rest, unit) = if rest.first() == Some(TokenKind::Index) {
        // A unit directly after a range.
        let text = rest.first_text();
        let unit = WrittenUnit::new(rest.span(), text[1..text.len() - 1].trim());
        (rest.behind_first(), Some(unit))
    } else {
        optional_unit(rest)?
    };
    let needs_value = matches!(declared, ArrayKind::Constant | ArrayKind::Parameter);
    let (rest, start) = match rest.first() {
        Some(TokenKind::Equal) if declared == ArrayKind::Input => {
            no_value_of_input(rest)?;
            (rest, None)
        }
        Some(TokenKind::Equal) => {
            let (rest, start) = cut(array_value).parse(rest.behind_first())?;
            (rest, Some(start))
        }
        _ if needs_value => {
            return rest.wrong(
                Diagnostic::new(Code::MissingValue, rest.span(), format!("{what} needs a value")).help(
                    "write `= …` behind it: one value for all elements, or `(…, …)` with one for each",
                ),
            );
        }
        _ => (rest, None),
    };
    let (rest, attributes) = attributes(allowed, what, rest)?;
    Ok((rest, ItemKind::Array { declared, name, axes, unit, start, attributes }))
}

/// Refuses a range after a name that cannot be an array; other brackets may be a unit.
pub(super) fn no_range<'a>(
    input: Tokens<'a>,
    message: &str,
    help: &'static str,
) -> ParseResult<'a, ()> {
    if input.first() != Some(TokenKind::Index) || !input.first_text().contains("..") {
        return Ok((input, ()));
    }
    input.wrong(Diagnostic::new(Code::UnexpectedToken, input.span(), message).help(help))
}
