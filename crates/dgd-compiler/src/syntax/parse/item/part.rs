//! Models inside models: `part pump: subsea_pump(c0 = 275 [m])` and `pump.q = q_ssp`.

use nom::Parser;

use super::values::array_value;
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{ItemKind, PartArgument};
use crate::syntax::parse::expression::{close, expression};
use crate::syntax::parse::index::{axes, indices};
use crate::syntax::parse::lexical::TokenKind;
use crate::syntax::parse::tokens::{ParseResult, Tokens, dotted, name, token};

/// Whether a binding of a part's input begins here: no keyword is followed by a point.
pub(super) fn is_binding(input: Tokens<'_>) -> bool {
    input.first() == Some(TokenKind::Name) && input.second() == Some(TokenKind::Dot)
}

/// `PART.INPUT = e` or `PART.INPUT[1] = e`
pub(super) fn binding(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let equal = token(TokenKind::Equal, "`=` and what the input is");
    let (rest, (input, indices, _, value)) = (dotted, indices, equal, expression).parse(input)?;
    Ok((rest, ItemKind::Binding { input, indices, value }))
}

/// `NAME: MODEL(a = e, …)` or `NAME[i in 1..N]: MODEL(a = e, …)` after the keyword; the parentheses are optional.
pub(super) fn part(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let colon = token(TokenKind::Colon, "`:` and the part's model");
    let model = name;
    let (rest, (name, axes)) = (name, axes).parse(input)?;
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
        let (behind, (name, _, value)) = (dotted, equal, array_value).parse(rest)?;
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
