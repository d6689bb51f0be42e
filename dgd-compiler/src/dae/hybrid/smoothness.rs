//! Whether an expression is smooth, has a corner or jumps where a switch changes.
//!
//! A switch changes on the surface e = 0. With A and B the expression as it is where e > 0 and where
//! e < 0, it is smooth if A = B and ∂A/∂v = ∂B/∂v on the surface for a symbol v that e
//! depends on: along the surface all derivatives agree where values do. Whether a difference is
//! identically zero is tried at points of the surface drawn with a fixed seed: at a random point, v
//! is moved until e = 0. The difference there is compared with those off the surface. `q*abs(q)` is
//! smooth, `abs(q)` has a corner, `sign(q)` jumps.

use std::collections::{BTreeMap, HashMap};

use crate::dae::Dae;
use crate::expr::graph::{Comparison, apply};
use crate::expr::{ExprId, Graph, Node, Symbol};
use crate::model::Model;

/// How an expression passes a surface, from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Passage {
    /// With the same value and slope.
    Smooth,
    /// With the same value and another slope.
    Corner,
    /// With another value.
    Jump,
}

/// Points tried, and how many of them suffice if both sides can be evaluated there.
const TRIALS: usize = 128;
const ENOUGH: usize = 6;
/// How many suffice where conditions or modes may hide a jump. Points near thresholds are tried for
/// rows of up to [`MOST_NODES`] nodes.
const MANY: usize = 64;
const MOST_NODES: usize = 400;
/// How far beside the thresholds of other conditions points are drawn, in sizes.
const BESIDE: f64 = 0.3;
/// How many suffice even if a condition has been met one way only.
const MOST: usize = 32;
/// Other conditions that are followed.
const MOST_CONDITIONS: usize = 16;
/// Decades about their sizes that unknowns are drawn from, every other time.
const WIDE: f64 = 2.0;
/// Steps of Newton's method to a surface.
const MOST_NEWTON: usize = 50;
/// How near and how far changes of a sign are looked for, in the size of the symbol.
const NEAREST: f64 = 1e-3;
const MOST_DOUBLINGS: i32 = 40;
/// Where random numbers begin.
const SEED: u64 = 0x9E37_79B9_7F4A_7C15;
/// How far from the surface the sides are compared, in the size of the symbol.
const NEAR: f64 = 1e-10;
/// How far from it the difference is taken that theirs is compared with.
const FAR: f64 = 1e-3;
/// A difference that falls to this fraction of its value off the surface counts as zero. Roots fall
/// slowest:
/// a cube root to 0.005 of what it is at [`FAR`].
const NONE: f64 = 1e-2;
/// A difference below this fraction of the sides is rounding.
const ROUNDING: f64 = 1e-12;

/// What a node is on the side of a surface where e > 0, if it is a switch of it: 1 or −1.
pub(super) type Signs = HashMap<ExprId, f64>;

