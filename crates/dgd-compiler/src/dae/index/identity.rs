//! Identities: expressions that are constant numbers, or constant in time.
//!
//! C + D − C − D is zero, but no rule of simplification finds that. A rational expression with the same value at
//! several points without a pattern has it everywhere (J. T. Schwartz, J. ACM 27 (1980) 701–717); symbols and
//! operations that are not arithmetic get numbers of their own.

use crate::expr::graph::apply;
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// Seeds of the sequences of numbers.
const SAMPLES: [u64; 3] = [1, 2, 3];
/// Values this close to a whole number, relative to the cancelled terms, count as that number.
const ROUNDING: f64 = 1e-12;

/// Replaces an expression that is identically a whole number by that number.
pub(super) fn tidied(graph: &mut ExprGraph, id: ExprId) -> ExprId {
    if graph.value(id).is_some() {
        return id;
    }
    let values = SAMPLES.map(|sample| sampled(graph, id, sample));
    let whole = values[0].0.round();
    let is_whole = |(value, size): &(f64, f64)| (value - whole).abs() <= ROUNDING * size;
    if values.iter().all(is_whole) { graph.constant(whole) } else { id }
}

/// The values of an expression at all samples.
pub(super) fn samples(graph: &ExprGraph, id: ExprId) -> [f64; 3] {
    SAMPLES.map(|sample| sampled(graph, id, sample).0)
}

/// The value of an expression at a sample, and its magnitude without cancellation.
fn sampled(graph: &ExprGraph, id: ExprId, sample: u64) -> (f64, f64) {
    let mut values: HashMap<ExprId, (f64, f64)> = HashMap::default();
    for (part, node) in graph.listed([id]) {
        let value = match node {
            Node::Constant(_)
            | Node::Negate(_)
            | Node::Add(..)
            | Node::Subtract(..)
            | Node::Multiply(..)
            | Node::Divide(..) => apply(node, |operand| values[&operand].0),
            _ => number(part.index() as u64, sample),
        };
        let size = match node {
            Node::Add(a, b) | Node::Subtract(a, b) => values[&a].1 + values[&b].1,
            Node::Multiply(a, b) => values[&a].1 * values[&b].1,
            Node::Divide(a, b) => values[&a].1 / values[&b].0.abs(),
            Node::Negate(a) => values[&a].1,
            _ => value.abs(),
        };
        values.insert(part, (value, size));
    }
    values[&id]
}

/// A number between ½ and 1½, by SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): differences of such numbers must have
/// no pattern either.
fn number(position: u64, sample: u64) -> f64 {
    let mut bits = (sample << 32 | position).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    0.5 + (bits >> 11) as f64 / (1_u64 << 53) as f64
}

/// Whether an expression is constant in time.
pub(super) fn is_constant(graph: &ExprGraph, id: ExprId) -> bool {
    graph.symbols(id).iter().all(|symbol| matches!(symbol, Symbol::Parameter(_)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cancels_is_found_and_what_is_small_is_kept() {
        let mut g = ExprGraph::default();
        let [c, d] = [0, 1].map(|i| g.symbol(Symbol::Parameter(i)));
        let sum = g.add(c, d);
        let rest = g.subtract(sum, c);
        let zero = g.subtract(rest, d);
        let nothing = g.constant(0.0);
        assert_eq!(tidied(&mut g, zero), nothing);
        let quotient = g.divide(rest, d);
        let one = g.constant(1.0);
        assert_eq!(tidied(&mut g, quotient), one);
        let pico = g.constant(1e-12);
        let small = g.multiply(pico, c);
        assert_eq!(tidied(&mut g, small), small);
        // Differences at equal distances are not equal.
        let [e, f] = [2, 3].map(|i| g.symbol(Symbol::Parameter(i)));
        let (one_way, other_way) = (g.subtract(d, c), g.subtract(f, e));
        let not_zero = g.subtract(one_way, other_way);
        assert_eq!(tidied(&mut g, not_zero), not_zero);
        // sqrt(c²) is c only if c is not negative.
        let square = g.multiply(c, c);
        let root = g.call1("sqrt", square);
        let not_one = g.divide(root, c);
        assert_eq!(tidied(&mut g, not_one), not_one);
    }
}
