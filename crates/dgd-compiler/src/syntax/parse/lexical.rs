//! Splits text into tokens.
//!
//! Blanks separate tokens; every other character belongs to a token, including comments and line ends, so that the
//! formatter works on the same tokens as the parser.

use nom::branch::alt;
use nom::bytes::complete::{tag, take_while, take_while1};
use nom::character::complete::{anychar, char, digit1, one_of, satisfy};
use nom::combinator::{map, opt, peek, recognize, value, verify};
use nom::error::ErrorKind;
use nom::sequence::{preceded, terminated};
use nom::{IResult, Parser};

use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::source::{SourceId, SourceMap, Span};

/// The kind of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenKind {
    /// `3.5e3`
    Number,
    /// A name or a word of the language
    Name,
    /// `"…"`
    Text,
    /// `[…]` after a blank or a number
    Unit,
    /// `[…]` directly after a name, or after another index
    Index,
    /// `+`
    Plus,
    /// `-`
    Minus,
    /// `*`
    Star,
    /// `/`
    Slash,
    /// `^`
    Caret,
    /// `=`
    Equal,
    /// `<`
    Less,
    /// `<=`
    LessEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterEqual,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `{`
    OpenBrace,
    /// `}`
    CloseBrace,
    /// `,`
    Comma,
    /// `:`
    Colon,
    /// `'` directly after a name, the notation for derivatives in other languages
    Prime,
    /// `..`
    Range,
    /// `.` between names
    Dot,
    /// `->`
    Arrow,
    /// `/// …`
    Doc,
    /// `# …`
    Comment,
    /// The end of a line
    Newline,
    /// Invalid text that has been reported.
    Invalid,
}

/// A token and its place in the source's text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Token {
    /// Its kind.
    pub kind: TokenKind,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Token {
    /// The token's text.
    pub fn text(self, source: &str) -> &str {
        &source[self.start as usize..self.end as usize]
    }

    /// Its place in this source.
    pub fn span(self, source: SourceId) -> Span {
        Span { source, start: self.start, end: self.end }
    }
}

/// Words of expressions, which cannot be names.
pub(crate) const RESERVED: &[&str] = &["and", "or", "not", "if", "then", "else"];

/// Splits a source into tokens. Unreadable text becomes [`TokenKind::Invalid`] and is reported.
pub fn tokens(source: SourceId, sources: &SourceMap, diagnostics: &mut Diagnostics) -> Vec<Token> {
    let text = sources.get(source).text.as_str();
    if i32::try_from(text.len()).is_err() {
        let span = Span { source, start: 0, end: 0 };
        diagnostics.error(Diagnostic::new(Code::EmptyFile, span, "the file is larger than 2 GiB"));
        return Vec::new();
    }
    cut(source, text.strip_prefix('\u{feff}').unwrap_or(text), text.len(), &mut |mistake| {
        diagnostics.error(mistake);
    })
}

/// Splits the content of an index's brackets into tokens.
pub(crate) fn tokens_within(brackets: Span, text: &str) -> (Vec<Token>, Vec<Diagnostic>) {
    let mut mistakes = Vec::new();
    let inside = text.get(1..text.len().saturating_sub(1)).unwrap_or_default();
    let end = brackets.end as usize - 1;
    let tokens = cut(brackets.source, inside, end, &mut |mistake| mistakes.push(mistake));
    (tokens, mistakes)
}

/// Help for `x''`.
const SECOND_DERIVATIVE: &str = "a second derivative is the first one of a state which equals the first, as in \
     `equation v: der(x) = v`";