/// The root as it is where e > 0 (side 1) or e < 0 (side −1).
pub(super) fn on_side(graph: &mut Graph, root: ExprId, signs: &Signs, side: f64) -> ExprId {
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

/// How an expression passes where `surface` is zero. The graph is thrown away afterwards.
///
/// Another condition may hide a jump at random points, so points are tried until each condition has
/// been met both ways. A condition that has not is then assumed to hold the other way, unless the
/// surface itself decides it, as x = 0 decides x < 1.
pub(super) fn passage(
    graph: &mut Graph,
    sizes: &Sizes,
    root: ExprId,
    surface: ExprId,
    signs: &Signs,
) -> Passage {
    let sides = [1.0, -1.0].map(|side| on_side(graph, root, signs, side));
    if sides[0] == sides[1] {
        return Passage::Smooth;
    }
    let mut comparison = Sides { graph, sizes, surface, met: BTreeMap::new() };
    let mut found = comparison.compare(sides, true);
    let on_surface = comparison.graph.symbols(surface);
    let unmet: Vec<(ExprId, bool)> = comparison
        .met
        .iter()
        .filter_map(|(id, met)| match met {
            [true, false] => Some((*id, false)),
            [false, true] => Some((*id, true)),
            _ => None,
        })
        .filter(|(id, _)| {
            let symbols = comparison.graph.symbols(*id);
            symbols.iter().any(|symbol| !on_surface.contains(symbol))
        })
        .collect();
    let each = unmet.iter().map(std::slice::from_ref);
    for supposed in std::iter::once(&unmet[..]).chain(each).take_while(|s| !s.is_empty()) {
        let graph = &mut *comparison.graph;
        let mut truths = HashMap::new();
        for (id, truth) in supposed {
            let otherwise = if is_sign(graph.node(*id)) { -1.0 } else { 0.0 };
            truths.insert(*id, graph.constant(if *truth { 1.0 } else { otherwise }));
        }
        let replaced = graph.replace(sides, &truths);
        let sides = sides.map(|side| replaced[&side]);
        if sides[0] != sides[1] {
            found = found.max(comparison.compare(sides, false));
        }
        if unmet.len() == 1 {
            break;
        }
    }
    // What cannot be evaluated anywhere nearby is left to error control.
    found.unwrap_or(Passage::Corner)
}

fn is_sign(node: Node) -> bool {
    matches!(node, Node::Call1(function, _) if function.get().name == "sign")
}

/// The comparison of two sides of a surface.
struct Sides<'a> {
    graph: &'a mut Graph,
    sizes: &'a Sizes,
    surface: ExprId,
    /// Whether the sides' conditions have been met where they do not hold, and where they do.
    met: BTreeMap<ExprId, [bool; 2]>,
}

