//! Expressions as text: a listing in which shared, named and long expressions have lines of their own.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::graph::{Comparison, ExprGraph, ExprId, Node, Symbol};
use crate::expr::hash::HashMap;

/// Text longer than this gets a line of its own, so that printing stays linear in the graph.
const LONGEST_INLINE: usize = 160;

/// A listing of expressions.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Listing {
    /// `name = text`, with every name defined before its use.
    pub lines: Vec<(String, String)>,
    /// The text of each root.
    pub roots: Vec<String>,
}

/// How tightly a piece of text binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum TextPrecedence {
    Select,
    Or,
    And,
    Not,
    Compare,
    Sum,
    Product,
    Negate,
    Power,
    Atom,
}

/// Lists expressions. `names` are the model's names of expressions.
pub fn listing(
    graph: &ExprGraph,
    roots: &[ExprId],
    names: &BTreeMap<ExprId, String>,
    symbol: &dyn Fn(Symbol) -> String,
) -> Listing {
    let order = graph.reachable(roots.iter().copied());
    let mut uses: HashMap<ExprId, usize> = HashMap::default();
    for id in &order {
        for operand in graph.node(*id).operands() {
            *uses.entry(operand).or_default() += 1;
        }
    }

    let mut out = Listing::default();
    let mut texts: HashMap<ExprId, (String, TextPrecedence)> = HashMap::default();
    for id in order {
        let (text, tightness) = node_text(graph, id, &texts, symbol);
        let leaf = graph.node(id).operands().next().is_none();
        let own_line = !leaf
            && (names.contains_key(&id)
                || uses.get(&id).copied().unwrap_or(0) > 1
                || text.len() > LONGEST_INLINE);
        if own_line {
            let name = names.get(&id).cloned().unwrap_or_else(|| format!("_{}", out.lines.len()));
            out.lines.push((name.clone(), text));
            texts.insert(id, (name, TextPrecedence::Atom));
        } else {
            texts.insert(id, (text, tightness));
        }
    }
    out.roots = roots.iter().map(|root| texts[root].0.clone()).collect();
    out
}

fn node_text(
    graph: &ExprGraph,
    id: ExprId,
    texts: &HashMap<ExprId, (String, TextPrecedence)>,
    symbol: &dyn Fn(Symbol) -> String,
) -> (String, TextPrecedence) {
    let at_least = |operand: ExprId, least: TextPrecedence| {
        let (text, tightness) = &texts[&operand];
        if *tightness >= least { text.clone() } else { format!("({text})") }
    };
    let infix = |a, operator: &str, b, own: TextPrecedence, right: TextPrecedence| {
        (format!("{}{operator}{}", at_least(a, own), at_least(b, right)), own)
    };
    match graph.node(id) {
        Node::Constant(bits) => {
            let value = f64::from_bits(bits);
            let tightness = if value < 0.0 { TextPrecedence::Negate } else { TextPrecedence::Atom };
            (number(value), tightness)
        }
        Node::Symbol(s) => (symbol(s), TextPrecedence::Atom),
        Node::Negate(a) => {
            (format!("-{}", at_least(a, TextPrecedence::Power)), TextPrecedence::Negate)
        }
        Node::Add(a, b) => infix(a, " + ", b, TextPrecedence::Sum, TextPrecedence::Product),
        Node::Subtract(a, b) => infix(a, " - ", b, TextPrecedence::Sum, TextPrecedence::Product),
        Node::Multiply(a, b) => infix(a, "*", b, TextPrecedence::Product, TextPrecedence::Power),
        Node::Divide(a, b) => infix(a, "/", b, TextPrecedence::Product, TextPrecedence::Power),
        Node::Call1(f, a) => (
            format!("{}({})", f.get().name, at_least(a, TextPrecedence::Select)),
            TextPrecedence::Atom,
        ),
        Node::Curve(curve, a) => {
            let name = &curve.get().name;
            (format!("{name}({})", at_least(a, TextPrecedence::Select)), TextPrecedence::Atom)
        }
        Node::Call2(f, a, b) if f.get().name == "^" => {
            infix(a, "^", b, TextPrecedence::Power, TextPrecedence::Atom)
        }
        Node::Call2(f, a, b) => {
            let (a, b) = (at_least(a, TextPrecedence::Select), at_least(b, TextPrecedence::Select));
            (format!("{}({a}, {b})", f.get().name), TextPrecedence::Atom)
        }
        Node::Delay(x, tau) => {
            let (x, tau) =
                (at_least(x, TextPrecedence::Select), at_least(tau, TextPrecedence::Select));
            (format!("delay({x}, {tau})"), TextPrecedence::Atom)
        }
        Node::Compare(c, a, b) => infix(
            a,
            &format!(" {} ", c.spelling()),
            b,
            TextPrecedence::Compare,
            TextPrecedence::Sum,
        ),
        Node::And(a, b) => infix(a, " and ", b, TextPrecedence::And, TextPrecedence::Not),
        Node::Or(a, b) => infix(a, " or ", b, TextPrecedence::Or, TextPrecedence::And),
        Node::Not(a) => {
            (format!("not {}", at_least(a, TextPrecedence::Compare)), TextPrecedence::Not)
        }
        Node::Select(c, a, b) => {
            let mut text = format!("if {} then ", at_least(c, TextPrecedence::Or));
            let _ = write!(
                text,
                "{} else {}",
                at_least(a, TextPrecedence::Or),
                at_least(b, TextPrecedence::Or)
            );
            (text, TextPrecedence::Select)
        }
    }
}

/// The shortest spelling of a number that reads back as itself.
pub fn number(value: f64) -> String {
    let plain = format!("{value}");
    let scientific = format!("{value:e}");
    if plain.len() <= scientific.len() + 3 { plain } else { scientific }
}

impl Comparison {
    /// Its spelling in the language.
    pub fn spelling(self) -> &'static str {
        match self {
            Comparison::Less => "<",
            Comparison::LessEqual => "<=",
            Comparison::Greater => ">",
            Comparison::GreaterEqual => ">=",
        }
    }
}
