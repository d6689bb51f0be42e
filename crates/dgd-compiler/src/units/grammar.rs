//! The text between unit brackets.
//!
//! ```text
//! unit    = power (("*" | "·" | "/") power)*          left to right
//! power   = base ("^" exponent | superscript)?
//! base    = "1" | "(" unit ")" | symbol digits?       digits: m3 is m^3
//! exponent = "-"? digits | "(" "-"? digits ("/" digits)? ")"
//! ```
//!
//! Blanks are allowed between any two of these. [`super::read`] resolves the symbols.

use std::ops::Range;

use nom::branch::alt;
use nom::bytes::complete::{take_while, take_while1};
use nom::character::complete::{char, digit1, one_of, satisfy};
use nom::combinator::{cut, map_opt, not, opt, peek, recognize, value};
use nom::error::{ErrorKind, ParseError};
use nom::sequence::{delimited, preceded, terminated};
use nom::{Err, IResult, Parser};

use super::Exponent;

/// Limit on the nesting of parentheses in a unit.
const NESTING: usize = 16;

/// A symbol to a power.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct UnitFactor {
    /// Its text, without the digits after it.
    pub(crate) symbol: String,
    /// Digits directly after the symbol, which are its power unless the symbol contains them.
    pub(crate) digits: String,
    /// Bytes of symbol and digits within the text.
    pub(crate) range: Range<usize>,
    /// Power of everything in `range`, including that from parentheses and quotients.
    pub(crate) exponent: Exponent,
}

/// A syntax error in a unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MalformedUnit {
    /// The byte at which reading stopped.
    pub(crate) at: usize,
    /// The expected syntax.
    pub(crate) expected: &'static str,
}

/// Splits a unit into its factors. `1` has none.
pub(crate) fn parse(text: &str) -> Result<Vec<UnitFactor>, MalformedUnit> {
    let stopped = |rest: &str, expected| MalformedUnit { at: text.len() - rest.len(), expected };
    let mut factors = Vec::new();
    match (UnitReader { text, nesting: 0 }).unit(text.trim_start_matches(is_blank), &mut factors) {
        Ok((rest, ())) => match rest.chars().next() {
            None => Ok(factors),
            Some(')') => Err(stopped(rest, "no `)`, for none is open")),
            Some('^') => Err(stopped(rest, "no second exponent")),
            Some(_) => Err(stopped(rest, "`*`, `/` or `^`")),
        },
        Err(Err::Error(stop) | Err::Failure(stop)) => Err(stopped(stop.rest, stop.expected)),
        Err(Err::Incomplete(_)) => unreachable!("complete parsers ask for no more"),
    }
}

/// The position at which a parser stopped, and the expected syntax.
#[derive(Debug)]
struct UnitStop<'a> {
    rest: &'a str,
    expected: &'static str,
}

impl<'a> ParseError<&'a str> for UnitStop<'a> {
    fn from_error_kind(rest: &'a str, _: ErrorKind) -> Self {
        UnitStop { rest, expected: "the name of a unit" }
    }

    fn append(_: &'a str, _: ErrorKind, other: Self) -> Self {
        other
    }
}

type UnitParse<'a, T> = IResult<&'a str, T, UnitStop<'a>>;

fn is_blank(c: char) -> bool {
    c == ' ' || c == '\t'
}

/// Skips the blanks after a parser's match.
fn lexeme<'a, T>(
    parser: impl Parser<&'a str, Output = T, Error = UnitStop<'a>>,
) -> impl Parser<&'a str, Output = T, Error = UnitStop<'a>> {
    terminated(parser, take_while(is_blank))
}

/// Commits to a parser, with a description for errors.
fn expect<'a, T>(
    expected: &'static str,
    parser: impl Parser<&'a str, Output = T, Error = UnitStop<'a>>,
) -> impl Parser<&'a str, Output = T, Error = UnitStop<'a>> {
    let mut parser = cut(parser);
    move |input| {
        parser
            .parse(input)
            .map_err(|error: Err<UnitStop<'a>>| error.map(|stop| UnitStop { expected, ..stop }))
    }
}

struct UnitReader<'a> {
    text: &'a str,
    nesting: usize,
}

