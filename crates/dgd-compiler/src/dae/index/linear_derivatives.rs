//! Solves equations for derivatives: ẋ = f, if they are linear in derivatives.
//!
//! Equations that share derivatives are solved together. If they have constant coefficients,
//!
//! ```text
//!   0 = A ẋ + b,   rows eliminated:   Σ c ẋ = f for as many combinations as A has rank,
//!                                     0 = b'    for the rows that are left.
//! ```
//!
//! A combination w = Σ c x of several unknowns is an unknown of its own: ẇ = f, while the x are algebraic. So a
//! capacitor between two nodes does not require differentiating an equation. If A has full rank or is not constant,
//! derivatives stay in the equations as algebraic unknowns z, ẋ = z.

use std::collections::BTreeMap;

use super::identity::{is_constant, tidied};
use super::variables::{UnknownList, sum};
use crate::dae::transfer::TransferredEquation;
use crate::expr::{ExprGraph, ExprId, Symbol};

/// 0 = rest, from an equation of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RemainingResidual {
    pub(super) rest: ExprId,
    /// Position of the equation.
    pub(super) equation: usize,
    /// How many times it has been differentiated.
    pub(super) order: u32,
}

/// ẋ, and the equation that gives it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct DerivativeRate {
    pub(super) value: ExprId,
    pub(super) equation: usize,
}

/// Derivatives that equations give directly, and the remaining equations.
#[derive(Debug, Default)]
pub(super) struct SolvedDerivatives {
    pub(super) rates: BTreeMap<u32, DerivativeRate>,
    /// The other equations, without derivatives.
    pub(super) algebraic: Vec<RemainingResidual>,
}

