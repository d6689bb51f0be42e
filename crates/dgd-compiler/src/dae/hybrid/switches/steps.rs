//! ⌊x⌋ of a varying x, as an event at every whole number that x passes.
//!
//! The discrete number z is ⌊x⌋, so that a step that passes a whole number continues unchanged until it is cut there:
//!
//! ```text
//!   x − z − 1 rises above 0, x − z falls below 0:    z = ⌊x⌋
//! ```
//!
//! Loops whose rows step at different places have been unrolled ([`super::unrolled`]). An angle atan2(y, x) jumps by 2
//! π where y passes zero with x below zero: it is rewritten with the sign of y, which is a switch like any other.

use super::surfaces::{Variation, moves};
use super::written::written;
use crate::dae::{AutomatonKind, Crossing, Dae, DaeAutomaton, DaeTransition, Trigger};
use crate::expr::graph::Comparison;
use crate::expr::hash::HashMap;
use crate::expr::intrinsics::IntrinsicId;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::Model;

/// Turns the steps in the rows into events, and the angles that jump into switches.
pub(super) fn locate(dae: &mut Dae, model: &Model) {
    if !["floor", "atan2"].iter().any(|name| dae.graph.calls(IntrinsicId::named(name))) {
        return;
    }
    let rows = dae.graph.listed(dae.rows());
    let moving = moves(dae, model, &rows);
    let before = dae.automata.len();
    let mut steps = Vec::new();
    let mut angles = Vec::new();
    for (id, node) in rows {
        let Variation { varies, sweeps } = moving[&id];
        match node {
            Node::Call1(function, x) if function.get().name == "floor" && varies && !sweeps => {
                steps.push((id, x));
            }
            Node::Call2(function, y, x)
                if function.get().name == "atan2" && moving[&y].varies && !sweeps =>
            {
                angles.push((id, y, x));
            }
            _ => {}
        }
    }
    if steps.is_empty() && angles.is_empty() {
        return;
    }
    let mut replacement: HashMap<ExprId, ExprId> = HashMap::default();
    for (k, (id, _)) in steps.iter().enumerate() {
        let position = u32::try_from(before + k).unwrap_or(u32::MAX);
        replacement.insert(*id, dae.graph.symbol(Symbol::Discrete(position)));
    }
    let replacing = StepReplacement { replacement, angles: angles.iter().map(|a| a.0).collect() };
    let built = replacing.all(dae, before, steps.len(), steps.iter().map(|(_, x)| *x));
    for (id, x) in steps {
        let (z, x) = (replacing.replacement[&id], built[&x]);
        let automaton = automaton(dae, model, x, z);
        dae.automata.push(automaton);
    }
}

/// Whether a row of a loop steps where a value that differs from row to row passes a whole number.
pub(super) fn differ_by_row(dae: &Dae, model: &Model, row: ExprId) -> bool {
    let nodes = dae.graph.listed([row]);
    let moving = moves(dae, model, &nodes);
    nodes.iter().any(|(id, node)| {
        let Variation { varies, sweeps } = moving[id];
        matches!(node, Node::Call1(function, _) if function.get().name == "floor")
            && varies
            && sweeps
    })
}

/// The row of a loop with switches for angles whose jumps differ from row to row.
pub(super) fn with_switched_angles(dae: &mut Dae, model: &Model, row: ExprId) -> ExprId {
    let nodes = dae.graph.listed([row]);
    let moving = moves(dae, model, &nodes);
    let mut built: HashMap<ExprId, ExprId> = HashMap::default();
    for (id, node) in nodes {
        let here = match node {
            Node::Symbol(_) => id,
            Node::Call2(function, y, x)
                if function.get().name == "atan2" && moving[&y].varies && moving[&id].sweeps =>
            {
                angle(&mut dae.graph, built[&y], built[&x])
            }
            _ => dae.graph.simplified(node.map(|operand| built[&operand])),
        };
        built.insert(id, here);
    }
    built[&row]
}

/// Rebuilds all expressions.
pub(super) struct StepReplacement {
    /// For each step, its discrete number.
    pub(super) replacement: HashMap<ExprId, ExprId>,
    pub(super) angles: Vec<ExprId>,
}

impl StepReplacement {
    /// Rebuilds all expressions, and `more`. Discrete numbers from `first` on move by `by`.
    pub(super) fn all(
        &self,
        dae: &mut Dae,
        first: usize,
        by: usize,
        more: impl Iterator<Item = ExprId>,
    ) -> HashMap<ExprId, ExprId> {
        let mut roots: Vec<ExprId> = more.collect();
        dae.each_expression(&mut |_, id| roots.push(*id));
        roots.extend(dae.names.keys().copied());
        let graph = &mut dae.graph;
        let mut built: HashMap<ExprId, ExprId> = HashMap::default();
        for (id, node) in graph.listed(roots) {
            let here = match (self.replacement.get(&id), node) {
                (Some(z), _) => *z,
                (None, Node::Symbol(Symbol::Discrete(i))) if i as usize >= first => {
                    let moved = u32::try_from(by).unwrap_or(u32::MAX);
                    graph.symbol(Symbol::Discrete(i.saturating_add(moved)))
                }
                (None, Node::Symbol(_)) => id,
                (None, Node::Call2(_, y, x)) if self.angles.contains(&id) => {
                    angle(graph, built[&y], built[&x])
                }
                (None, _) => graph.simplified(node.map(|operand| built[&operand])),
            };
            built.insert(id, here);
        }
        dae.each_expression(&mut |_, id| *id = built[id]);
        let names = std::mem::take(&mut dae.names);
        dae.names = names.into_iter().map(|(id, name)| (built[&id], name)).collect();
        built
    }
}

/// atan2(y, x), left of the origin as atan(y/x) ± π: each side continues smoothly through the other.
fn angle(graph: &mut ExprGraph, y: ExprId, x: ExprId) -> ExprId {
    let pi = std::f64::consts::PI;
    let (zero, half_turn, back) = (graph.constant(0.0), graph.constant(pi), graph.constant(-pi));
    let size = graph.call1("abs", y);
    let edge = graph.add(x, size);
    let is_left = graph.compare(Comparison::Less, edge, zero);
    let is_below = graph.compare(Comparison::Less, y, zero);
    let turn = graph.select(is_below, back, half_turn);
    let slope = graph.divide(y, x);
    let angle = graph.call1("atan", slope);
    let left = graph.add(turn, angle);
    let usual = graph.call(IntrinsicId::named("atan2"), &[y, x]);
    graph.select(is_left, left, usual)
}

/// The automaton of the steps of x, counted by z.
fn automaton(dae: &mut Dae, model: &Model, x: ExprId, z: ExprId) -> DaeAutomaton {
    let name = format!("floor of {}", written(dae, model, x));
    let one = dae.graph.constant(1.0);
    let above = dae.graph.subtract(x, z);
    let beyond = dae.graph.subtract(above, one);
    of_two(AutomatonKind::Step, name, beyond, above)
}

/// An automaton of one mode that acts when one event function rises above zero or another falls below.
pub(super) fn of_two(
    kind: AutomatonKind,
    name: String,
    rising: ExprId,
    falling: ExprId,
) -> DaeAutomaton {
    let transition = |crossing, event| DaeTransition {
        from: 0,
        to: 0,
        event,
        crossing,
        trigger: Trigger::Level,
        resets: Vec::new(),
    };
    let transitions =
        vec![transition(Crossing::Rises, rising), transition(Crossing::Falls, falling)];
    DaeAutomaton { kind, name, modes: vec![String::new()], start: 0, transitions }
}
