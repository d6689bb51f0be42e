//! Conditions on time: comparisons that switch at a time determined by parameters alone, and clocks: ⌊x⌋ of an x linear
//! in time, which steps at times determined by parameters alone.
//!
//! Both sides of `time > t_on` depend on time linearly, and otherwise on parameters only, so left − right = α + β time.
//! It switches at t = −α/β, and a solver can stop there. If α or β depend on numbers of other clocks, as in `mod(time,
//! 1 [d]) > 6 [h]`, so does this time: it is a clock with one mark, at zero, that follows the others.

use crate::dae::hybrid::lines::{TimeAffine, TimeAffineMap, ticks};
use crate::dae::{Clock, TimeCondition};
use crate::expr::graph::Comparison;
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// Conditions on time, and their replacements in expressions.
pub(in crate::dae) struct OnTime {
    pub(in crate::dae) conditions: Vec<TimeCondition>,
    /// Each replaces two conditions.
    pub(in crate::dae) clocks: Vec<Clock>,
    pub(in crate::dae) replacement: HashMap<ExprId, ExprId>,
}

/// The conditions on time in the roots, and the replacement of each: whether the discrete number from position `first`
/// on is above one half; for a step, its discrete number.
pub(in crate::dae) fn time_conditions(
    graph: &mut ExprGraph,
    roots: impl IntoIterator<Item = ExprId>,
    first: usize,
) -> OnTime {
    let nodes = graph.listed(roots);
    let mut lines = TimeAffineMap::new(nodes.len(), first);
    let (mut conditions, mut clocks) = (Vec::new(), Vec::new());
    let mut replacement = HashMap::default();
    for (id, node) in nodes {
        let position = u32::try_from(first + conditions.len()).unwrap_or(u32::MAX);
        if let Node::Compare(comparison, a, b) = node
            && let (Some(a), Some(b)) = (lines.affine(a), lines.affine(b))
            && (a.beta.is_some() || b.beta.is_some())
        {
            let number = graph.symbol(Symbol::Discrete(position));
            let half = graph.constant(0.5);
            let holds = if a.is_fixed(graph) && b.is_fixed(graph) {
                conditions.push(switch(graph, comparison, a, b));
                graph.compare(Comparison::Greater, number, half)
            } else {
                let (times, clock) = passage(graph, comparison, a, b, conditions.len());
                conditions.extend(times);
                clocks.push(clock);
                let delayed =
                    if is_delayed(comparison) { Comparison::Greater } else { Comparison::Less };
                graph.compare(delayed, number, half)
            };
            replacement.insert(id, holds);
            lines.insert(id, TimeAffine { alpha: holds, beta: None });
        } else if let Node::Call1(function, x) = node
            && function.get().name == "floor"
            && let Some(line) = lines.affine(x)
            && line.beta.is_some()
        {
            let (times, clock) = ticks(graph, line, conditions.len(), Vec::new());
            conditions.extend(times);
            clocks.push(clock);
            let number = graph.symbol(Symbol::Discrete(position));
            replacement.insert(id, number);
            lines.insert(id, TimeAffine { alpha: number, beta: None });
        } else {
            lines.read(graph, id, node);
        }
    }
    OnTime { conditions, clocks, replacement }
}

/// Whether a comparison holds above its threshold.
fn is_delayed(comparison: Comparison) -> bool {
    matches!(comparison, Comparison::Greater | Comparison::GreaterEqual)
}

/// The clock with a mark where a − b passes zero.
fn passage(
    graph: &mut ExprGraph,
    comparison: Comparison,
    a: TimeAffine,
    b: TimeAffine,
    condition: usize,
) -> ([TimeCondition; 2], Clock) {
    let difference = a.minus(graph, b);
    let (mut times, clock) = ticks(graph, difference, condition, vec![0.0]);
    // If it does not depend on time, the comparison itself decides.
    let zero = graph.constant(0.0);
    let holds = graph.compare(comparison, difference.alpha, zero);
    let [above, below] = [1.0, -1.0].map(|side| graph.constant(side));
    let (yes, no) = if is_delayed(comparison) { (above, below) } else { (below, above) };
    times[0].after = graph.select(holds, yes, no);
    (times, clock)
}

/// The time at which a ≷ b switches, and its value then.
///
/// With a − b = α + β t it switches at −α/β. If β is zero it never does, which counts as having switched before all
/// times.
fn switch(
    graph: &mut ExprGraph,
    comparison: Comparison,
    a: TimeAffine,
    b: TimeAffine,
) -> TimeCondition {
    let zero = graph.constant(0.0);
    let difference = a.minus(graph, b);
    let (alpha, beta) = (difference.alpha, difference.beta.unwrap_or(zero));
    let truth = |graph: &mut ExprGraph, holds: bool| graph.constant(f64::from(u8::from(holds)));
    let is_rising_delayed = is_delayed(comparison);
    let (rising, falling) = (truth(graph, is_rising_delayed), truth(graph, !is_rising_delayed));

    let quotient = graph.divide(alpha, beta);
    let crossing = graph.negate(quotient);
    let rises = graph.compare(Comparison::Greater, beta, zero);
    let falls = graph.compare(Comparison::Less, beta, zero);
    let moves = graph.simplified(Node::Or(rises, falls));
    let always = graph.constant(f64::NEG_INFINITY);
    let time = graph.select(moves, crossing, always);
    let (one, still) = (graph.constant(1.0), graph.compare(comparison, alpha, zero));
    let still = graph.select(still, one, zero);
    let falling = graph.select(falls, falling, still);
    let after = graph.select(rises, rising, falling);
    TimeCondition { at: time, after }
}
