//! Whether an expression goes on smoothly where a switch changes, or jumps, or has a corner.
//!
//! A switch changes on the surface e = 0. With A and B the expression as it is where e > 0 and where
//! e < 0, it goes on smoothly if A = B and ∂A/∂v = ∂B/∂v on the surface for a symbol v that e
//! depends on: along the surface all derivatives agree where values do. Whether a difference is
//! identically zero is tried at points of the surface drawn with a fixed seed: at a random point, v
//! is moved until e = 0. What counts is the difference there against those off the surface. `q*abs(q)` goes on smoothly, `abs(q)` has a corner, `sign(q)` jumps.

use std::collections::HashMap;

use super::Dae;
use crate::expr::graph::{Comparison, apply};
use crate::expr::{ExprId, Graph, Node, Symbol};

/// How an expression goes on behind a surface; what is more is worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Passage {
    /// With the same value and slope.
    Smooth,
    /// With the same value and another slope.
    Corner,
    /// With another value.
    Jump,
}

/// Points tried, and as many of them as are enough where both sides can be evaluated.
const TRIALS: usize = 32;
const ENOUGH: usize = 6;
/// How far from the surface the sides are compared, in the size of the symbol.
const NEAR: f64 = 1e-10;
/// And how far from it the difference is taken that theirs is compared with.
const FAR: f64 = 1e-3;
/// A difference that falls to this part of what it is off the surface is none. Roots fall slowest:
/// a cube root to 0.005 of what it is at [`FAR`].
const NONE: f64 = 1e-2;
/// A difference of this part of the sides is rounding.
const ROUNDING: f64 = 1e-12;

/// What a node is on the side of a surface where e > 0, if it is a switch of it: 1 or −1.
pub(super) type Signs = HashMap<ExprId, f64>;

