//! The parser's input: the tokens of one item, for nom.

use std::iter::{Copied, Enumerate};
use std::slice::Iter;

use nom::error::{ErrorKind, ParseError};
use nom::{Err, IResult, Input, Needed};

use super::lexical::{RESERVED, Token, TokenKind};
use crate::diagnostics::{Code, Diagnostic};
use crate::source::{SourceId, Span};
use crate::syntax::ast::Name;
use crate::units::parse_unit;

/// Limit on the nesting of expressions and blocks.
///
/// It bounds the stack of the parser, and of every later recursion over a tree.
pub(crate) const NESTING: u32 = 128;

/// The remaining tokens of an item.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tokens<'a> {
    left: &'a [Token],
    text: &'a str,
    source: SourceId,
    /// End of the last token read.
    before: u32,
    nesting: u32,
}

/// The reason why a parser stopped.
#[derive(Debug)]
pub(crate) struct ParseStop<'a> {
    /// The position.
    at: Tokens<'a>,
    /// The expected syntax.
    expected: &'static str,
    /// A more specific diagnostic, if there is one.
    diagnostic: Option<Diagnostic>,
}

pub(crate) type ParseResult<'a, T> = IResult<Tokens<'a>, T, Box<ParseStop<'a>>>;

impl<'a> Tokens<'a> {
    /// The tokens of an item in a source with this text.
    pub(crate) fn new(tokens: &'a [Token], text: &'a str, source: SourceId) -> Self {
        let before = tokens.first().map_or(0, |token| token.start);
        Tokens { left: tokens, text, source, before, nesting: 0 }
    }

    /// Tokens that the first one was split into, at its nesting level.
    pub(crate) fn within<'b>(&self, tokens: &'b [Token]) -> Tokens<'b>
    where
        'a: 'b,
    {
        let end = self.span().end.saturating_sub(1);
        let before = tokens.first().map_or(end, |token| token.start);
        Tokens { left: tokens, text: self.text, source: self.source, before, nesting: self.nesting }
    }

    pub(crate) fn first(&self) -> Option<TokenKind> {
        self.left.first().map(|token| token.kind)
    }

    /// The kind of the token after the first.
    pub(crate) fn second(&self) -> Option<TokenKind> {
        self.left.get(1).map(|token| token.kind)
    }

    /// Text of the first token; empty at the end.
    pub(crate) fn first_text(&self) -> &'a str {
        self.left.first().map_or("", |token| token.text(self.text))
    }

    /// Place of the first token, or the place after the last.
    pub(crate) fn span(&self) -> Span {
        match self.left.first() {
            Some(token) => token.span(self.source),
            None => Span { source: self.source, start: self.before, end: self.before },
        }
    }

    /// From the first token of `self` to the last one before `rest`.
    pub(crate) fn span_to(&self, rest: &Tokens<'a>) -> Span {
        let Span { source, start, .. } = self.span();
        Span { source, start, end: rest.before.max(start) }
    }

    /// Whether a digit stands directly before and after the first token.
    fn is_between_digits(&self) -> bool {
        let Span { start, end, .. } = self.span();
        let (before, behind) = (&self.text[..start as usize], &self.text[end as usize..]);
        before.ends_with(|c: char| c.is_ascii_digit())
            && behind.starts_with(|c: char| c.is_ascii_digit())
    }

    /// Whether the first token follows a number and has the name of a unit.
    fn is_unit_of_number(&self) -> bool {
        let before = self.text[..self.span().start as usize].trim_end_matches(' ');
        let word = before.rsplit(|c: char| !(c.is_alphanumeric() || matches!(c, '.' | '_'))).next();
        word.is_some_and(|word| word.parse::<f64>().is_ok())
            && parse_unit(self.first_text()).is_ok()
    }

    /// The text from the first token to the end.
    pub(crate) fn written(&self) -> &'a str {
        let Some(last) = self.left.last() else { return "" };
        let (from, to) = (self.span().start as usize, last.span(self.source).end as usize);
        &self.text[from..to]
    }

    /// The text from the first token of `self` to the last one before `rest`.
    pub(crate) fn written_to(&self, rest: &Tokens<'a>) -> &'a str {
        let Span { start, end, .. } = self.span_to(rest);
        &self.text[start as usize..end as usize]
    }

    /// Whether the parentheses that open here contain a comma, outside of nested ones.
    pub(crate) fn is_list(&self) -> bool {
        let mut open = 0_usize;
        for token in self.left {
            match token.kind {
                TokenKind::Open => open += 1,
                TokenKind::Close if open <= 1 => return false,
                TokenKind::Close => open -= 1,
                TokenKind::Comma if open == 1 => return true,
                _ => {}
            }
        }
        false
    }

    /// Whether one of the tokens is of a kind.
    pub(crate) fn left_has(&self, kind: TokenKind) -> bool {
        self.left.iter().any(|token| token.kind == kind)
    }

    /// Number of remaining tokens.
    pub(crate) fn len(&self) -> usize {
        self.left.len()
    }

    /// Whether the item has been read to its end.
    pub(crate) fn is_empty(&self) -> bool {
        self.left.is_empty()
    }

    /// Whether the first token is this word.
    pub(crate) fn starts_with_word(&self, word: &str) -> bool {
        self.first() == Some(TokenKind::Name) && self.first_text() == word
    }

    /// All tokens but the first.
    pub(crate) fn behind_first(&self) -> Tokens<'a> {
        self.take_from(1.min(self.left.len()))
    }

    /// The tokens one level deeper; an error if that is too deep.
    pub(crate) fn deeper(self) -> Result<Self, Err<Box<ParseStop<'a>>>> {
        if self.nesting == NESTING {
            return self.wrong::<()>(too_deep(self.span())).map(|_| self);
        }
        Ok(Tokens { nesting: self.nesting + 1, ..self })
    }

    /// The tokens one level less deep.
    pub(crate) fn shallower(self) -> Self {
        Tokens { nesting: self.nesting.saturating_sub(1), ..self }
    }

    /// A recoverable failure: another parser may be tried here.
    pub(crate) fn expected<T>(self, expected: &'static str) -> ParseResult<'a, T> {
        Err(Err::Error(Box::new(ParseStop { at: self, expected, diagnostic: None })))
    }

    /// A failure with its own diagnostic, which ends the item.
    pub(crate) fn wrong<T>(self, diagnostic: Diagnostic) -> ParseResult<'a, T> {
        let diagnostic = Some(diagnostic);
        Err(Err::Failure(Box::new(ParseStop { at: self, expected: "", diagnostic })))
    }
}

