//! Functions, in one line or with a block behind their head.

use nom::Parser;

use super::signature::signature;
use super::values::value;
use crate::syntax::ast::{FormalArgument, ItemKind, LocalLet, Name};
use crate::syntax::parse::expression::optional_unit;
use crate::syntax::parse::lexical::TokenKind;
use crate::syntax::parse::tokens::{OPERATOR, ParseResult, Tokens, name, token};

pub(super) fn function(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let (rest, (name, arguments)) = signature(input)?;
    let (rest, body) = value("a function")(rest)?;
    Ok((rest, ItemKind::Function { name, arguments, lets: Vec::new(), body }))
}

/// `function NAME(arguments) =`, followed by a block.
pub(crate) fn head_of_function(input: Tokens<'_>) -> ParseResult<'_, (Name, Vec<FormalArgument>)> {
    let (rest, head) = signature(input.behind_first())?;
    let rest = token(TokenKind::Equal, "`=` before the block of a function")(rest)?.0;
    if rest.is_empty() { Ok((rest, head)) } else { rest.expected("`{`") }
}

/// `let NAME [unit] = …` within a function.
pub(crate) fn local_let(input: Tokens<'_>) -> ParseResult<'_, LocalLet> {
    let what = "a `let`";
    let (rest, (name, unit)) = (name, optional_unit).parse(input.behind_first())?;
    let (rest, value) = value(what)(rest)?;
    if rest.is_empty() {
        Ok((rest, LocalLet { name, unit, value }))
    } else {
        rest.expected(OPERATOR)
    }
}
