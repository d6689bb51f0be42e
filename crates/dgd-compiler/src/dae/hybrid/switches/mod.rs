//! Switches as events: comparisons, `abs` and `sign` on which the rows depend.
//!
//! Each changes on a surface e = 0: left = right, or x = 0. If all rows are smooth across it ([`super::smoothness`]),
//! or if e changes only at samples of inputs, nothing happens. If a slope jumps, there is an event without an action: a
//! step ends there, so that no step reaches across the corner. If a value jumps, the switch becomes a discrete number
//! z, so that a step that passes the surface continues unchanged until it is cut there; likewise if the slope of an
//! algebraic equation jumps ([`algebraic`]):
//!
//! ```text
//!   z = below   e < 0    ->  above when e rises above 0
//!   z = above   e > 0    ->  below when e falls below 0
//!   z = sliding e = 0, if both sides push back
//! ```
//!
//! On a surface that it cannot leave, the solution slides (Filippov). Then a share α of the side above and 1 − α of the
//! one below act such that e stays zero:
//!
//! ```text
//!   value = B + α (A − B),   0 = ė = ∂e/∂t + ∂e/∂y f(α) + ∂e/∂u u̇
//! ```
//!
//! α is an algebraic unknown, so it may act through other algebraic unknowns, and several surfaces can slide at the
//! same time. The solution leaves the surface when α leaves [0, 1]. A surface that reads algebraic unknowns has no ė,
//! and cannot slide, unless equations give these unknowns directly.
//!
//! # Source
//!
//! Filippov, Differential Equations with Discontinuous Righthand Sides (1988), §4.

mod affected;
mod algebraic;
mod driven;
pub(in crate::dae) mod histories;
mod nested;
mod opened;
mod pieces;
mod steps;
mod surfaces;
mod tables;
mod unrolled;
mod written;

use std::cell::RefCell;

use self::affected::ExpressionReaders;
use self::surfaces::{SurfaceKind, SwitchingSurface};
use self::written::written;
use crate::dae::hybrid::smoothness::{Continuity, SymbolSizes, is_greater, passage};
use crate::dae::rates::{RowLayout, VaryingQuantities, family_of};
use crate::dae::{AutomatonKind, Dae, DaeAutomaton, DaeTransition, DaeUnknown, Trigger};
use crate::expr::graph::Comparison;
use crate::expr::hash::{HashMap, HashSet};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::{Crossing, Model};
use crate::units::Unit;

const BELOW: usize = 0;
const ABOVE: usize = 1;
const SLIDING: usize = 2;

/// Turns the switches on which the rows depend into events.
pub(in crate::dae) fn locate(dae: &mut Dae, model: &Model) {
    pieces::take_apart(dae, model);
    unrolled::unroll(dae, model);
    steps::locate(dae, model);
    nested::take_apart(dae, model);
    make_events(dae, model);
    tables::locate(dae, model);
}

/// Turns switches into events.
fn make_events(dae: &mut Dae, model: &Model) {
    let mut surfaces = passed(dae, model);
    surfaces.retain(|surface| surface.passage > Continuity::Smooth);
    if surfaces.is_empty() {
        return;
    }
    for surface in &mut surfaces {
        surface.name = name(dae, model, surface.e);
    }
    // Surfaces that only stop steps come last because rows read the others by position.
    surfaces.sort_by_key(|surface| !surface.is_held());
    open(dae, model, &mut surfaces);
    replace_switches(dae, model, &mut surfaces);
    for surface in &surfaces {
        let automaton = automaton(dae, model, surface);
        dae.automata.push(automaton);
    }
}

/// In surfaces at which a value jumps, substitutes explicit solutions for algebraic unknowns if the surface then has a
/// rate.
fn open(dae: &mut Dae, model: &Model, surfaces: &mut [SwitchingSurface]) {
    for surface in surfaces.iter_mut().filter(|surface| surface.passage == Continuity::Jump) {
        let Some(e) = opened::opened(dae, surface.e).filter(|e| *e != surface.e) else { continue };
        let varying = VaryingQuantities { model, delayed: &dae.delayed_inputs };
        let rows = RowLayout { unknowns: &dae.unknowns, families: &dae.families };
        let mut trial = dae.graph.clone();
        if varying.terms(&mut trial, e, rows).is_some() {
            surface.e = e;
        }
    }
}

