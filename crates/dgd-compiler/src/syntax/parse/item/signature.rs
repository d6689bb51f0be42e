//! Names with what they are declared with: units and arguments.

use nom::Parser;
use nom::combinator::map;
use nom::multi::separated_list1;

use crate::syntax::ast::{FormalArgument, Name, WrittenUnit};
use crate::syntax::parse::expression::{close, optional_unit};
use crate::syntax::parse::lexical::TokenKind;
use crate::syntax::parse::tokens::{ParseResult, Tokens, dotted, name, token};

/// A name and its unit, if it has one.
pub(super) fn declared(input: Tokens<'_>) -> ParseResult<'_, (Name, Option<WrittenUnit>)> {
    (dotted, optional_unit).parse(input)
}

/// A name and the arguments between parentheses.
pub(super) fn signature(input: Tokens<'_>) -> ParseResult<'_, (Name, Vec<FormalArgument>)> {
    let argument = map((name, optional_unit), |(name, unit)| FormalArgument { name, unit });
    let (open, name) = dotted(input)?;
    let rest = token(TokenKind::Open, "`(` and the arguments")(open)?.0;
    let comma = token(TokenKind::Comma, "`,`");
    let (rest, arguments) = separated_list1(comma, argument).parse(rest)?;
    if rest.first() == Some(TokenKind::Comma) {
        return rest.behind_first().expected("the name of an argument");
    }
    let rest = close(open.span(), rest)?.0;
    Ok((rest, (name, arguments)))
}
