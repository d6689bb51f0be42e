//! Attributes at the end of an item.

use nom::Parser;
use nom::combinator::{cut, map};

use crate::diagnostics::{Code, Diagnostic, Fix, FixEdit, suggestion};
use crate::source::Span;
use crate::syntax::ast::{
    Attribute, AttributeKind, Expr, PriorLaw, TableExtrapolation, TableInterpolation,
};
use crate::syntax::parse::expression::{close, expression};
use crate::syntax::parse::lexical::TokenKind;
use crate::syntax::parse::tokens::{DECIMAL_POINT, ParseResult, Tokens, token, word};
use crate::units::parse_unit;

/// Reads an attribute after its word.
type AttributeRule = for<'a> fn(Tokens<'a>) -> ParseResult<'a, AttributeKind>;

/// Words of attributes, with their rules.
const ATTRIBUTES: &[(&str, AttributeRule)] = &[
    ("in", bounds),
    ("log", |input| Ok((input, AttributeKind::Log))),
    ("fixed", |input| Ok((input, AttributeKind::Fixed))),
    ("guess", |input| Ok((input, AttributeKind::Guess))),
    ("nominal", |input| map(expression, AttributeKind::Nominal).parse(input)),
    ("prior", prior),
    ("hold", |input| Ok((input, AttributeKind::Hold))),
    ("linear", |input| Ok((input, AttributeKind::Linear))),
    ("noise", |input| map(expression, AttributeKind::Noise).parse(input)),
    ("history", |input| map(expression, AttributeKind::History).parse(input)),
    ("exact", |input| Ok((input, AttributeKind::Exact))),
    ("pchip", |input| Ok((input, AttributeKind::Shape(TableInterpolation::Pchip)))),
    ("natural", |input| Ok((input, AttributeKind::Shape(TableInterpolation::Natural)))),
    ("cubic", |input| Ok((input, AttributeKind::Shape(TableInterpolation::Cubic)))),
    ("beyond", beyond),
    ("smooth", |input| map(expression, AttributeKind::Smooth).parse(input)),
];

/// Whether the first word is that of an attribute.
pub(super) fn begins_attribute(input: Tokens<'_>) -> bool {
    ATTRIBUTES.iter().any(|(word, _)| input.starts_with_word(word))
}

/// Attributes to the end of the item: the first without a comma, the others after one.
pub(super) fn attributes<'a>(
    allowed: &[&str],
    what: &str,
    mut input: Tokens<'a>,
) -> ParseResult<'a, Vec<Attribute>> {
    let mut attributes: Vec<(&str, Attribute)> = Vec::new();
    if input.first() == Some(TokenKind::Comma) {
        let behind = input.behind_first();
        if begins_attribute(behind) {
            let word = behind.first_text();
            let message = format!("`{word}` has a comma in front of it");
            return input.wrong(
                Diagnostic::new(Code::UnexpectedToken, input.span(), message)
                    .fix(Fix::safe(vec![FixEdit::replace(input.span(), " ")])),
            );
        }
    }
    if input.first() != Some(TokenKind::Name) || allowed.is_empty() && !begins_attribute(input) {
        return Ok((input, Vec::new()));
    }
    loop {
        let word = input.first_text();
        let (rest, attribute) = attribute(allowed, what, input)?;
        let is_sampling =
            |word: &str| matches!(word, "hold" | "linear" | "pchip" | "natural" | "cubic");
        let same = |earlier: &&(&str, Attribute)| {
            earlier.0 == word || is_sampling(earlier.0) && is_sampling(word)
        };
        if let Some((earlier, first)) = attributes.iter().find(same) {
            let message = if *earlier == word {
                format!("`{word}` is given twice")
            } else {
                format!("`{earlier}` and `{word}` exclude each other")
            };
            return input.wrong(
                Diagnostic::new(Code::RepeatedAttribute, attribute.span, message)
                    .label(first.span, "given here already"),
            );
        }
        attributes.push((word, attribute));
        match rest.first() {
            Some(TokenKind::Comma) => input = rest.behind_first(),
            Some(TokenKind::Name) => return rest.expected("`,` between attributes"),
            Some(_) | None => {
                return Ok((
                    rest,
                    attributes.into_iter().map(|(_, attribute)| attribute).collect(),
                ));
            }
        }
    }
}

