//! Checks results of a run against the text of the model.

use std::cell::Cell;
use std::collections::BTreeMap;

use dgd_compiler::syntax::ast::{Expr, ExprKind, FactorSide};
use dgd_compiler::syntax::visit::operands;
use dgd_runtime::{EvaluationPoint, Observations, Solution, System};

use super::Finding;
use crate::prepared::Prepared;
use crate::truth::{Place, Truth};

/// Relative distance within which a comparison may have either result, and the same in tolerances.
const NEAR: f64 = 1e-6;
const TOLERANCES: f64 = 30.0;
/// Sides below this are rounding errors of cancelling terms.
const ROUNDING: f64 = 1e-6;

/// Size of the terms on a side of an equation.
fn terms(truth: &Truth<'_>, expr: &Expr, at: &Place<'_>) -> f64 {
    match &expr.kind {
        ExprKind::Group(a) | ExprKind::Negate(a) => terms(truth, a, at),
        ExprKind::Sum(all) => all.iter().fold(0.0, |m, (_, term)| m.max(terms(truth, term, at))),
        ExprKind::Product(all) => all.iter().fold(1.0, |m, (factor, expr)| match factor {
            FactorSide::Times => m * terms(truth, expr, at),
            FactorSide::Over => m / truth.value(expr, at).map_or(1.0, f64::abs),
        }),
        _ => truth.value(expr, at).map_or(0.0, f64::abs),
    }
}

fn derivatives<'e>(expr: &'e Expr, found: &mut Vec<&'e str>) {
    if let ExprKind::Call { function, arguments } = &expr.kind
        && function.text == "der"
        && let Some(ExprKind::Name(name)) = arguments.first().map(|a| &a.kind)
    {
        found.push(name);
    }
    for operand in operands(expr) {
        derivatives(operand, found);
    }
}

/// Whether an expression reads a name or its derivative.
fn reads(expr: &Expr, name: &str) -> bool {
    matches!(&expr.kind, ExprKind::Name(read) if read == name)
        || operands(expr).into_iter().any(|operand| reads(operand, name))
}

/// Checks outputs and equations at all rows of a run with this tolerance.
pub(super) fn judge(
    prepared: &Prepared,
    solution: &Solution,
    observations: &Observations,
    tolerance: f64,
    findings: &mut Vec<Finding>,
) {
    if prepared.compiled.asts.len() > 1 {
        return;
    }
    let Some(truth) = Truth::new(&prepared.compiled.asts[0]) else { return };
    let signature = prepared.signature();
    let problem = prepared.problem(&prepared.p);
    let Ok(inputs) = problem.inputs_read() else { return };
    let near = NEAR.max(TOLERANCES * tolerance);
    let n = signature.unknowns.len();
    let mut u = vec![0.0; inputs.len()];
    // Values of both sides, and the rows at which they are known.
    let mut sides: Vec<Vec<[f64; 4]>> = vec![Vec::new(); truth.equations.len()];
    for k in 0..solution.len() {
        let t = solution.times[k];
        inputs.value(t, solution.side(k), &mut u);
        if signature.delayed_unknowns.is_empty() {
            let (y, z) = (solution.y(k), solution.z(k));
            let mut f = vec![0.0; n];
            let point = EvaluationPoint { t, y, u: &u, p: &prepared.p, z };
            prepared.system.rhs(point, &mut f);
            let mut mass = vec![0.0; n];
            prepared.system.mass(point, &mut mass);
            let mut values: BTreeMap<String, f64> = BTreeMap::new();
            for (i, unknown) in signature.unknowns.iter().enumerate() {
                values.insert(unknown.name.to_string(), y[i]);
                if mass[i] != 0.0 {
                    values.insert(format!("der({})", unknown.name), f[i]);
                }
            }
            for (i, input) in signature.inputs.iter().enumerate() {
                values.insert(input.name.to_string(), u[i]);
            }
            for (i, parameter) in signature.parameters.iter().enumerate() {
                values.insert(parameter.name.to_string(), prepared.p[i]);
            }
            for (k, (_, left, right)) in truth.equations.iter().enumerate() {
                // At a bound, the bound applies instead of the equation.
                let bounded = |name: &&str| reads(left, name) || reads(right, name);
                if truth.saturated.iter().any(bounded) {
                    continue;
                }
                let place = Place { t, values: &values, margin: Cell::new(f64::INFINITY) };
                let both = truth.value(left, &place).zip(truth.value(right, &place));
                if let Some((l, r)) = both
                    && place.margin.get() > near
                {
                    let size = terms(&truth, left, &place).max(terms(&truth, right, &place));
                    sides[k].push([t, l, r, size]);
                }
            }
            for (name, value, factor, offset) in &truth.outputs {
                let Some(i) = signature.outputs.iter().position(|o| o.name == *name) else {
                    continue;
                };
                let place = Place { t, values: &values, margin: Cell::new(f64::INFINITY) };
                let Some(expected) = truth.declared(value, (*factor, *offset), &place) else {
                    continue;
                };
                let computed = observations.w(k)[i];
                let size = expected.abs().max(*factor);
                if place.margin.get() > near
                    && ((computed - expected).abs() > 1e-8 * size || computed.is_nan())
                {
                    let detail =
                        format!("output {name} at {t}: {computed:e}, by its text {expected:e}");
                    findings.push(Finding::new(
                        "runs",
                        "an output is not what its text says",
                        detail,
                    ));
                    return;
                }
            }
        }
    }
    for ((label, left, right), rows) in truth.equations.iter().zip(&sides) {
        let mut read = Vec::new();
        derivatives(left, &mut read);
        derivatives(right, &mut read);
        let size = rows.iter().fold(ROUNDING, |m, row| m.max(row[3]));
        for [t, left, right, _] in rows {
            let apart = (left - right).abs() / size;
            // Rates equal the functions exactly; algebraic unknowns are accurate to the tolerance.
            let allowed =
                if read.is_empty() { 30.0 * tolerance } else { (30.0 * tolerance).max(1e-9) };
            if apart > allowed {
                let what =
                    if read.is_empty() { "an equation" } else { "an equation of a derivative" };
                let detail = format!(
                    "{label} at {t}, rtol {tolerance:e}: {left:e} = {right:e}, apart by {apart:e} of its size"
                );
                findings.push(Finding::new("runs", format!("{what} is not satisfied"), detail));
                return;
            }
        }
    }
}
