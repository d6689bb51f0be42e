//! Compares both sides of a surface at random points of it.

use std::collections::BTreeMap;

use super::point::{SamplePoint, SplitMix64, SwitchThreshold, SymbolSizes};
use super::{Continuity, is_sign};
use crate::expr::{ExprGraph, ExprId, Node, Symbol, Tape};

/// Points to try, and the number that suffices if both sides can be evaluated there.
const TRIALS: usize = 128;
const ENOUGH: usize = 6;
/// Number that suffices if conditions or modes may hide a jump. Points near thresholds are tried for rows of up to
/// [`MOST_NODES`] nodes.
const MANY: usize = 64;
const MOST_NODES: usize = 400;
/// Number that suffices even if a condition has taken only one value.
const MOST: usize = 32;
/// Number of other conditions that are tracked.
const MOST_CONDITIONS: usize = 16;
/// Every other time, unknowns are drawn from this many decades about their sizes.
const WIDE: f64 = 2.0;
/// Distance from the surface at which the sides are compared, relative to the size of the symbol.
const NEAR: f64 = 1e-10;
/// Distance from the surface of the reference difference.
const FAR: f64 = 1e-3;
/// A difference that falls to this fraction of its value off the surface counts as zero. Roots fall slowest: a cube
/// root to 0.005 of its value at [`FAR`].
const NONE: f64 = 1e-2;
/// A difference below this fraction of the sides is rounding error.
const ROUNDING: f64 = 1e-12;

/// The comparison of two sides of a surface.
pub(super) struct SurfaceSides<'a> {
    pub(super) graph: &'a mut ExprGraph,
    sizes: &'a SymbolSizes,
    surface: ExprId,
    /// Whether each of the sides' conditions has been false, and true.
    pub(super) met: BTreeMap<ExprId, [bool; 2]>,
}

/// A symbol to move to the surface, and the tapes to evaluate then.
struct SurfaceApproach {
    symbol: Symbol,
    /// e, ∂e/∂v, both sides, and their derivatives to v.
    all: Tape<6>,
    /// Positions on that tape of the nodes that depend on the symbol.
    moving: Vec<usize>,
    /// e and ∂e/∂v.
    surface: Tape<2>,
    symbols: Vec<Symbol>,
}

impl<'a> SurfaceSides<'a> {
    pub(super) fn new(graph: &'a mut ExprGraph, sizes: &'a SymbolSizes, surface: ExprId) -> Self {
        Self { graph, sizes, surface, met: BTreeMap::new() }
    }

    /// The worst passage at random points; `None` if the sides can be evaluated at none of them.
    pub(super) fn compare(&mut self, sides: [ExprId; 2], all: bool) -> Option<Continuity> {
        let candidates: Vec<Symbol> =
            self.graph.symbols(self.surface).into_iter().filter(|symbol| moves(*symbol)).collect();
        let mut thresholds = Vec::new();
        if all {
            self.list_conditions(sides);
            if self.graph.reachable(sides).len() <= MOST_NODES {
                thresholds = self.thresholds();
            }
        }
        // Conditions and modes may hide a jump unless several of them hold together.
        let is_mode = |symbol: &Symbol| matches!(symbol, Symbol::Discrete(_));
        let hides = !thresholds.is_empty()
            || sides.iter().any(|side| self.graph.symbols(*side).iter().any(is_mode));
        let enough = if hides { MANY } else { ENOUGH };
        let mut directions: Vec<Option<SurfaceApproach>> = Vec::new();
        directions.resize_with(candidates.len(), || None);
        let mut worst = None;
        let mut random = SplitMix64::default();
        let mut compared = 0;
        let mut values = Vec::new();
        for trial in 0..TRIALS {
            let all_met = !all || self.met.values().all(|met| *met == [true; 2]);
            if compared >= enough && (all_met || compared >= MOST) || candidates.is_empty() {
                break;
            }
            let k = trial % candidates.len();
            let direction =
                &*directions[k].get_or_insert_with(|| self.direction(sides, candidates[k]));
            let spread = if trial % 2 == 1 { WIDE } else { 0.0 };
            let mut point =
                SamplePoint::random(self.sizes, &direction.symbols, spread, &mut random);
            if trial % 4 > 1 && !thresholds.is_empty() {
                let which = (0.5 * (random.next() + 1.0) * thresholds.len() as f64) as usize;
                point.move_near(&thresholds[which], direction.symbol, &mut random);
            }
            let Some(found) = passage_at(&mut point, direction, &mut values) else { continue };
            compared += 1;
            worst = worst.max(Some(found));
            if worst == Some(Continuity::Jump) {
                break;
            }
            if all && !self.met.is_empty() {
                point.evaluate_again(&direction.all, &direction.moving, &mut values);
                note_conditions(&direction.all, &values, &mut self.met);
            }
        }
        worst
    }