impl<'a> Input for Tokens<'a> {
    type Item = Token;
    type Iter = Copied<Iter<'a, Token>>;
    type IterIndices = Enumerate<Self::Iter>;

    fn input_len(&self) -> usize {
        self.left.len()
    }

    fn take(&self, index: usize) -> Self {
        Tokens { left: &self.left[..index], ..*self }
    }

    fn take_from(&self, index: usize) -> Self {
        let (taken, left) = self.left.split_at(index);
        Tokens { left, before: taken.last().map_or(self.before, |token| token.end), ..*self }
    }

    fn take_split(&self, index: usize) -> (Self, Self) {
        (self.take_from(index), self.take(index))
    }

    fn position<P: Fn(Token) -> bool>(&self, predicate: P) -> Option<usize> {
        self.left.iter().position(|token| predicate(*token))
    }

    fn iter_elements(&self) -> Self::Iter {
        self.left.iter().copied()
    }

    fn iter_indices(&self) -> Self::IterIndices {
        self.iter_elements().enumerate()
    }

    fn slice_index(&self, count: usize) -> Result<usize, Needed> {
        if count <= self.left.len() { Ok(count) } else { Err(Needed::new(count - self.left.len())) }
    }
}

impl<'a> ParseError<Tokens<'a>> for Box<ParseStop<'a>> {
    fn from_error_kind(at: Tokens<'a>, _: ErrorKind) -> Self {
        Box::new(ParseStop { at, expected: "something else", diagnostic: None })
    }

    fn append(_: Tokens<'a>, _: ErrorKind, other: Self) -> Self {
        other
    }

    /// Of two alternatives, the failure of the one that got further is more informative.
    fn or(self, other: Self) -> Self {
        if self.at.left.len() < other.at.left.len() { self } else { other }
    }
}

