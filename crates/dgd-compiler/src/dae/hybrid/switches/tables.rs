//! Tables: events at the knots at which a row's slope jumps, and at the ends of the table where a run ends.
//!
//! All knots of a table, at one argument x, are one automaton. Its discrete number z counts the knots passed, by the
//! broken line s that is k at the k-th knot:
//!
//! ```text
//!   s(x) − z − 1 rises above 0, s(x) − z falls below 0:    z = ⌊s(x)⌋
//! ```
//!
//! For a smooth table these are all knots if its argument does not depend on the solution: error control sees an
//! argument that the solution determines, but not a clock, along which every method is exact. Values that differ from
//! row to row of a loop are computed row by row, without events.

use std::collections::BTreeSet;

use super::driven::DrivenUnknowns;
use super::steps::{StepReplacement, of_two};
use super::surfaces::moves;
use super::written::written;
use crate::dae::{AutomatonKind, Dae};
use crate::expr::curve::interpolate::position;
use crate::expr::curve::{CurveId, TableCurve};
use crate::expr::hash::HashMap;
use crate::expr::{ExprId, Node, Symbol};
use crate::model::Model;

/// The argument of a table counts as beyond it from this fraction of the table's width: a value at rest at an end is
/// accurate only to the tolerance.
pub(super) const BEYOND: f64 = 1e-6;

/// A curve, and the argument at which it is evaluated.
type TableRead = (CurveId, ExprId);

/// The knots of a table at which steps end.
struct KnotStops {
    curve: &'static TableCurve,
    x: ExprId,
    at: Vec<f64>,
}

/// Turns the knots and the ends of tables into automata.
pub(super) fn locate(dae: &mut Dae, model: &Model) {
    let rows = dae.graph.listed(dae.rows());
    let outputs = dae.graph.listed(dae.outputs.iter().map(|output| output.value));
    let curves = |nodes: &[(ExprId, Node)]| -> Vec<TableRead> {
        let read = nodes.iter().filter_map(|(_, node)| match node {
            Node::Curve(curve, x) => Some((*curve, *x)),
            _ => None,
        });
        read.collect()
    };
    let (of_rows, of_outputs) = (curves(&rows), curves(&outputs));
    if of_rows.is_empty() && of_outputs.is_empty() {
        return;
    }
    let mut moving = moves(dae, model, &rows);
    moving.extend(moves(dae, model, &outputs));
    let is_single = |(_, x): &TableRead| !moving[x].sweeps;
    let driven = DrivenUnknowns::from_dae(dae, model);
    let stops = |(curve, x): TableRead| -> Option<KnotStops> {
        let curve = curve.get();
        if !moving[&x].varies || moving[&x].sweeps || !curve.is_table() {
            return None;
        }
        let arguments =
            if driven.drives(dae, x) { curve.curve.knots.to_vec() } else { curve.kinks.clone() };
        (!arguments.is_empty()).then_some(KnotStops { curve, x, at: arguments })
    };
    let mut known = BTreeSet::new();
    let mut knots: Vec<KnotStops> = of_rows.iter().copied().filter_map(stops).collect();
    knots.retain(|stops| known.insert((bits(&stops.at), stops.x)));
    let limited = of_rows.into_iter().chain(of_outputs).filter(is_single);
    let limits = distinct(limited.filter(|read| read.0.get().limit.is_some()), |curve| {
        let text = curve.limit.iter().flat_map(|text| text.bytes().map(u64::from));
        bits(&curve.ends).into_iter().chain(text).collect()
    });
    let before = dae.automata.len();
    let arguments: Vec<ExprId> =
        knots.iter().map(|stops| stops.x).chain(limits.iter().map(|(_, x)| *x)).collect();
    let (replacement, angles) = (HashMap::default(), Vec::new());
    let replacing = StepReplacement { replacement, angles };
    let built = replacing.all(dae, before, knots.len() + limits.len(), arguments.into_iter());
    for KnotStops { curve, x, at } in knots {
        make_knots(dae, model, curve, &at, built[&x]);
    }
    for (curve, x) in limits {
        make_limit(dae, curve.get(), built[&x]);
    }
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|x| x.to_bits()).collect()
}

/// The first of each group that share an automaton.
fn distinct(
    all: impl Iterator<Item = TableRead>,
    what: impl Fn(&TableCurve) -> Vec<u64>,
) -> Vec<TableRead> {
    let mut known = BTreeSet::new();
    all.filter(|(curve, x)| known.insert((what(curve.get()), *x))).collect()
}

fn make_knots(dae: &mut Dae, model: &Model, curve: &TableCurve, at: &[f64], x: ExprId) {
    let TableCurve { ends, name, .. } = curve;
    let table = name.split('[').next().unwrap_or_default();
    let line = TableCurve {
        name: format!("segment of {table}"),
        curve: position(at, ends[1] - ends[0]),
        smooth: 0,
        kinks: Vec::new(),
        ends: *ends,
        limit: None,
    };
    let line = CurveId::store(line);
    let z = u32::try_from(dae.automata.len()).unwrap_or(u32::MAX);
    let name = format!("segment of {table}({})", written(dae, model, x));
    let graph = &mut dae.graph;
    let (z, one) = (graph.symbol(Symbol::Discrete(z)), graph.constant(1.0));
    let position = graph.simplified(Node::Curve(line, x));
    let above = graph.subtract(position, z);
    let beyond = graph.subtract(above, one);
    dae.automata.push(of_two(AutomatonKind::Knots, name, beyond, above));
}

fn make_limit(dae: &mut Dae, curve: &TableCurve, x: ExprId) {
    let [low, high] = curve.ends;
    let slack = BEYOND * (high - low);
    let graph = &mut dae.graph;
    let (low, high) = (graph.constant(low - slack), graph.constant(high + slack));
    let (above, below) = (graph.subtract(x, high), graph.subtract(x, low));
    let name = curve.limit.clone().unwrap_or_default();
    dae.automata.push(of_two(AutomatonKind::Limit, name, above, below));
}