/// All surfaces, with the rows' continuity across them.
fn passed(dae: &mut Dae, model: &Model) -> Vec<SwitchingSurface> {
    let roots: Vec<ExprId> = dae.rows().collect();
    let mut surfaces = surfaces::surfaces(dae, model, &roots, SurfaceKind::Common);
    let mut readers = ExpressionReaders::from_dae(dae);
    let typical = SymbolSizes::estimate(dae, model);
    let mut trial = dae.graph.clone();
    for surface in &mut surfaces {
        let (affected, rows) = readers.affected(&surface.signs);
        surface.rows = rows;
        for root in affected {
            let here = passage(&mut trial, &typical, root, surface.e, &surface.signs);
            surface.passage = surface.passage.max(here);
        }
    }
    let algebraic = algebraic::AlgebraicUnknowns::from_dae(dae);
    for surface in &mut surfaces {
        surface.is_piece = algebraic.holds(dae, &roots, surface);
    }
    surfaces
}

/// e in the notation of formulas, if it is short.
fn name(dae: &Dae, model: &Model, e: ExprId) -> String {
    format!("switch {} at 0", written(dae, model, e))
}

/// Replaces switches whose values jump by discrete numbers, and by shares while they slide.
fn replace_switches(dae: &mut Dae, model: &Model, surfaces: &mut [SwitchingSurface]) {
    let before = dae.automata.len();
    let after = before + surfaces.len();
    let sliding = SlidingSurfaces::from_dae(dae);
    let mut sharing: HashSet<ExprId> = HashSet::default();
    let one_sided = surfaces.iter_mut().filter(|surface| surface.is_held());
    let mut n_shares = 0;
    for (k, surface) in one_sided.enumerate() {
        let position = u32::try_from(before + k).unwrap_or(u32::MAX);
        surface.z = Some(dae.graph.symbol(Symbol::Discrete(position)));
        // A share is algebraic: surfaces that read it have no ė.
        let reads_share = |dae: &Dae| {
            !sharing.is_empty()
                && dae.graph.reachable([surface.e]).iter().any(|id| sharing.contains(id))
        };
        let slides = !surface.is_piece && sliding.is_possible(dae, model, surface);
        if slides && !reads_share(dae) {
            let index = u32::try_from(dae.unknowns.len()).unwrap_or(u32::MAX);
            surface.share = Some((index, dae.graph.symbol(Symbol::Unknown(index))));
            sharing.extend(surface.signs.keys());
            n_shares += 1;
            let share = share_of(dae, surface, n_shares);
            dae.unknowns.push(share);
        }
    }
    let replaced = SwitchReplacement::new(surfaces, before, after - before).all(dae);
    dae.each_expression(&mut |_, id| *id = replaced[id]);
    let names = std::mem::take(&mut dae.names);
    dae.names = names
        .into_iter()
        .filter_map(|(id, name)| replaced.get(&id).map(|id| (*id, name)))
        .collect();
    for surface in surfaces.iter_mut() {
        surface.e = replaced[&surface.e];
    }
    // α: constant on the sides, and between them the value that keeps e zero.
    for surface in surfaces.iter() {
        let (Some(z), Some((index, alpha))) = (surface.z, surface.share) else { continue };
        let rate = rate_of(dae, model, surface.e);
        let graph = &mut dae.graph;
        let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
        let is_above = in_mode(graph, z, ABOVE);
        let side = graph.select(is_above, one, zero);
        let side = graph.subtract(side, alpha);
        let slides = in_mode(graph, z, SLIDING);
        let sliding_rhs = held(graph, rate, index, z);
        dae.unknowns[index as usize].rhs = graph.select(slides, sliding_rhs, side);
    }
}

