//! Compares runs by all methods with the known facts of a case.

use dgd_runtime::{Solution, simulate, simulate_with_sensitivities};

use super::Finding;
use super::runs::{Rows, name};
use crate::case::Case;
use crate::facts::Fact;
use crate::prepared::{Prepared, options};

/// Methods and tolerances.
const RUNS: [(&str, f64); 6] = [
    ("rodas5p", 1e-6),
    ("rodas5p", 1e-9),
    ("kencarp4", 1e-7),
    ("bdf", 1e-7),
    ("tsit5", 1e-7),
    ("taylor", 1e-7),
];

/// Allowed difference in tolerances of the value's size: errors of steps add up.
const TOLERANCES: f64 = 1000.0;

/// Allowed relative difference of an exact value: its rounding.
const ROUNDING: f64 = 1e-9;

pub(super) fn judge(case: &Case, prepared: &Prepared, findings: &mut Vec<Finding>) {
    if case.facts.is_empty() {
        return;
    }
    let mut times = case.times();
    times.extend(case.facts.iter().filter_map(|fact| fact.at));
    times.sort_by(f64::total_cmp);
    times.dedup();
    for (method, tolerance) in RUNS {
        let options = options(method, tolerance);
        let problem = prepared.problem(&prepared.p);
        // Derivatives are compared for the default method.
        let has_derivatives = case.facts.iter().any(|fact| fact.derivative().is_some());
        let is_default = method == "rodas5p";
        let solution = if is_default && has_derivatives {
            simulate_with_sensitivities(&problem, &times, &options)
        } else {
            simulate(&problem, &times, &options)
        };
        // Other oracles check how runs end.
        let Ok(solution) = solution else { continue };
        let rows = Rows::new(prepared, &prepared.p, solution);
        for fact in &case.facts {
            if fact.derivative().is_some() && !is_default {
                continue;
            }
            if let Some((t, found)) = contradiction(fact, prepared, &rows, tolerance) {
                let what = match fact.derivative() {
                    Some(_) => "a derivative",
                    None => "a value",
                };
                let detail =
                    format!("{fact}\n  by {method} at rtol {tolerance:e}: {found:e} at {t}");
                let symptom = format!("{method}: {what} is not what is known");
                findings.push(Finding::new("facts", symptom, detail));
                break;
            }
        }
    }
}

/// The time and value of a row that contradicts a fact.
fn contradiction(
    fact: &Fact,
    prepared: &Prepared,
    rows: &Rows,
    tolerance: f64,
) -> Option<(f64, f64)> {
    let solution: &Solution = &rows.solution;
    let (of, by) = fact.derivative().map_or((fact.of.as_str(), None), |(of, by)| (of, Some(by)));
    let signature = prepared.signature();
    let count = signature.unknowns.len() + signature.outputs.len();
    // There are no facts about items that were dropped from the model.
    let i = (0..count).find(|i| name(prepared, *i) == of)?;
    let j = match by {
        Some(by) => {
            let directions = 0..signature.directions.len();
            Some(directions.into_iter().find(|j| signature.direction_name(*j) == by)?)
        }
        None => None,
    };
    let allowed = match fact.size {
        0.0 => ROUNDING * fact.value.abs().max(1.0),
        size => TOLERANCES * tolerance * size,
    };
    for (k, t) in solution.times.iter().enumerate() {
        if fact.at.is_some_and(|at| at != *t) {
            continue;
        }
        let computed = match j {
            Some(j) => rows.derivatives(k, j)[i],
            None => rows.values(k)[i],
        };
        let is_flagged = j.is_some() && computed.is_nan() && !solution.undefined.is_empty();
        if !((computed - fact.value).abs() <= allowed) && !is_flagged {
            return Some((*t, computed));
        }
    }
    None
}