impl Sides<'_> {
    /// The worst passage met at random points; `None` if the sides can be evaluated at none of them.
    fn compare(&mut self, [above, below]: [ExprId; 2], all: bool) -> Option<Passage> {
        let surface = self.surface;
        let candidates: Vec<Symbol> =
            self.graph.symbols(surface).into_iter().filter(|symbol| moves(*symbol)).collect();
        let mut thresholds = Vec::new();
        if all {
            self.list_conditions([above, below]);
            if self.graph.reachable([above, below]).len() <= MOST_NODES {
                thresholds = self.thresholds();
            }
        }
        // Conditions and modes may hide a jump except where several of them hold together.
        let is_mode = |symbol: &Symbol| matches!(symbol, Symbol::Discrete(_));
        let hides = !thresholds.is_empty()
            || [above, below].iter().any(|side| self.graph.symbols(*side).iter().any(is_mode));
        let enough = if hides { MANY } else { ENOUGH };
        let mut slopes: Vec<Option<[ExprId; 3]>> = vec![None; candidates.len()];
        let mut worst = None;
        let mut random = Random(SEED);
        let mut compared = 0;
        let graph = &mut *self.graph;
        for trial in 0..TRIALS {
            let all_met = !all || self.met.values().all(|met| *met == [true; 2]);
            if compared >= enough && (all_met || compared >= MOST) || candidates.is_empty() {
                break;
            }
            let k = trial % candidates.len();
            let v = candidates[k];
            let [e_v, above_v, below_v] = *slopes[k].get_or_insert_with(|| {
                [surface, above, below].map(|e| {
                    let gradient = graph.gradient(e, |symbol| (symbol == v).then_some(0));
                    gradient.first().map_or_else(|| graph.constant(0.0), |(_, slope)| *slope)
                })
            });
            let roots = [surface, e_v, above, below, above_v, below_v];
            let order = graph.reachable(roots);
            let spread = if trial % 2 == 1 { WIDE } else { 0.0 };
            let mut point = Point::random(graph, self.sizes, &order, spread, &mut random);
            if trial % 4 > 1 && !thresholds.is_empty() {
                let which = (0.5 * (random.next() + 1.0) * thresholds.len() as f64) as usize;
                point.move_near(graph, &thresholds[which], v, &mut random);
            }
            let off = point.evaluate(graph, &order, roots);
            let at_surface = graph.reachable([surface, e_v]);
            let found = point.move_to_surface(graph, v, &at_surface, [surface, e_v]);
            let Some(rising) = found else { continue };
            let (at, size) = (point.values[&v], point.size(v));
            let mut moved = |distance: f64| {
                point.values.insert(v, at + rising * distance * size);
                point.evaluate(graph, &order, roots)
            };
            let (beyond, before) = (moved(NEAR), moved(-NEAR));
            let (far_beyond, far_before) = (moved(FAR), moved(-FAR));

            let differs = |a: usize, b: usize, unbounded: Option<bool>| {
                // Both sides at one point, where both can be continued to it.
                let sides =
                    [(beyond[a], beyond[b]), (before[a], before[b]), (beyond[a], before[b])];
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
            // A slope that is infinite on one side is not that of the other.
            let found = match (differs(2, 3, None), differs(4, 5, Some(true))) {
                (Some(true), _) => Passage::Jump,
                (Some(false), Some(true)) => Passage::Corner,
                (Some(false), Some(false)) => Passage::Smooth,
                (None, _) | (_, None) => continue,
            };
            compared += 1;
            worst = worst.max(Some(found));
            if worst == Some(Passage::Jump) {
                break;
            }
            if all && !self.met.is_empty() {
                point.values.insert(v, at);
                point.note_conditions(graph, &order, &mut self.met);
            }
        }
        worst
    }

    /// Where conditions other than the surface's own change: e, and ∂e/∂v for each symbol v that moves.
    fn thresholds(&mut self) -> Vec<Threshold> {
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
                Some((v, *slope, graph.reachable([e, *slope])))
            });
            let slopes: Vec<_> = slopes.collect();
            if !slopes.is_empty() {
                thresholds.push(Threshold { e, slopes });
            }
        }
        thresholds
    }

    /// Lists the conditions of the sides, where they are few.
    fn list_conditions(&mut self, sides: [ExprId; 2]) {
        let graph = &*self.graph;
        let conditions = graph.listed(sides).into_iter().filter(|(id, node)| {
            let by_mode = |symbol: &Symbol| matches!(symbol, Symbol::Discrete(_));
            (matches!(node, Node::Compare(..)) || is_sign(*node))
                && !graph.symbols(*id).iter().all(by_mode)
        });
        self.met = conditions.map(|(id, _)| (id, [false; 2])).take(MOST_CONDITIONS).collect();
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
            | Symbol::Time
    )
}

/// Where a condition changes, e = 0: for each symbol v, ∂e/∂v and what both are made of.
struct Threshold {
    e: ExprId,
    slopes: Vec<(Symbol, ExprId, Vec<ExprId>)>,
}

/// The values of an expression at random points, which are the same for expressions of the same symbols.
pub(super) fn values_at_random<const N: usize>(
    graph: &Graph,
    sizes: &Sizes,
    root: ExprId,
) -> [f64; N] {
    let mut random = Random(SEED);
    let order = graph.reachable([root]);
    std::array::from_fn(|_| {
        let point = Point::random(graph, sizes, &order, 0.0, &mut random);
        let [value] = point.evaluate(graph, &order, [root]);
        value
    })
}

/// What sizes symbols have.
pub(super) struct Sizes {
    parameters: Vec<f64>,
    unknowns: Vec<f64>,
    /// Of declared inputs, then of those that arrive late.
    inputs: Vec<f64>,
    /// Of delayed unknowns.
    late: Vec<f64>,
    /// For each array, its first element and their size.
    arrays: Vec<(u32, f64)>,
    /// For each discrete number, how many values it has.
    modes: Vec<usize>,
}

