//! Items: declarations, equations, imports. Items that contain others are read in [`super`].

use nom::Parser;
use nom::combinator::{cut, map, opt};
use nom::multi::separated_list1;
use nom::sequence::preceded;

use super::array;
use super::effect;
use super::expression::{close, expression, optional_unit};
use super::lexical::TokenKind;
use super::part::{self, is_binding};
use super::table::{self, table};
use super::tokens::{DECIMAL_POINT, OPERATOR, ParseResult, Tokens, dotted, name, token, word};
use crate::diagnostics::{Code, Diagnostic, Fix, FixEdit, suggestion};
use crate::syntax::ast::{
    ArrayKind, Attribute, AttributeKind, BoundSide, Expr, ExprKind, FormalArgument, ItemKind,
    LocalLet, Name, PriorLaw, StartRule, TableInterpolation, UnknownKind, WrittenUnit,
};
use crate::units::parse_unit;

/// Reads an item after its keyword.
type ItemRule = for<'a> fn(Tokens<'a>) -> ParseResult<'a, ItemKind>;

/// Keywords of items that contain no others, with their rules.
const SIMPLE: &[(&str, ItemRule)] = &[
    ("import", import),
    ("constant", constant),
    ("parameter", parameter),
    ("input", input),
    ("state", |input| unknown(UnknownKind::State, input)),
    ("unknown", |input| unknown(UnknownKind::Unknown, input)),
    ("held", |input| unknown(UnknownKind::Held, input)),
    ("unit", unit),
    ("let", definition),
    ("function", function),
    ("table", table),
    ("equation", equation),
    ("output", output),
    ("part", part::part),
    ("saturate", saturate),
    ("start", start),
    ("size", size),
];

/// Whether a word can begin an item.
pub(crate) fn is_keyword(word: &str) -> bool {
    keywords().any(|keyword| keyword == word) || effect::CLAUSES.contains(&word)
}

fn keywords() -> impl Iterator<Item = &'static str> {
    SIMPLE
        .iter()
        .map(|(keyword, _)| *keyword)
        .chain(["model", "variant", "modes", "when", "every", "effect", "for"])
}

/// Reads an item without a block, from its keyword to its last token.
pub(crate) fn item(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let keyword = input.first_text();
    let (rule, start) = if is_binding(input) {
        (Some(part::binding as ItemRule), input)
    } else {
        let rule = SIMPLE.iter().find(|(simple, _)| *simple == keyword).map(|(_, rule)| *rule);
        (rule, input.behind_first())
    };
    if let Some(rule) = rule {
        let (rest, kind) = cut(rule).parse(start)?;
        if !rest.is_empty() {
            return rest.expected(OPERATOR);
        }
        return Ok((rest, kind));
    }
    input.wrong(no_item(input))
}

/// The reason why no item begins here.
fn no_item(input: Tokens<'_>) -> Diagnostic {
    let text = input.first_text();
    let wrong = |message| Diagnostic::new(Code::NotAnItem, input.span(), message);
    if let Some((element, behind)) = part::index_at_the_end(input) {
        return wrong("the index of a part stands at the end".to_owned())
            .help(format!("write `{element}{behind}`"));
    }
    if input.second() == Some(TokenKind::Colon) && input.left_has(TokenKind::Equal) {
        let fix = Fix::safe(vec![FixEdit::insert_before(input.span(), "equation ".to_owned())]);
        return wrong("an equation begins with `equation`".to_owned()).fix(fix);
    }
    match (input.first(), input.second()) {
        (Some(TokenKind::Name), _) => {
            let diagnostic = wrong(format!("no item begins with `{text}`"));
            match (suggestion(text, keywords()), input.second()) {
                (Some(keyword), _) => diagnostic.help(format!("did you mean `{keyword}`?")),
                (None, Some(TokenKind::Equal)) => diagnostic
                    .help(format!("write `let {text} = …` or `equation LABEL: {text} = …`")),
                (None, _) => {
                    let words: Vec<&str> = keywords().collect();
                    diagnostic.help(format!("items begin with one of: {}", words.join(", ")))
                }
            }
        }
        (Some(TokenKind::Slash), Some(TokenKind::Star)) => {
            wrong("no item begins with `/*`".to_owned()).help("a comment begins with `#`")
        }
        (
            Some(
                TokenKind::Plus
                | TokenKind::Minus
                | TokenKind::Star
                | TokenKind::Slash
                | TokenKind::Caret
                | TokenKind::Comma
                | TokenKind::Equal,
            ),
            _,
        ) => wrong(format!("no item begins with `{text}`"))
            .help(format!("to go on with the line above, leave the `{text}` at its end")),
        _ => wrong(format!("no item begins with `{text}`")),
    }
}

