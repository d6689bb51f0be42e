//! Expressions.
//!
//! ```text
//! expression  = conjunction ("or" conjunction)*
//! conjunction = negation ("and" negation)*
//! negation    = "not" negation | comparison
//! comparison  = sum (("<" | "<=" | ">" | ">=") sum)?
//! sum         = product (("+" | "-") product)*
//! product     = sign (("*" | "/") sign)*
//! sign        = "-" sign | power
//! power       = operand ("^" sign)?
//! operand     = number unit? | name | name "(" list ")" | name ("[" expression "]")+
//!             | name "(" expression "for" name "in" range ("," name "in" range)* ")"
//!             | "(" expression ")"
//!             | "if" expression "then" expression "else" expression
//! ```
//!
//! Operators are kept on an explicit stack until their right operand is complete. Only brackets, calls and `if`s
//! recurse, so nesting needs little of the call stack. The parser looks one token ahead, and reads nothing twice.

use super::array;
use super::lexical::{RESERVED, TokenKind};
use super::tokens::{CLOSE, Parsed, Tokens, members, word};
use crate::diagnostics::{Code, Diagnostic};
use crate::source::Span;
use crate::syntax::ast::{Comparison, Expr, ExprKind, Factor, Name, Sign, Unit};

/// Description of an operand in messages.
const OPERAND: &str = "an expression";

/// Precedence of operators, loosest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Or,
    And,
    Not,
    Compare,
    Sum,
    Product,
    Sign,
    Power,
}

/// A binary operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operator {
    Or,
    And,
    Compare(Comparison),
    Sum(Sign),
    Product(Factor),
    Power,
}

impl Operator {
    fn level(self) -> Level {
        match self {
            Operator::Or => Level::Or,
            Operator::And => Level::And,
            Operator::Compare(_) => Level::Compare,
            Operator::Sum(_) => Level::Sum,
            Operator::Product(_) => Level::Product,
            Operator::Power => Level::Power,
        }
    }
}

/// The binary operator at the front.
fn operator(input: Tokens<'_>) -> Option<Operator> {
    match input.first()? {
        TokenKind::Less => Some(Operator::Compare(Comparison::Less)),
        TokenKind::LessEqual => Some(Operator::Compare(Comparison::LessEqual)),
        TokenKind::Greater => Some(Operator::Compare(Comparison::Greater)),
        TokenKind::GreaterEqual => Some(Operator::Compare(Comparison::GreaterEqual)),
        TokenKind::Plus => Some(Operator::Sum(Sign::Plus)),
        TokenKind::Minus => Some(Operator::Sum(Sign::Minus)),
        TokenKind::Star => Some(Operator::Product(Factor::Times)),
        TokenKind::Slash => Some(Operator::Product(Factor::Over)),
        TokenKind::Caret => Some(Operator::Power),
        TokenKind::Name => match input.first_text() {
            "or" => Some(Operator::Or),
            "and" => Some(Operator::And),
            _ => None,
        },
        _ => None,
    }
}

/// A node that lacks its last operand.
enum Pending {
    Or(Vec<Expr>),
    And(Vec<Expr>),
    Not(Span),
    Compare(Comparison, Box<Expr>),
    Sum(Vec<(Sign, Expr)>, Sign),
    Product(Vec<(Factor, Expr)>, Factor),
    Negate(Span),
    Power(Box<Expr>),
}

impl Pending {
    fn new(operator: Operator, left: Expr) -> Pending {
        match operator {
            Operator::Or => Pending::Or(vec![left]),
            Operator::And => Pending::And(vec![left]),
            Operator::Compare(comparison) => Pending::Compare(comparison, Box::new(left)),
            Operator::Sum(sign) => Pending::Sum(vec![(Sign::Plus, left)], sign),
            Operator::Product(factor) => Pending::Product(vec![(Factor::Times, left)], factor),
            Operator::Power => Pending::Power(Box::new(left)),
        }
    }

    fn level(&self) -> Level {
        match self {
            Pending::Or(_) => Level::Or,
            Pending::And(_) => Level::And,
            Pending::Not(_) => Level::Not,
            Pending::Compare(..) => Level::Compare,
            Pending::Sum(..) => Level::Sum,
            Pending::Product(..) => Level::Product,
            Pending::Negate(_) => Level::Sign,
            Pending::Power(_) => Level::Power,
        }
    }

    /// Whether its last operand is one level deeper than itself; the others are lists.
    fn nests(&self) -> bool {
        match self {
            Pending::Not(_) | Pending::Negate(_) | Pending::Power(_) => true,
            Pending::Or(_)
            | Pending::And(_)
            | Pending::Compare(..)
            | Pending::Sum(..)
            | Pending::Product(..) => false,
        }
    }

