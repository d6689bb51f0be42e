//! Expressions linear in time, α + β time, and the clocks that they drive.
//!
//! α and β depend on parameters and on discrete numbers of conditions on time and of clocks: they change only at ticks.

use super::exact::exact_ticks;
use crate::dae::{Clock, TimeCondition};
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// An expression α + β time; without β if it does not depend on time.
#[derive(Debug, Clone, Copy)]
pub(in crate::dae) struct TimeAffine {
    pub(in crate::dae) alpha: ExprId,
    pub(in crate::dae) beta: Option<ExprId>,
}

impl TimeAffine {
    /// Whether α and β are constant.
    pub(in crate::dae) fn is_fixed(self, graph: &ExprGraph) -> bool {
        std::iter::once(self.alpha).chain(self.beta).all(|id| !is_counted(graph, id))
    }

    pub(in crate::dae) fn minus(self, graph: &mut ExprGraph, other: Self) -> Self {
        let alpha = graph.subtract(self.alpha, other.alpha);
        Self { alpha, beta: of_both(graph, self.beta, other.beta, ExprGraph::subtract) }
    }
}

/// Whether an expression contains a discrete number.
fn is_counted(graph: &ExprGraph, id: ExprId) -> bool {
    graph.symbols(id).iter().any(|symbol| matches!(symbol, Symbol::Discrete(_)))
}

/// The two conditions of the clock that ticks where a line passes each mark, or each whole number if there are no
/// marks.
pub(in crate::dae) fn ticks(
    graph: &mut ExprGraph,
    line: TimeAffine,
    condition: usize,
    marks: Vec<f64>,
) -> ([TimeCondition; 2], Clock) {
    let (one, zero) = (graph.constant(1.0), graph.constant(0.0));
    let beta = line.beta.unwrap_or(zero);
    let quotient = graph.divide(line.alpha, beta);
    let first = graph.negate(quotient);
    let period = graph.divide(one, beta);
    let follows = [first, period].into_iter().any(|time| is_counted(graph, time));
    let exact = match (graph.value(first), graph.value(period)) {
        (Some(first), Some(period)) if marks.is_empty() => exact_ticks(first, period),
        _ => None,
    };
    let times =
        [TimeCondition { at: first, after: line.alpha }, TimeCondition { at: period, after: zero }];
    (times, Clock { condition, automaton: None, marks: marks.into(), follows, exact })
}

/// The lines over time among expressions, operands first.
pub(in crate::dae) struct TimeAffineMap {
    lines: HashMap<ExprId, TimeAffine>,
    /// Discrete numbers from here on are those of conditions on time.
    first: usize,
}

impl TimeAffineMap {
    pub(in crate::dae) fn new(n: usize, first: usize) -> Self {
        Self { lines: HashMap::with_capacity_and_hasher(n, <_>::default()), first }
    }

    pub(in crate::dae) fn affine(&self, id: ExprId) -> Option<TimeAffine> {
        self.lines.get(&id).copied()
    }

    pub(in crate::dae) fn insert(&mut self, id: ExprId, line: TimeAffine) {
        self.lines.insert(id, line);
    }

    /// Stores the line of an expression if its operands are lines.
    pub(in crate::dae) fn read(&mut self, graph: &mut ExprGraph, id: ExprId, node: Node) {
        if let Some(line) = self.line(graph, id, node) {
            self.lines.insert(id, line);
        }
    }

    fn line(&self, graph: &mut ExprGraph, id: ExprId, node: Node) -> Option<TimeAffine> {
        match node {
            Node::Symbol(Symbol::Time) => {
                let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
                return Some(TimeAffine { alpha: zero, beta: Some(one) });
            }
            Node::Symbol(Symbol::Parameter(_)) | Node::Constant(_) => {
                return Some(TimeAffine { alpha: id, beta: None });
            }
            Node::Symbol(Symbol::Discrete(i)) if i as usize >= self.first => {
                return Some(TimeAffine { alpha: id, beta: None });
            }
            Node::Symbol(_) => return None,
            _ => {}
        }
        let operands: Vec<TimeAffine> =
            node.operands().map(|operand| self.affine(operand)).collect::<Option<_>>()?;
        if operands.iter().all(|operand| operand.beta.is_none()) {
            let unchanged = node.operands().zip(&operands).all(|(id, line)| id == line.alpha);
            let alpha = if unchanged {
                id
            } else {
                graph.simplified(node.map(|operand| self.lines[&operand].alpha))
            };
            return Some(TimeAffine { alpha, beta: None });
        }
        let zero = graph.constant(0.0);
        match (node, &operands[..]) {
            (Node::Negate(_), [a]) => {
                let none = TimeAffine { alpha: zero, beta: None };
                Some(none.minus(graph, *a))
            }
            (Node::Add(..), [a, b]) => {
                let beta = of_both(graph, a.beta, b.beta, ExprGraph::add);
                Some(TimeAffine { alpha: graph.add(a.alpha, b.alpha), beta })
            }
            (Node::Subtract(..), [a, b]) => Some(a.minus(graph, *b)),
            (Node::Multiply(..), [a, b] | [b, a]) if b.beta.is_none() => {
                let beta = of_both(graph, a.beta, Some(b.alpha), ExprGraph::multiply);
                Some(TimeAffine { alpha: graph.multiply(a.alpha, b.alpha), beta })
            }
            (Node::Divide(..), [a, b]) if b.beta.is_none() => {
                let beta = of_both(graph, a.beta, Some(b.alpha), ExprGraph::divide);
                Some(TimeAffine { alpha: graph.divide(a.alpha, b.alpha), beta })
            }
            (Node::Select(..), [condition, a, b]) if condition.beta.is_none() => {
                let alpha = graph.select(condition.alpha, a.alpha, b.alpha);
                let [a, b] = [a.beta, b.beta].map(|beta| beta.unwrap_or(zero));
                Some(TimeAffine { alpha, beta: Some(graph.select(condition.alpha, a, b)) })
            }
            _ => None,
        }
    }
}

/// A function of two slopes; a missing slope is zero.
fn of_both(
    graph: &mut ExprGraph,
    a: Option<ExprId>,
    b: Option<ExprId>,
    f: fn(&mut ExprGraph, ExprId, ExprId) -> ExprId,
) -> Option<ExprId> {
    a.or(b)?;
    let zero = graph.constant(0.0);
    Some(f(graph, a.unwrap_or(zero), b.unwrap_or(zero)))
}
