//! Models inside models: `part pump: subsea_pump(c0 = 275 [m])` and `pump.q = q_ssp`.

use nom::Parser;

use super::array;
use super::expression::{close, expression};
use super::lexical::TokenKind;
use super::tokens::{ParseResult, Tokens, dotted, name, token};
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{ItemKind, PartArgument};

/// Whether a binding of a part's input begins here: no keyword is followed by a point.
pub(super) fn is_binding(input: Tokens<'_>) -> bool {
    input.first() == Some(TokenKind::Name) && input.second() == Some(TokenKind::Dot)
}

/// `PART.NAME[i]` for a written `PART[i].NAME`, and the written text.
pub(super) fn index_at_the_end(input: Tokens<'_>) -> Option<(String, String)> {
    let (rest, part) = name(input).ok()?;
    let (behind, indices) = array::indices(rest).ok()?;
    if indices.is_empty() || behind.first() != Some(TokenKind::Dot) {
        return None;
    }
    let brackets = rest.written_to(&behind);
    let (rest, inner) = dotted(behind.behind_first()).ok()?;
    let more = rest.written();
    let more = if more.is_empty() { String::new() } else { format!(" {more}") };
    Some((format!("{}.{}{brackets}", part.text, inner.text), more))
}

/// `PART.INPUT = e` or `PART.INPUT[1] = e`
pub(super) fn binding(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let equal = token(TokenKind::Equal, "`=` and what the input is");
    let (rest, (input, indices, _, value)) =
        (dotted, array::indices, equal, expression).parse(input)?;
    Ok((rest, ItemKind::Binding { input, indices, value }))
}

/// `NAME: MODEL(a = e, …)` or `NAME[i in 1..N]: MODEL(a = e, …)` after the keyword; the parentheses are optional.
pub(super) fn part(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let colon = token(TokenKind::Colon, "`:` and the part's model");
    let model = name;
    let (rest, (name, axes)) = (name, array::axes).parse(input)?;
    if rest.first() == Some(TokenKind::Equal) {
        let message = "a part and its model have `:` between them";
        return rest.wrong(Diagnostic::new(Code::UnexpectedToken, rest.span(), message).help(
            format!("write `part {}: {}`", input.written_to(&rest), rest.behind_first().written()),
        ));
    }
    let (rest, (_, model)) = (colon, model).parse(rest)?;
    let mut arguments = Vec::new();
    if rest.first() != Some(TokenKind::Open) {
        return Ok((rest, ItemKind::Part { name, axes, model, arguments }));
    }
    let open = rest.span();
    let mut rest = rest.behind_first();
    while rest.first() != Some(TokenKind::Close) {
        let equal = token(TokenKind::Equal, "`=` and a value");
        let (behind, (name, _, value)) = (dotted, equal, array::value).parse(rest)?;
        arguments.push(PartArgument { name, value });
        rest = behind;
        if rest.first() != Some(TokenKind::Comma) {
            break;
        }
        rest = rest.behind_first();
    }
    let (rest, _) = close(open, rest)?;
    Ok((rest, ItemKind::Part { name, axes, model, arguments }))
}