    /// Adds an operand that is followed by an operator of the node's own level. Returns it as an error if the node has
    /// no room for it.
    fn push(&mut self, operand: Expr, operator: Operator) -> Result<(), Expr> {
        match (self, operator) {
            (Pending::Or(all), Operator::Or) | (Pending::And(all), Operator::And) => {
                all.push(operand);
            }
            (Pending::Sum(all, sign), Operator::Sum(next)) => {
                all.push((*sign, operand));
                *sign = next;
            }
            (Pending::Product(all, factor), Operator::Product(next)) => {
                all.push((*factor, operand));
                *factor = next;
            }
            (_, _) => return Err(operand),
        }
        Ok(())
    }

    /// The node with its last operand.
    fn complete(self, last: Expr) -> Expr {
        let end = last.span;
        let (start, kind) = match self {
            Pending::Or(mut all) => {
                all.push(last);
                (all[0].span, ExprKind::Or(all))
            }
            Pending::And(mut all) => {
                all.push(last);
                (all[0].span, ExprKind::And(all))
            }
            Pending::Not(span) => (span, ExprKind::Not(Box::new(last))),
            Pending::Compare(comparison, left) => {
                (left.span, ExprKind::Compare(comparison, left, Box::new(last)))
            }
            Pending::Sum(mut all, sign) => {
                all.push((sign, last));
                (all[0].1.span, ExprKind::Sum(all))
            }
            Pending::Product(mut all, factor) => {
                all.push((factor, last));
                (all[0].1.span, ExprKind::Product(all))
            }
            Pending::Negate(span) => (span, ExprKind::Negate(Box::new(last))),
            Pending::Power(base) => (base.span, ExprKind::Power(base, Box::new(last))),
        };
        Expr { span: start.to(end), kind }
    }
}

/// The longest expression from here.
pub(crate) fn expression(input: Tokens<'_>) -> Parsed<'_, Expr> {
    expression_from(Level::Or, input)
}

/// The longest sum from here, without comparisons and conjunctions.
pub(crate) fn sum(input: Tokens<'_>) -> Parsed<'_, Expr> {
    expression_from(Level::Sum, input)
}

/// An expression of operators with at least this precedence.
fn expression_from(least: Level, input: Tokens<'_>) -> Parsed<'_, Expr> {
    let mut stack: Vec<Pending> = Vec::new();
    let mut rest = input;
    loop {
        rest = signs(&mut stack, rest)?.0;
        let mut left;
        (rest, left) = operand(rest)?;
        let next = operator(rest).filter(|next| next.level() >= least);
        (rest, left) = complete(&mut stack, left, next, rest);
        let Some(next) = next else {
            return Ok((rest, left));
        };
        rest = pend(&mut stack, left, next, rest)?.0;
    }
}

/// Reads the prefixes of an operand: `-`, and `not` where a condition is allowed.
fn signs<'a>(stack: &mut Vec<Pending>, mut rest: Tokens<'a>) -> Parsed<'a, ()> {
    loop {
        let is_condition = stack.last().is_none_or(|last| last.level() <= Level::Not);
        if rest.first() == Some(TokenKind::Minus) {
            stack.push(Pending::Negate(rest.span()));
        } else if rest.starts_with_word("not") && is_condition {
            stack.push(Pending::Not(rest.span()));
        } else {
            return Ok((rest, ()));
        }
        rest = rest.deeper()?.behind_first();
    }
}

/// Completes the nodes that bind more tightly than the next operator.
fn complete<'a>(
    stack: &mut Vec<Pending>,
    mut operand: Expr,
    next: Option<Operator>,
    mut rest: Tokens<'a>,
) -> (Tokens<'a>, Expr) {
    let is_complete = |last: &mut Pending| next.is_none_or(|next| last.level() > next.level());
    while let Some(last) = stack.pop_if(is_complete) {
        if last.nests() {
            rest = rest.shallower();
        }
        operand = last.complete(operand);
    }
    (rest, operand)
}

/// Adds an operator with its left operand: to the list that it continues, or as a new node.
fn pend<'a>(
    stack: &mut Vec<Pending>,
    left: Expr,
    operator: Operator,
    rest: Tokens<'a>,
) -> Parsed<'a, ()> {
    let left = match stack.last_mut() {
        None => left,
        Some(last) => match last.push(left, operator) {
            Ok(()) => return Ok((rest.behind_first(), ())),
            Err(left) => left,
        },
    };
    if let (Some(Pending::Compare(_, first)), Operator::Compare(_)) = (stack.last(), operator) {
        return rest.wrong(
            Diagnostic::new(Code::E109, rest.span(), "comparisons do not chain")
                .label(first.span.to(left.span), "this is a comparison already")
                .help("join two comparisons: `a < b and b < c`"),
        );
    }
    let node = Pending::new(operator, left);
    let rest = if node.nests() { rest.deeper()? } else { rest };
    stack.push(node);
    Ok((rest.behind_first(), ()))
}