/// The row of α while the solution slides: ė = 0.
///
/// If another switch keeps α from acting, as when a brake is released, ė cannot be made zero. α is then outside its
/// range, on the side to which the solution leaves.
fn held(graph: &mut ExprGraph, rate: ExprId, share: u32, z: ExprId) -> ExprId {
    let slopes = graph.gradient(rate, |symbol| (symbol == Symbol::Unknown(share)).then_some(0));
    let Some((_, slope)) = slopes.first().copied() else { return rate };
    let sliding = graph.constant(SLIDING as f64);
    let nodes = graph.listed([slope]);
    let built = graph.rebuild(&nodes, |graph, symbol| {
        let here = graph.symbol(symbol);
        if here == z { sliding } else { here }
    });
    let slope = built[&slope];
    let switched = graph.listed([slope]).iter().any(|(_, node)| matches!(node, Node::Select(..)));
    if !switched {
        return rate;
    }
    let alpha = graph.symbol(Symbol::Unknown(share));
    let [zero, two, minus_one] = [0.0, 2.0, -1.0].map(|number| graph.constant(number));
    let size = graph.call1("abs", slope);
    let acts = graph.compare(Comparison::Greater, size, zero);
    let rises = graph.compare(Comparison::Greater, rate, zero);
    let beyond = graph.select(rises, two, minus_one);
    let leaves = graph.subtract(beyond, alpha);
    graph.select(acts, rate, leaves)
}

/// ė of a surface that can slide.
fn rate_of(dae: &mut Dae, model: &Model, e: ExprId) -> ExprId {
    let varying = VaryingQuantities { model, delayed: &dae.delayed_inputs };
    let rows = RowLayout { unknowns: &dae.unknowns, families: &dae.families };
    let rate = varying.rate(&mut dae.graph, e, rows);
    rate.unwrap_or_else(|| unreachable!("what slides reads no algebraic unknown"))
}

/// The surfaces along which a solution can slide.
struct SlidingSurfaces {
    /// For each row, whether it reads an algebraic unknown.
    reads_algebraic: Vec<bool>,
    /// A scratch graph.
    trial: RefCell<ExprGraph>,
}

impl SlidingSurfaces {
    fn from_dae(dae: &Dae) -> SlidingSurfaces {
        let is_algebraic = |symbol: &Symbol| match symbol {
            Symbol::Unknown(i) => dae.graph.value(dae.unknowns[*i as usize].mass) != Some(1.0),
            Symbol::Element(i) | Symbol::Swept(i) => {
                family_of(&dae.families, *i).is_none_or(|(_, family)| !family.differential)
            }
            _ => false,
        };
        let reads = |root: ExprId| dae.graph.symbols(root).iter().any(is_algebraic);
        let reads_algebraic = dae.rows().map(reads).collect();
        SlidingSurfaces { reads_algebraic, trial: RefCell::new(dae.graph.clone()) }
    }

    /// Whether ė is known, and the switch may change it.
    fn is_possible(&self, dae: &Dae, model: &Model, surface: &SwitchingSurface) -> bool {
        let varying = VaryingQuantities { model, delayed: &dae.delayed_inputs };
        let rows = RowLayout { unknowns: &dae.unknowns, families: &dae.families };
        let trial = &mut *self.trial.borrow_mut();
        let Some(terms) = varying.terms(trial, surface.e, rows) else { return false };
        let n_single = self.reads_algebraic.len() - dae.families.len();
        terms.into_iter().any(|(symbol, _)| {
            let row = match symbol {
                Symbol::Unknown(i) => i as usize,
                Symbol::Element(i) => match family_of(&dae.families, i) {
                    Some((position, _)) => n_single + position,
                    None => return false,
                },
                _ => return false,
            };
            surface.rows.contains(&row) || self.reads_algebraic[row]
        })
    }
}

/// The unknown α, without its row yet.
fn share_of(dae: &mut Dae, surface: &SwitchingSurface, number: usize) -> DaeUnknown {
    let (zero, half) = (dae.graph.constant(0.0), dae.graph.constant(0.5));
    DaeUnknown {
        name: format!("share({number})"),
        unit: Unit::one(),
        doc: vec![format!(
            "How much of the side above acts, while it slides, of {}.",
            surface.name
        )],
        nominal: Some(1.0),
        differential: false,
        mass: zero,
        rhs: zero,
        start: half,
        history: None,
        fixed: true,
        equation: surface.name.clone(),
        span: dae.unknowns.first().map(|unknown| unknown.span).unwrap_or_default(),
    }
}

fn in_mode(graph: &mut ExprGraph, z: ExprId, mode: usize) -> ExprId {
    let (low, high) = (graph.constant(mode as f64 - 0.5), graph.constant(mode as f64 + 0.5));
    let above = graph.compare(Comparison::Greater, z, low);
    if mode == SLIDING {
        return above;
    }
    let below = graph.compare(Comparison::Less, z, high);
    if mode == BELOW { below } else { graph.simplified(Node::And(above, below)) }
}