impl Sizes {
    pub(super) fn of(dae: &Dae, model: &Model) -> Sizes {
        let parameters: Vec<f64> = dae.parameters.iter().map(|parameter| parameter.value).collect();
        let at_start = |symbol| match symbol {
            Symbol::Parameter(i) => parameters[i as usize],
            Symbol::Constant(i) => model.constants[i as usize].value,
            Symbol::Time | Symbol::Counter => 0.0,
            _ => f64::NAN,
        };
        let size = |nominal: Option<f64>, start: f64, factor: f64| match nominal {
            Some(nominal) => nominal,
            None if start.is_normal() => start.abs(),
            None => factor,
        };
        let unknowns: Vec<f64> = dae
            .unknowns
            .iter()
            .map(|x| size(x.nominal, dae.graph.evaluate(x.start, &at_start), x.unit.factor))
            .collect();
        let arrays = model.arrays.iter().map(|array| {
            let x = &array.unknown;
            let start = model.graph.evaluate(x.start, &at_start);
            (array.first, size(x.nominal, start, x.declared.unit.factor))
        });
        // A temperature in °C is about 273 K.
        let input = |i: usize| {
            let unit = &model.inputs[i].declared.unit;
            unit.factor.abs().max(unit.offset.abs())
        };
        let late_inputs = dae.delayed_inputs.iter().map(|late| late.input);
        Sizes {
            inputs: (0..model.inputs.len()).chain(late_inputs).map(input).collect(),
            late: dae.delayed_unknowns.iter().map(|late| unknowns[late.unknown]).collect(),
            arrays: arrays.collect(),
            modes: dae.automata.iter().map(|automaton| automaton.modes.len()).collect(),
            parameters,
            unknowns,
        }
    }

    /// Of an element of an array.
    fn of_element(&self, i: u32) -> f64 {
        let after = self.arrays.partition_point(|(first, _)| *first <= i);
        after.checked_sub(1).map_or(1.0, |array| self.arrays[array].1)
    }
}

/// A point: values of symbols, and their sizes.
struct Point {
    values: HashMap<Symbol, f64>,
    sizes: HashMap<Symbol, f64>,
}

impl Point {
    /// Values of up to two sizes, or up to `spread` decades more or less.
    fn random(
        graph: &Graph,
        of: &Sizes,
        order: &[ExprId],
        spread: f64,
        random: &mut Random,
    ) -> Self {
        let mut point = Self { values: HashMap::new(), sizes: HashMap::new() };
        let mut symbols: Vec<Symbol> = order
            .iter()
            .filter_map(|id| match graph.node(*id) {
                Node::Symbol(symbol) => Some(symbol),
                _ => None,
            })
            .collect();
        symbols.sort_unstable();
        for symbol in symbols {
            let mut around_zero = |size: f64| {
                let decades = if spread == 0.0 { 0.0 } else { spread * random.next() };
                (size, size * 2.0 * random.next() * 10.0_f64.powf(decades))
            };
            let (size, value) = match symbol {
                Symbol::Parameter(i) => {
                    let value = of.parameters[i as usize];
                    let size = if value == 0.0 { 1.0 } else { value };
                    (size, size * (1.0 + 0.5 * random.next()))
                }
                Symbol::Unknown(i) => around_zero(of.unknowns[i as usize]),
                Symbol::DelayedUnknown(k) => around_zero(of.late[k as usize]),
                Symbol::Input(i) => around_zero(of.inputs.get(i as usize).copied().unwrap_or(1.0)),
                Symbol::Element(i) | Symbol::Swept(i) => around_zero(of.of_element(i)),
                Symbol::Discrete(i) => {
                    // Conditions on time are 0 or 1.
                    let modes = of.modes.get(i as usize).copied().unwrap_or(2) as f64;
                    (1.0, (0.5 * (random.next() + 1.0) * modes).floor().min(modes - 1.0))
                }
                _ => around_zero(1.0),
            };
            point.values.insert(symbol, value);
            point.sizes.insert(symbol, size);
        }
        point
    }

    fn size(&self, symbol: Symbol) -> f64 {
        self.sizes[&symbol].abs().max(self.values[&symbol].abs())
    }

