//! Items, and the blocks that contain items: variants and modes.

use super::{ItemReader, closed_length, item_length, take_docs};
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{Item, ItemKind, Name, StartMode, VariantChoice};
use crate::syntax::parse::expression::expression;
use crate::syntax::parse::lexical::{Token, TokenKind};
use crate::syntax::parse::tokens::{OPERATOR, ParseResult, Tokens, name, word};

impl<'a> ItemReader<'a, '_> {
    /// Reads items until no tokens are left.
    pub(in crate::syntax::parse) fn items(
        &mut self,
        mut tokens: &'a [Token],
        nesting: u32,
    ) -> Vec<Item> {
        let mut items = Vec::new();
        let mut doc = Vec::new();
        while let Some((first, rest)) = tokens.split_first() {
            match first.kind {
                TokenKind::Newline => tokens = rest,
                TokenKind::Doc => {
                    doc.push(*first);
                    tokens = rest;
                }
                TokenKind::CloseBrace => {
                    let message = "no block is open for this `}`";
                    let span = self.span(*first);
                    self.error(Diagnostic::new(Code::UnmatchedBracket, span, message));
                    self.take_out(&mut items, span);
                    tokens = rest;
                }
                _ => {
                    let (statement, rest) = tokens.split_at(self.length(tokens));
                    let docs = std::mem::take(&mut doc);
                    let n_mistakes = self.diagnostics.len();
                    let item = self.item(statement, docs, nesting);
                    if item.is_none() && self.is_wrong(statement, n_mistakes) {
                        self.hole(statement, nesting);
                    }
                    items.extend(item);
                    tokens = rest;
                }
            }
        }
        if let Some(first) = doc.first() {
            let message = "this doc comment belongs to nothing";
            self.error(Diagnostic::new(Code::DetachedDoc, self.span(*first), message).help(
                "write it above an item or at the end of its line; a remark begins with `#`",
            ));
        }
        items
    }

    /// Number of tokens of an item; one with an unclosed block ends where another begins.
    fn length(&self, tokens: &[Token]) -> usize {
        closed_length(tokens, &self.unclosed).unwrap_or_else(|| self.end_of_unclosed(tokens))
    }

    /// Whether an error of an item has been reported, now or by the lexer.
    fn is_wrong(&self, statement: &[Token], n_mistakes_before: usize) -> bool {
        self.diagnostics.len() > n_mistakes_before
            || statement.iter().any(|token| token.kind == TokenKind::Invalid)
    }

    /// Reads one item, without line ends around it.
    fn item(&mut self, statement: &'a [Token], mut docs: Vec<Token>, nesting: u32) -> Option<Item> {
        let is_first = !std::mem::replace(&mut self.begun, true);
        let first = statement.first()?;
        let kind = match (first.kind, first.text(self.text)) {
            (TokenKind::Name, "variant") => self.variant(statement, &mut docs, nesting),
            (TokenKind::Name, "modes") => self.modes(statement, &mut docs, nesting),
            (TokenKind::Name, "when") => self.when(statement, &mut docs).map(ItemKind::When),
            (TokenKind::Name, "every") => self.every(statement, &mut docs),
            (TokenKind::Name, "function") if has_block(statement) => {
                self.function(statement, &mut docs)
            }
            (TokenKind::Name, "for") => self.loop_(statement, &mut docs, nesting),
            _ => {
                docs.extend(statement.iter().filter(|token| token.kind == TokenKind::Doc));
                self.plain_item(statement, &docs, is_first && nesting == 0, nesting)
            }
        };
        let last = statement.iter().rfind(|token| token.kind != TokenKind::Doc)?;
        let span = self.span(*first).join(self.span(*last));
        Some(Item { span, doc: self.doc_lines(&docs), kind: kind? })
    }

    /// `variant NAME { CHOICE { items } … }`
    fn variant(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
        nesting: u32,
    ) -> Option<ItemKind> {
        let (name, mut inside, behind) = self.named_block(statement, docs, nesting)?;
        let mut choices = Vec::new();
        let mut above = Vec::new();
        while let Some((first, rest)) = inside.split_first() {
            match first.kind {
                TokenKind::Newline => inside = rest,
                TokenKind::Doc => {
                    above.push(*first);
                    inside = rest;
                }
                _ => {
                    let mut docs = std::mem::take(&mut above);
                    let (choice, rest) = self.choice(inside, &mut docs, nesting)?;
                    choices.push(choice);
                    inside = rest;
                }
            }
        }
        self.end_of_block(&above, behind, docs)?;
        if choices.is_empty() {
            let message = format!("variant `{}` has no choices", name.text);
            self.error(
                Diagnostic::new(Code::UnexpectedToken, name.span, message)
                    .help("write them as `NAME { … }`, the default first"),
            );
            return None;
        }
        Some(ItemKind::Variant { name, choices })
    }

    /// `modes NAME { MODE { equations } … MODE -> MODE when … start MODE }`
    fn modes(
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

    /// Reads `NAME { items }` and the doc comment at the end of its line.
    fn choice(
        &mut self,
        tokens: &'a [Token],
        docs: &mut Vec<Token>,
        nesting: u32,
    ) -> Option<(VariantChoice, &'a [Token])> {
        let (rest, name) = self.report(name(self.input(tokens)))?;
        let (mut inside, mut behind) = self.block(&tokens[tokens.len() - rest.len()..])?;
        take_docs(&mut inside, docs);
        take_docs(&mut behind, docs);
        let items = self.items(inside, nesting + 1);
        Some((VariantChoice { doc: self.doc_lines(docs), name, items }, behind))
    }
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

fn has_block(statement: &[Token]) -> bool {
    statement.iter().any(|token| token.kind == TokenKind::OpenBrace)
}