/// Rebuilds all expressions with switches replaced.
struct SwitchReplacement<'a> {
    surfaces: &'a [SwitchingSurface],
    /// For each switch, its surface.
    of_switches: HashMap<ExprId, usize>,
    /// Discrete numbers from here on are conditions on time, which move by the number of new ones.
    before: usize,
    moved: usize,
}

/// A condition as a number between 0 and 1 while switches in it slide.
#[derive(Clone, Copy)]
struct SlidingWeight {
    value: ExprId,
    /// Whether one of its switches slides.
    slides: ExprId,
}

impl<'a> SwitchReplacement<'a> {
    fn new(surfaces: &'a [SwitchingSurface], before: usize, moved: usize) -> Self {
        let switches = surfaces.iter().enumerate();
        let switches =
            switches.flat_map(|(k, surface)| surface.signs.keys().map(move |id| (*id, k)));
        SwitchReplacement { surfaces, of_switches: switches.collect(), before, moved }
    }

    fn all(&self, dae: &mut Dae) -> HashMap<ExprId, ExprId> {
        let mut roots = Vec::new();
        dae.each_expression(&mut |_, id| roots.push(*id));
        roots.extend(dae.names.keys().copied());
        roots.extend(self.surfaces.iter().map(|surface| surface.e));
        let graph = &mut dae.graph;
        let mut built: HashMap<ExprId, ExprId> = HashMap::default();
        let mut weights: HashMap<ExprId, SlidingWeight> = HashMap::default();
        for (id, node) in graph.listed(roots) {
            let here = match node {
                Node::Symbol(Symbol::Discrete(i)) if i as usize >= self.before => {
                    let moved = u32::try_from(self.moved).unwrap_or(u32::MAX);
                    graph.symbol(Symbol::Discrete(i.saturating_add(moved)))
                }
                Node::Symbol(_) => id,
                Node::Select(condition, a, b) if weights.contains_key(&condition) => {
                    let (c, a, b) = (built[&condition], built[&a], built[&b]);
                    let frozen = graph.select(c, a, b);
                    blend(graph, weights[&condition], a, b, frozen)
                }
                _ => graph.simplified(node.map(|operand| built[&operand])),
            };
            let here = self.switched(graph, id, node, here, &mut weights);
            built.insert(id, here);
            if let Some(weight) = joined(graph, node, &built, &weights) {
                weights.insert(id, weight);
            }
        }
        built
    }

    /// The replacement of a switch of which steps evaluate one side only; `rebuilt` for any other.
    fn switched(
        &self,
        graph: &mut ExprGraph,
        id: ExprId,
        node: Node,
        rebuilt: ExprId,
        weights: &mut HashMap<ExprId, SlidingWeight>,
    ) -> ExprId {
        let Some(surface) = self.of_switches.get(&id).map(|k| &self.surfaces[*k]) else {
            return rebuilt;
        };
        let Some(z) = surface.z else { return rebuilt };
        let sign = surface.signs[&id];
        let (zero, one, two) = (graph.constant(0.0), graph.constant(1.0), graph.constant(2.0));
        let above = in_mode(graph, z, ABOVE);
        let slides = in_mode(graph, z, SLIDING);
        match node {
            Node::Compare(comparison, ..) => {
                let with_above = is_greater(comparison) == (sign > 0.0);
                if let Some((_, alpha)) = surface.share {
                    let value = if with_above { alpha } else { graph.subtract(one, alpha) };
                    weights.insert(id, SlidingWeight { value, slides });
                }
                let below = in_mode(graph, z, BELOW);
                if with_above { above } else { below }
            }
            Node::Call1(function, _) if function.get().name == "sign" => {
                let (high, low) = (graph.constant(sign), graph.constant(-sign));
                let value = graph.select(above, high, low);
                let Some((_, alpha)) = surface.share else { return value };
                // 2α − 1
                let share = graph.multiply(two, alpha);
                let share = graph.subtract(share, one);
                let share = if sign > 0.0 { share } else { graph.subtract(zero, share) };
                graph.select(slides, share, value)
            }
            Node::Call1(..) if surface.is_piece => absolute(graph, rebuilt, above, sign),
            // The absolute value only has a corner.
            _ => rebuilt,
        }
    }
}

