//! `saturate`: an unknown stays at its bound while its own equation would take it beyond.
//!
//! Each such unknown has an automaton of its own with the modes free and at a bound b, and its row chooses between
//! them:
//!
//! ```text
//!              free        at a bound   to the bound when     released when
//!   ẋ = f      ẋ = f       ẋ = ḃ        x passes b; x = b     f − ḃ points inwards
//!   0 = f      0 = f       0 = b − x    f(b) points outwards  f(b) points inwards
//! ```
//!
//! For an algebraic f, the sign of its slope ∂f/∂x slightly inside the bound gives the direction: x solves 0 = f there,
//! so f(b) and the slope together show on which side of b the solution lies. At the bound itself the slope can vanish,
//! as it does for q|q|.

use crate::dae::families::isolate;
use crate::dae::rates::{RowLayout, VaryingQuantities};
use crate::dae::{
    AutomatonKind, DaeAutomaton, DaeFamily, DaeTransition, DaeUnknown, Trigger, position,
};
use crate::expr::graph::Comparison;
use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::{BoundSide, Crossing, Model};

/// Distance inside the bound at which the slope of an algebraic row is evaluated, relative to the size of the unknown.
const A_LITTLE: f64 = 1e-3;
/// Rounding error of a state at its bound, relative to the size of the unknown.
const A_HAIR: f64 = 1e-9;
/// The mode in which no bound acts.
const FREE: usize = 0;

/// Number of automata, including those of saturations.
pub(in crate::dae) fn n_automata(model: &Model) -> usize {
    model.automata.len() + saturated(model).len()
}

/// The unknowns with bounds, in the order of the file.
fn saturated(model: &Model) -> Vec<Symbol> {
    let mut symbols: Vec<Symbol> = Vec::new();
    for saturation in &model.saturations {
        if !symbols.contains(&saturation.unknown) {
            symbols.push(saturation.unknown);
        }
    }
    symbols
}

/// A bound, and the mode of the unknown at it.
#[derive(Clone, Copy)]
struct ActiveBound {
    side: BoundSide,
    bound: ExprId,
    mode: usize,
}

/// An unknown, or an element of an array, with its row.
struct BoundedUnknown {
    symbol: Symbol,
    name: String,
    size: f64,
    rhs: ExprId,
    mass: ExprId,
}

/// Makes the rows of unknowns with bounds depend on their modes, and adds the automata.
pub(in crate::dae) fn saturate(
    graph: &mut ExprGraph,
    varying: VaryingQuantities<'_>,
    bounds: &[ExprId],
    unknowns: &mut [DaeUnknown],
    families: &mut Vec<DaeFamily>,
    automata: &mut Vec<DaeAutomaton>,
) {
    let model = varying.model;
    for symbol in saturated(model) {
        let own_bounds = model.saturations.iter().zip(bounds).filter(|(s, _)| s.unknown == symbol);
        let bounds_of_x: Vec<ActiveBound> = own_bounds
            .zip(FREE + 1..)
            .map(|((saturation, bound), mode)| ActiveBound {
                side: saturation.side,
                bound: *bound,
                mode,
            })
            .collect();
        let automaton = u32::try_from(automata.len()).unwrap_or(u32::MAX);
        let now = graph.symbol(Symbol::Discrete(automaton));
        let declared = match symbol {
            Symbol::Unknown(i) => &model.unknowns[i as usize],
            Symbol::Element(i) => &model.array_of(i).unknown,
            _ => unreachable!("what has a bound is an unknown or an element"),
        };
        let (rhs, mass) = if let Symbol::Element(i) = symbol {
            let row = isolate(graph, families, i).map(|family| &mut families[family]);
            let row = row.unwrap_or_else(|| unreachable!("each element has its row"));
            (&mut row.rhs, row.mass)
        } else {
            let unknown = &mut unknowns[position(symbol)];
            (&mut unknown.rhs, unknown.mass)
        };
        let bounded = BoundedUnknown {
            symbol,
            name: model.unknown_name(symbol),
            size: declared.nominal.unwrap_or(declared.declared.unit.factor).abs(),
            rhs: *rhs,
            mass,
        };
        let mut transitions = Vec::new();
        for bound in &bounds_of_x {
            let (held, changes) = at_bound(graph, varying, &bounded, *bound);
            let behind = graph.constant(bound.mode as f64 - 0.5);
            let before = graph.constant(bound.mode as f64 + 0.5);
            let above = graph.compare(Comparison::Greater, now, behind);
            let below = graph.compare(Comparison::Less, now, before);
            let is_mode = graph.simplified(crate::expr::graph::Node::And(above, below));
            *rhs = graph.select(is_mode, held, *rhs);
            transitions.extend(changes);
        }
        let names = bounds_of_x.iter().map(|bound| match bound.side {
            BoundSide::Lower => "at its lower bound",
            BoundSide::Upper => "at its upper bound",
        });
        automata.push(DaeAutomaton {
            kind: AutomatonKind::Saturation,
            name: format!("saturate {}", bounded.name),
            modes: std::iter::once("free").chain(names).map(str::to_owned).collect(),
            start: FREE,
            transitions,
        });
    }
}

