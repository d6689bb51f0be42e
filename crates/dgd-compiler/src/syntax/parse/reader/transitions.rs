//! Transitions between modes, and reactions without modes: `when` and `every`.

use nom::Parser;

use super::{ItemReader, head_and_block, item_length, take_docs};
use crate::diagnostics::{Code, Diagnostic, Fix, FixEdit};
use crate::source::Span;
use crate::syntax::ast::{
    Crossing, CrossingCondition, Expr, ItemKind, Name, Reaction, ResetClause, TransitionClause,
};
use crate::syntax::parse::expression::{expression, sum};
use crate::syntax::parse::index::indices;
use crate::syntax::parse::item::last_value;
use crate::syntax::parse::lexical::{Token, TokenKind};
use crate::syntax::parse::tokens::{OPERATOR, ParseResult, Tokens, dotted, name, token, word};

impl<'a> ItemReader<'a, '_> {
    /// `MODE -> MODE when EXPRESSION falls below EXPRESSION`, optionally with `{ reset x = e }`.
    pub(super) fn transition(
        &mut self,
        line: &'a [Token],
        mut docs: Vec<Token>,
    ) -> Option<TransitionClause> {
        let (plain, block) = head_and_block(line, &mut docs)?;
        let input = Tokens::new(&plain, self.text, self.source);
        let (_, (from, to, conditions)) = self.report(head_of_transition(input))?;
        let resets = if block.is_empty() { Vec::new() } else { self.resets(block, &mut docs)? };
        let last = line.iter().rfind(|token| token.kind != TokenKind::Doc)?;
        let span = self.span(*line.first()?).join(self.span(*last));
        let doc = self.doc_lines(&docs);
        Some(TransitionClause { span, doc, from, to, conditions, resets })
    }

    /// `when EXPRESSION falls below EXPRESSION { reset x = e }`
    pub(super) fn when(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
    ) -> Option<Reaction> {
        let (plain, block) = head_and_block(statement, docs)?;
        let input = Tokens::new(&plain, self.text, self.source);
        let (_, conditions) = self.report(conditions(input.behind_first()))?;
        let resets = self.some_resets("when", input.span(), block, docs)?;
        Some(Reaction { conditions, resets })
    }

    /// The resets of a block; an empty block is reported.
    fn some_resets(
        &mut self,
        word: &str,
        span: Span,
        block: &'a [Token],
        docs: &mut Vec<Token>,
    ) -> Option<Vec<ResetClause>> {
        let resets = if block.is_empty() { Vec::new() } else { self.resets(block, docs)? };
        if resets.is_empty() {
            let message = format!("this `{word}` does nothing");
            self.error(
                Diagnostic::new(Code::UnexpectedToken, span, message)
                    .help("write `{ reset NAME = … }` behind it"),
            );
            return None;
        }
        Some(resets)
    }

    /// `every EXPRESSION { reset x = e }`, optionally with `offset EXPRESSION` before the braces.
    pub(super) fn every(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
    ) -> Option<ItemKind> {
        let (plain, block) = head_and_block(statement, docs)?;
        let input = Tokens::new(&plain, self.text, self.source);
        let (_, (period, offset)) = self.report(times(input.behind_first()))?;
        let resets = self.some_resets("every", input.span(), block, docs)?;
        Some(ItemKind::Every { period, offset, resets })
    }

    /// `{ reset x = e … }`, one per line.
    fn resets(&mut self, block: &'a [Token], docs: &mut Vec<Token>) -> Option<Vec<ResetClause>> {
        let mut resets = Vec::new();
        let (mut inside, behind) = self.block(block)?;
        take_docs(&mut inside, docs);
        while let Some((first, rest)) = inside.split_first() {
            if first.kind == TokenKind::Newline {
                inside = rest;
                continue;
            }
            let (line, rest) = inside.split_at(item_length(inside));
            let (_, reset) = self.report(reset(self.input(line)))?;
            resets.push(reset);
            inside = rest;
        }
        self.end_of_block(&[], behind, docs)?;
        Some(resets)
    }
}

