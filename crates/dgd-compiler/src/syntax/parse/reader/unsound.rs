//! Items that could not be read: the names that they may declare, and replacements for them.

use super::{ItemReader, UnreadableItem};
use crate::diagnostics::suggestion;
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, Item, ItemKind, Name, UnknownKind, WrittenUnit};
use crate::syntax::parse::item::is_keyword;
use crate::syntax::parse::item_ends::begins_item;
use crate::syntax::parse::lexical::{Token, TokenKind};
use crate::syntax::visit::{self, ItemPart};

/// Items that can be replaced.
const STANDING_IN: [&str; 6] = ["constant", "parameter", "input", "state", "unknown", "let"];

impl ItemReader<'_, '_> {
    /// Records an item that could not be read.
    pub(super) fn hole(&mut self, statement: &[Token], nesting: u32) {
        let (Some(first), Some(last)) = (statement.first(), statement.last()) else { return };
        let names = self.names_declared(statement);
        // Only an import contains a text.
        let hides_all = statement.iter().any(|token| token.kind == TokenKind::Text)
            || first.text(self.text) == "import";
        let span = self.span(*first).join(self.span(*last));
        // Inside a block it would be outside of its choice.
        let stand_in = if nesting == 0 { self.stand_in(statement) } else { None };
        self.holes.push((UnreadableItem { span, names, hides_all }, stand_in));
    }

    /// Records an item that was read but is not allowed here.
    pub(super) fn hole_of(&mut self, item: &mut Item) {
        let mut names = Vec::new();
        visit::parts_mut(item, &mut |part| {
            if let ItemPart::Declares(_, name) = part {
                names.push(name.text.clone());
            }
        });
        self.holes.push((UnreadableItem { span: item.span, names, hides_all: false }, None));
    }

    /// Assigns items that are indented deeper than an unmatched `}` to its block.
    pub(super) fn take_out(&mut self, items: &mut Vec<Item>, brace: Span) {
        let column = |span: Span| {
            let before = &self.text[..span.start as usize];
            before.len() - before.rfind('\n').map_or(0, |line| line + 1)
        };
        let brace_column = column(brace);
        let mut inside = Vec::new();
        while let Some(item) = items.pop_if(|item| column(item.span) > brace_column) {
            inside.push(item);
        }
        for mut item in inside {
            self.hole_of(&mut item);
        }
    }

    /// The names after keywords and the bound names; if the item does not begin with a keyword, or is unreadable, all
    /// words before its value.
    fn names_declared(&self, statement: &[Token]) -> Vec<String> {
        let is_name = |token: &Token| token.kind == TokenKind::Name;
        let head = Self::head(statement);
        let begins_with_keyword =
            statement.first().is_some_and(|first| is_keyword(first.text(self.text)));
        let is_unreadable = head.iter().any(|token| token.kind == TokenKind::Invalid);
        let mut names = Vec::new();
        if is_unreadable || !begins_with_keyword {
            names = self.words(head);
        }
        for (i, pair) in statement.windows(2).enumerate() {
            if !is_name(&pair[0]) {
                continue;
            }
            if is_keyword(pair[0].text(self.text)) && is_name(&pair[1]) {
                names.push(self.dotted_at(&statement[i + 1..]));
            } else if pair[1].kind == TokenKind::Dot && (i == 0 || !is_dot(&statement[i - 1])) {
                names.push(self.dotted_at(&statement[i..]));
            }
        }
        names.extend(self.run_together(statement));
        let members: Vec<String> =
            names.iter().filter_map(|name| Some(name.rsplit_once('.')?.1.to_owned())).collect();
        names.extend(members);
        names
    }

    /// Possible names of a function or table whose first argument runs into its name: `flightz)` was `flight(z)`.
    fn run_together(&self, statement: &[Token]) -> Vec<String> {
        let [keyword, name, behind, ..] = statement else { return Vec::new() };
        let has_arguments = matches!(keyword.text(self.text), "function" | "table");
        if !has_arguments || name.kind != TokenKind::Name || behind.kind == TokenKind::Open {
            return Vec::new();
        }
        let name = name.text(self.text);
        name.char_indices().skip(1).map(|(end, _)| name[..end].to_owned()).collect()
    }