/// The row of an unknown at a bound, and the transitions to it and from it.
fn at_bound(
    graph: &mut ExprGraph,
    varying: VaryingQuantities<'_>,
    unknown: &BoundedUnknown,
    at: ActiveBound,
) -> (ExprId, Vec<DaeTransition>) {
    let (this, size) = (unknown.symbol, unknown.size);
    let x = graph.symbol(this);
    let rate = varying.rate(graph, at.bound, RowLayout { unknowns: &[], families: &[] });
    let rate = rate.unwrap_or_else(|| unreachable!("bounds read no unknowns"));
    let inwards = |graph: &mut ExprGraph, value: ExprId| match at.side {
        BoundSide::Lower => value,
        BoundSide::Upper => graph.negate(value),
    };

    // x − b and f − ḃ
    let distance = graph.subtract(x, at.bound);
    let distance = inwards(graph, distance);
    let relative = graph.subtract(unknown.rhs, rate);
    let relative = inwards(graph, relative);

    // −f(b) sign(∂f/∂x)
    let at_bound = graph.substitute(unknown.rhs, |symbol| (symbol == this).then_some(at.bound));
    let slope = graph.gradient(unknown.rhs, |symbol| (symbol == this).then_some(0));
    let slope = slope.first().map_or_else(|| graph.constant(0.0), |(_, slope)| *slope);
    let little = graph.constant(A_LITTLE * size);
    let little = inwards(graph, little);
    let inside = graph.add(at.bound, little);
    let slope = graph.substitute(slope, |symbol| (symbol == this).then_some(inside));
    let sign = graph.call1("sign", slope);
    let solution = graph.multiply(at_bound, sign);
    let solution = graph.negate(solution);
    let solution = inwards(graph, solution);

    let half = graph.constant(0.5);
    let differential = graph.compare(Comparison::Greater, unknown.mass, half);
    let away = graph.subtract(at.bound, x);
    let stays = graph.select(differential, rate, away);
    let enter = graph.select(differential, distance, solution);
    let leave = graph.select(differential, relative, solution);
    let reset = vec![(this, at.bound)];
    let transition = |from, to, crossing, event, resets: &[(Symbol, ExprId)]| DaeTransition {
        from,
        to,
        event,
        crossing,
        trigger: Trigger::Level,
        resets: resets.to_vec(),
    };
    let mut transitions = vec![
        transition(FREE, at.mode, Crossing::Falls, enter, &reset),
        transition(at.mode, FREE, Crossing::Rises, leave, &reset),
    ];
    if graph.symbols(at.bound).iter().any(|symbol| matches!(symbol, Symbol::Input(_))) {
        // A bound that jumps takes x along or leaves it behind.
        let hair = graph.constant(A_HAIR * size);
        let (taken, left) = (graph.add(distance, hair), graph.subtract(distance, hair));
        transitions.extend([
            transition(at.mode, at.mode, Crossing::Falls, taken, &reset),
            transition(at.mode, FREE, Crossing::Rises, left, &[]),
        ]);
    }
    (stays, transitions)
}
