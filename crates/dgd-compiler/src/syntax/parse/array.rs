//! Arrays: ranges and indices between brackets, and `for NAME in a..b { … }`.
//!
//! The lexer makes one token of brackets after a name. Here it is split into its own tokens.

use nom::Parser;
use nom::combinator::cut;
use nom::multi::separated_list1;

use super::expression::{close, expression, optional_unit};
use super::item::{attributes, no_value_of_input};
use super::lexical::{Token, TokenKind, tokens_within};
use super::part;
use super::tokens::{OPERATOR, ParseResult, ParseStop, Tokens, name, token, too_deep, word};
use super::{ItemReader, item_length, take_docs};
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::ast::{
    ArrayAxis, ArrayKind, Expr, ExprKind, Item, ItemKind, LoopCounter, Name, NumberRange,
    Reduction, ReductionOperation, WrittenUnit,
};

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

/// The element of an array, `p[i - 1]` or `T[i][j]`, after its name: the brackets are the next tokens.
pub(crate) fn element<'a>(
    input: Tokens<'a>,
    brackets: Tokens<'a>,
    array: Name,
) -> ParseResult<'a, Expr> {
    let mut element = Expr { span: array.span, kind: ExprKind::Name(array.text) };
    let mut rest = brackets;
    while rest.first() == Some(TokenKind::Index) {
        let index;
        (rest, index) = one_index(rest)?;
        let kind = ExprKind::Element(Box::new(element), Box::new(index));
        element = Expr { span: input.span_to(&rest), kind };
    }
    if let Some((moved, _)) = part::index_at_the_end(input) {
        let message = "the index of a part stands at the end";
        let diagnostic = Diagnostic::new(Code::UnexpectedToken, input.span_to(&rest), message);
        return input.wrong(diagnostic.help(format!("write `{moved}`")));
    }
    Ok((rest, element))
}

/// `[i - 1]`
fn one_index(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    let (rest, index) = between_brackets(input.deeper()?, |inside| {
        let (rest, index) = expression(inside)?;
        if rest.is_empty() { Ok((rest, index)) } else { rest.expected(OPERATOR) }
    })?;
    Ok((rest.shallower(), index))
}

/// `[1][j]`, or nothing.
pub(super) fn indices(input: Tokens<'_>) -> ParseResult<'_, Vec<Expr>> {
    all_brackets(input, one_index)
}

/// `[1..N][j in 1..M]`, or nothing.
pub(super) fn axes(input: Tokens<'_>) -> ParseResult<'_, Vec<ArrayAxis>> {
    all_brackets(input, declared_axis)
}

/// Reads all consecutive brackets.
fn all_brackets<'a, T>(
    input: Tokens<'a>,
    read: impl Fn(Tokens<'a>) -> ParseResult<'a, T>,
) -> ParseResult<'a, Vec<T>> {
    let (mut rest, mut all) = (input, Vec::new());
    while rest.first() == Some(TokenKind::Index) {
        let one;
        (rest, one) = read(rest)?;
        all.push(one);
    }
    Ok((rest, all))
}

/// The rest of an array's declaration, from its brackets on.
pub(super) fn declared<'a>(
    declared: ArrayKind,
    name: Name,
    allowed: &[&str],
    what: &'static str,
    input: Tokens<'a>,
) -> ParseResult<'a, ItemKind> {
    let (mut rest, first) = declared_axis(input)?;
    let mut axes = vec![first];
    while rest.first() == Some(TokenKind::Index) && rest.first_text().contains("..") {
        let axis;
        (rest, axis) = declared_axis(rest)?;
        axes.push(axis);
    }
    let (rest, unit) = if rest.first() == Some(TokenKind::Index) {
        // A unit directly after a range.
        let text = rest.first_text();
        let unit = WrittenUnit::new(rest.span(), text[1..text.len() - 1].trim());
        (rest.behind_first(), Some(unit))
    } else {
        optional_unit(rest)?
    };
    let needs_value = matches!(declared, ArrayKind::Constant | ArrayKind::Parameter);
    let (rest, start) = match rest.first() {
        Some(TokenKind::Equal) if declared == ArrayKind::Input => {
            no_value_of_input(rest)?;
            (rest, None)
        }
        Some(TokenKind::Equal) => {
            let (rest, start) = cut(value).parse(rest.behind_first())?;
            (rest, Some(start))
        }
        _ if needs_value => {
            return rest.wrong(
                Diagnostic::new(Code::MissingValue, rest.span(), format!("{what} needs a value")).help(
                    "write `= …` behind it: one value for all elements, or `(…, …)` with one for each",
                ),
            );
        }
        _ => (rest, None),
    };
    let (rest, attributes) = attributes(allowed, what, rest)?;
    Ok((rest, ItemKind::Array { declared, name, axes, unit, start, attributes }))
}

/// Refuses a range after a name that cannot be an array; other brackets may be a unit.
pub(super) fn no_range<'a>(
    input: Tokens<'a>,
    message: &str,
    help: &'static str,
) -> ParseResult<'a, ()> {
    if input.first() != Some(TokenKind::Index) || !input.first_text().contains("..") {
        return Ok((input, ()));
    }
    input.wrong(Diagnostic::new(Code::UnexpectedToken, input.span(), message).help(help))
}