/// The root as it is where e > 0 (side 1) or e < 0 (side −1).
fn on_side(graph: &mut Graph, root: ExprId, signs: &Signs, side: f64) -> ExprId {
    let mut built: HashMap<ExprId, ExprId> = HashMap::new();
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

/// How a row goes on where `surface` passes zero. The graph is one to be thrown away.
pub(super) fn passage(
    graph: &mut Graph,
    dae: &Dae,
    (root, surface, signs): (ExprId, ExprId, &Signs),
) -> Passage {
    let (above, below) = (on_side(graph, root, signs, 1.0), on_side(graph, root, signs, -1.0));
    if above == below {
        return Passage::Smooth;
    }
    let moves = |s: &Symbol| matches!(s, Symbol::Unknown(_) | Symbol::Input(_) | Symbol::Time);
    let candidates: Vec<Symbol> = graph.symbols(surface).into_iter().filter(moves).collect();
    let mut worst = Passage::Smooth;
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let mut compared = 0;
    for trial in 0..TRIALS {
        if compared >= ENOUGH {
            break;
        }
        let v = candidates[trial % candidates.len()];
        let slope_of = |graph: &mut Graph, e: ExprId| {
            let gradient = graph.gradient(e, |symbol| (symbol == v).then_some(0));
            gradient.first().map_or_else(|| graph.constant(0.0), |(_, slope)| *slope)
        };
        let (e_v, above_v, below_v) =
            (slope_of(graph, surface), slope_of(graph, above), slope_of(graph, below));
        let roots = [surface, e_v, above, below, above_v, below_v];
        let mut place = Place::random(graph, dae, roots, &mut random);
        let off = place.evaluate(graph, roots);
        let Some(rising) = place.move_to_surface(graph, v, [surface, e_v]) else { continue };
        let (at, size) = (place.values[&v], place.size(v));
        let mut moved = |distance: f64| {
            place.values.insert(v, at + rising * distance * size);
            place.evaluate(graph, roots)
        };
        let (beyond, before) = (moved(NEAR), moved(-NEAR));
        let (far_beyond, far_before) = (moved(FAR), moved(-FAR));

        let differs = |a: usize, b: usize, unbounded: Option<bool>| {
            // Both sides at one point, where both can be continued to it.
            let sides = [(beyond[a], beyond[b]), (before[a], before[b]), (beyond[a], before[b])];
            let finite = sides.into_iter().find(|(a, b)| a.is_finite() && b.is_finite());
            let Some((a_here, b_here)) = finite else { return unbounded };
            let elsewhere = [off, far_beyond, far_before]
                .into_iter()
                .map(|place| match (place[a] - place[b]).abs() {
                    difference if difference.is_finite() => difference,
                    // One side only has a value there.
                    _ if place[a].is_finite() => place[a].abs(),
                    _ => place[b].abs(),
                })
                .fold(0.0, f64::max);
            let negligible = NONE * elsewhere + ROUNDING * (a_here.abs() + b_here.abs());
            Some((a_here - b_here).abs() > negligible)
        };
        // A slope that is infinite on one side is not that of the other.
        let found = match (differs(2, 3, None), differs(4, 5, Some(true))) {
            (Some(true), _) => Passage::Jump,
            (Some(false), Some(true)) => Passage::Corner,
            (Some(false), Some(false)) => Passage::Smooth,
            (None, _) | (_, None) => continue,
        };
        compared += 1;
        worst = worst.max(found);
    }
    // What cannot be evaluated anywhere near is left to the control of the error.
    if compared == 0 { Passage::Corner } else { worst }
}

/// Values of symbols.
struct Place {
    values: HashMap<Symbol, f64>,
    sizes: HashMap<Symbol, f64>,
}

impl Place {
    fn random(graph: &Graph, dae: &Dae, roots: [ExprId; 6], random: &mut Random) -> Self {
        let mut place = Self { values: HashMap::new(), sizes: HashMap::new() };
        for id in graph.reachable(roots) {
            let Node::Symbol(symbol) = graph.node(id) else { continue };
            let (size, value) = match symbol {
                Symbol::Parameter(i) => {
                    let value = dae.parameters[i as usize].value;
                    let size = if value == 0.0 { 1.0 } else { value };
                    (size, size * (1.0 + 0.5 * random.next()))
                }
                Symbol::Unknown(i) => {
                    let unknown = &dae.unknowns[i as usize];
                    let size = unknown.nominal.unwrap_or(unknown.unit.factor);
                    (size, size * 2.0 * random.next())
                }
                // 0 and 1: modes, and conditions on time.
                Symbol::Discrete(_) => (1.0, f64::from(u8::from(random.next() > 0.0))),
                _ => (1.0, 2.0 * random.next()),
            };
            place.values.insert(symbol, value);
            place.sizes.insert(symbol, size);
        }
        place
    }

    fn size(&self, symbol: Symbol) -> f64 {
        self.sizes[&symbol].abs().max(self.values[&symbol].abs())
    }

    fn evaluate<const N: usize>(&self, graph: &Graph, roots: [ExprId; N]) -> [f64; N] {
        let order = graph.reachable(roots);
        let mut values: HashMap<ExprId, f64> = HashMap::with_capacity(order.len());
        for id in order {
            let value = match graph.node(id) {
                Node::Symbol(symbol) => self.values[&symbol],
                node => apply(node, |operand| values[&operand]),
            };
            values.insert(id, value);
        }
        roots.map(|root| values[&root])
    }

    /// Moves v by Newton's method until e = 0; the sign of ∂e/∂v there.
    fn move_to_surface(&mut self, graph: &Graph, v: Symbol, roots: [ExprId; 2]) -> Option<f64> {
        for _ in 0..50 {
            let [e, slope] = self.evaluate(graph, roots);
            let step = e / slope;
            if !step.is_finite() {
                return None;
            }
            let value = self.values[&v] - step;
            self.values.insert(v, value);
            if step.abs() <= 1e-14 * self.size(v) {
                return Some(slope.signum());
            }
        }
        None
    }
}

/// Numbers in (−1, 1), the same in every run: SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
