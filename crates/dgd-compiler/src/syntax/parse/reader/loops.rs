//! Loops: `for NAME in a..b { … }`.

use super::{ItemReader, item_length, take_docs};
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{Item, ItemKind, LoopCounter};
use crate::syntax::parse::index::{counters, index_at_the_end};
use crate::syntax::parse::lexical::{Token, TokenKind};
use crate::syntax::parse::tokens::{NESTING, too_deep};

/// Items of loops other than bindings of parts' inputs, by their first words, with the position of the name that the
/// loop's indices follow; `None` if elements are named inside the item.
const IN_LOOPS: [(&str, Option<usize>); 6] = [
    ("equation", Some(1)),
    ("let", Some(1)),
    ("start", Some(2)),
    ("saturate", None),
    ("when", None),
    ("every", None),
];

impl<'a> ItemReader<'a, '_> {
    /// `for i in 1..N { equation mass[i]: … }`
    pub(super) fn loop_(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
        nesting: u32,
    ) -> Option<ItemKind> {
        let input = self.input(statement);
        if nesting >= NESTING {
            self.error(too_deep(input.span()));
            return None;
        }
        let (rest, counters) = self.report(counters(input.behind_first()))?;
        let (mut inside, behind) = self.block(&statement[statement.len() - rest.len()..])?;
        take_docs(&mut inside, docs);
        let mut items = Vec::new();
        let mut above = Vec::new();
        while let Some((first, rest)) = inside.split_first() {
            match first.kind {
                TokenKind::Newline => inside = rest,
                TokenKind::Doc => {
                    above.push(*first);
                    inside = rest;
                }
                _ => {
                    let (line, rest) = inside.split_at(item_length(inside));
                    let item = self.item_of_loop(line, std::mem::take(&mut above), &counters);
                    if item.is_none() {
                        self.hole(line, nesting + 1);
                    }
                    items.extend(item);
                    inside = rest;
                }
            }
        }
        self.end_of_block(&above, behind, docs)?;
        Some(ItemKind::For { counters, items })
    }

    /// `equation NAME[i]: …`, `let NAME[i] = …` or `PART.INPUT[i] = …`: the item without its indices, which are the
    /// loop's. `saturate`, `when` and `every` can name any elements.
    fn item_of_loop(
        &mut self,
        line: &'a [Token],
        docs: Vec<Token>,
        counters: &[LoopCounter],
    ) -> Option<Item> {
        let first = line.first()?;
        let last = line.iter().rfind(|token| token.kind != TokenKind::Doc)?;
        let span = self.span(*first).join(self.span(*last));
        let keyword = first.text(self.text);
        let is_binding = line.get(1).is_some_and(|second| second.kind == TokenKind::Dot);
        let second = line.get(1).map_or("", |second| second.text(self.text));
        let known = IN_LOOPS.iter().find(|(word, _)| *word == keyword);
        let known = known.filter(|_| keyword != "start" || second == "equation");
        let named_at = match known {
            _ if is_binding => Some(0),
            Some((_, named_at)) => *named_at,
            None => {
                let diagnostic = self.no_item_of_loop(line, counters)?;
                self.error(diagnostic);
                return None;
            }
        };
        let mut docs = docs;
        let kind = match (named_at, keyword) {
            (None, "when") => self.when(line, &mut docs).map(ItemKind::When),
            (None, "every") => self.every(line, &mut docs),
            _ => {
                let message = match named_at {
                    Some(named_at) => self.indices_of_loop(line, named_at, counters)?,
                    None => 0..0,
                };
                let without_index: Vec<Token> = line
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| !message.contains(i))
                    .map(|(_, token)| *token)
                    .collect();
                docs.extend(line.iter().filter(|token| token.kind == TokenKind::Doc));
                self.plain_item(&without_index, &docs, false, 1)
            }
        };
        Some(Item { span, doc: self.doc_lines(&docs), kind: kind? })
    }

    /// The reason why no item of a loop begins here.
    fn no_item_of_loop(&self, line: &'a [Token], counters: &[LoopCounter]) -> Option<Diagnostic> {
        let (first, index) = (line.first()?, &counters.first()?.index);
        let (keyword, input) = (first.text(self.text), self.input(line));
        let moved = index_at_the_end(input);
        let message = match &moved {
            Some(_) => "the index of a part stands at the end".to_owned(),
            None => format!("`{keyword}` cannot stand in a loop"),
        };
        let help = match (moved, keyword) {
            (Some((element, behind)), _) => format!("write `{element}{behind}`"),
            (None, "for") => {
                "one loop goes over several indices: `for i in 1..N, j in 1..M { … }`".to_owned()
            }
            (None, "output") => {
                "write `output NAME` outside the loop: for an array it is one output for each element; \
                 what the loop computes for each index is an array of `unknown`s"
                    .to_owned()
            }
            (None, _) => {
                "a loop holds equations, start equations, `let`s, what inputs of parts are, `saturate`, \
                 `when` and `every`; arrays are declared in front of it"
                    .to_owned()
            }
        };
        let diagnostic = Diagnostic::new(Code::ItemInLoop, self.span(*first), message);
        Some(diagnostic.label(index.span, "the loop's index").help(help))
    }

    /// Finds the loop's indices in an item, after the name at `named_at`; reports missing ones.
    fn indices_of_loop(
        &mut self,
        line: &'a [Token],
        named_at: usize,
        counters: &[LoopCounter],
    ) -> Option<std::ops::Range<usize>> {
        let members = line.iter().skip(named_at + 1).step_by(2);
        let dots = members.take_while(|token| token.kind == TokenKind::Dot).count();
        let brackets_at = (named_at + 1 + 2 * dots).min(line.len());
        let brackets = line[brackets_at..].iter().take_while(|t| t.kind == TokenKind::Index);
        let inside = |token: &Token| {
            let inner = token.text(self.text).strip_prefix('[')?.strip_suffix(']')?;
            Some(inner.trim().to_owned())
        };
        let written: Vec<Option<String>> = brackets.map(inside).collect();
        let wanted = counters.iter().map(|counter| Some(counter.index.text.clone()));
        if written.into_iter().eq(wanted) {
            return Some(brackets_at..brackets_at + counters.len());
        }
        let token = line.get(brackets_at).or(line.get(1)).or(line.first())?;
        let names: Vec<&str> = counters.iter().map(|c| c.index.text.as_str()).collect();
        let indices = format!("[{}]", names.join("]["));
        let message =
            format!("what stands in a loop over `{}` ends in `{indices}`", names.join("`, `"));
        let words = line[..named_at.min(line.len())].iter();
        let words: Vec<&str> = words.map(|word| word.text(self.text)).collect();
        let help = if words.is_empty() {
            format!("write `PART.INPUT{indices} = …`")
        } else {
            format!("write `{} NAME{indices}`", words.join(" "))
        };
        self.error(
            Diagnostic::new(Code::ItemInLoop, self.span(*token), message)
                .label(counters.first()?.index.span, "the loop's index")
                .help(help),
        );
        None
    }
}
