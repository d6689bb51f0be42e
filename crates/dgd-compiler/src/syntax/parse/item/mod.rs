//! Items: declarations, equations, imports. Items that contain others are read in [`super::reader`].

mod array;
mod attribute;
mod effect;
mod function;
mod part;
mod signature;
mod table;
mod values;

use nom::Parser;
use nom::combinator::cut;

use super::expression::expression;
use super::index::{index_at_the_end, indices};
use super::lexical::TokenKind;
use super::tokens::{OPERATOR, ParseResult, Tokens, dotted, name, token, word};
use crate::diagnostics::{Code, Diagnostic, Fix, FixEdit, suggestion};
use crate::syntax::ast::{
    ArrayKind, BoundSide, Expr, ExprKind, ItemKind, Name, StartRule, UnknownKind,
};
use attribute::{attributes, begins_attribute};
use effect::CLAUSES;
use function::function;
use part::is_binding;
use signature::declared;
use table::table;
use values::{array_value, no_value_of_input, optional_value, value};

pub(super) use effect::{clause, header, is_clause};
pub(super) use function::{head_of_function, local_let};
pub(super) use values::last_value;

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
    keywords().any(|keyword| keyword == word) || CLAUSES.contains(&word)
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
    if let Some((element, behind)) = index_at_the_end(input) {
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

fn output(input: Tokens<'_>) -> ParseResult<'_, ItemKind> {
    if let Some((element, _)) = index_at_the_end(input) {
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
    let (rest, (_, value)) = (equal, array_value).parse(rest)?;
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
    let (rest, attributes) = if begins_attribute(rest) {
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
    let (rest, (name, indices)) = (dotted, indices).parse(input)?;
    let side = match rest.first() {
        Some(TokenKind::GreaterEqual) => BoundSide::Lower,
        Some(TokenKind::LessEqual) => BoundSide::Upper,
        _ => return rest.expected("`>=` or `<=` and a bound"),
    };
    let (rest, bound) = expression(rest.behind_first())?;
    Ok((rest, ItemKind::Saturate { name, indices, side, bound }))
}