/// Splits a text that ends at `end` of its source.
fn cut(source: SourceId, text: &str, end: usize, report: &mut dyn FnMut(Diagnostic)) -> Vec<Token> {
    let mut tokens: Vec<Token> = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start_matches([' ', '\t']);
        if rest.is_empty() {
            return tokens;
        }
        let start = (end - rest.len()) as u32;
        let last = tokens.last().filter(|last| last.end == start).map(|last| last.kind);
        let behind_name = last == Some(TokenKind::Name);
        let has_index = matches!(last, Some(TokenKind::Name | TokenKind::Index));
        let bracket = if has_index { TokenKind::Index } else { TokenKind::Unit };
        let (after, kind) = match alt((sound, brackets(bracket))).parse(rest) {
            Err(_) if behind_name && rest.starts_with('\'') => (&rest[1..], Ok(TokenKind::Prime)),
            Ok((after, kind)) => (after, Ok(kind)),
            Err(_) => unsound(rest),
        };
        let token_end = (end - after.len()) as u32;
        let kind_or_invalid = *kind.as_ref().unwrap_or(&TokenKind::Invalid);
        let token = Token { kind: kind_or_invalid, start, end: token_end };
        if let Err(mistake) = kind {
            let mut diagnostic = Diagnostic::new(mistake.code, token.span(source), mistake.message);
            let is_second = last == Some(TokenKind::Prime) && rest.starts_with('\'');
            let help = if is_second { Some(SECOND_DERIVATIVE) } else { mistake.help };
            diagnostic.help = help.map(Into::into);
            report(diagnostic);
        }
        tokens.push(token);
        rest = after;
    }
}

type LexResult<'a, T = TokenKind> = IResult<&'a str, T, (&'a str, ErrorKind)>;

/// A valid token, apart from unit brackets.
fn sound(input: &str) -> LexResult<'_> {
    alt((
        value(TokenKind::Name, name),
        value(TokenKind::Number, number),
        comment,
        line_end,
        symbol,
        value(TokenKind::Text, text),
    ))
    .parse(input)
}

fn name(input: &str) -> LexResult<'_, &str> {
    recognize((satisfy(is_letter), take_while(is_name_character))).parse(input)
}

/// Letters allowed in names.
///
/// They are unchanged by Unicode normalisation and allowed in Rust identifiers, so that a name is the same identifier
/// in generated code.
fn is_letter(c: char) -> bool {
    c.is_ascii_alphabetic()
        || c.is_alphabetic()
            && matches!(
                c,
                '\u{c0}'..='\u{24f}'       // Latin
                | '\u{386}'..='\u{3ff}'    // Greek
                | '\u{400}'..='\u{481}' | '\u{48a}'..='\u{52f}' // Cyrillic
                | '\u{5d0}'..='\u{5ea}' | '\u{620}'..='\u{64a}' // Hebrew, Arabic
                | '\u{3041}'..='\u{3096}' | '\u{30a1}'..='\u{30fa}' // Kana
                | '\u{4e00}'..='\u{9fff}' | '\u{ac00}'..='\u{d7a3}' // Han, Hangul
            )
}

fn is_name_character(c: char) -> bool {
    c == '_' || c.is_ascii_digit() || is_letter(c)
}

/// Digits, an optional point with digits, an optional exponent; not directly followed by a word.
fn number(input: &str) -> LexResult<'_, &str> {
    verify(
        verify_rest(digits, |rest| {
            let dot = rest.starts_with('.') && !rest.starts_with("..");
            !dot && !rest.starts_with(is_name_character)
        }),
        in_range,
    )
    .parse(input)
}

fn digits(input: &str) -> LexResult<'_, &str> {
    let fraction = (char('.'), digit1);
    let exponent = (one_of("eE"), opt(one_of("+-")), digit1);
    recognize((digit1, opt(fraction), opt(exponent))).parse(input)
}

/// Succeeds if the remainder after a parser satisfies a condition.
fn verify_rest<'a, T>(
    mut parser: impl Parser<&'a str, Output = T, Error = (&'a str, ErrorKind)>,
    condition: impl Fn(&str) -> bool,
) -> impl Parser<&'a str, Output = T, Error = (&'a str, ErrorKind)> {
    move |input| {
        let (rest, out) = parser.parse(input)?;
        if condition(rest) {
            Ok((rest, out))
        } else {
            Err(nom::Err::Error((input, ErrorKind::Verify)))
        }
    }
}

/// Whether a number is neither infinite nor zero by underflow.
fn in_range(number: &str) -> bool {
    let mantissa = number.split(['e', 'E']).next().unwrap_or(number);
    let is_zero = mantissa.chars().all(|c| matches!(c, '0' | '.'));
    number.parse::<f64>().is_ok_and(|value| value.is_finite() && (value != 0.0 || is_zero))
}

