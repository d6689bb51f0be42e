//! Tables of time and tables with steps: a discrete number selects the piece of the curve, so that a step evaluates one
//! polynomial and continues it until the step is cut at the knot.
//!
//! ```text
//!   f(x) = c₀[k] + d (c₁[k] + d (c₂[k] + d c₃[k])),   d = x − knot[k]
//! ```
//!
//! If x is linear in time, k is counted by a clock that ticks at the knots, so no knot is missed, however long the
//! steps that the rest of the model allows. Otherwise, the knots of a table that jumps are counted by a step, ⌊s(x)⌋ of
//! the broken line s that is k at the k-th knot. Values that differ from row to row of a loop are computed row by row.

use super::surfaces::moves;
use super::tables::BEYOND;
use crate::dae::Dae;
use crate::dae::hybrid::lines::{TimeAffineMap, ticks};
use crate::expr::curve::interpolate::position;
use crate::expr::curve::{CurveId, TableCurve};
use crate::expr::hash::{HashMap, HashSet};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::Model;

/// Curves with the same knots at the same argument share a number.
type KnotKey = (Vec<u64>, ExprId);

/// Splits tables of time and tables with steps into pieces.
pub(super) fn take_apart(dae: &mut Dae, model: &Model) {
    let acting = dae.automata.iter().flat_map(|automaton| &automaton.transitions);
    let acting = acting.flat_map(|transition| {
        std::iter::once(transition.event).chain(transition.resets.iter().map(|(_, value)| *value))
    });
    let rows = dae.graph.listed(dae.rows().chain(acting).collect::<Vec<_>>());
    let is_table = |node: &Node| matches!(node, Node::Curve(curve, _) if curve.get().is_table());
    let outputs = dae.graph.listed(dae.outputs.iter().map(|output| output.value));
    if !rows.iter().chain(&outputs).any(|(_, node)| is_table(node)) {
        return;
    }
    let mut moving = moves(dae, model, &rows);
    moving.extend(moves(dae, model, &outputs));
    let of_rows: HashSet<ExprId> = rows.iter().map(|(id, _)| *id).collect();

    let mut roots: Vec<ExprId> = Vec::new();
    dae.each_expression(&mut |_, id| roots.push(*id));
    roots.extend(dae.names.keys().copied());
    let nodes = dae.graph.listed(roots);
    let mut lines = TimeAffineMap::new(nodes.len(), dae.automata.len());
    let mut built: HashMap<ExprId, ExprId> = HashMap::default();
    let mut numbers: HashMap<KnotKey, ExprId> = HashMap::default();
    for (id, node) in nodes {
        lines.read(&mut dae.graph, id, node);
        let is_changed = node.operands().any(|operand| built[&operand] != operand);
        let mut here =
            if is_changed { dae.graph.simplified(node.map(|operand| built[&operand])) } else { id };
        if let Node::Curve(curve, x) = node
            && is_table(&node)
            && (of_rows.contains(&id) || curve.get().jumps())
        {
            let marks = knots(curve.get());
            let key = (marks.iter().map(|mark| mark.to_bits()).collect(), x);
            let line = lines.affine(x).filter(|line| line.beta.is_some());
            let number = match (numbers.get(&key), line) {
                (Some(number), _) => Some(*number),
                (None, Some(line)) => {
                    let condition = dae.time_conditions.len();
                    let (times, clock) = ticks(&mut dae.graph, line, condition, marks);
                    dae.time_conditions.extend(times);
                    dae.clocks.push(clock);
                    let position = u32::try_from(dae.automata.len() + condition);
                    let position = position.unwrap_or(u32::MAX);
                    Some(dae.graph.symbol(Symbol::Discrete(position)))
                }
                (None, None) => {
                    let is_counted = curve.get().jumps()
                        && moving.get(&x).is_some_and(|x| x.varies && !x.sweeps);
                    is_counted.then(|| counted(&mut dae.graph, curve.get(), &marks, built[&x]))
                }
            };
            if let Some(number) = number {
                numbers.insert(key, number);
                here = piece(&mut dae.graph, curve.get(), number, built[&x]);
            }
        }
        built.insert(id, here);
    }
    if numbers.is_empty() {
        return;
    }
    dae.each_expression(&mut |_, id| *id = *built.get(id).unwrap_or(id));
    let names = std::mem::take(&mut dae.names);
    dae.names = names.into_iter().map(|(id, name)| (built[&id], name)).collect();
}

/// The knots between pieces. At an end where a run ends, the last piece is extended a little.
fn knots(curve: &TableCurve) -> Vec<f64> {
    let mut knots = curve.curve.knots.to_vec();
    if curve.limit.is_some()
        && let [low, high] = curve.ends
        && let [first, .., last] = &mut knots[..]
    {
        let slack = BEYOND * (high - low);
        (*first, *last) = (low - slack, high + slack);
    }
    knots
}

/// The number of the piece at x, as a step function.
fn counted(graph: &mut ExprGraph, curve: &TableCurve, marks: &[f64], x: ExprId) -> ExprId {
    let TableCurve { ends, name, .. } = curve;
    let table = name.split('[').next().unwrap_or_default();
    let line = TableCurve {
        name: format!("segment of {table}"),
        curve: position(marks, ends[1] - ends[0]),
        smooth: 0,
        kinks: Vec::new(),
        ends: *ends,
        limit: None,
    };
    let position = graph.simplified(Node::Curve(CurveId::store(line), x));
    let passed = graph.call1("floor", position);
    let one = graph.constant(1.0);
    graph.add(passed, one)
}

/// The piece of a curve with this number.
fn piece(graph: &mut ExprGraph, curve: &TableCurve, number: ExprId, x: ExprId) -> ExprId {
    let TableCurve { curve: of, name, limit, .. } = curve;
    let look_up = |graph: &mut ExprGraph, what: &str, numbers: &[f64], limit: Option<String>| {
        if limit.is_none() && numbers.iter().all(|number| *number == numbers[0]) {
            return graph.constant(numbers[0]);
        }
        let curve = CurveId::of_numbers(&format!("{name} {what}"), numbers, limit);
        graph.simplified(Node::Curve(curve, number))
    };
    let knots: Vec<f64> = (0..of.pieces.len()).map(|k| of.knots[k.saturating_sub(1)]).collect();
    let knot = look_up(graph, "knot", &knots, None);
    let distance = graph.subtract(x, knot);
    let zero = graph.constant(0.0);
    (0..4).rev().fold(zero, |higher, k| {
        let coefficients: Vec<f64> = of.pieces.iter().map(|piece| piece[k]).collect();
        let limit = limit.clone().filter(|_| k == 0);
        let lowest = look_up(graph, &format!("c{k}"), &coefficients, limit);
        let rest = graph.multiply(distance, higher);
        graph.add(lowest, rest)
    })
}