    /// The tapes for moving a symbol to the surface.
    fn direction(&mut self, [above, below]: [ExprId; 2], symbol: Symbol) -> SurfaceApproach {
        let (graph, surface) = (&mut *self.graph, self.surface);
        let [e_v, above_v, below_v] = [surface, above, below].map(|e| {
            let gradient = graph.gradient(e, |other| (other == symbol).then_some(0));
            gradient.first().map_or_else(|| graph.constant(0.0), |(_, slope)| *slope)
        });
        let tape = Tape::from_roots(graph, [surface, e_v, above, below, above_v, below_v]);
        let surface = Tape::from_roots(graph, [surface, e_v]);
        let (symbols, moving) = (tape.symbols(), tape.readers(symbol));
        SurfaceApproach { symbol, all: tape, moving, surface, symbols }
    }

    /// Thresholds of conditions other than the surface's own: e, and ∂e/∂v for each symbol v that moves.
    fn thresholds(&mut self) -> Vec<SwitchThreshold> {
        let conditions: Vec<ExprId> = self.met.keys().copied().collect();
        let mut thresholds = Vec::new();
        for condition in conditions {
            let graph = &mut *self.graph;
            let e = match graph.node(condition) {
                Node::Compare(_, a, b) => graph.subtract(a, b),
                Node::Call1(_, x) => x,
                _ => continue,
            };
            if e == self.surface {
                continue;
            }
            let symbols: Vec<Symbol> =
                graph.symbols(e).into_iter().filter(|symbol| moves(*symbol)).collect();
            let slopes = symbols.into_iter().filter_map(|v| {
                let gradient = graph.gradient(e, |symbol| (symbol == v).then_some(0));
                let (_, slope) = gradient.first()?;
                Some((v, Tape::from_roots(graph, [e, *slope])))
            });
            let slopes: Vec<_> = slopes.collect();
            if !slopes.is_empty() {
                thresholds.push(SwitchThreshold { slopes });
            }
        }
        thresholds
    }

    /// Lists the conditions of the sides if there are few.
    fn list_conditions(&mut self, sides: [ExprId; 2]) {
        let graph = &*self.graph;
        let conditions = graph.listed(sides).into_iter().filter(|(id, node)| {
            let by_mode = |symbol: &Symbol| self.sizes.is_drawn(*symbol);
            (matches!(node, Node::Compare(..)) || is_sign(*node))
                && !graph.symbols(*id).iter().all(by_mode)
        });
        self.met = conditions.map(|(id, _)| (id, [false; 2])).take(MOST_CONDITIONS).collect();
    }
}

/// Records which conditions hold at these values.
fn note_conditions(tape: &Tape<6>, values: &[f64], met: &mut BTreeMap<ExprId, [bool; 2]>) {
    for (id, met) in met {
        if let Some(at) = tape.position(*id) {
            met[usize::from(values[at] > 0.0)] = true;
        }
    }
}

/// The passage at a point, which is moved to the surface; `None` if it cannot be moved there or if neither side can be
/// evaluated.
///
/// `values` receives those of all nodes of the sides, next to the surface.
fn passage_at(
    point: &mut SamplePoint,
    direction: &SurfaceApproach,
    values: &mut Vec<f64>,
) -> Option<Continuity> {
    let v = direction.symbol;
    let off = point.evaluate(&direction.all, values);
    let rising = point.move_to_surface(v, &direction.surface)?;
    let (at, size) = (point.value(v), point.size(v));
    let mut moved = |distance: f64| {
        point.set(v, at + rising * distance * size);
        point.evaluate_again(&direction.all, &direction.moving, values)
    };
    let (beyond, before) = (moved(NEAR), moved(-NEAR));
    let (far_beyond, far_before) = (moved(FAR), moved(-FAR));
    point.set(v, at);
    let differs = |a: usize, b: usize, unbounded: Option<bool>| {
        // Both sides at one point, if both can be continued to it.
        let sides = [(beyond[a], beyond[b]), (before[a], before[b]), (beyond[a], before[b])];
        let finite = sides.into_iter().find(|(a, b)| a.is_finite() && b.is_finite());
        let Some((a_here, b_here)) = finite else { return unbounded };
        let elsewhere = [off, far_beyond, far_before]
            .into_iter()
            .map(|place| match (place[a] - place[b]).abs() {
                difference if difference.is_finite() => difference,
                // Only one side has a value there.
                _ if place[a].is_finite() => place[a].abs(),
                _ => place[b].abs(),
            })
            .fold(0.0, f64::max);
        let negligible = NONE * elsewhere + ROUNDING * (a_here.abs() + b_here.abs());
        Some((a_here - b_here).abs() > negligible)
    };
    // A slope that is infinite on one side differs from that on the other.
    match (differs(2, 3, None), differs(4, 5, Some(true))) {
        (Some(true), _) => Some(Continuity::Jump),
        (Some(false), Some(true)) => Some(Continuity::Corner),
        (Some(false), Some(false)) => Some(Continuity::Smooth),
        (None, _) | (_, None) => None,
    }
}

/// Whether a symbol may be moved to a surface.
fn moves(symbol: Symbol) -> bool {
    matches!(
        symbol,
        Symbol::Unknown(_)
            | Symbol::Element(_)
            | Symbol::Swept(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Input(_)
            | Symbol::SweptInput(..)
            | Symbol::Time
    )
}