/// `/// …` or `# …` up to the end of the line.
fn comment(input: &str) -> LexResult<'_> {
    let line = |c: char| !c.is_control() || c == '\t';
    let kind = alt((value(TokenKind::Doc, tag("///")), value(TokenKind::Comment, tag("#"))));
    verify_rest(terminated(kind, take_while(line)), at_line_end).parse(input)
}

fn at_line_end(rest: &str) -> bool {
    rest.is_empty() || rest.starts_with('\n') || rest.starts_with("\r\n")
}

fn line_end(input: &str) -> LexResult<'_> {
    value(TokenKind::Newline, alt((tag("\n"), tag("\r\n")))).parse(input)
}

fn symbol(input: &str) -> LexResult<'_> {
    let two = alt((
        value(TokenKind::LessEqual, tag("<=")),
        value(TokenKind::GreaterEqual, tag(">=")),
        value(TokenKind::Range, tag("..")),
        value(TokenKind::Arrow, tag("->")),
    ));
    // A point before a digit begins a malformed number.
    let dot = terminated(char('.'), peek(satisfy(is_letter)));
    let one = alt((
        value(TokenKind::Plus, char('+')),
        value(TokenKind::Minus, char('-')),
        value(TokenKind::Star, char('*')),
        value(TokenKind::Slash, char('/')),
        value(TokenKind::Caret, char('^')),
        value(TokenKind::Equal, char('=')),
        value(TokenKind::Less, char('<')),
        value(TokenKind::Greater, char('>')),
        value(TokenKind::Open, char('(')),
        value(TokenKind::Close, char(')')),
        value(TokenKind::OpenBrace, char('{')),
        value(TokenKind::CloseBrace, char('}')),
        value(TokenKind::Comma, char(',')),
        value(TokenKind::Colon, char(':')),
        value(TokenKind::Dot, dot),
    ));
    alt((two, one)).parse(input)
}

fn text(input: &str) -> LexResult<'_, &str> {
    recognize((char('"'), take_while(|c: char| c != '"' && !c.is_control()), char('"')))
        .parse(input)
}

/// `[` up to the `]` that closes it on the same line.
fn brackets<'a>(
    kind: TokenKind,
) -> impl Parser<&'a str, Output = TokenKind, Error = (&'a str, ErrorKind)> {
    move |input: &'a str| {
        let mut open = 0_usize;
        for (at, c) in input.char_indices() {
            match c {
                '[' => open += 1,
                _ if open == 0 || c.is_control() && c != '\t' => break,
                ']' if open == 1 => return Ok((&input[at + 1..], kind)),
                ']' => open -= 1,
                _ => {}
            }
        }
        Err(nom::Err::Error((input, ErrorKind::Char)))
    }
}

/// The reason why a piece of text is not a token.
#[derive(Debug)]
struct LexicalMistake {
    code: Code,
    message: String,
    help: Option<&'static str>,
}

/// Takes a nonempty piece that is not a token, with the reason.
fn unsound(input: &str) -> (&str, Result<TokenKind, LexicalMistake>) {
    let result: LexResult<'_, LexicalMistake> = alt((
        map(malformed_number, |piece: &str| number_mistake(piece)),
        map(unclosed, |piece: &str| {
            let closing = if piece.starts_with('"') { '"' } else { ']' };
            LexicalMistake {
                code: Code::UnclosedText,
                message: format!("no `{closing}` closes this on its line"),
                help: None,
            }
        }),
        map(broken_comment, |_| LexicalMistake {
            code: Code::UnexpectedCharacter,
            message: "control character in a comment".to_owned(),
            help: None,
        }),
        map(unexpected, |piece: &str| LexicalMistake {
            code: Code::UnexpectedCharacter,
            message: match piece.chars().next() {
                Some(c) if c.is_control() => format!("unexpected control character {c:?}"),
                _ => format!("unexpected character `{}`", shortened(piece)),
            },
            help: character_help(piece),
        }),
    ))
    .parse(input);
    match result {
        Ok((rest, mistake)) => (rest, Err(mistake)),
        Err(_) => unreachable!("`unexpected` takes any character"),
    }
}

