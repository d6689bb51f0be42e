//! Items without a block, and the lines of an effect.

use super::ItemReader;
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{EffectClause, EffectHeader, Expr, ItemKind, ModelHeader, Name};
use crate::syntax::parse::item::{clause, header, is_clause, item, setting};
use crate::syntax::parse::lexical::{Token, TokenKind};
use crate::syntax::parse::notation;
use crate::syntax::parse::tokens::{Tokens, name};

impl<'a> ItemReader<'a, '_> {
    /// Reads an item without a block. The `model` or `effect` line and an effect's clauses are stored separately.
    pub(super) fn plain_item(
        &mut self,
        statement: &[Token],
        docs: &[Token],
        is_first: bool,
        nesting: u32,
    ) -> Option<ItemKind> {
        let plain: Vec<Token> =
            statement.iter().filter(|token| token.kind != TokenKind::Doc).copied().collect();
        if plain.iter().any(|token| token.kind == TokenKind::Invalid) {
            return None;
        }
        let input = Tokens::new(&plain, self.text, self.source);
        if input.starts_with_word("model") {
            self.header(input, docs, is_first);
            return None;
        }
        if input.starts_with_word("effect") {
            self.effect_header(input, docs, is_first);
            return None;
        }
        if is_clause(input) {
            self.clause(input, docs, nesting);
            return None;
        }
        if let Some(diagnostic) = notation::foreign(&plain, self.text, self.source, &self.declared)
        {
            self.error(diagnostic);
            return None;
        }
        self.report(item(input)).map(|(_, kind)| kind)
    }

    fn header(&mut self, input: Tokens<'_>, docs: &[Token], is_first: bool) {
        if !is_first {
            let message = "`model` must be the first item of the file";
            let diagnostic = Diagnostic::new(Code::MisplacedModelLine, input.span(), message);
            let diagnostic = match &self.model {
                Some(model) => diagnostic.label(model.name.span, "the model is named here"),
                None => diagnostic,
            };
            self.error(diagnostic);
            return;
        }
        let result = name(input.behind_first()).and_then(|(rest, name)| {
            if rest.is_empty() { Ok((rest, name)) } else { rest.expected("the end of the line") }
        });
        if let Some(name) = self.report(result.map(|(_, name)| name)) {
            self.model = Some(ModelHeader { doc: self.doc_lines(docs), name });
        }
    }

    fn effect_header(&mut self, input: Tokens<'_>, docs: &[Token], is_first: bool) {
        if !is_first {
            let message = "`effect` must be the first item of the file";
            self.error(
                Diagnostic::new(Code::MisplacedModelLine, input.span(), message)
                    .help("an effect stands in a file of its own"),
            );
            return;
        }
        if let Some((_, (name, target))) = self.report(header(input)) {
            let doc = self.doc_lines(docs);
            self.effect = Some(EffectHeader { doc, name, target, clauses: Vec::new() });
        }
    }

    fn clause(&mut self, input: Tokens<'_>, docs: &[Token], nesting: u32) {
        let clause = self.report(clause(input));
        let (doc, keyword) = (self.doc_lines(docs), input.first_text());
        let message = match &mut self.effect {
            Some(_) if nesting > 0 => format!("`{keyword}` cannot stand within a block"),
            Some(effect) => {
                effect.clauses.extend(clause.map(|(_, (span, kind))| EffectClause {
                    span,
                    doc,
                    kind,
                }));
                return;
            }
            None => format!("`{keyword}` belongs in an effect"),
        };
        self.error(
            Diagnostic::new(Code::ClauseOutsideEffect, input.span(), message)
                .help("an effect is a file that begins with `effect NAME on MODEL`"),
        );
    }

    pub(in crate::syntax::parse) fn setting(
        &mut self,
        tokens: &'a [Token],
    ) -> Option<(Name, Expr)> {
        let result = setting(self.input(tokens));
        self.report(result.map(|(_, setting)| setting))
    }
}