/// The value of an array: an expression, or a parenthesised list with one for each element.
pub(super) fn value(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    if input.first() != Some(TokenKind::Open) || !input.is_list() {
        return expression(input);
    }
    let mut rest = input.deeper()?.behind_first();
    let mut values = Vec::new();
    loop {
        let one;
        (rest, one) = value(rest)?;
        values.push(one);
        if rest.first() != Some(TokenKind::Comma) {
            break;
        }
        rest = rest.behind_first();
    }
    let (rest, _) = close(input.span(), rest.shallower())?;
    Ok((rest, Expr { span: input.span_to(&rest), kind: ExprKind::List(values) }))
}

/// `sum(… for i in 1..N)` after its keyword and its body: `for` is the next token.
pub(crate) fn reduction<'a>(
    word: &Name,
    open: Tokens<'a>,
    body: Expr,
    input: Tokens<'a>,
) -> ParseResult<'a, ExprKind> {
    let Some((_, kind)) = ReductionOperation::ALL.iter().find(|(known, _)| *known == word.text)
    else {
        let known: Vec<&str> = ReductionOperation::ALL.iter().map(|(known, _)| *known).collect();
        let message = format!("`{}` does not go over indices", word.text);
        return input.wrong(
            Diagnostic::new(Code::UnexpectedToken, input.span(), message)
                .help(format!("`for` stands in one of: {}", known.join(", "))),
        );
    };
    let (rest, counters) = counters(input.behind_first())?;
    let (rest, _) = close(open.span(), rest)?;
    let reduction = Reduction { kind: *kind, word: word.span, body, counters };
    Ok((rest, ExprKind::Reduce(Box::new(reduction))))
}

/// A range of a declared array, `[1..N]` or `[i in 1..N]`; its place is that of the brackets.
fn declared_axis(input: Tokens<'_>) -> ParseResult<'_, ArrayAxis> {
    let brackets = input.span();
    between_brackets(input, |inside| {
        let (rest, index) = if inside.second() == Some(TokenKind::Name) {
            let (rest, (index, _)) = (name, word("in", "`in` and a range")).parse(inside)?;
            (rest, Some(index))
        } else {
            (inside, None)
        };
        if !rest.left_has(TokenKind::Range) {
            let message = "an array has a range between its brackets";
            return rest.wrong(
                Diagnostic::new(Code::UnexpectedToken, brackets, message)
                    .help(format!("write `[1..{}]`", rest.written())),
            );
        }
        let (rest, range) = range(rest)?;
        let range = NumberRange { span: brackets, ..range };
        if rest.first() == Some(TokenKind::Comma) {
            let message = "each index has brackets of its own";
            let help = format!(
                "write `[{}][{}]`",
                inside.written_to(&rest),
                rest.behind_first().written()
            );
            return rest
                .wrong(Diagnostic::new(Code::UnexpectedToken, rest.span(), message).help(help));
        }
        if rest.is_empty() {
            Ok((rest, ArrayAxis { index, range }))
        } else {
            rest.expected(OPERATOR)
        }
    })
}

/// `a..b`
fn range(input: Tokens<'_>) -> ParseResult<'_, NumberRange> {
    let dots = token(TokenKind::Range, "`..` and the last index");
    let (rest, (lower, _, upper)) = (expression, dots, expression).parse(input)?;
    Ok((rest, NumberRange { span: input.span_to(&rest), lower, upper }))
}

/// Reads the content of the brackets of the first token.
fn between_brackets<'a, T>(
    input: Tokens<'a>,
    read: impl for<'b> FnOnce(Tokens<'b>) -> ParseResult<'b, T>,
) -> ParseResult<'a, T> {
    let (within, mistakes) = tokens_within(input.span(), input.first_text());
    if let Some(mistake) = mistakes.into_iter().next() {
        return input.wrong(mistake);
    }
    let result = read(input.within(&within)).map(|(_, out)| out).map_err(explained);
    match result {
        Ok(out) => Ok((input.behind_first(), out)),
        Err(diagnostic) => input.wrong(diagnostic),
    }
}

/// The diagnostic for a parser's failure.
fn explained(stop: nom::Err<Box<ParseStop<'_>>>) -> Diagnostic {
    match stop {
        nom::Err::Error(stop) | nom::Err::Failure(stop) => stop.into_diagnostic(),
        nom::Err::Incomplete(_) => unreachable!("an item's tokens are all there"),
    }
}

impl<'a> ItemReader<'a, '_> {
    /// `for i in 1..N { equation mass[i]: … }`
    pub(super) fn loop_(
        &mut self,
        statement: &'a [Token],
        docs: &mut Vec<Token>,
        nesting: u32,
    ) -> Option<ItemKind> {
        let input = self.input(statement);
        if nesting >= super::NESTING {
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
        let moved = part::index_at_the_end(input);
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

/// `i in 1..N, j in 1..M`
fn counters(input: Tokens<'_>) -> ParseResult<'_, Vec<LoopCounter>> {
    let comma = token(TokenKind::Comma, "`,` and another index");
    separated_list1(comma, counter).parse(input)
}

/// `i in 1..N`
fn counter(input: Tokens<'_>) -> ParseResult<'_, LoopCounter> {
    let (rest, (index, _, range)) =
        (name, word("in", "`in` and a range such as `1..N`"), range).parse(input)?;
    Ok((rest, LoopCounter { index, range }))
}