    /// The values of the roots, which are made of `order`.
    fn evaluate<const N: usize>(
        &self,
        graph: &Graph,
        order: &[ExprId],
        roots: [ExprId; N],
    ) -> [f64; N] {
        let mut values: HashMap<ExprId, f64> = HashMap::with_capacity(order.len());
        for &id in order {
            let value = match graph.node(id) {
                Node::Symbol(symbol) => self.values[&symbol],
                node => apply(node, |operand| values[&operand]),
            };
            values.insert(id, value);
        }
        roots.map(|root| values[&root])
    }

    /// Records which conditions hold here.
    fn note_conditions(
        &self,
        graph: &Graph,
        order: &[ExprId],
        met: &mut BTreeMap<ExprId, [bool; 2]>,
    ) {
        let mut values: HashMap<ExprId, f64> = HashMap::with_capacity(order.len());
        for &id in order {
            let value = match graph.node(id) {
                Node::Symbol(symbol) => self.values[&symbol],
                node => apply(node, |operand| values[&operand]),
            };
            values.insert(id, value);
            if let Some(met) = met.get_mut(&id) {
                met[usize::from(value > 0.0)] = true;
            }
        }
    }

    /// Moves v to where e = 0, by Newton's method or, where that does not get there, as with `q^3` and
    /// `exp(-q) - 1e-9`, by halving; the sign of ∂e/∂v there.
    fn move_to_surface(
        &mut self,
        graph: &Graph,
        v: Symbol,
        order: &[ExprId],
        roots: [ExprId; 2],
    ) -> Option<f64> {
        let from = self.values[&v];
        for _ in 0..MOST_NEWTON {
            let [e, slope] = self.evaluate(graph, order, roots);
            let step = e / slope;
            if !step.is_finite() {
                break;
            }
            let value = self.values[&v] - step;
            self.values.insert(v, value);
            if step.abs() <= 1e-14 * self.size(v) {
                return Some(slope.signum());
            }
        }
        self.values.insert(v, from);
        self.halve_to_surface(graph, v, order, roots)
    }

    /// Moves a symbol, other than `kept` if possible, to just beside a threshold.
    fn move_near(
        &mut self,
        graph: &Graph,
        threshold: &Threshold,
        kept: Symbol,
        random: &mut Random,
    ) {
        let other = threshold.slopes.iter().rev().find(|(symbol, ..)| *symbol != kept);
        let Some((v, slope, order)) = other.or(threshold.slopes.first()) else { return };
        let from = self.values[v];
        if self.move_to_surface(graph, *v, order, [threshold.e, *slope]).is_some() {
            *self.values.entry(*v).or_default() += BESIDE * random.next() * self.size(*v);
        } else {
            self.values.insert(*v, from);
        }
    }

    /// Looks for a change of the sign of e along v, ever further away, and halves to it.
    fn halve_to_surface(
        &mut self,
        graph: &Graph,
        v: Symbol,
        order: &[ExprId],
        roots: [ExprId; 2],
    ) -> Option<f64> {
        let (from, size) = (self.values[&v], self.size(v));
        let sign_at = |point: &mut Self, value: f64| {
            point.values.insert(v, value);
            let [e, _] = point.evaluate(graph, order, roots);
            (e != 0.0 && !e.is_nan()).then_some(e.signum())
        };
        let mut ends = [(from, sign_at(self, from)); 2];
        for k in 0..MOST_DOUBLINGS {
            let distance = size * NEAREST * 2.0_f64.powi(k);
            for (end, side) in ends.iter_mut().zip([-1.0, 1.0]) {
                let next = (from + side * distance, sign_at(self, from + side * distance));
                let before = std::mem::replace(end, next);
                let (Some(a), Some(b)) = (before.1, next.1) else { continue };
                if a != b {
                    let (mut low, mut high) = (before.0, next.0);
                    loop {
                        let middle = f64::midpoint(low, high);
                        if middle == low || middle == high {
                            break;
                        }
                        match sign_at(self, middle) {
                            Some(sign) if sign == a => low = middle,
                            Some(_) => high = middle,
                            None => {
                                (low, high) = (middle, middle);
                            }
                        }
                    }
                    self.values.insert(v, low);
                    return Some(side * b);
                }
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
