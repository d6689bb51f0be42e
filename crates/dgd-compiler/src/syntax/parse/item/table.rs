//! Parses a table: `table head(q [lpm]) [m] = (0, 305), (1200, 301), …  pchip, beyond refuse`.

use nom::Parser;
use nom::combinator::cut;

use super::attribute::attributes;
use super::signature::signature;
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{Expr, ExprKind, FormalArgument, ItemKind, Name, TablePoint, TablePoints};
use crate::syntax::parse::expression::{close, expression, optional_unit};
use crate::syntax::parse::lexical::TokenKind;
use crate::syntax::parse::tokens::{ParseResult, Tokens, dotted, token};

/// Limit on the arguments of a table.
const MOST_ARGUMENTS: usize = 2;

/// Reads a table after its keyword.
pub(super) fn table(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let (rest, (name, arguments)) = cut(signature).parse(input)?;
    if let Some(more) = arguments.get(MOST_ARGUMENTS) {
        let message =
            format!("a table has one argument or two, and `{}` is another", more.name.text);
        return rest.wrong(
            Diagnostic::new(Code::UnexpectedToken, more.name.span, message)
                .help("make it of several tables"),
        );
    }
    let (rest, unit) = cut(optional_unit).parse(rest)?;
    let (rest, points) = points(&name, &arguments, rest)?;
    let (rest, attributes) =
        attributes(&["linear", "pchip", "natural", "cubic", "beyond", "smooth"], "a table", rest)?;
    Ok((rest, ItemKind::Table { name, arguments, unit, points, attributes }))
}

/// `from "eta.csv"`
fn of_file(input: Tokens<'_>) -> ParseResult<'_, TablePoints> {
    let (rest, path_span) =
        cut(token(TokenKind::Text, "a path such as \"eta.csv\"")).parse(input)?;
    let quoted = input.first_text();
    let path = quoted[1..quoted.len() - 1].to_owned();
    Ok((rest, TablePoints::File { path, path_span, rows: None }))
}

/// `= (0, 305), (1200, 301)`, `at (0, 1200) = (305, 301)` or `from "eta.csv"`.
fn points<'a>(
    name: &Name,
    arguments: &[FormalArgument],
    input: Tokens<'a>,
) -> ParseResult<'a, TablePoints> {
    if input.starts_with_word("from") {
        return of_file(input.behind_first());
    }
    if input.starts_with_word("at") {
        if let Some(second) = arguments.get(1) {
            let message = "`at` is for tables of one argument";
            return input.wrong(
                Diagnostic::new(Code::UnexpectedToken, input.span(), message)
                    .label(second.name.span, "this is another")
                    .help(format!("write its points: {}", example(arguments))),
            );
        }
        let (rest, abscissae) = list(input.behind_first())?;
        let rest =
            cut(token(TokenKind::Equal, "`=` and the values between parentheses")).parse(rest)?.0;
        let values = rest.span();
        if rest.first() == Some(TokenKind::Name) {
            // An array of values.
            let (rest, Name { text, span }) = dotted(rest)?;
            let array = Expr { span, kind: ExprKind::Name(text) };
            return Ok((rest, TablePoints::Columns([abscissae, vec![array]])));
        }
        let (rest, ordinates) = list(rest)?;
        if ordinates.len() != abscissae.len() {
            let message = format!(
                "`{}` has {} abscissae and {} values",
                name.text,
                abscissae.len(),
                ordinates.len()
            );
            return rest.wrong(Diagnostic::new(Code::UnexpectedToken, values, message));
        }
        return Ok((rest, TablePoints::Columns([abscissae, ordinates])));
    }
    if input.first() != Some(TokenKind::Equal) {
        return input.wrong(
            Diagnostic::new(Code::MissingValue, input.span(), "a table needs its points")
                .help(format!("write them behind it: {}", example(arguments))),
        );
    }
    let mut rest = input.behind_first();
    let mut points = Vec::new();
    loop {
        if rest.first() != Some(TokenKind::Open) {
            return rest.wrong(
                Diagnostic::new(
                    Code::UnexpectedToken,
                    rest.span(),
                    "expected a point of the table",
                )
                .help(format!("a point stands between parentheses: {}", example(arguments))),
            );
        }
        if rest.second() == Some(TokenKind::Open) && is_list_of_points(rest) {
            let message = "the points of a table stand without parentheses around them";
            return rest.wrong(
                Diagnostic::new(Code::UnexpectedToken, rest.span(), message)
                    .help(format!("write them one after the other: {}", example(arguments))),
            );
        }
        let begin = rest;
        let (behind, numbers) = list(rest)?;
        let span = begin.span_to(&behind);
        if numbers.len() != arguments.len() + 1 {
            let count = numbers.len();
            let noun = if count == 1 { "number" } else { "numbers" };
            return begin.wrong(
                Diagnostic::new(
                    Code::UnexpectedToken,
                    span,
                    format!("this point has {count} {noun}"),
                )
                .help(format!("write each so: {}", example(arguments))),
            );
        }
        points.push(TablePoint { span, numbers });
        rest = behind;
        let goes_on =
            rest.first() == Some(TokenKind::Comma) && rest.second() != Some(TokenKind::Name);
        if !goes_on {
            return Ok((rest, TablePoints::Written(points)));
        }
        rest = rest.behind_first();
    }
}

/// `= (q, value), (q, value)`
fn example(arguments: &[FormalArgument]) -> String {
    let names: Vec<&str> = arguments.iter().map(|a| a.name.text.as_str()).collect();
    let point = format!("({}, value)", names.join(", "));
    format!("`= {point}, {point}`")
}

/// Whether `((0, 1), …` begins here: parentheses around points. A parenthesised number contains no comma.
fn is_list_of_points(input: Tokens<'_>) -> bool {
    list(input.behind_first()).is_ok_and(|(_, numbers)| numbers.len() > 1)
}

/// Expressions in parentheses, at least one.
fn list(input: Tokens<'_>) -> ParseResult<'_, Vec<Expr>> {
    let open = input.span();
    let mut rest = cut(token(TokenKind::Open, "`(` and numbers")).parse(input)?.0;
    let mut numbers = Vec::new();
    loop {
        let (behind, expr) = cut(expression).parse(rest)?;
        numbers.push(expr);
        if behind.first() != Some(TokenKind::Comma) {
            let rest = close(open, behind)?.0;
            return Ok((rest, numbers));
        }
        rest = behind.behind_first();
    }
}