fn import(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let (rest, path_span) = token(TokenKind::Text, "a path such as \"friction.dgd\"")(input)?;
    let quoted = input.first_text();
    let path = quoted[1..quoted.len() - 1].to_owned();
    Ok((rest, ItemKind::Import { path, path_span }))
}

fn declared(input: Tokens<'_>) -> ParseResult<'_, (Name, Option<WrittenUnit>)> {
    (dotted, optional_unit).parse(input)
}

/// `= …`, which is required.
fn value(what: &'static str) -> impl Fn(Tokens<'_>) -> ParseResult<'_, Expr> {
    move |input| match input.first() {
        Some(TokenKind::Equal) => one_value(input.behind_first()),
        None => input.wrong(
            Diagnostic::new(Code::MissingValue, input.span(), format!("{what} needs a value"))
                .help("write `= …` behind it"),
        ),
        Some(_) => input.expected("`=`"),
    }
}

fn optional_value(input: Tokens<'_>) -> ParseResult<'_, Option<Expr>> {
    opt(preceded(token(TokenKind::Equal, "`=`"), cut(one_value))).parse(input)
}

/// The value of a single item, not an array.
fn one_value(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    if input.first() != Some(TokenKind::Open) || !input.is_list() {
        return expression(input);
    }
    let (_, list) = array::value(input)?;
    let count = if let ExprKind::List(values) = &list.kind { values.len() } else { 1 };
    input.wrong(
        Diagnostic::new(Code::UnexpectedToken, list.span, format!("{count} values for one name"))
            .help(format!("an array has a range behind its name: `[1..{count}]`")),
    )
}

/// An array, if one is declared, after its keyword.
fn array_of<'a>(
    declared: ArrayKind,
    allowed: &[&str],
    what: &'static str,
    input: Tokens<'a>,
) -> Option<ParseResult<'a, ItemKind>> {
    let (behind, name) = dotted(input).ok()?;
    (behind.first() == Some(TokenKind::Index))
        .then(|| array::declared(declared, name, allowed, what, behind))
}

fn constant(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    if let Some(array) = array_of(ArrayKind::Constant, &[], "a constant", input) {
        return array;
    }
    let (rest, ((name, unit), value)) = (declared, value("a constant")).parse(input)?;
    let rest = attributes(&[], "a constant", rest)?.0;
    Ok((rest, ItemKind::Constant { name, unit, value }))
}

fn parameter(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let allowed = &["in", "log", "fixed", "nominal", "prior"];
    if let Some(array) = array_of(ArrayKind::Parameter, allowed, "a parameter", input) {
        return array;
    }
    let (rest, ((name, unit), value)) = (declared, value("a parameter")).parse(input)?;
    let (rest, attributes) = attributes(allowed, "a parameter", rest)?;
    Ok((rest, ItemKind::Parameter { name, unit, value, attributes }))
}

fn input(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let allowed = &["hold", "linear"];
    if let Some(array) = array_of(ArrayKind::Input, allowed, "an input", input) {
        return array;
    }
    let (rest, (name, unit)) = declared(input)?;
    no_value_of_input(rest)?;
    let (rest, attributes) = attributes(allowed, "an input", rest)?;
    Ok((rest, ItemKind::Input { name, unit, attributes }))
}

