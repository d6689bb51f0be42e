//! Parsing: the text is split into tokens, the tokens into items, and every item is parsed separately.
//!
//! An error in one item therefore does not affect the next, and all errors of a file are reported at once.

mod array;
mod effect;
mod expression;
mod function;
mod item;
pub(super) mod lexical;
mod modes;
mod notation;
mod part;
mod table;
pub(super) mod tokens;
mod unsound;

use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::source::{SourceId, SourceMap, Span};
use crate::syntax::ast::{
    Ast, EffectClause, EffectHeader, Expr, Item, ItemKind, ModelHeader, Name, VariantChoice,
};
use lexical::{Token, TokenKind};
use notation::TokenDeclarations;
use tokens::{NESTING, ParseStop, Tokens, dotted, name, too_deep};

pub(super) use item::is_keyword;
pub use unsound::UnreadableItem;

/// Reads a source.
///
/// The tree represents the text exactly; names and units are not resolved.
pub fn parse(
    source: SourceId,
    sources: &SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<Ast, ErrorReported> {
    // Errors of earlier sources do not concern this one.
    let (ast, _, own) = read(source, sources);
    for diagnostic in own.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    own.check()?;
    Ok(ast)
}

/// Reads the valid items of a source and skips the rest, for tools that continue after an error.
pub fn parse_what_is_sound(source: SourceId, sources: &SourceMap) -> Ast {
    read(source, sources).0
}

/// Reads a source with errors so that further errors in its valid items can be found: declarations replace the items
/// that could not be read, if their heads show what they declare.
pub fn parse_with_holes(
    source: SourceId,
    sources: &SourceMap,
    diagnostics: &mut Diagnostics,
) -> (Ast, Vec<UnreadableItem>) {
    let (mut ast, holes, own) = read(source, sources);
    for diagnostic in own.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    let stand_ins = holes.iter().filter_map(|(_, stand_in)| stand_in.clone());
    ast.items.extend(stand_ins);
    let letters = |span: Span| sources.text(span).chars().filter(|c| c.is_alphanumeric());
    let is_header =
        |hole: &UnreadableItem| letters(hole.span).collect::<String>().contains("model");
    if let Some((hole, _)) = holes.iter().find(|(hole, _)| ast.model.is_none() && is_header(hole)) {
        let text = hole.names.last().cloned().unwrap_or_default();
        ast.model = Some(ModelHeader { doc: Vec::new(), name: Name { text, span: hole.span } });
    }
    (ast, holes.into_iter().map(|(hole, _)| hole).collect())
}

/// An unreadable item, and a possible replacement.
type UnsoundItem = (UnreadableItem, Option<Item>);

/// The valid items, the invalid ones, and the errors.
fn read(source: SourceId, sources: &SourceMap) -> (Ast, Vec<UnsoundItem>, Diagnostics) {
    let mut problems = Diagnostics::default();
    let text = sources.get(source).text.as_str();
    let raw_tokens = lexical::tokens(source, sources, &mut problems);
    let ends = lexical::item_ends(&raw_tokens, text);
    let tokens: Vec<Token> = raw_tokens
        .into_iter()
        .zip(ends)
        .filter(|(token, ends_item)| match token.kind {
            TokenKind::Newline => *ends_item,
            kind => kind != TokenKind::Comment,
        })
        .map(|(token, _)| token)
        .collect();

    let mut reader = ItemReader::new(source, text, &mut problems);
    reader.declared = TokenDeclarations::collect(&tokens, text);
    reader.unclosed = unclosed(&tokens);
    let items = reader.items(&tokens, 0);
    let (model, effect, holes) = (reader.model, reader.effect, reader.holes);
    if items.is_empty() && model.is_none() && effect.is_none() && problems.check().is_ok() {
        let span = Span { source, start: 0, end: 0 };
        problems.error(Diagnostic::new(Code::EmptyFile, span, "there is nothing in this file"));
    }
    (Ast { source, model, effect, items, imports: Vec::new() }, holes, problems)
}

/// Reads `name = value`, a setting from outside a model file.
pub fn parse_setting(
    source: SourceId,
    sources: &SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<(Name, Expr), ErrorReported> {
    let mut problems = Diagnostics::default();
    let text = sources.get(source).text.as_str();
    let mut tokens = lexical::tokens(source, sources, &mut problems);
    tokens.retain(|token| token.kind != TokenKind::Newline);
    let mut reader = ItemReader::new(source, text, &mut problems);
    let setting = reader.setting(&tokens);
    for diagnostic in problems.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    problems.check()?;
    Ok(setting.unwrap_or_else(|| unreachable!("without a setting there is a diagnostic")))
}

/// Reads the items of a file and of its blocks.
struct ItemReader<'a, 'd> {
    source: SourceId,
    text: &'a str,
    model: Option<ModelHeader>,
    effect: Option<EffectHeader>,
    /// Whether an item has been read.
    begun: bool,
    /// Items that could not be read.
    holes: Vec<UnsoundItem>,
    declared: TokenDeclarations<'a>,
    /// Positions of unclosed braces, in order.
    unclosed: Vec<u32>,
    diagnostics: &'d mut Diagnostics,
}

impl<'a, 'd> ItemReader<'a, 'd> {
    fn new(source: SourceId, text: &'a str, diagnostics: &'d mut Diagnostics) -> Self {
        let (model, effect, holes) = (None, None, Vec::new());
        let (declared, unclosed) = (TokenDeclarations::default(), Vec::new());
        ItemReader {
            source,
            text,
            model,
            effect,
            begun: false,
            holes,
            declared,
            unclosed,
            diagnostics,
        }
    }

    /// Reads items until no tokens are left.
    fn items(&mut self, mut tokens: &'a [Token], nesting: u32) -> Vec<Item> {
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

    /// Reads an item without a block. The `model` or `effect` line and an effect's clauses are stored separately.
    fn plain_item(
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
        if effect::is_clause(input) {
            self.clause(input, docs, nesting);
            return None;
        }
        if let Some(diagnostic) = notation::foreign(&plain, self.text, self.source, &self.declared)
        {
            self.error(diagnostic);
            return None;
        }
        self.report(item::item(input)).map(|(_, kind)| kind)
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
        if let Some((_, (name, target))) = self.report(effect::header(input)) {
            let doc = self.doc_lines(docs);
            self.effect = Some(EffectHeader { doc, name, target, clauses: Vec::new() });
        }
    }

    fn clause(&mut self, input: Tokens<'_>, docs: &[Token], nesting: u32) {
        let clause = self.report(effect::clause(input));
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

    /// Splits `KEYWORD NAME { … } …` into the name, the content of the braces and the rest.
    fn named_block(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
        nesting: u32,
    ) -> Option<(Name, &'a [Token], &'a [Token])> {
        let input = self.input(statement);
        if nesting >= NESTING {
            self.error(too_deep(input.span()));
            return None;
        }
        let (rest, name) = self.report(dotted(input.behind_first()))?;
        let (mut inside, behind) = self.block(&statement[statement.len() - rest.len()..])?;
        take_docs(&mut inside, docs);
        Some((name, inside, behind))
    }

    /// Takes the doc comment after a block; `above` are the doc comments at the end of the block that no item follows.
    fn end_of_block(
        &mut self,
        above: &[Token],
        behind: &[Token],
        docs: &mut Vec<Token>,
    ) -> Option<()> {
        if let Some(doc) = above.first() {
            let message = "this doc comment belongs to nothing";
            self.error(Diagnostic::new(Code::DetachedDoc, self.span(*doc), message));
        }
        docs.extend(behind.iter().filter(|token| token.kind == TokenKind::Doc));
        if let Some(extra) = behind.iter().find(|token| token.kind != TokenKind::Doc) {
            let message = "expected the end of the line behind a block";
            self.error(Diagnostic::new(Code::UnexpectedToken, self.span(*extra), message));
            return None;
        }
        Some(())
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

    /// Splits `{ … } …` into the content of the braces and the rest.
    fn block(&mut self, tokens: &'a [Token]) -> Option<(&'a [Token], &'a [Token])> {
        let input = self.input(tokens);
        let brace = tokens::token(TokenKind::OpenBrace, "`{`");
        self.report(brace(input))?;
        let inside = &tokens[1..];
        let mut open = 1_usize;
        for (i, token) in inside.iter().enumerate() {
            match token.kind {
                TokenKind::OpenBrace => open += 1,
                TokenKind::CloseBrace => open -= 1,
                _ => {}
            }
            if open == 0 {
                return Some((&inside[..i], &inside[i + 1..]));
            }
        }
        let message = "this `{` is not closed";
        self.error(Diagnostic::new(Code::UnmatchedBracket, self.span(tokens[0]), message));
        None
    }

    /// The lines of doc comments, without `///` and one blank after it.
    fn doc_lines(&self, docs: &[Token]) -> Vec<String> {
        let line = |token: &Token| {
            let text = &token.text(self.text)[3..];
            text.strip_prefix(' ').unwrap_or(text).trim_end().to_owned()
        };
        docs.iter().map(line).collect()
    }

    fn setting(&mut self, tokens: &'a [Token]) -> Option<(Name, Expr)> {
        let result = item::setting(self.input(tokens));
        self.report(result.map(|(_, setting)| setting))
    }

    fn input(&self, tokens: &'a [Token]) -> Tokens<'a> {
        Tokens::new(tokens, self.text, self.source)
    }

    fn span(&self, token: Token) -> Span {
        token.span(self.source)
    }

    fn error(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.error(diagnostic);
    }

    /// Reports a parser's failure.
    fn report<T>(&mut self, result: Result<T, nom::Err<Box<ParseStop<'_>>>>) -> Option<T> {
        match result {
            Ok(out) => Some(out),
            Err(nom::Err::Error(stop) | nom::Err::Failure(stop)) => {
                self.error(stop.into_diagnostic());
                None
            }
            Err(nom::Err::Incomplete(_)) => unreachable!("an item's tokens are all there"),
        }
    }
}

fn has_block(statement: &[Token]) -> bool {
    statement.iter().any(|token| token.kind == TokenKind::OpenBrace)
}

/// Moves doc comments up to the end of the line.
fn take_docs(tokens: &mut &[Token], docs: &mut Vec<Token>) {
    while let Some((first, rest)) = tokens.split_first()
        && first.kind == TokenKind::Doc
    {
        docs.push(*first);
        *tokens = rest;
    }
}

/// Positions of unclosed braces, in order.
fn unclosed(tokens: &[Token]) -> Vec<u32> {
    let mut open = Vec::new();
    for token in tokens {
        match token.kind {
            TokenKind::OpenBrace => open.push(token.start),
            TokenKind::CloseBrace => drop(open.pop()),
            _ => {}
        }
    }
    open
}

/// Number of tokens of an item, including its block but not its line end; `None` if its block is unclosed.
fn closed_length(tokens: &[Token], unclosed: &[u32]) -> Option<usize> {
    let mut open = 0_usize;
    for (i, token) in tokens.iter().enumerate() {
        match token.kind {
            TokenKind::OpenBrace if unclosed.binary_search(&token.start).is_ok() => return None,
            TokenKind::OpenBrace => open += 1,
            TokenKind::CloseBrace | TokenKind::Newline if open == 0 => return Some(i),
            TokenKind::CloseBrace => open -= 1,
            _ => {}
        }
    }
    Some(tokens.len())
}

/// Number of tokens of an item in a block, where all braces are closed.
fn item_length(tokens: &[Token]) -> usize {
    closed_length(tokens, &[]).unwrap_or(tokens.len())
}
