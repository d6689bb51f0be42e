//! `function NAME(arguments) = { … }`: lines `let y = …`, then the value in the last line.

use super::{ItemReader, head_and_block, item_length, take_docs};
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::ItemKind;
use crate::syntax::parse::item::{head_of_function, last_value, local_let};
use crate::syntax::parse::lexical::{Token, TokenKind};
use crate::syntax::parse::tokens::Tokens;

impl<'a> ItemReader<'a, '_> {
    /// A function with a block. Doc comments in the block belong to the function.
    pub(super) fn function(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
    ) -> Option<ItemKind> {
        let (plain, block) = head_and_block(statement, docs)?;
        let input = Tokens::new(&plain, self.text, self.source);
        let (_, (name, arguments)) = self.report(head_of_function(input))?;
        let (mut inside, behind) = self.block(block)?;
        take_docs(&mut inside, docs);
        let (mut lets, mut body) = (Vec::new(), None);
        while let Some((first, rest)) = inside.split_first() {
            match first.kind {
                TokenKind::Newline => {
                    inside = rest;
                    continue;
                }
                TokenKind::Doc => {
                    docs.push(*first);
                    inside = rest;
                    continue;
                }
                _ => {}
            }
            let (line, rest) = inside.split_at(item_length(inside));
            let (own, line): (Vec<Token>, Vec<Token>) =
                line.iter().partition(|token| token.kind == TokenKind::Doc);
            docs.extend(own);
            inside = rest;
            if line.iter().any(|token| token.kind == TokenKind::Invalid) {
                return None;
            }
            let input = Tokens::new(&line, self.text, self.source);
            let is_let = input.starts_with_word("let") && input.second() == Some(TokenKind::Name);
            if body.is_some() {
                let message = "the value of a function stands in the last line of its block";
                self.error(
                    Diagnostic::new(Code::UnexpectedToken, input.span(), message)
                        .help("give what comes before it a name: `let NAME = …`"),
                );
                return None;
            }
            if is_let {
                lets.push(self.report(local_let(input))?.1);
            } else {
                body = Some(self.report(last_value(input))?.1);
            }
        }
        self.end_of_block(&[], behind, docs)?;
        let Some(body) = body else {
            let message = format!("the function `{}` has no value", name.text);
            self.error(
                Diagnostic::new(Code::UnexpectedToken, name.span, message)
                    .help("write it in the last line of the block"),
            );
            return None;
        };
        Some(ItemKind::Function { name, arguments, lets, body })
    }
}
