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

use super::index;
use super::lexical::{RESERVED, TokenKind};
use super::tokens::{CLOSE, ParseResult, Tokens, members, word};
use crate::diagnostics::{Code, Diagnostic};
use crate::source::Span;
use crate::syntax::ast::{Comparison, Expr, ExprKind, FactorSide, Name, Sign, WrittenUnit};

/// Description of an operand in messages.
const OPERAND: &str = "an expression";

/// Precedence of operators, loosest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum PrecedenceLevel {
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
enum BinaryOperator {
    Or,
    And,
    Compare(Comparison),
    Sum(Sign),
    Product(FactorSide),
    Power,
}

impl BinaryOperator {
    fn level(self) -> PrecedenceLevel {
        match self {
            BinaryOperator::Or => PrecedenceLevel::Or,
            BinaryOperator::And => PrecedenceLevel::And,
            BinaryOperator::Compare(_) => PrecedenceLevel::Compare,
            BinaryOperator::Sum(_) => PrecedenceLevel::Sum,
            BinaryOperator::Product(_) => PrecedenceLevel::Product,
            BinaryOperator::Power => PrecedenceLevel::Power,
        }
    }
}

/// The binary operator at the front.
fn operator(input: Tokens<'_>) -> Option<BinaryOperator> {
    match input.first()? {
        TokenKind::Less => Some(BinaryOperator::Compare(Comparison::Less)),
        TokenKind::LessEqual => Some(BinaryOperator::Compare(Comparison::LessEqual)),
        TokenKind::Greater => Some(BinaryOperator::Compare(Comparison::Greater)),
        TokenKind::GreaterEqual => Some(BinaryOperator::Compare(Comparison::GreaterEqual)),
        TokenKind::Plus => Some(BinaryOperator::Sum(Sign::Plus)),
        TokenKind::Minus => Some(BinaryOperator::Sum(Sign::Minus)),
        TokenKind::Star => Some(BinaryOperator::Product(FactorSide::Times)),
        TokenKind::Slash => Some(BinaryOperator::Product(FactorSide::Over)),
        TokenKind::Caret => Some(BinaryOperator::Power),
        TokenKind::Name => match input.first_text() {
            "or" => Some(BinaryOperator::Or),
            "and" => Some(BinaryOperator::And),
            _ => None,
        },
        _ => None,
    }
}

/// A node that lacks its last operand.
enum PendingNode {
    Or(Vec<Expr>),
    And(Vec<Expr>),
    Not(Span),
    Compare(Comparison, Box<Expr>),
    Sum(Vec<(Sign, Expr)>, Sign),
    Product(Vec<(FactorSide, Expr)>, FactorSide),
    Negate(Span),
    Power(Box<Expr>),
}

impl PendingNode {
    fn new(operator: BinaryOperator, left: Expr) -> PendingNode {
        match operator {
            BinaryOperator::Or => PendingNode::Or(vec![left]),
            BinaryOperator::And => PendingNode::And(vec![left]),
            BinaryOperator::Compare(comparison) => PendingNode::Compare(comparison, Box::new(left)),
            BinaryOperator::Sum(sign) => PendingNode::Sum(vec![(Sign::Plus, left)], sign),
            BinaryOperator::Product(factor) => {
                PendingNode::Product(vec![(FactorSide::Times, left)], factor)
            }
            BinaryOperator::Power => PendingNode::Power(Box::new(left)),
        }
    }

    fn level(&self) -> PrecedenceLevel {
        match self {
            PendingNode::Or(_) => PrecedenceLevel::Or,
            PendingNode::And(_) => PrecedenceLevel::And,
            PendingNode::Not(_) => PrecedenceLevel::Not,
            PendingNode::Compare(..) => PrecedenceLevel::Compare,
            PendingNode::Sum(..) => PrecedenceLevel::Sum,
            PendingNode::Product(..) => PrecedenceLevel::Product,
            PendingNode::Negate(_) => PrecedenceLevel::Sign,
            PendingNode::Power(_) => PrecedenceLevel::Power,
        }
    }

