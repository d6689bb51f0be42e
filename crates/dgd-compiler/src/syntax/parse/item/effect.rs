//! Syntax specific to effect files: their first line, and the clauses with their changes.
//!
//! ```text
//! header  = "effect" name ("on" name | "(" slot ("," slot)* ")")
//! slot    = name ":" ("input" | "output" | "state" | "equation" | "parameter" | "quantity" | "let") unit?
//! clause  = "kind" ("plant" | "sensor" | "input")
//!         | "form" name
//!         | "null" name "=" expression
//!         | "replace" "output" name "by" expression
//!         | "replace" name arguments? ("in" name)? "by" expression
//!         | "add" expression "to" name
//! ```

use nom::Parser;
use nom::multi::separated_list1;

use crate::diagnostics::{Code, Diagnostic, suggestion};
use crate::source::Span;
use crate::syntax::ast::{ClauseKind, EffectKind, EffectTarget, Name, SlotKind, TemplateSlot};
use crate::syntax::parse::expression::{close, expression, optional_unit};
use crate::syntax::parse::lexical::TokenKind;
use crate::syntax::parse::tokens::{OPERATOR, ParseResult, Tokens, dotted, name, token, word};

/// Words that begin a clause.
pub(crate) const CLAUSES: [&str; 5] = ["kind", "form", "null", "replace", "add"];

/// Whether a clause begins here.
pub(crate) fn is_clause(input: Tokens<'_>) -> bool {
    input.first() == Some(TokenKind::Name) && CLAUSES.contains(&input.first_text())
}

/// Reads the first line of an effect.
pub(crate) fn header(input: Tokens<'_>) -> ParseResult<'_, (Name, EffectTarget)> {
    let (rest, effect) = name(input.behind_first())?;
    let (rest, target) = if rest.starts_with_word("on") {
        let (rest, model) = name(rest.behind_first())?;
        (rest, EffectTarget::Model(model))
    } else if rest.first() == Some(TokenKind::Open) {
        let comma = token(TokenKind::Comma, "`,`");
        let (inside, slots) = separated_list1(comma, slot).parse(rest.behind_first())?;
        if inside.first() == Some(TokenKind::Comma) {
            return inside.behind_first().expected("the name of an argument");
        }
        (close(rest.span(), inside)?.0, EffectTarget::Template(slots))
    } else {
        return rest.expected("`on MODEL`, or arguments such as `(y: output)`");
    };
    whole(rest, (effect, target))
}

fn slot(input: Tokens<'_>) -> ParseResult<'_, TemplateSlot> {
    let colon = token(TokenKind::Colon, "`:` and what the argument is");
    let (rest, (name, _)) = (name, colon).parse(input)?;
    let (rest, kind) = one_of(&SlotKind::ALL, rest)?;
    let (rest, unit) = optional_unit(rest)?;
    Ok((rest, TemplateSlot { name, kind, unit }))
}

/// One of these words.
fn one_of<'a, T: Copy>(words: &[(&'static str, T)], input: Tokens<'a>) -> ParseResult<'a, T> {
    if let Some((_, meaning)) = words.iter().find(|(word, _)| input.starts_with_word(word)) {
        return Ok((input.behind_first(), *meaning));
    }
    let spellings: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
    let word = match input.first() {
        None => "the end of the item".to_owned(),
        Some(_) => format!("`{}`", input.first_text()),
    };
    let message = format!("expected one of {}, found {word}", spellings.join(", "));
    let near =
        suggestion(input.first_text(), spellings).map(|near| format!("did you mean `{near}`?"));
    input.wrong(Diagnostic::new(Code::UnexpectedToken, input.span(), message).maybe_help(near))
}

/// Reads a clause, from its keyword to its last token.
pub(crate) fn clause(input: Tokens<'_>) -> ParseResult<'_, (Span, ClauseKind)> {
    let rest = input.behind_first();
    let (rest, kind) = match input.first_text() {
        "kind" => one_of(&EffectKind::ALL, rest).map(|(rest, kind)| (rest, ClauseKind::Kind(kind))),
        "form" => name(rest).map(|(rest, form)| (rest, ClauseKind::Form(form))),
        "null" => null(rest),
        "replace" => replace(rest),
        _ => add(rest),
    }?;
    let (rest, kind) = whole(rest, kind)?;
    Ok((rest, (input.span_to(&rest), kind)))
}

fn null(input: Tokens<'_>) -> ParseResult<'_, ClauseKind> {
    let equal = token(TokenKind::Equal, "`=` and the value at which the effect vanishes");
    let (rest, (name, _, value)) = (name, equal, expression).parse(input)?;
    Ok((rest, ClauseKind::Null { name, value }))
}

fn replace(input: Tokens<'_>) -> ParseResult<'_, ClauseKind> {
    let by_word = word("by", "`by` and what stands in its place");
    let behind = input.behind_first();
    let is_clause = behind.starts_with_word("by") || behind.starts_with_word("in");
    if input.starts_with_word("output") && behind.first() == Some(TokenKind::Name) && !is_clause {
        let (rest, (output, _, by_word)) = (dotted, by_word, expression).parse(behind)?;
        return Ok((rest, ClauseKind::ReplaceOutput { output, by: by_word }));
    }
    let (mut rest, replaced) = dotted(input)?;
    let mut arguments = Vec::new();
    if rest.first() == Some(TokenKind::Open) {
        let comma = token(TokenKind::Comma, "`,`");
        let inside;
        (inside, arguments) = separated_list1(comma, name).parse(rest.behind_first())?;
        rest = close(rest.span(), inside)?.0;
    }
    let mut equation = None;
    if rest.starts_with_word("in") {
        let label;
        (rest, label) = dotted(rest.behind_first())?;
        equation = Some(label);
    }
    let expected = if equation.is_some() { "`by`" } else { "`in EQUATION` or `by`" };
    let (rest, (_, by_word)) = (word("by", expected), expression).parse(rest)?;
    Ok((rest, ClauseKind::Replace { name: replaced, arguments, equation, by: by_word }))
}

fn add(input: Tokens<'_>) -> ParseResult<'_, ClauseKind> {
    let to_word = word("to", "`to` and the equation's label, or an operator");
    let (rest, (value, _, equation)) = (expression, to_word, dotted).parse(input)?;
    Ok((rest, ClauseKind::Add { value, equation }))
}

/// The value, if no tokens are left.
fn whole<T>(rest: Tokens<'_>, read: T) -> ParseResult<'_, T> {
    if rest.is_empty() { Ok((rest, read)) } else { rest.expected(OPERATOR) }
}
