//! Delays that may jump by themselves, by a comparison, a step or a table, become unknowns.
//!
//! Such a delay has an equation of its own, lag = τ, whose switches are events like those of any other equation.

use std::borrow::Cow;

use crate::dae::transfer::roots;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::{DeclarationHeader, Equation, Model, Unknown};
use crate::units::{Unit, parse_unit};

/// Initial guess for a delay that is unknown in advance, s.
const GUESS: f64 = 1.0;

/// The model with an unknown and an equation for each delay that may jump by itself, and the position of the unknown
/// for each of these delays.
pub(in crate::dae) fn with_lags(model: &Model) -> (Cow<'_, Model>, Vec<(ExprId, u32)>) {
    let nodes = model.graph.listed(roots(model));
    let mut jumping: Vec<ExprId> = nodes
        .into_iter()
        .filter_map(|(_, node)| match node {
            Node::Delay(_, tau) if jumps(&model.graph, tau) => Some(tau),
            _ => None,
        })
        .collect();
    jumping.sort_unstable();
    jumping.dedup();
    if jumping.is_empty() {
        return (Cow::Borrowed(model), Vec::new());
    }
    let mut model = model.clone();
    let lags = jumping.into_iter().map(|tau| (tau, add_lag(&mut model, tau)));
    let lags = lags.collect();
    (Cow::Owned(model), lags)
}

/// Whether a delay changes during a run, and not smoothly.
fn jumps(graph: &ExprGraph, tau: ExprId) -> bool {
    let varies =
        |symbol: &Symbol| matches!(symbol, Symbol::Time | Symbol::Input(_) | Symbol::Unknown(_));
    if !graph.symbols(tau).iter().any(varies) {
        return false;
    }
    graph.listed([tau]).into_iter().any(|(_, node)| match node {
        Node::Compare(..) | Node::Select(..) => true,
        Node::Call1(function, _) if function.get().name == "sign" => true,
        _ => node.steps(),
    })
}

/// Adds an unknown that equals a delay, and returns its position.
fn add_lag(model: &mut Model, tau: ExprId) -> u32 {
    let position = u32::try_from(model.unknowns.len()).unwrap_or(u32::MAX);
    let taken = |name: &str| model.unknowns.iter().any(|unknown| unknown.declared.name == name);
    let mut number = 1;
    while taken(&format!("lag({number})")) {
        number += 1;
    }
    let name = format!("lag({number})");
    let known = |symbol: &Symbol| {
        matches!(symbol, Symbol::Constant(_) | Symbol::Parameter(_) | Symbol::Input(_))
    };
    let is_known = model.graph.symbols(tau).iter().all(known);
    let start = if is_known { tau } else { model.graph.constant(GUESS) };
    let unit = parse_unit("s").unwrap_or_else(|_| Unit::one());
    let span = model.unknowns.first().map(|unknown| unknown.declared.span).unwrap_or_default();
    let doc = vec!["How late something is read, by a delay that may jump.".to_owned()];
    let dimension = unit.dimension;
    model.unknowns.push(Unknown {
        declared: DeclarationHeader { name: name.clone(), span, unit, doc },
        state: false,
        start,
        fixed: true,
        guess: false,
        nominal: None,
        history: None,
        noise: None,
    });
    let left = model.graph.symbol(Symbol::Unknown(position));
    model.equations.push(Equation {
        label: name,
        span,
        doc: Vec::new(),
        left,
        right: tau,
        dimension,
        is_exact: true,
    });
    position
}
