//! `modes NAME { … }`: modes with their equations, and the transitions between them; and `when`, a transition without
//! modes.

use nom::Parser;

use super::array;
use super::expression::{expression, sum};
use super::item::last_value;
use super::lexical::{Token, TokenKind};
use super::tokens::{OPERATOR, ParseResult, Tokens, dotted, name, token, word};
use super::{ItemReader, item_length, take_docs};
use crate::diagnostics::{Code, Diagnostic, Fix, FixEdit};
use crate::source::Span;
use crate::syntax::ast::{
    Crossing, CrossingCondition, Expr, Item, ItemKind, Name, Reaction, ResetClause, StartMode,
    TransitionClause, VariantChoice,
};

/// The tokens before the block of a line, without doc comments, and the block; `None` if there is an invalid token.
pub(super) fn head_and_block<'a>(
    line: &'a [Token],
    docs: &mut Vec<Token>,
) -> Option<(Vec<Token>, &'a [Token])> {
    let brace = line.iter().position(|token| token.kind == TokenKind::OpenBrace);
    let (head, block) = line.split_at(brace.unwrap_or(line.len()));
    let (doc, plain): (Vec<Token>, Vec<Token>) =
        head.iter().partition(|token| token.kind == TokenKind::Doc);
    docs.extend(doc);
    let is_sound = plain.iter().all(|token| token.kind != TokenKind::Invalid);
    is_sound.then_some((plain, block))
}

impl<'a> ItemReader<'a, '_> {
    /// `modes NAME { MODE { equations } … MODE -> MODE when … start MODE }`
    pub(super) fn modes(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
        nesting: u32,
    ) -> Option<ItemKind> {
        if let [_, _, start, ..] = statement
            && start.kind == TokenKind::Name
            && start.text(self.text) == "start"
        {
            let message = "`start` stands inside the block";
            self.error(
                Diagnostic::new(Code::UnexpectedToken, self.span(*start), message)
                    .help("write `start MODE` in a line of its own between `{` and `}`"),
            );
            return None;
        }
        let (name, mut inside, behind) = self.named_block(statement, docs, nesting)?;
        let mut modes: Vec<VariantChoice> = Vec::new();
        let mut transitions = Vec::new();
        let mut starts: Vec<StartMode> = Vec::new();
        let mut above = Vec::new();
        while let Some((first, rest)) = inside.split_first() {
            match (first.kind, rest.first().map(|second| second.kind)) {
                (TokenKind::Newline, _) => inside = rest,
                (TokenKind::Doc, _) => {
                    above.push(*first);
                    inside = rest;
                }
                (TokenKind::Name, Some(TokenKind::OpenBrace)) => {
                    let mut docs = std::mem::take(&mut above);
                    let (mut mode, rest) = self.choice(inside, &mut docs, nesting)?;
                    mode.items.retain_mut(|item| self.is_mode_item(item, &mode.name));
                    modes.push(mode);
                    inside = rest;
                }
                (TokenKind::Name, Some(TokenKind::Name)) if first.text(self.text) == "start" => {
                    let (line, rest) = inside.split_at(item_length(inside));
                    let (_, start) = self.report(start_mode(self.input(line)))?;
                    let always = starts.iter().find(|earlier| earlier.condition.is_none());
                    if let Some(earlier) = always.filter(|_| start.condition.is_none()) {
                        let message = "`start` is given twice";
                        self.error(
                            Diagnostic::new(Code::RepeatedAttribute, start.mode.span, message)
                                .label(earlier.mode.span, "given here already")
                                .help("say when: `start MODE if CONDITION`"),
                        );
                    }
                    starts.push(start);
                    inside = rest;
                }
                _ => {
                    let (line, rest) = inside.split_at(item_length(inside));
                    transitions.extend(self.transition(line, std::mem::take(&mut above)));
                    inside = rest;
                }
            }
        }
        self.end_of_block(&above, behind, docs)?;
        if modes.is_empty() {
            let message = format!("`{}` has no modes", name.text);
            self.error(
                Diagnostic::new(Code::UnexpectedToken, name.span, message)
                    .help("write them as `NAME { … }`, the one it starts in first"),
            );
            return None;
        }
        Some(ItemKind::Modes { name, modes, transitions, starts })
    }

    /// Whether an item is allowed in a mode: modes contain equations, and declarations are common to all of them. Other
    /// items are reported and ignored.
    fn is_mode_item(&mut self, item: &mut Item, mode: &Name) -> bool {
        let is_equation = matches!(item.kind, ItemKind::Equation { .. });
        if !is_equation {
            let message = "a mode holds equations only";
            self.error(
                Diagnostic::new(Code::DeclarationInMode, item.span, message)
                    .label(mode.span, "the mode")
                    .help("move it in front of `modes`: what is declared exists in every mode"),
            );
            self.hole_of(item);
        }
        is_equation
    }

    /// `MODE -> MODE when EXPRESSION falls below EXPRESSION`, optionally with `{ reset x = e }`.
    fn transition(&mut self, line: &'a [Token], mut docs: Vec<Token>) -> Option<TransitionClause> {
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

/// `start MODE`, optionally with `if CONDITION`.
fn start_mode(input: Tokens<'_>) -> ParseResult<'_, StartMode> {
    let (rest, mode) = name(input.behind_first())?;
    if rest.is_empty() {
        return Ok((rest, StartMode { mode, condition: None }));
    }
    let (rest, _) = word("if", "`if` and a condition, or the end of the line")(rest)?;
    let (rest, condition) = expression(rest)?;
    let condition = Some(condition);
    if rest.is_empty() {
        Ok((rest, StartMode { mode, condition }))
    } else {
        rest.expected(OPERATOR)
    }
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
        (keyword, dotted, array::indices, equal, expression).parse(input)?;
    if rest.is_empty() {
        Ok((rest, ResetClause { span: input.span_to(&rest), name, indices, value }))
    } else {
        rest.expected(OPERATOR)
    }
}
