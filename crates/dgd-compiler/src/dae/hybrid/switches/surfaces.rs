//! The surfaces on which the switches of the rows change.

use std::collections::BTreeMap;

use crate::dae::Dae;
use crate::dae::hybrid::smoothness::{Continuity, SwitchSigns, SymbolSizes, values_at_random};
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::{Interpolation, Model};

/// A surface, and the switches that change on it.
pub(super) struct SwitchingSurface {
    pub(super) e: ExprId,
    /// The switches, each with its sign where e > 0.
    pub(super) signs: SwitchSigns,
    /// Positions of the rows that read one of them.
    pub(super) rows: Vec<usize>,
    pub(super) passage: Continuity,
    /// Whether steps evaluate one side only, although no value jumps.
    pub(super) is_piece: bool,
    pub(super) name: String,
    /// Its discrete number, if steps evaluate one side only.
    pub(super) z: Option<ExprId>,
    /// α, if it can slide.
    pub(super) share: Option<(u32, ExprId)>,
}

impl SwitchingSurface {
    /// Whether steps evaluate one side only.
    pub(super) fn is_held(&self) -> bool {
        self.is_piece || self.passage == Continuity::Jump
    }
}

/// Number of points at which two expressions are compared, and how constant their ratio must be for them to be
/// multiples of each other.
const PLACES: usize = 3;
const SAME: f64 = 1e-9;

/// How an expression varies.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Variation {
    /// Between samples.
    pub(super) varies: bool,
    /// From row to row of a loop.
    pub(super) sweeps: bool,
}

/// Kinds of surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SurfaceKind {
    /// Surfaces that all rows of a loop share.
    Common,
    /// Surfaces that each row of a loop has of its own.
    OfRows,
}

/// The surfaces of the switches in `roots` that can change between samples.
pub(super) fn surfaces(
    dae: &mut Dae,
    model: &Model,
    roots: &[ExprId],
    which: SurfaceKind,
) -> Vec<SwitchingSurface> {
    let nodes = dae.graph.listed(roots.iter().copied());
    let moves = moves(dae, model, &nodes);
    let mut surfaces: Vec<SwitchingSurface> = Vec::new();
    let mut known: HashMap<ExprId, usize> = HashMap::default();
    for (id, node) in nodes {
        let here = moves[&id];
        let (e, sign) = match node {
            Node::Compare(_, a, b) => (dae.graph.subtract(a, b), 1.0),
            Node::Call1(f, x) if matches!(f.get().name, "abs" | "sign") => (x, 1.0),
            _ => continue,
        };
        let wanted = here.varies && here.sweeps == (which == SurfaceKind::OfRows);
        if !wanted || dae.graph.value(e).is_some() {
            continue;
        }
        let (e, sign) = match dae.graph.node(e) {
            Node::Negate(inner) => (inner, -sign),
            _ => (e, sign),
        };
        let minus = dae.graph.negate(e);
        if let Some(surface) = known.get(&e) {
            surfaces[*surface].signs.insert(id, sign);
        } else if let Some(surface) = known.get(&minus) {
            surfaces[*surface].signs.insert(id, -sign);
        } else {
            known.insert(e, surfaces.len());
            let signs = [(id, sign)].into_iter().collect();
            let (passage, name) = (Continuity::Smooth, String::new());
            let rows = Vec::new();
            surfaces.push(SwitchingSurface {
                e,
                signs,
                rows,
                passage,
                is_piece: false,
                name,
                z: None,
                share: None,
            });
        }
    }
    joined(dae, model, surfaces)
}

/// How expressions vary, operands first.
pub(super) fn moves(
    dae: &Dae,
    model: &Model,
    nodes: &[(ExprId, Node)],
) -> HashMap<ExprId, Variation> {
    let is_linear: Vec<bool> = {
        let declared = model.inputs.iter().map(|input| input.interpolation);
        let delayed = dae.delayed_inputs.iter().map(|l| model.inputs[l.input].interpolation);
        declared
            .chain(delayed)
            .map(|interpolation| interpolation == Interpolation::Linear)
            .collect()
    };
    let mut moves: HashMap<ExprId, Variation> =
        HashMap::with_capacity_and_hasher(nodes.len(), <_>::default());
    for &(id, node) in nodes {
        let here = match node {
            Node::Symbol(symbol) => moves_of(symbol, &is_linear),
            _ => {
                node.operands().map(|operand| moves[&operand]).fold(Variation::default(), |a, b| {
                    Variation { varies: a.varies || b.varies, sweeps: a.sweeps || b.sweeps }
                })
            }
        };
        moves.insert(id, here);
    }
    moves
}

fn moves_of(symbol: Symbol, is_linear: &[bool]) -> Variation {
    let varies = match symbol {
        Symbol::Time
        | Symbol::Unknown(_)
        | Symbol::Element(_)
        | Symbol::Swept(_)
        | Symbol::DelayedUnknown(_) => true,
        // The elements of an array are interpolated alike.
        Symbol::Input(i) | Symbol::SweptInput(i, _) => {
            is_linear.get(i as usize).copied().unwrap_or(false)
        }
        _ => false,
    };
    let sweeps = matches!(
        symbol,
        Symbol::Swept(_) | Symbol::SweptParameter(..) | Symbol::SweptInput(..) | Symbol::Counter
    );
    Variation { varies, sweeps }
}

/// Whether an expression that is a multiple of another at some points is so everywhere.
pub(super) fn is_smooth(graph: &ExprGraph, e: ExprId) -> bool {
    graph.listed([e]).into_iter().all(|(_, node)| match node {
        Node::Select(..) | Node::Compare(..) | Node::Curve(..) => false,
        Node::Call1(function, _) => !matches!(function.get().name, "abs" | "sign"),
        _ => true,
    })
}

/// Merges equivalent surfaces: `x > 1` and `2*x + 1 > 3` change at the same time, whatever the parameters.
fn joined(dae: &Dae, model: &Model, surfaces: Vec<SwitchingSurface>) -> Vec<SwitchingSurface> {
    let typical = SymbolSizes::estimate(dae, model);
    let mut of_symbols: BTreeMap<Vec<Symbol>, Vec<(usize, [f64; PLACES])>> = BTreeMap::new();
    let mut joined: Vec<SwitchingSurface> = Vec::new();
    for surface in surfaces {
        if !is_smooth(&dae.graph, surface.e) {
            joined.push(surface);
            continue;
        }
        let values = values_at_random(&dae.graph, &typical, surface.e);
        let others = of_symbols.entry(dae.graph.symbols(surface.e)).or_default();
        let ratio = |other: &[f64; PLACES]| {
            let ratio = values[0] / other[0];
            let is_constant = values
                .iter()
                .zip(other)
                .all(|(a, b)| (a / b - ratio).abs() <= SAME * ratio.abs() && ratio != 0.0);
            is_constant.then_some(ratio)
        };
        let same = others.iter().find_map(|(at, other)| Some((*at, ratio(other)?)));
        if let Some((at, ratio)) = same {
            let signs = surface.signs.iter().map(|(id, sign)| (*id, sign * ratio.signum()));
            joined[at].signs.extend(signs);
        } else {
            others.push((joined.len(), values));
            joined.push(surface);
        }
    }
    joined
}