    /// Whether its last operand is one level deeper than itself; the others are lists.
    fn nests(&self) -> bool {
        match self {
            PendingNode::Not(_) | PendingNode::Negate(_) | PendingNode::Power(_) => true,
            PendingNode::Or(_)
            | PendingNode::And(_)
            | PendingNode::Compare(..)
            | PendingNode::Sum(..)
            | PendingNode::Product(..) => false,
        }
    }

    /// Adds an operand that is followed by an operator of the node's own level. Returns it as an error if the node has
    /// no room for it.
    fn push(&mut self, operand: Expr, operator: BinaryOperator) -> Result<(), Expr> {
        match (self, operator) {
            (PendingNode::Or(all), BinaryOperator::Or)
            | (PendingNode::And(all), BinaryOperator::And) => {
                all.push(operand);
            }
            (PendingNode::Sum(all, sign), BinaryOperator::Sum(next)) => {
                all.push((*sign, operand));
                *sign = next;
            }
            (PendingNode::Product(all, factor), BinaryOperator::Product(next)) => {
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
            PendingNode::Or(mut all) => {
                all.push(last);
                (all[0].span, ExprKind::Or(all))
            }
            PendingNode::And(mut all) => {
                all.push(last);
                (all[0].span, ExprKind::And(all))
            }
            PendingNode::Not(span) => (span, ExprKind::Not(Box::new(last))),
            PendingNode::Compare(comparison, left) => {
                (left.span, ExprKind::Compare(comparison, left, Box::new(last)))
            }
            PendingNode::Sum(mut all, sign) => {
                all.push((sign, last));
                (all[0].1.span, ExprKind::Sum(all))
            }
            PendingNode::Product(mut all, factor) => {
                all.push((factor, last));
                (all[0].1.span, ExprKind::Product(all))
            }
            PendingNode::Negate(span) => (span, ExprKind::Negate(Box::new(last))),
            PendingNode::Power(base) => (base.span, ExprKind::Power(base, Box::new(last))),
        };
        Expr { span: start.join(end), kind }
    }
}

/// The longest expression from here.
pub(crate) fn expression(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    expression_from(PrecedenceLevel::Or, input)
}

/// The longest sum from here, without comparisons and conjunctions.
pub(crate) fn sum(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    expression_from(PrecedenceLevel::Sum, input)
}

/// An expression of operators with at least this precedence.
fn expression_from(least: PrecedenceLevel, input: Tokens<'_>) -> ParseResult<'_, Expr> {
    let mut stack: Vec<PendingNode> = Vec::new();
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
fn signs<'a>(stack: &mut Vec<PendingNode>, mut rest: Tokens<'a>) -> ParseResult<'a, ()> {
    loop {
        let is_condition = stack.last().is_none_or(|last| last.level() <= PrecedenceLevel::Not);
        if rest.first() == Some(TokenKind::Minus) {
            stack.push(PendingNode::Negate(rest.span()));
        } else if rest.starts_with_word("not") && is_condition {
            stack.push(PendingNode::Not(rest.span()));
        } else {
            return Ok((rest, ()));
        }
        rest = rest.deeper()?.behind_first();
    }
}

/// Completes the nodes that bind more tightly than the next operator.
fn complete<'a>(
    stack: &mut Vec<PendingNode>,
    mut operand: Expr,
    next: Option<BinaryOperator>,
    mut rest: Tokens<'a>,
) -> (Tokens<'a>, Expr) {
    let is_complete = |last: &mut PendingNode| next.is_none_or(|next| last.level() > next.level());
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
    stack: &mut Vec<PendingNode>,
    left: Expr,
    operator: BinaryOperator,
    rest: Tokens<'a>,
) -> ParseResult<'a, ()> {
    let left = match stack.last_mut() {
        None => left,
        Some(last) => match last.push(left, operator) {
            Ok(()) => return Ok((rest.behind_first(), ())),
            Err(left) => left,
        },
    };
    if let (Some(PendingNode::Compare(_, first)), BinaryOperator::Compare(_)) =
        (stack.last(), operator)
    {
        return rest.wrong(
            Diagnostic::new(Code::UnreadableComparison, rest.span(), "comparisons do not chain")
                .label(first.span.join(left.span), "this is a comparison already")
                .help("join two comparisons: `a < b and b < c`"),
        );
    }
    let node = PendingNode::new(operator, left);
    let rest = if node.nests() { rest.deeper()? } else { rest };
    stack.push(node);
    Ok((rest.behind_first(), ()))
}