/// A piece of text short enough for a message.
fn shortened(piece: &str) -> String {
    const LETTERS: usize = 30;
    let mut letters = piece.chars();
    let start: String = letters.by_ref().take(LETTERS).collect();
    if letters.next().is_some() { start + "…" } else { start }
}

/// A malformed number, up to the next blank or operator; `1..2` keeps its range.
fn malformed_number(input: &str) -> LexResult<'_, &str> {
    let begins = input.strip_prefix('.').unwrap_or(input).starts_with(|c: char| c.is_ascii_digit());
    if !begins {
        return Err(nom::Err::Error((input, ErrorKind::Digit)));
    }
    // The well-formed prefix, `1e+999`, then up to the end of the word, `1.2.3m`.
    let sound = digits(input).map_or(0, |(rest, _)| input.len() - rest.len());
    let word = |c: char| is_name_character(c) || c == '.';
    let end = input[sound..].find(|c| !word(c)).map_or(input.len(), |at| sound + at);
    let end = input[1..end].find("..").map_or(end, |at| at + 1);
    Ok((&input[end..], &input[..end]))
}

/// `# …` with forbidden characters.
fn broken_comment(input: &str) -> LexResult<'_, &str> {
    preceded(peek(alt((tag("///"), tag("#")))), take_while1(|c| c != '\n')).parse(input)
}

fn number_mistake(piece: &str) -> LexicalMistake {
    let (mantissa, _) = piece.split_once(['e', 'E']).unwrap_or((piece, ""));
    let letter = piece.find(|c: char| !c.is_ascii_digit() && c != '.');
    let is_exponent = letter.is_some_and(|at| at == mantissa.len() && piece.len() == at + 1);
    let shown = shortened(piece);
    if piece.parse::<f64>().is_ok() && !piece.starts_with('.') && !piece.ends_with('.') {
        return LexicalMistake {
            code: Code::NumberOutOfRange,
            message: format!("`{shown}` is out of the range of numbers"),
            help: Some("numbers reach from about 1e-308 to 1e308"),
        };
    }
    let help = if piece.starts_with('.') {
        "write a zero before the decimal point"
    } else if piece.ends_with('.') {
        "write a zero behind the decimal point, or leave it out"
    } else if is_exponent {
        "write digits behind the `e`"
    } else if letter.is_some() {
        "a number does not run into a word; a product needs `*`"
    } else {
        "a number has one decimal point at most"
    };
    LexicalMistake {
        code: Code::MalformedNumber,
        message: format!("`{shown}` is not a number"),
        help: Some(help),
    }
}

/// `"` or `[` without its end, up to the end of the line.
fn unclosed(input: &str) -> LexResult<'_, &str> {
    preceded(peek(one_of("\"[")), take_while1(|c: char| !c.is_control() || c == '\t')).parse(input)
}

/// A run of characters that begin no token, or a word that begins with one.
fn unexpected(input: &str) -> LexResult<'_, &str> {
    let begins_nothing = |c: char| !c.is_ascii() && !is_letter(c) && !c.is_whitespace();
    let word = (one_of("_°µ"), take_while(|c| begins_nothing(c) || is_name_character(c)));
    let controls = take_while1(|c: char| c.is_control() && !matches!(c, '\n' | '\r' | '\t'));
    alt((recognize(word), controls, take_while1(begins_nothing), recognize(anychar))).parse(input)
}