/// The period of an `every`, optionally with its offset.
fn times(input: Tokens<'_>) -> ParseResult<'_, (Expr, Option<Expr>)> {
    let (rest, period) = expression(input)?;
    if rest.starts_with_word("offset") {
        let (rest, offset) = last_value(rest.behind_first())?;
        return Ok((rest, (period, Some(offset))));
    }
    let (rest, period) = last_value(input)?;
    Ok((rest, (period, None)))
}

type TransitionHead = (Name, Name, Vec<CrossingCondition>);

fn head_of_transition(input: Tokens<'_>) -> ParseResult<'_, TransitionHead> {
    let arrow = token(TokenKind::Arrow, "`->` and the mode that follows, or `{` and equations");
    let when = word("when", "`when` and a condition such as `x falls below 0`");
    let (rest, (from, _, to, _)) = (name, arrow, name, when).parse(input)?;
    let (rest, conditions) = conditions(rest)?;
    Ok((rest, (from, to, conditions)))
}

/// Conditions joined by `or`, up to the end.
fn conditions(mut input: Tokens<'_>) -> ParseResult<'_, Vec<CrossingCondition>> {
    let mut conditions = Vec::new();
    loop {
        let (rest, one) = condition(input)?;
        conditions.push(one);
        if rest.is_empty() {
            return Ok((rest, conditions));
        }
        if rest.starts_with_word("and") {
            let message = "what is watched is joined by `or` only";
            return rest.wrong(Diagnostic::new(Code::UnexpectedToken, rest.span(), message).help(
                "two conditions hold at once when the smaller of two differences, each over its unit, rises \
                 above 0: `when min((x - a)/1 [m], (y - b)/1 [s]) rises above 0`",
            ));
        }
        input = word("or", OPERATOR)(rest)?.0;
    }
}

/// `EXPRESSION falls below EXPRESSION`
fn condition(input: Tokens<'_>) -> ParseResult<'_, CrossingCondition> {
    let (rest, left) = sum(input)?;
    let (crossing, side) = match (rest.first_text(), rest.first()) {
        ("rises", _) => (Crossing::Rises, "above"),
        ("falls", _) => (Crossing::Falls, "below"),
        (
            sign,
            Some(
                TokenKind::Less
                | TokenKind::LessEqual
                | TokenKind::Greater
                | TokenKind::GreaterEqual,
            ),
        ) => {
            let words = if sign.starts_with('<') { "falls below" } else { "rises above" };
            let message = format!("what is watched passes a value, and `{sign}` only compares");
            let (left, right) = (input.written_to(&rest), rest.behind_first().written());
            return rest.wrong(
                Diagnostic::new(Code::UnexpectedToken, rest.span(), message)
                    .help(format!("write `{left} {words} {right}`")),
            );
        }
        _ => return rest.expected("`rises above`, `falls below` or an operator"),
    };
    let expected = if side == "above" { "`above`" } else { "`below`" };
    let (rest, _) = word(side, expected)(rest.behind_first())?;
    let (rest, right) = sum(rest)?;
    Ok((rest, CrossingCondition { left, crossing, right }))
}

/// `reset x = e`
fn reset(input: Tokens<'_>) -> ParseResult<'_, ResetClause> {
    if input.first_text() != "reset" && input.second() == Some(TokenKind::Equal) {
        let message = "a new value begins with `reset`";
        let fix = Fix::safe(vec![FixEdit::insert_before(input.span(), "reset ".to_owned())]);
        return input.wrong(Diagnostic::new(Code::UnexpectedToken, input.span(), message).fix(fix));
    }
    let keyword = word("reset", "`reset NAME = …`");
    let equal = token(TokenKind::Equal, "`=`");
    let (rest, (_, name, indices, _, value)) =
        (keyword, dotted, indices, equal, expression).parse(input)?;
    if rest.is_empty() {
        Ok((rest, ResetClause { span: input.span_to(&rest), name, indices, value }))
    } else {
        rest.expected(OPERATOR)
    }
}