/// |x| on the side of a surface on which x has this sign.
fn absolute(graph: &mut ExprGraph, rebuilt: ExprId, above: ExprId, sign: f64) -> ExprId {
    let Node::Call1(_, x) = graph.node(rebuilt) else { return rebuilt };
    let minus = graph.negate(x);
    let [high, low] = if sign > 0.0 { [x, minus] } else { [minus, x] };
    graph.select(above, high, low)
}

/// B + α (A − B) while a switch of the condition slides.
fn blend(
    graph: &mut ExprGraph,
    weight: SlidingWeight,
    a: ExprId,
    b: ExprId,
    frozen: ExprId,
) -> ExprId {
    let difference = graph.subtract(a, b);
    let part = graph.multiply(weight.value, difference);
    let between = graph.add(b, part);
    graph.select(weight.slides, between, frozen)
}

/// The weight of a condition made of others: products for `and`, 1 − (1 − a)(1 − b) for `or`.
fn joined(
    graph: &mut ExprGraph,
    node: Node,
    built: &HashMap<ExprId, ExprId>,
    weights: &HashMap<ExprId, SlidingWeight>,
) -> Option<SlidingWeight> {
    let (zero, one) = (graph.constant(0.0), graph.constant(1.0));
    match node {
        Node::Not(a) => {
            let SlidingWeight { value, slides } = *weights.get(&a)?;
            Some(SlidingWeight { value: graph.subtract(one, value), slides })
        }
        Node::And(a, b) | Node::Or(a, b) => {
            let [first, second] = [a, b].map(|side| weights.get(&side).copied());
            let slides = match (first, second) {
                (None, None) => return None,
                (Some(one), None) | (None, Some(one)) => one.slides,
                (Some(a), Some(b)) => graph.simplified(Node::Or(a.slides, b.slides)),
            };
            let mut value_of = |side: ExprId, weight: Option<SlidingWeight>| match weight {
                Some(weight) => weight.value,
                None => graph.select(built[&side], one, zero),
            };
            let (a, b) = (value_of(a, first), value_of(b, second));
            let value = if matches!(node, Node::And(..)) {
                graph.multiply(a, b)
            } else {
                let (a, b) = (graph.subtract(one, a), graph.subtract(one, b));
                let neither = graph.multiply(a, b);
                graph.subtract(one, neither)
            };
            Some(SlidingWeight { value, slides })
        }
        _ => None,
    }
}

/// The automaton of a surface, with event functions for the current rows.
fn automaton(dae: &mut Dae, model: &Model, surface: &SwitchingSurface) -> DaeAutomaton {
    let transition = |from, to, crossing, event, trigger| DaeTransition {
        from,
        to,
        event,
        crossing,
        trigger,
        resets: Vec::new(),
    };
    let (e, name) = (surface.e, surface.name.clone());
    if surface.z.is_none() {
        return DaeAutomaton {
            kind: AutomatonKind::Corner,
            name,
            modes: vec![String::new()],
            start: 0,
            transitions: vec![
                transition(0, 0, Crossing::Rises, e, Trigger::Edge),
                transition(0, 0, Crossing::Falls, e, Trigger::Edge),
            ],
        };
    }
    let mut modes = vec!["below".to_owned(), "above".to_owned()];
    let mut transitions = vec![
        transition(BELOW, ABOVE, Crossing::Rises, e, Trigger::Level),
        transition(ABOVE, BELOW, Crossing::Falls, e, Trigger::Level),
    ];
    if let Some((_, alpha)) = surface.share {
        let rate = rate_of(dae, model, e);
        let one = dae.graph.constant(1.0);
        let beyond = dae.graph.subtract(alpha, one);
        modes.push("sliding".to_owned());
        transitions.extend([
            transition(ABOVE, SLIDING, Crossing::Falls, rate, Trigger::Entry),
            transition(BELOW, SLIDING, Crossing::Rises, rate, Trigger::Entry),
            transition(SLIDING, ABOVE, Crossing::Rises, beyond, Trigger::Level),
            transition(SLIDING, BELOW, Crossing::Falls, alpha, Trigger::Level),
        ]);
    }
    let kind = if surface.is_piece { AutomatonKind::Piece } else { AutomatonKind::Switch };
    DaeAutomaton { kind, name, modes, start: BELOW, transitions }
}