fn operand(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    match input.first() {
        Some(TokenKind::Number) => number(input),
        Some(TokenKind::Open) => group(input),
        Some(TokenKind::Name) => match input.first_text() {
            "if" => conditional(input),
            "not" => input.wrong(
                Diagnostic::new(
                    Code::UnexpectedToken,
                    input.span(),
                    "`not` cannot stand inside a formula",
                )
                .help("put the condition into parentheses: `(not a < b)`"),
            ),
            word if RESERVED.contains(&word) => input.expected(OPERAND),
            _ => {
                let (rest, name) = members(input)?;
                match rest.first() {
                    Some(TokenKind::Open) => call(input, rest, name),
                    Some(TokenKind::Index) => index::element(input, rest, name),
                    _ => Ok((rest, Expr { span: name.span, kind: ExprKind::Name(name.text) })),
                }
            }
        },
        Some(_) | None => input.expected(OPERAND),
    }
}

fn number(input: Tokens<'_>) -> ParseResult<'_, Expr> {
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

/// `[…]`, if present. Returns a `ParseResult` because it is a parser.
#[expect(clippy::unnecessary_wraps, reason = "combinators take parsers of one type")]
pub(crate) fn optional_unit(input: Tokens<'_>) -> ParseResult<'_, Option<WrittenUnit>> {
    if input.first() != Some(TokenKind::Unit) {
        return Ok((input, None));
    }
    let (text, span) = (input.first_text(), input.span());
    let text = text[1..text.len() - 1].trim();
    Ok((input.behind_first(), Some(WrittenUnit::new(span, text))))
}

fn group(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    let (rest, inner) = boxed(input.deeper()?.behind_first())?;
    let (rest, _) = close(input.span(), rest.shallower())?;
    Ok((rest, Expr { span: input.span_to(&rest), kind: ExprKind::Group(inner) }))
}

/// A boxed expression, which needs less stack to pass on.
fn boxed(input: Tokens<'_>) -> ParseResult<'_, Box<Expr>> {
    let (rest, expr) = expression(input)?;
    Ok((rest, Box::new(expr)))
}

/// The `)` of the `(` at `open`.
pub(crate) fn close(open: Span, input: Tokens<'_>) -> ParseResult<'_, Span> {
    match input.first() {
        Some(TokenKind::Close) => Ok((input.behind_first(), input.span())),
        None => input.wrong(
            Diagnostic::new(Code::UnmatchedBracket, open, "this `(` is not closed")
                .label(input.span(), "expected `)`"),
        ),
        Some(_) => input.expected(CLOSE),
    }
}

/// `f(a, b)` after the function's name.
fn call<'a>(input: Tokens<'a>, open: Tokens<'a>, function: Name) -> ParseResult<'a, Expr> {
    let (rest, mut arguments) = arguments(open.deeper()?.behind_first())?;
    let rest = rest.shallower();
    if rest.starts_with_word("for") && arguments.len() == 1 {
        let body = arguments.remove(0);
        let (rest, kind) = index::reduction(&function, open, body, rest)?;
        return Ok((rest, Expr { span: input.span_to(&rest), kind }));
    }
    let (rest, _) = close(open.span(), rest)?;
    Ok((rest, Expr { span: input.span_to(&rest), kind: ExprKind::Call { function, arguments } }))
}

fn arguments(mut input: Tokens<'_>) -> ParseResult<'_, Vec<Expr>> {
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

fn conditional(input: Tokens<'_>) -> ParseResult<'_, Expr> {
    let (rest, condition) = boxed(input.deeper()?.behind_first())?;
    if rest.first() == Some(TokenKind::Equal) {
        return rest.wrong(
            Diagnostic::new(
                Code::UnreadableComparison,
                rest.span(),
                "numbers are not compared for equality",
            )
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
) -> ParseResult<'a, Box<Expr>> {
    boxed(word(keyword, expected)(input)?.0)
}