    /// The tokens before an item's unit, value or arguments.
    fn head(statement: &[Token]) -> &[Token] {
        let ends = |token: &Token| {
            matches!(
                token.kind,
                TokenKind::Equal
                    | TokenKind::Colon
                    | TokenKind::Unit
                    | TokenKind::Index
                    | TokenKind::Open
                    | TokenKind::OpenBrace
                    | TokenKind::Newline
            )
        };
        &statement[..statement.iter().position(ends).unwrap_or(statement.len())]
    }

    /// The words formed by tokens without blanks between them, without characters not allowed in words.
    fn words(&self, tokens: &[Token]) -> Vec<String> {
        let mut words: Vec<String> = Vec::new();
        let mut end = None;
        for token in tokens {
            let letters = token.text(self.text).chars();
            let sound = letters.filter(|c| c.is_alphanumeric() || matches!(c, '_' | '.'));
            match words.last_mut() {
                Some(last) if end == Some(token.start) => last.extend(sound),
                _ => words.push(sound.collect()),
            }
            end = Some(token.end);
        }
        words.retain(|word| !word.is_empty() && !is_keyword(word));
        words
    }

    /// The name at the beginning of tokens, with its members after points.
    fn dotted_at(&self, tokens: &[Token]) -> String {
        let mut end = 1;
        while tokens.get(end).is_some_and(|token| token.kind == TokenKind::Dot)
            && tokens.get(end + 1).is_some_and(|token| token.kind == TokenKind::Name)
        {
            end += 2;
        }
        tokens[..end].iter().map(|token| token.text(self.text)).collect()
    }

    /// A replacement for an unreadable declaration with a valid head: others can then read a name with its unit.
    fn stand_in(&self, statement: &[Token]) -> Option<Item> {
        let [keyword, name, behind @ ..] = statement else { return None };
        if name.kind != TokenKind::Name || behind.first().is_some_and(|t| t.kind == TokenKind::Dot)
        {
            return None;
        }
        let name_at = |token: &Token| Name {
            text: token.text(self.text).to_owned(),
            span: self.span(*token),
        };
        let unit = match behind.first() {
            Some(token) if token.kind == TokenKind::Unit => {
                let inside = token.text(self.text);
                let text = inside[1..inside.len() - 1].trim().to_owned();
                Some(WrittenUnit::new(self.span(*token), text))
            }
            Some(token) if !matches!(token.kind, TokenKind::Equal | TokenKind::Name) => {
                return None;
            }
            Some(_) | None => None,
        };
        let number = ExprKind::Number { value: 1.0, text: "1".to_owned(), unit: None };
        let value = Expr { span: self.span(*name), kind: number };
        let (name, attributes) = (name_at(name), Vec::new());
        let unknown = |declared| ItemKind::Unknown {
            declared,
            name: name.clone(),
            unit: unit.clone(),
            start: None,
            attributes: Vec::new(),
        };
        let word = keyword.text(self.text);
        let meant = if STANDING_IN.contains(&word) {
            Some(word)
        } else {
            suggestion(word, STANDING_IN).filter(|_| !is_keyword(word))
        };
        let kind = match meant? {
            "constant" => ItemKind::Constant { name, unit, value },
            "parameter" => ItemKind::Parameter { name, unit, value, attributes },
            "input" => ItemKind::Input { name, unit, attributes },
            "state" => unknown(UnknownKind::State),
            "unknown" => unknown(UnknownKind::Unknown),
            "let" if unit.is_some() => ItemKind::Constant { name, unit, value },
            _ => return None,
        };
        let span = self.span(*keyword).join(self.span(*statement.last()?));
        Some(Item { span, doc: Vec::new(), kind })
    }

    /// The end of an item with an unclosed block: before the next line that begins an item with the same or less
    /// indentation.
    pub(super) fn end_of_unclosed(&self, tokens: &[Token]) -> usize {
        let Some(first) = tokens.first() else { return 0 };
        let column = |token: &Token| {
            let line = &self.text[..token.start as usize];
            line.len() - line.rfind('\n').map_or(0, |at| at + 1)
        };
        let ends = |i: &usize| {
            let mut behind = tokens[i + 1..].iter().filter(|token| token.kind != TokenKind::Doc);
            let begins = behind.next().filter(|token| column(token) <= column(first));
            tokens[*i].kind == TokenKind::Newline
                && begins
                    .is_some_and(|token| begins_item(*token, behind.next().copied(), self.text))
        };
        (0..tokens.len()).find(ends).unwrap_or(tokens.len())
    }
}

fn is_dot(token: &Token) -> bool {
    token.kind == TokenKind::Dot
}
