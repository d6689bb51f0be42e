//! Conditions on time: comparisons that switch at a time which parameters alone determine, and clocks: ⌊x⌋ of an
//! x that time moves, which steps at times that parameters alone determine.
//!
//! Both sides of `time > t_on` depend on time linearly, and otherwise on parameters only, so that
//! left − right = α + β time. It switches at t = −α/β, and a solver can stop there.

use crate::dae::{Clock, TimeCondition};
use crate::expr::graph::Comparison;
use crate::expr::hash::HashMap;
use crate::expr::{ExprId, Graph, Node, Symbol};

/// An expression α + β time; no β where it does not depend on time.
#[derive(Debug, Clone, Copy)]
struct Line {
    alpha: ExprId,
    beta: Option<ExprId>,
}

/// Conditions on time, and what stands for them in expressions.
pub(in crate::dae) struct OnTime {
    pub(in crate::dae) conditions: Vec<TimeCondition>,
    /// Each in the place of two conditions.
    pub(in crate::dae) clocks: Vec<Clock>,
    pub(in crate::dae) replacement: HashMap<ExprId, ExprId>,
}

/// The conditions on time that the roots hold, and what stands for each: whether the discrete
/// number from position `first` on is above one half; for a step its discrete number.
pub(in crate::dae) fn time_conditions(
    graph: &mut Graph,
    roots: impl IntoIterator<Item = ExprId>,
    first: usize,
) -> OnTime {
    let nodes = graph.listed(roots);
    let mut lines: HashMap<ExprId, Line> =
        HashMap::with_capacity_and_hasher(nodes.len(), <_>::default());
    let (mut conditions, mut clocks) = (Vec::new(), Vec::new());
    let mut replacement = HashMap::default();
    for (id, node) in nodes {
        if let Node::Compare(comparison, a, b) = node
            && let (Some(&a), Some(&b)) = (lines.get(&a), lines.get(&b))
            && let Some(condition) = switch(graph, comparison, a, b)
        {
            let position = u32::try_from(first + conditions.len()).unwrap_or(u32::MAX);
            let number = graph.symbol(Symbol::Discrete(position));
            let half = graph.constant(0.5);
            replacement.insert(id, graph.compare(Comparison::Greater, number, half));
            conditions.push(condition);
        } else if let Node::Call1(function, x) = node
            && function.get().name == "floor"
            && let Some(&line) = lines.get(&x)
            && let Some(steps) = steps(graph, line)
        {
            let position = u32::try_from(first + conditions.len()).unwrap_or(u32::MAX);
            replacement.insert(id, graph.symbol(Symbol::Discrete(position)));
            clocks.push(Clock { condition: conditions.len(), automaton: None });
            conditions.extend(steps);
        } else if let Some(line) = line(graph, id, node, &lines) {
            lines.insert(id, line);
        }
    }
    OnTime { conditions, clocks, replacement }
}

/// An expression as a line over time, where its operands are lines.
fn line(graph: &mut Graph, id: ExprId, node: Node, lines: &HashMap<ExprId, Line>) -> Option<Line> {
    match node {
        Node::Symbol(Symbol::Time) => {
            let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
            return Some(Line { alpha: zero, beta: Some(one) });
        }
        Node::Symbol(Symbol::Parameter(_)) | Node::Constant(_) => {
            return Some(Line { alpha: id, beta: None });
        }
        Node::Symbol(_) => return None,
        _ => {}
    }
    let operands: Vec<Line> =
        node.operands().map(|operand| lines.get(&operand).copied()).collect::<Option<_>>()?;
    if operands.iter().all(|operand| operand.beta.is_none()) {
        return Some(Line { alpha: id, beta: None });
    }
    let mut both =
        |a: Option<ExprId>, b: Option<ExprId>, f: fn(&mut Graph, ExprId, ExprId) -> ExprId| {
            let zero = graph.constant(0.0);
            f(graph, a.unwrap_or(zero), b.unwrap_or(zero))
        };
    match (node, &operands[..]) {
        (Node::Negate(_), [a]) => {
            let beta = both(None, a.beta, Graph::subtract);
            Some(Line { alpha: both(None, Some(a.alpha), Graph::subtract), beta: Some(beta) })
        }
        (Node::Add(..), [a, b]) => {
            let beta = both(a.beta, b.beta, Graph::add);
            Some(Line { alpha: both(Some(a.alpha), Some(b.alpha), Graph::add), beta: Some(beta) })
        }
        (Node::Subtract(..), [a, b]) => {
            let beta = both(a.beta, b.beta, Graph::subtract);
            let alpha = both(Some(a.alpha), Some(b.alpha), Graph::subtract);
            Some(Line { alpha, beta: Some(beta) })
        }
        (Node::Multiply(..), [a, b] | [b, a]) if b.beta.is_none() => {
            let beta = both(a.beta, Some(b.alpha), Graph::multiply);
            let alpha = both(Some(a.alpha), Some(b.alpha), Graph::multiply);
            Some(Line { alpha, beta: Some(beta) })
        }
        (Node::Divide(..), [a, b]) if b.beta.is_none() => {
            let beta = both(a.beta, Some(b.alpha), Graph::divide);
            let alpha = both(Some(a.alpha), Some(b.alpha), Graph::divide);
            Some(Line { alpha, beta: Some(beta) })
        }
        _ => None,
    }
}

/// When ⌊α + β t⌋ is zero first, or last where β is below zero, and how long it stays the same: at −α/β, for 1/β.
/// `None` if it does not depend on time.
fn steps(graph: &mut Graph, line: Line) -> Option<[TimeCondition; 2]> {
    let beta = line.beta?;
    let (one, zero) = (graph.constant(1.0), graph.constant(0.0));
    let quotient = graph.divide(line.alpha, beta);
    let first = graph.negate(quotient);
    let period = graph.divide(one, beta);
    let first = TimeCondition { at: first, after: line.alpha };
    Some([first, TimeCondition { at: period, after: zero }])
}

/// When a ≷ b switches, and what it is then; `None` if the condition does not depend on time.
///
/// With a − b = α + β t it switches at −α/β. Where β is zero it never does, which counts as having
/// switched before all times.
fn switch(graph: &mut Graph, comparison: Comparison, a: Line, b: Line) -> Option<TimeCondition> {
    let zero = graph.constant(0.0);
    if a.beta.is_none() && b.beta.is_none() {
        return None;
    }
    let alpha = graph.subtract(a.alpha, b.alpha);
    let beta = graph.subtract(a.beta.unwrap_or(zero), b.beta.unwrap_or(zero));
    let truth = |graph: &mut Graph, holds: bool| graph.constant(f64::from(u8::from(holds)));
    let late = matches!(comparison, Comparison::Greater | Comparison::GreaterEqual);
    let (rising, falling) = (truth(graph, late), truth(graph, !late));

    let quotient = graph.divide(alpha, beta);
    let at = graph.negate(quotient);
    let rises = graph.compare(Comparison::Greater, beta, zero);
    let falls = graph.compare(Comparison::Less, beta, zero);
    let moves = graph.simplified(Node::Or(rises, falls));
    let always = graph.constant(f64::NEG_INFINITY);
    let at = graph.select(moves, at, always);
    let (one, still) = (graph.constant(1.0), graph.compare(comparison, alpha, zero));
    let still = graph.select(still, one, zero);
    let falling = graph.select(falls, falling, still);
    let after = graph.select(rises, rising, falling);
    Some(TimeCondition { at, after })
}