impl ParseStop<'_> {
    /// The diagnostic for the user.
    pub(crate) fn into_diagnostic(self) -> Diagnostic {
        if let Some(diagnostic) = self.diagnostic {
            return diagnostic;
        }
        let ParseStop { at, expected, .. } = self;
        let span = at.span();
        let text = at.first_text();
        let token = match at.first() {
            None => "the end of the item".to_owned(),
            Some(TokenKind::Number) => format!("the number `{text}`"),
            Some(TokenKind::Text) => "a text".to_owned(),
            Some(TokenKind::Unit) => {
                return Diagnostic::new(
                    Code::MisplacedUnit,
                    span,
                    format!("no unit can stand here: {text}"),
                )
                .here(format!("expected {expected}"))
                .help("in an expression a unit follows a number, such as `3 [m]`");
            }
            Some(TokenKind::Index) => {
                let message = format!("no index can stand here: {text}");
                return Diagnostic::new(Code::UnexpectedToken, span, message)
                    .here(format!("expected {expected}"))
                    .help("if this is a unit, leave a blank before it");
            }
            Some(TokenKind::Close | TokenKind::CloseBrace) => {
                let message = format!("no bracket is open for this `{text}`");
                return Diagnostic::new(Code::UnmatchedBracket, span, message)
                    .here(format!("expected {expected}"));
            }
            Some(_) => format!("`{text}`"),
        };
        let diagnostic = Diagnostic::new(
            Code::UnexpectedToken,
            span,
            format!("expected {expected}, found {token}"),
        );
        match at.first() {
            Some(TokenKind::Star) if at.text[..span.start as usize].ends_with('*') => {
                diagnostic.help("a power is written `a^b`")
            }
            Some(TokenKind::Slash | TokenKind::Star)
                if at.text[..span.start as usize].ends_with('/') =>
            {
                diagnostic.help("a comment begins with `#`")
            }
            Some(TokenKind::Name) if at.is_unit_of_number() => {
                diagnostic.help(format!("a unit stands between brackets: `[{text}]`"))
            }
            Some(TokenKind::Equal) if at.text[..span.start as usize].ends_with('=') => {
                diagnostic.help("equality is written `=`")
            }
            Some(TokenKind::Name | TokenKind::Number | TokenKind::Open)
                if expected == OPERATOR && !RESERVED.contains(&text) =>
            {
                diagnostic.help("a product needs `*`; every item begins on its own line")
            }
            Some(TokenKind::Comma) if at.is_between_digits() => diagnostic.help(DECIMAL_POINT),
            Some(TokenKind::Name | TokenKind::Number | TokenKind::Open)
                if expected == CLOSE && !RESERVED.contains(&text) =>
            {
                diagnostic.help("a product needs `*`")
            }
            _ => diagnostic,
        }
    }
}

/// Tokens that can follow a complete expression.
pub(crate) const OPERATOR: &str = "an operator or the end of the item";

/// Help for a comma inside a number.
pub(crate) const DECIMAL_POINT: &str = "decimals are written with a point, such as `1.75`";

/// Tokens that can follow a whole expression inside brackets.
pub(crate) const CLOSE: &str = "`)` or an operator";

/// A token of this kind.
pub(crate) fn token<'a>(
    kind: TokenKind,
    expected: &'static str,
) -> impl Fn(Tokens<'a>) -> ParseResult<'a, Span> {
    move |input| {
        if input.first() == Some(kind) {
            Ok((input.behind_first(), input.span()))
        } else {
            input.expected(expected)
        }
    }
}

/// This word.
pub(crate) fn word<'a>(
    word: &'static str,
    expected: &'static str,
) -> impl Fn(Tokens<'a>) -> ParseResult<'a, Span> {
    move |input| {
        if input.starts_with_word(word) {
            Ok((input.behind_first(), input.span()))
        } else {
            input.expected(expected)
        }
    }
}

/// A name that is not a reserved word.
pub(crate) fn name(input: Tokens<'_>) -> ParseResult<'_, Name> {
    let (text, span) = (input.first_text(), input.span());
    if input.first() != Some(TokenKind::Name) {
        return input.expected("a name");
    }
    if RESERVED.contains(&text) || text == "delay" {
        let message = format!("`{text}` is a word of the language and cannot be a name");
        return input.wrong(Diagnostic::new(Code::ReservedWord, span, message));
    }
    Ok((input.behind_first(), Name { text: text.to_owned(), span }))
}

/// A name, or names with points between them: `pump.q`.
pub(crate) fn dotted(input: Tokens<'_>) -> ParseResult<'_, Name> {
    name(input)?;
    members(input)
}

/// The name at the first token, with its members after points, where any word is a name.
pub(crate) fn members(input: Tokens<'_>) -> ParseResult<'_, Name> {
    let mut dotted = Name { text: input.first_text().to_owned(), span: input.span() };
    let mut rest = input.behind_first();
    while rest.first() == Some(TokenKind::Dot) {
        let member = rest.behind_first();
        if member.first() != Some(TokenKind::Name) {
            return member.expected("a name");
        }
        dotted.text.push('.');
        dotted.text.push_str(member.first_text());
        rest = member.behind_first();
        dotted.span = input.span_to(&rest);
    }
    Ok((rest, dotted))
}

pub(crate) fn too_deep(span: Span) -> Diagnostic {
    Diagnostic::new(Code::NestedTooDeep, span, format!("nested more than {NESTING} deep"))
        .help("name a part of it with `let`")
}