fn attribute<'a>(allowed: &[&str], what: &str, input: Tokens<'a>) -> ParseResult<'a, Attribute> {
    let text = input.first_text();
    if input.first() == Some(TokenKind::Number) {
        let message = format!("expected an attribute, found the number `{text}`");
        return input.wrong(
            Diagnostic::new(Code::UnexpectedToken, input.span(), message).help(DECIMAL_POINT),
        );
    }
    if input.first() != Some(TokenKind::Name) {
        return input.expected("an attribute");
    }
    let rule = ATTRIBUTES.iter().find(|(word, _)| *word == text);
    let Some((_, rule)) = rule.filter(|(word, _)| allowed.contains(word)) else {
        let message = match rule {
            Some(_) => format!("{what} has no attribute `{text}`"),
            None => format!("there is no attribute `{text}`"),
        };
        let help = match suggestion(text, allowed.iter().copied()) {
            Some(word) => format!("did you mean `{word}`?"),
            None if parse_unit(text).is_ok() => {
                format!("a unit stands between brackets before the `=`: `[{text}]`")
            }
            None if allowed.is_empty() => format!("{what} has no attributes"),
            None => format!("{what} can have: {}", allowed.join(", ")),
        };
        return input
            .wrong(Diagnostic::new(Code::MisplacedAttribute, input.span(), message).help(help));
    };
    let (rest, kind) = cut(*rule).parse(input.behind_first())?;
    Ok((rest, Attribute { span: input.span_to(&rest), kind }))
}

/// `a .. b`, each end optional.
fn bounds(input: Tokens<'_>) -> ParseResult<'_, AttributeKind> {
    if let Some(pair) = in_brackets(input) {
        return input.wrong(
            Diagnostic::new(Code::UnexpectedToken, input.span(), "bounds stand without brackets")
                .fix(Fix::safe(vec![FixEdit::replace(input.span(), pair)])),
        );
    }
    let (rest, lower) = bound(input)?;
    if rest.first() != Some(TokenKind::Range)
        && rest.first() != Some(TokenKind::Comma)
        && !rest.is_empty()
    {
        let message = format!("bounds have `..` between them, not `{}`", rest.first_text());
        let is_word = rest.first() == Some(TokenKind::Name);
        let upper = if is_word { rest.behind_first() } else { rest }.written();
        return rest.wrong(
            Diagnostic::new(Code::UnexpectedToken, rest.span(), message)
                .help(format!("write `in {} .. {upper}`", input.written_to(&rest))),
        );
    }
    let range = token(TokenKind::Range, "`..` between the bounds");
    let (rest, (_, upper)) = (range, bound).parse(rest)?;
    Ok((rest, AttributeKind::Bounds(lower, upper)))
}

/// `0.1 .. 0.9` for `[0.1, 0.9]`.
fn in_brackets(input: Tokens<'_>) -> Option<String> {
    let inside = input.first_text().strip_prefix('[')?.strip_suffix(']')?;
    let (lower, upper) = inside.split_once(',')?;
    Some(format!("{} .. {}", lower.trim(), upper.trim()))
}

/// A bound, if present.
fn bound(input: Tokens<'_>) -> ParseResult<'_, Option<Expr>> {
    match input.first() {
        Some(TokenKind::Range | TokenKind::Comma) | None => Ok((input, None)),
        Some(_) => map(expression, Some).parse(input),
    }
}

/// `normal(mean, standard deviation)`, or another distribution with two numbers.
fn prior(input: Tokens<'_>) -> ParseResult<'_, AttributeKind> {
    let named = |law: &PriorLaw| word(law.word(), "")(input).ok().map(|(rest, _)| (*law, rest));
    let Some((law, rest)) = PriorLaw::ALL.iter().find_map(named) else {
        let laws = "`normal(mean, standard deviation)`, `lognormal(…)`, `uniform(…)`, `laplace(…)` or `gamma(…)`";
        return word("normal", laws)(input).map(|_| unreachable!("tried before"));
    };
    let second = match law {
        PriorLaw::Normal => "`,` and the standard deviation",
        PriorLaw::LogNormal => "`,` and the standard deviation of the logarithm",
        PriorLaw::Uniform => "`,` and the upper end",
        PriorLaw::Laplace | PriorLaw::Gamma => "`,` and the scale",
    };
    let open = rest.span();
    let (rest, (_, a, _, b)) =
        (token(TokenKind::Open, "`(`"), expression, token(TokenKind::Comma, second), expression)
            .parse(rest)?;
    let rest = close(open, rest)?.0;
    Ok((rest, AttributeKind::Prior(law, a, b)))
}

/// `refuse`, `hold` or `extend`, after `beyond`.
fn beyond(input: Tokens<'_>) -> ParseResult<'_, AttributeKind> {
    let word = input.first_text();
    let entry = TableExtrapolation::ALL.iter().find(|(known, _)| *known == word);
    if let Some((_, beyond)) = entry.filter(|_| input.first() == Some(TokenKind::Name)) {
        return Ok((input.behind_first(), AttributeKind::Beyond(*beyond)));
    }
    let near = suggestion(word, TableExtrapolation::ALL.iter().map(|(word, _)| *word));
    let help = near.map_or_else(
        || {
            "beyond the ends `refuse` ends the run, `hold` goes on with the value there, and `extend` with the slope"
                .to_owned()
        },
        |near| format!("did you mean `{near}`?"),
    );
    let span: Span = input.span();
    let message = "expected `refuse`, `hold` or `extend`";
    input.wrong(Diagnostic::new(Code::UnexpectedToken, span, message).help(help))
}