fn character_help(piece: &str) -> Option<&'static str> {
    Some(match piece.chars().next()? {
        ';' => "an item ends with its line, without a mark",
        '&' => "conditions are joined by `and`",
        '|' => "an absolute value is `abs(x)`; conditions are joined by `or`",
        '!' => "the opposite of a condition is `not (…)`",
        '_' => "a name begins with a letter",
        '\'' | '“' | '”' | '„' => "texts stand between `\"`",
        '−' | '–' | '—' => "write `-`",
        '·' | '×' | '⋅' => "write `*`",
        '÷' => "write `/`",
        '≤' => "write `<=`",
        '≥' => "write `>=`",
        '²' | '³' => "write `^2` or `^3`",
        '%' | '‰' => {
            "units are written in brackets, `5 [%]`; a part of a value is a product, `5 [%]*abs(x)`"
        }
        '°' => "units are written in brackets after a number or a declared name",
        'µ' => "between brackets this is a prefix of units; in a name use the Greek letter μ",
        '\u{2126}' => "in a name use the Greek letter Ω",
        ']' => "no `[` is open here",
        '\r' => "lines end with a line feed, perhaps with a carriage return before it",
        '\u{a0}' | '\u{2000}'..='\u{200b}' | '\u{feff}' => {
            "this looks like a space but is another character"
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::SourceText;

    fn read(text: &str) -> (Vec<(TokenKind, String)>, Vec<String>) {
        let mut sources = SourceMap::default();
        let id = sources.add(SourceText { name: "test".into(), text: text.into() });
        let mut diagnostics = Diagnostics::default();
        let tokens = tokens(id, &sources, &mut diagnostics);
        let mistakes = diagnostics.sorted();
        (
            tokens.iter().map(|token| (token.kind, token.text(text).to_owned())).collect(),
            mistakes
                .iter()
                .map(|mistake| format!("{}: {}", mistake.code, mistake.message))
                .collect(),
        )
    }

    fn texts(text: &str) -> Vec<String> {
        let (tokens, mistakes) = read(text);
        assert!(mistakes.is_empty(), "{text}: {mistakes:?}");
        tokens.into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ranges_and_numbers_do_not_mix() {
        assert_eq!(texts("1..N"), ["1", "..", "N"]);
        assert_eq!(texts("1.5e3..2E-4"), ["1.5e3", "..", "2E-4"]);
        assert_eq!(texts("2-3"), ["2", "-", "3"]);
        assert_eq!(texts("a<=b->c.d"), ["a", "<=", "b", "->", "c", ".", "d"]);
        for (text, code) in [
            (".5", "E102"),
            ("1.", "E102"),
            ("1.2.3", "E102"),
            ("1e", "E102"),
            ("2x", "E102"),
            ("1_000", "E102"),
            ("1e999", "E103"),
            ("1e-999", "E103"),
        ] {
            let (tokens, mistakes) = read(text);
            assert_eq!(tokens, [(TokenKind::Invalid, text.to_owned())]);
            assert!(mistakes[0].starts_with(code), "{text}: {mistakes:?}");
        }
        assert_eq!(texts("0e-999"), ["0e-999"]);
    }

    #[test]
    fn brackets_are_units_behind_blanks_and_numbers() {
        let kinds = |text| read(text).0.iter().map(|(kind, _)| *kind).collect::<Vec<_>>();
        assert_eq!(kinds("h [m]"), [TokenKind::Name, TokenKind::Unit]);
        assert_eq!(kinds("h[i]"), [TokenKind::Name, TokenKind::Index]);
        assert_eq!(kinds("3[%]"), [TokenKind::Number, TokenKind::Unit]);
        assert_eq!(kinds("3 [µm²·°C]"), [TokenKind::Number, TokenKind::Unit]);
        assert_eq!(kinds("q[N[1]]"), [TokenKind::Name, TokenKind::Index]);
        let (tokens, mistakes) = read("h [m\n= 3");
        assert_eq!(tokens[1], (TokenKind::Invalid, "[m".to_owned()));
        assert!(mistakes[0].starts_with("E104"));
    }

    #[test]
    fn names_are_made_of_letters() {
        assert_eq!(texts("Δp_τ x1 größe"), ["Δp_τ", "x1", "größe"]);
        for text in ["_a", "µ", "x²", "\u{2126}", "°C", "%", "\u{24b6}", "e\u{301}"] {
            let (_, mistakes) = read(text);
            assert_eq!(mistakes.len(), 1, "{text}: {mistakes:?}");
            assert!(mistakes[0].starts_with("E101"), "{text}");
        }
    }

    #[test]
    fn every_byte_is_in_a_token_or_blank() {
        let all: String = (0..=0x3000).filter_map(char::from_u32).collect();
        let (tokens, mistakes) = read(&all);
        let joined: String = tokens.into_iter().map(|(_, text)| text).collect();
        assert_eq!(joined, all.replace([' ', '\t'], ""));
        assert!(!mistakes.is_empty());
    }
}