/// Refuses a value for an input, whose values come from the data.
pub(super) fn no_value_of_input(rest: Tokens<'_>) -> ParseResult<'_, ()> {
    if rest.first() == Some(TokenKind::Equal) {
        let message = "an input has no value in the model";
        return rest.wrong(
            Diagnostic::new(Code::UnexpectedToken, rest.span(), message)
                .help("its values come from the data; a `constant` or `parameter` has one"),
        );
    }
    Ok((rest, ()))
}

fn unknown(declared_as: UnknownKind, input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let what = match declared_as {
        UnknownKind::State => "a state",
        UnknownKind::Unknown => "an unknown",
        UnknownKind::Held => "a held value",
    };
    let allowed: &[&str] = match declared_as {
        UnknownKind::State => &["fixed", "nominal", "history", "noise", "guess"],
        UnknownKind::Unknown => &["fixed", "nominal", "history"],
        UnknownKind::Held => &["fixed", "nominal"],
    };
    if let Some(array) = array_of(declared_as.of_elements(), allowed, what, input) {
        return array;
    }
    let (rest, ((name, unit), start)) = (declared, optional_value).parse(input)?;
    let (rest, attributes) = attributes(allowed, what, rest)?;
    Ok((rest, ItemKind::Unknown { declared: declared_as, name, unit, start, attributes }))
}

/// `unit stroke = 0.118 [l]`
fn unit(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let (rest, (name, value)) = (name, value("a unit")).parse(input)?;
    if !matches!(value.kind, ExprKind::Number { .. }) {
        let message = "a unit is a number of another unit";
        return rest.wrong(
            Diagnostic::new(Code::UnexpectedToken, value.span, message)
                .help(format!("write it so: `unit {} = 0.118 [l]`", name.text)),
        );
    }
    let rest = attributes(&[], "a unit", rest)?.0;
    Ok((rest, ItemKind::Unit { name, value }))
}

fn size(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let (rest, (name, value)) = (name, value("a size")).parse(input)?;
    let rest = attributes(&[], "a size", rest)?.0;
    Ok((rest, ItemKind::Size { name, value }))
}

fn definition(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let help = "a `let` for each index stands in a loop: `for i in 1..N { let NAME[i] = … }`";
    array::no_range(dotted(input)?.0, "a `let` can be an array only in a loop", help)?;
    let (rest, ((name, unit), value)) = (declared, value("a `let`")).parse(input)?;
    let rest = attributes(&[], "a `let`", rest)?.0;
    Ok((rest, ItemKind::Let { name, unit, value }))
}

fn function(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let (rest, (name, arguments)) = signature(input)?;
    let (rest, body) = value("a function")(rest)?;
    Ok((rest, ItemKind::Function { name, arguments, lets: Vec::new(), body }))
}

/// `function NAME(arguments) =`, followed by a block.
pub(crate) fn head_of_function(input: Tokens<'_>) -> ParseResult<'_, (Name, Vec<FormalArgument>)> {
    let (rest, head) = signature(input.behind_first())?;
    let rest = token(TokenKind::Equal, "`=` before the block of a function")(rest)?.0;
    if rest.is_empty() { Ok((rest, head)) } else { rest.expected("`{`") }
}

/// `let NAME [unit] = …` within a function.
pub(crate) fn local_let(input: Tokens<'_>) -> ParseResult<'_, LocalLet> {
    let what = "a `let`";
    let (rest, (name, unit)) = (name, optional_unit).parse(input.behind_first())?;
    let (rest, value) = value(what)(rest)?;
    if rest.is_empty() {
        Ok((rest, LocalLet { name, unit, value }))
    } else {
        rest.expected(OPERATOR)
    }
}

/// The last line of a function's block.
pub(crate) fn last_value(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    let (rest, value) = expression(input)?;
    if rest.is_empty() { Ok((rest, value)) } else { rest.expected(OPERATOR) }
}

/// A name and the arguments between parentheses.
pub(super) fn signature(input: Tokens<'_>) -> ParseResult<'_, (Name, Vec<FormalArgument>)> {
    let argument = map((name, optional_unit), |(name, unit)| FormalArgument { name, unit });
    let (open, name) = dotted(input)?;
    let rest = token(TokenKind::Open, "`(` and the arguments")(open)?.0;
    let comma = token(TokenKind::Comma, "`,`");
    let (rest, arguments) = separated_list1(comma, argument).parse(rest)?;
    if rest.first() == Some(TokenKind::Comma) {
        return rest.behind_first().expected("the name of an argument");
    }
    let rest = close(open.span(), rest)?.0;
    Ok((rest, (name, arguments)))
}

fn output(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    if let Some((element, _)) = part::index_at_the_end(input) {
        let message = "the index of a part stands at the end";
        let diagnostic = Diagnostic::new(Code::UnexpectedToken, input.span(), message);
        return input.wrong(diagnostic.help(format!(
            "`output NAME = {element}` is an output of one, and without an index an output of each"
        )));
    }
    let (rest, ((name, unit), value)) = (declared, optional_value).parse(input)?;
    let (rest, attributes) = attributes(&["noise"], "an output", rest)?;
    Ok((rest, ItemKind::Output { name, unit, value, attributes }))
}

/// `name = value` up to the end.
pub(crate) fn setting(input: Tokens<'_>) -> ParseResult<'_, (Name, Expr)> {
    let equal = token(TokenKind::Equal, "`=` behind the name");
    let (mut rest, mut name) = dotted(input)?;
    // An element of an array, `k[2]`.
    while rest.first() == Some(TokenKind::Index) {
        name.text.extend(rest.first_text().chars().filter(|c| !c.is_whitespace()));
        rest = rest.behind_first();
        name.span = input.span_to(&rest);
    }
    let (rest, (_, value)) = (equal, array::value).parse(rest)?;
    if rest.is_empty() {
        Ok((rest, (name, value)))
    } else {
        rest.expected("an operator or the end")
    }
}

/// An equation with its label.
fn labelled(input: Tokens<'_>) -> ParseResult<'_, (Name, Expr, Expr)> {
    let colon = token(TokenKind::Colon, "`:` behind the equation's label");
    let equal = token(TokenKind::Equal, "`=` or an operator");
    let (rest, (label, _, left, _, right)) =
        (dotted, colon, expression, equal, expression).parse(input)?;
    if rest.first() == Some(TokenKind::Equal) {
        let message = "an equation has one `=`";
        return rest.wrong(Diagnostic::new(Code::UnexpectedToken, rest.span(), message));
    }
    Ok((rest, (label, left, right)))
}

fn equation(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let (rest, (label, left, right)) = labelled(input)?;
    let is_attribute = ATTRIBUTES.iter().any(|(word, _)| rest.starts_with_word(word));
    let (rest, attributes) = if is_attribute {
        attributes(&["exact"], "an equation", rest)?
    } else {
        (rest, Vec::new())
    };
    Ok((rest, ItemKind::Equation { label, left, right, attributes }))
}

/// `start steady` or `start equation level: der(h) = 0`
fn start(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    if input.starts_with_word("equation") {
        let (rest, (label, left, right)) = labelled(input.behind_first())?;
        return Ok((rest, ItemKind::Start(StartRule::Equation { label, left, right })));
    }
    let rest = word("steady", "`steady`, or `equation` and what holds at the start")(input)?.0;
    Ok((rest, ItemKind::Start(StartRule::Steady)))
}

/// `saturate x >= e`
fn saturate(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    let (rest, (name, indices)) = (dotted, array::indices).parse(input)?;
    let side = match rest.first() {
        Some(TokenKind::GreaterEqual) => BoundSide::Lower,
        Some(TokenKind::LessEqual) => BoundSide::Upper,
        _ => return rest.expected("`>=` or `<=` and a bound"),
    };
    let (rest, bound) = expression(rest.behind_first())?;
    Ok((rest, ItemKind::Saturate { name, indices, side, bound }))
}

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
    ("beyond", table::beyond),
    ("smooth", |input| map(expression, AttributeKind::Smooth).parse(input)),
];

/// Attributes to the end of the item: the first without a comma, the others after one.
pub(super) fn attributes<'a>(
    allowed: &[&str],
    what: &str,
    mut input: Tokens<'a>,
) -> ParseResult<'a, Vec<Attribute>> {
    let mut attributes: Vec<(&str, Attribute)> = Vec::new();
    if input.first() == Some(TokenKind::Comma) {
        let behind = input.behind_first();
        if ATTRIBUTES.iter().any(|(word, _)| behind.starts_with_word(word)) {
            let word = behind.first_text();
            let message = format!("`{word}` has a comma in front of it");
            return input.wrong(
                Diagnostic::new(Code::UnexpectedToken, input.span(), message)
                    .fix(Fix::safe(vec![FixEdit::replace(input.span(), " ")])),
            );
        }
    }
    let is_attribute = ATTRIBUTES.iter().any(|(word, _)| input.starts_with_word(word));
    if input.first() != Some(TokenKind::Name) || allowed.is_empty() && !is_attribute {
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