/// Solves the equations of a combination of modes for derivatives, as far as they are linear in them.
pub(super) fn solve_for_derivatives(
    graph: &mut ExprGraph,
    all: &[TransferredEquation<'_>],
    holding: &[usize],
    variables: &mut UnknownList,
) -> SolvedDerivatives {
    let mut solved = SolvedDerivatives::default();
    let mut implicit: BTreeMap<u32, ExprId> = BTreeMap::new();
    let mut left: Vec<RemainingResidual> = Vec::new();
    for members in together(all, holding) {
        let done = match members[..] {
            [e] if all[e].derivatives.is_empty() => {
                left.push(RemainingResidual { rest: all[e].rest, equation: e, order: 0 });
                true
            }
            [e] if all[e].derivatives.len() == 1 => {
                let i = all[e].derivatives[0];
                let rate = solve_for_derivative(graph, all[e].rest, Symbol::Derivative(i));
                let rate = rate.map(|value| DerivativeRate { value, equation: e });
                rate.is_some_and(|rate| solved.rates.insert(i, rate).is_none())
            }
            _ => eliminate(graph, all, &members, variables, &mut solved.rates, &mut left),
        };
        if !done {
            for &equation in &members {
                for &i in &all[equation].derivatives {
                    let rate = variables.rate_of(i, equation, graph);
                    let value = graph.symbol(Symbol::Unknown(rate));
                    implicit.insert(i, value);
                    solved.rates.entry(i).or_insert(DerivativeRate { value, equation });
                }
                left.push(RemainingResidual { rest: all[equation].rest, equation, order: 0 });
            }
        }
    }
    for residual in &mut left {
        residual.rest = graph.substitute(residual.rest, |symbol| match symbol {
            Symbol::Derivative(i) => implicit.get(&i).copied(),
            _ => None,
        });
    }
    left.sort_by_key(|residual| residual.equation);
    solved.algebraic = left;
    solved
}

/// The equations grouped by shared derivatives, each group in the order of the file.
fn together(all: &[TransferredEquation<'_>], holding: &[usize]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut group_of: BTreeMap<u32, usize> = BTreeMap::new();
    for &e in holding {
        let mut joined: Vec<usize> =
            all[e].derivatives.iter().filter_map(|i| group_of.get(i).copied()).collect();
        joined.sort_unstable();
        joined.dedup();
        let into = joined.first().copied().unwrap_or_else(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        for &other in joined.iter().skip(1) {
            let moved = std::mem::take(&mut groups[other]);
            for i in moved.iter().flat_map(|e| &all[*e].derivatives) {
                group_of.insert(*i, into);
            }
            groups[into].extend(moved);
        }
        groups[into].push(e);
        for i in &all[e].derivatives {
            group_of.insert(*i, into);
        }
    }
    groups.retain(|group| !group.is_empty());
    // The order of the file must not affect the elimination.
    for group in &mut groups {
        group.sort_by_key(|e| all[*e].label);
    }
    groups
}

/// f in ẋ = f, where 0 = r − l is a ẋ + b with a free of derivatives: f = −b/a.
pub(in crate::dae) fn solve_for_derivative(
    graph: &mut ExprGraph,
    rest: ExprId,
    rate: Symbol,
) -> Option<ExprId> {
    let gradient = graph.gradient(rest, |s| (s == rate).then_some(0));
    let [(_, a)] = gradient[..] else { return None };
    let is_rate = |s: &Symbol| {
        matches!(s, Symbol::Derivative(_) | Symbol::ElementRate(_) | Symbol::SweptRate(_))
    };
    if graph.symbols(a).iter().any(is_rate) {
        return None;
    }
    let zero = graph.constant(0.0);
    let b = graph.substitute(rest, |s| (s == rate).then_some(zero));
    let minus_a = graph.negate(a);
    Some(graph.divide(b, minus_a))
}

fn without_derivatives(graph: &mut ExprGraph, rest: ExprId) -> ExprId {
    let zero = graph.constant(0.0);
    graph.substitute(rest, |symbol| matches!(symbol, Symbol::Derivative(_)).then_some(zero))
}

/// A row of 0 = A ẋ + b.
struct LinearRow {
    coefficients: Vec<ExprId>,
    rest: ExprId,
    equation: usize,
}

/// Eliminates among equations that share derivatives; returns whether that produced combinations.
fn eliminate(
    graph: &mut ExprGraph,
    all: &[TransferredEquation<'_>],
    members: &[usize],
    variables: &mut UnknownList,
    rates: &mut BTreeMap<u32, DerivativeRate>,
    left: &mut Vec<RemainingResidual>,
) -> bool {
    let mut columns: Vec<u32> =
        members.iter().flat_map(|e| all[*e].derivatives.iter().copied()).collect();
    columns.sort_unstable();
    columns.dedup();
    let Some(mut lines) = linear(graph, all, members, &columns) else { return false };
    let Some(pivots) = reduce(graph, &mut lines, columns.len()) else { return false };
    if pivots.len() == columns.len() && members.len() == columns.len() {
        // They determine every derivative and need no further unknowns.
        return false;
    }
    for (row, line) in lines.iter().enumerate() {
        let LinearRow { coefficients, rest, equation } = line;
        let Some(&pivot) = pivots.get(row) else {
            left.push(RemainingResidual { rest: *rest, equation: *equation, order: 0 });
            continue;
        };
        let divisor = coefficients[pivot];
        let minus = graph.negate(divisor);
        let value = graph.divide(*rest, minus);
        let mut terms = Vec::new();
        for (column, coefficient) in columns.iter().zip(coefficients) {
            if graph.value(*coefficient) != Some(0.0) {
                let quotient = graph.divide(*coefficient, divisor);
                terms.push((*column, tidied(graph, quotient)));
            }
        }
        let rate = DerivativeRate { value, equation: *equation };
        if let [(only, _)] = terms[..] {
            rates.insert(only, rate);
            continue;
        }
        let label = all[*equation].label;
        let w = variables.combination(terms.clone(), *equation, label, graph);
        rates.insert(w, rate);
        // 0 = Σ c x − w
        let value = sum(graph, &terms, |graph, i| graph.symbol(Symbol::Unknown(i)));
        let w = graph.symbol(Symbol::Unknown(w));
        let rest = graph.subtract(value, w);
        left.push(RemainingResidual { rest, equation: *equation, order: 0 });
    }
    true
}

/// 0 = A ẋ + b, if A is free of derivatives.
fn linear(
    graph: &mut ExprGraph,
    all: &[TransferredEquation<'_>],
    members: &[usize],
    columns: &[u32],
) -> Option<Vec<LinearRow>> {
    let zero = graph.constant(0.0);
    let mut lines = Vec::with_capacity(members.len());
    for &equation in members {
        let rest = all[equation].rest;
        let mut coefficients = vec![zero; columns.len()];
        let gradient = graph.gradient(rest, |symbol| match symbol {
            Symbol::Derivative(i) => columns.binary_search(&i).ok(),
            _ => None,
        });
        for (column, a) in gradient {
            if graph.symbols(a).iter().any(|s| matches!(s, Symbol::Derivative(_))) {
                return None;
            }
            coefficients[column] = a;
        }
        lines.push(LinearRow { coefficients, rest: without_derivatives(graph, rest), equation });
    }
    Some(lines)
}

/// Gauss–Jordan elimination: moves rows with pivots to the front and returns their columns; `None` if a quotient of
/// coefficients is not constant in time.
fn reduce(graph: &mut ExprGraph, lines: &mut [LinearRow], n: usize) -> Option<Vec<usize>> {
    let mut pivots: Vec<usize> = Vec::new();
    for column in 0..n {
        let first = pivots.len();
        let Some(found) = (first..lines.len())
            .find(|row| graph.value(lines[*row].coefficients[column]) != Some(0.0))
        else {
            continue;
        };
        lines[first..=found].rotate_right(1);
        pivots.push(column);
        for row in 0..lines.len() {
            let entry = lines[row].coefficients[column];
            if row == first || graph.value(entry) == Some(0.0) {
                continue;
            }
            // row ← row − (aᵢ/aₚ) pivot row
            let quotient = graph.divide(entry, lines[first].coefficients[column]);
            let quotient = tidied(graph, quotient);
            if !is_constant(graph, quotient) {
                return None;
            }
            for k in 0..n {
                let part = graph.multiply(quotient, lines[first].coefficients[k]);
                let entry = graph.subtract(lines[row].coefficients[k], part);
                lines[row].coefficients[k] = tidied(graph, entry);
            }
            let part = graph.multiply(quotient, lines[first].rest);
            lines[row].rest = graph.subtract(lines[row].rest, part);
        }
    }
    for (row, pivot) in pivots.iter().enumerate() {
        for k in 0..n {
            let (entry, by) = (lines[row].coefficients[k], lines[row].coefficients[*pivot]);
            let quotient = graph.divide(entry, by);
            let quotient = tidied(graph, quotient);
            if !is_constant(graph, quotient) {
                return None;
            }
        }
    }
    Some(pivots)
}