fn operand(input: Tokens<'_>) -> Parsed<'_, Expr> {
    match input.first() {
        Some(TokenKind::Number) => number(input),
        Some(TokenKind::Open) => group(input),
        Some(TokenKind::Name) => match input.first_text() {
            "if" => conditional(input),
            "not" => input.wrong(
                Diagnostic::new(Code::E105, input.span(), "`not` cannot stand inside a formula")
                    .help("put the condition into parentheses: `(not a < b)`"),
            ),
            word if RESERVED.contains(&word) => input.expected(OPERAND),
            _ => {
                let (rest, name) = members(input)?;
                match rest.first() {
                    Some(TokenKind::Open) => call(input, rest, name),
                    Some(TokenKind::Index) => array::element(input, rest, name),
                    _ => Ok((rest, Expr { span: name.span, kind: ExprKind::Name(name.text) })),
                }
            }
        },
        Some(_) | None => input.expected(OPERAND),
    }
}

fn number(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let text = input.first_text();
    // The lexer has checked that this is a number within range.
    let Ok(value) = text.parse() else {
        return input.expected(OPERAND);
    };
    let rest = input.behind_first();
    let (rest, unit) = optional_unit(rest)?;
    let kind = ExprKind::Number { value, text: text.to_owned(), unit };
    Ok((rest, Expr { span: input.span_to(&rest), kind }))
}

/// `[…]`, if present. Returns a `Parsed` because it is a parser.
#[expect(clippy::unnecessary_wraps, reason = "combinators take parsers of one type")]
pub(crate) fn optional_unit(input: Tokens<'_>) -> Parsed<'_, Option<Unit>> {
    if input.first() != Some(TokenKind::Unit) {
        return Ok((input, None));
    }
    let (text, span) = (input.first_text(), input.span());
    let text = text[1..text.len() - 1].trim();
    Ok((input.behind_first(), Some(Unit::new(span, text))))
}

fn group(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, inner) = boxed(input.deeper()?.behind_first())?;
    let (rest, _) = close(input.span(), rest.shallower())?;
    Ok((rest, Expr { span: input.span_to(&rest), kind: ExprKind::Group(inner) }))
}

/// A boxed expression, which needs less stack to pass on.
fn boxed(input: Tokens<'_>) -> Parsed<'_, Box<Expr>> {
    let (rest, expr) = expression(input)?;
    Ok((rest, Box::new(expr)))
}

/// The `)` of the `(` at `open`.
pub(crate) fn close(open: Span, input: Tokens<'_>) -> Parsed<'_, Span> {
    match input.first() {
        Some(TokenKind::Close) => Ok((input.behind_first(), input.span())),
        None => input.wrong(
            Diagnostic::new(Code::E115, open, "this `(` is not closed")
                .label(input.span(), "expected `)`"),
        ),
        Some(_) => input.expected(CLOSE),
    }
}

/// `f(a, b)` after the function's name.
fn call<'a>(input: Tokens<'a>, open: Tokens<'a>, function: Name) -> Parsed<'a, Expr> {
    let (rest, mut arguments) = arguments(open.deeper()?.behind_first())?;
    let rest = rest.shallower();
    if rest.starts_with_word("for") && arguments.len() == 1 {
        let body = arguments.remove(0);
        let (rest, kind) = array::reduction(&function, open, body, rest)?;
        return Ok((rest, Expr { span: input.span_to(&rest), kind }));
    }
    let (rest, _) = close(open.span(), rest)?;
    Ok((rest, Expr { span: input.span_to(&rest), kind: ExprKind::Call { function, arguments } }))
}

fn arguments(mut input: Tokens<'_>) -> Parsed<'_, Vec<Expr>> {
    let mut arguments = Vec::new();
    if input.first() == Some(TokenKind::Close) {
        return Ok((input, arguments));
    }
    loop {
        let (rest, argument) = boxed(input)?;
        arguments.push(*argument);
        if rest.first() != Some(TokenKind::Comma) {
            return Ok((rest, arguments));
        }
        input = rest.behind_first();
    }
}

fn conditional(input: Tokens<'_>) -> Parsed<'_, Expr> {
    let (rest, condition) = boxed(input.deeper()?.behind_first())?;
    if rest.first() == Some(TokenKind::Equal) {
        return rest.wrong(
            Diagnostic::new(Code::E109, rest.span(), "numbers are not compared for equality")
                .help("use `<`, `<=`, `>` or `>=`"),
        );
    }
    let (rest, yes) = branch(rest, "then", "`then` or an operator")?;
    let (rest, no) = branch(rest, "else", "`else` or an operator")?;
    let rest = rest.shallower();
    Ok((rest, Expr { span: input.span_to(&rest), kind: ExprKind::If(condition, yes, no) }))
}

/// A keyword and the expression that follows.
fn branch<'a>(
    input: Tokens<'a>,
    keyword: &'static str,
    expected: &'static str,
) -> Parsed<'a, Box<Expr>> {
    boxed(word(keyword, expected)(input)?.0)
}
