//! Whether an expression is smooth, has a corner or jumps where a switch changes.
//!
//! A switch changes on the surface e = 0. Let A and B be the expression on the sides e > 0 and e < 0. It is smooth if A
//! = B and ∂A/∂v = ∂B/∂v on the surface for a symbol v that e depends on: along the surface all derivatives agree where
//! values do. Differences are tested for being identically zero at points of the surface drawn with a fixed seed: at a
//! random point, v is moved until e = 0, and the difference there is compared with those off the surface. `q*abs(q)` is
//! smooth, `abs(q)` has a corner, `sign(q)` jumps.

mod point;
mod sides;

pub(super) use self::point::SymbolSizes;
use self::point::{SamplePoint, SplitMix64};
use self::sides::SurfaceSides;
use crate::expr::graph::Comparison;
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node, Symbol, Tape};

/// Continuity of an expression across a surface, from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Continuity {
    /// Value and slope are continuous.
    Smooth,
    /// The value is continuous, the slope jumps.
    Corner,
    /// The value jumps.
    Jump,
}

/// Value of a switch, by its node, on the side e > 0 of its surface: 1 or −1.
pub(super) type SwitchSigns = HashMap<ExprId, f64>;

/// The root on the side e > 0 (side 1) or e < 0 (side −1).
pub(super) fn on_side(
    graph: &mut ExprGraph,
    root: ExprId,
    signs: &SwitchSigns,
    side: f64,
) -> ExprId {
    let mut built: HashMap<ExprId, ExprId> = HashMap::default();
    for (id, node) in graph.listed([root]) {
        let sign = signs.get(&id).map(|sign| sign * side);
        let here = match (node, sign) {
            (Node::Compare(comparison, ..), Some(sign)) => {
                graph.constant(f64::from(u8::from(is_greater(comparison) == (sign > 0.0))))
            }
            (Node::Call1(function, x), Some(sign)) if function.get().name == "abs" => {
                let x = built[&x];
                if sign > 0.0 { x } else { graph.negate(x) }
            }
            (Node::Call1(..), Some(sign)) => graph.constant(sign),
            _ => graph.simplified(node.map(|operand| built[&operand])),
        };
        built.insert(id, here);
    }
    built[&root]
}

/// Whether a comparison holds where its left side is the larger one.
pub(super) fn is_greater(comparison: Comparison) -> bool {
    matches!(comparison, Comparison::Greater | Comparison::GreaterEqual)
}

/// Continuity of an expression across `surface` = 0. The graph is discarded afterwards.
///
/// Another condition may hide a jump at random points, so points are tried until each condition has been both true and
/// false. A condition that has not is then assumed to take the other value, unless the surface itself decides it, as x
/// = 0 decides x < p for a positive parameter.
pub(super) fn passage(
    graph: &mut ExprGraph,
    sizes: &SymbolSizes,
    root: ExprId,
    surface: ExprId,
    signs: &SwitchSigns,
) -> Continuity {
    let sides = [1.0, -1.0].map(|side| on_side(graph, root, signs, side));
    if sides[0] == sides[1] {
        return Continuity::Smooth;
    }
    let mut comparison = SurfaceSides::new(graph, sizes, surface);
    let mut passage = comparison.compare(sides, true);
    let on_surface = comparison.graph.symbols(surface);
    let unmet: Vec<(ExprId, bool)> = comparison
        .met
        .iter()
        .filter_map(|(id, met)| match met {
            [true, false] => Some((*id, true)),
            [false, true] => Some((*id, false)),
            _ => None,
        })
        .filter(|(id, _)| {
            let symbols = comparison.graph.symbols(*id);
            let is_known = |symbol: &Symbol| {
                matches!(symbol, Symbol::Parameter(_) | Symbol::SweptParameter(..))
            };
            symbols.iter().any(|symbol| !on_surface.contains(symbol) && !is_known(symbol))
        })
        .collect();
    let each = unmet.iter().map(std::slice::from_ref);
    for supposed in std::iter::once(&unmet[..]).chain(each).take_while(|s| !s.is_empty()) {
        let graph = &mut *comparison.graph;
        let mut truths = HashMap::default();
        for (id, truth) in supposed {
            let otherwise = if is_sign(graph.node(*id)) { -1.0 } else { 0.0 };
            truths.insert(*id, graph.constant(if *truth { 1.0 } else { otherwise }));
        }
        let replaced = graph.replace(sides, &truths);
        let sides = sides.map(|side| replaced[&side]);
        if sides[0] != sides[1] {
            passage = passage.max(comparison.compare(sides, false));
        }
        if unmet.len() == 1 {
            break;
        }
    }
    // A value that cannot be evaluated anywhere nearby is left to error control. If time or inputs alone change the
    // condition and no such point was found, as with a short peak of a table, the value may jump there.
    let is_of_unknown =
        |symbol: &Symbol| symbol.is_of_unknown() || matches!(symbol, Symbol::DelayedUnknown(_));
    let moves_by_itself = !on_surface.iter().any(is_of_unknown);
    passage.unwrap_or(if moves_by_itself { Continuity::Jump } else { Continuity::Corner })
}

fn is_sign(node: Node) -> bool {
    matches!(node, Node::Call1(function, _) if function.get().name == "sign")
}

/// The values of an expression at random points, which are the same for expressions of the same symbols.
pub(super) fn values_at_random<const N: usize>(
    graph: &ExprGraph,
    sizes: &SymbolSizes,
    root: ExprId,
) -> [f64; N] {
    let mut random = SplitMix64::default();
    let tape = Tape::from_roots(graph, [root]);
    let symbols = tape.symbols();
    std::array::from_fn(|_| {
        let point = SamplePoint::random(sizes, &symbols, 0.0, &mut random);
        let [value] = point.evaluate(&tape, &mut Vec::new());
        value
    })
}