impl<'a> UnitReader<'a> {
    /// Reads a product and appends its factors.
    fn unit(&self, input: &'a str, factors: &mut Vec<UnitFactor>) -> UnitParse<'a, ()> {
        let mut operator = opt(lexeme(alt((value(1, one_of("*·")), value(-1, char('/'))))));
        let (mut input, ()) = self.power(input, 1, factors)?;
        loop {
            let (rest, sign) = operator.parse(input)?;
            let Some(sign) = sign else {
                return Ok((rest, ()));
            };
            (input, ()) = self.power(rest, sign, factors)?;
        }
    }

    fn power(&self, input: &'a str, sign: i64, factors: &mut Vec<UnitFactor>) -> UnitParse<'a, ()> {
        let first = factors.len();
        let (rest, ()) = self.base(input, factors)?;
        let (rest, power) = opt(lexeme(exponent)).parse(rest)?;

        let too_large = || Err::Failure(UnitStop { rest: input, expected: "a smaller exponent" });
        let power = power.or_else(|| Exponent::new(1, 1)).ok_or_else(too_large)?;
        let sign = Exponent::new(sign, 1).ok_or_else(too_large)?;
        let power = power.times(sign).ok_or_else(too_large)?;
        for factor in &mut factors[first..] {
            factor.exponent = factor.exponent.times(power).ok_or_else(too_large)?;
        }
        Ok((rest, ()))
    }

    fn base(&self, input: &'a str, factors: &mut Vec<UnitFactor>) -> UnitParse<'a, ()> {
        if let (rest, Some(_)) = opt(lexeme(char('('))).parse(input)? {
            if self.nesting == NESTING {
                let expected = "fewer parentheses within one another";
                return Err(Err::Failure(UnitStop { rest: input, expected }));
            }
            let inner = UnitReader { text: self.text, nesting: self.nesting + 1 };
            let (rest, ()) = inner.unit(rest, factors)?;
            let (rest, _) = expect("`)`", lexeme(char(')'))).parse(rest)?;
            return Ok((rest, ()));
        }
        let one = terminated(char('1'), not(peek(one_of("0123456789."))));
        if let (rest, Some(_)) = opt(lexeme(one)).parse(input)? {
            return Ok((rest, ()));
        }
        let more = take_while(|c: char| is_symbol(c) || c.is_ascii_digit());
        let (rest, whole) = recognize((satisfy(is_symbol), more)).parse(input)?;
        let symbol = whole.trim_end_matches(|c: char| c.is_ascii_digit());
        let digits = &whole[symbol.len()..];
        let start = self.text.len() - input.len();
        factors.push(UnitFactor {
            symbol: symbol.to_owned(),
            digits: digits.to_owned(),
            range: start..self.text.len() - rest.len(),
            exponent: Exponent::new(1, 1).unwrap_or(Exponent::ZERO),
        });
        Ok((rest.trim_start_matches(is_blank), ()))
    }
}

/// Letters of all scripts, and the signs that name units.
fn is_symbol(c: char) -> bool {
    c.is_alphabetic() || matches!(c, '%' | '°' | '‰' | '_')
}

/// `^2`, `^-1`, `^(1/2)`, `²` or `⁻¹`.
fn exponent(input: &str) -> UnitParse<'_, Exponent> {
    let integer = || lexeme(map_opt(recognize((opt(char('-')), digit1)), |n: &str| n.parse().ok()));
    let fraction = delimited(
        lexeme(char('(')),
        map_opt((integer(), opt(preceded(lexeme(char('/')), integer()))), |(n, d)| {
            bounded(n, d.unwrap_or(1))
        }),
        char(')'),
    );
    let plain = map_opt(integer(), |n| bounded(n, 1));
    let caret = preceded(
        lexeme(char('^')),
        expect("an exponent such as 2, -1 or (1/2), below 100", alt((fraction, plain))),
    );
    let superscript = map_opt(take_while1(|c| superscript_digit(c).is_some()), |text: &str| {
        let plain: String = text.chars().filter_map(superscript_digit).collect();
        bounded(plain.parse().ok()?, 1)
    });
    alt((caret, superscript)).parse(input)
}

/// Exponents of two digits suffice for every unit, and keep factors finite.
fn bounded(numerator: i64, denominator: i64) -> Option<Exponent> {
    let exponent = Exponent::new(numerator, denominator)?;
    (numerator.abs() < 100 && denominator.abs() < 100).then_some(exponent)
}

fn superscript_digit(c: char) -> Option<char> {
    const SUPERSCRIPTS: [char; 11] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹', '⁻'];
    let digit = SUPERSCRIPTS.iter().position(|&superscript| superscript == c)?;
    "0123456789-".chars().nth(digit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> String {
        match parse(text) {
            Ok(factors) => factors
                .iter()
                .map(|f| format!("{}{}^{}", f.symbol, f.digits, f.exponent))
                .collect::<Vec<_>>()
                .join(" "),
            Err(malformed) => format!("{}: {}", malformed.at, malformed.expected),
        }
    }

    #[test]
    fn products_are_read_from_left_to_right() {
        assert_eq!(read("kg/m*s"), "kg^1 m^-1 s^1");
        assert_eq!(read("kg/(m*s)"), "kg^1 m^-1 s^-1");
        assert_eq!(read("Pa*s^2/m^6"), "Pa^1 s^2 m^-6");
        assert_eq!(read(" m · s ^ -1 "), "m^1 s^-1");
        assert_eq!(read("(m^2/s)^(1/2)"), "m^1 s^(-1/2)");
        assert_eq!(read("m²/s³"), "m^2 s^-3");
        assert_eq!(read("m·s⁻¹"), "m^1 s^-1");
        assert_eq!(read("m3/h"), "m3^1 h^-1");
        assert_eq!(read("1"), "");
        assert_eq!(read("1/s"), "s^-1");
        assert_eq!(read("%"), "%^1");
    }

    #[test]
    fn what_is_malformed_is_placed() {
        for (text, at) in [
            ("", 0),
            ("kg m", 3),
            ("kg/", 3),
            ("(m", 2),
            ("m)", 1),
            ("m^", 2),
            ("m^(1/0)", 2),
            ("m^2^2", 3),
            ("10*m", 0),
            ("m^999", 2),
            ("m^99999999999999999999", 2),
            ("m^0.5", 3),
        ] {
            assert_eq!(parse(text).err().map(|malformed| malformed.at), Some(at), "{text}");
        }
        assert!(parse(&"(".repeat(20_000)).is_err());
        assert!(parse(&"m*".repeat(20_000)).is_err());
    }
}
