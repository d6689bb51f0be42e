//! Sensitivities against differences of simulations, on the user's own run.

use std::fmt::Write;

use dgd_runtime::{Direction, Options, Problem, Solution, simulate};
use serde_json::{Value, json};

use crate::console::Console;
use crate::failure::CommandError;
use crate::run::Run;

/// Relative change of a parameter in a difference.
///
/// The difference has an error of order h² from curvature and ε/h from the integrations, which run
/// at ε = 1e-10: both are about 1e-6 at h = 1e-3.
const CHANGE: f64 = 1e-3;
const TIGHT: f64 = 1e-10;

/// A sensitivity may differ by this fraction of its largest value; it is ten times what the
/// differences themselves can be wrong by, plus what the user's tolerance allows.
const ALLOWED: f64 = 1e-5;

/// How the sensitivities of a run compare.
pub(crate) struct Report {
    rows: Vec<Row>,
    allowed: f64,
}

/// One unknown and one parameter.
struct Row {
    of: String,
    to: String,
    /// Largest difference over all times, as a fraction of the largest value.
    difference: f64,
    /// When it occurs, s.
    at: f64,
}

/// Repeats the simulation with each parameter or start value a little lower and a little higher.
pub(crate) fn against_differences(run: &Run, solution: &Solution) -> Result<Report, CommandError> {
    let signature = run.signature();
    let options = Options { rtol: TIGHT, atol: TIGHT, ..run.options };
    let mut rows = Vec::new();
    for (j, direction) in signature.directions.iter().enumerate() {
        let unit = signature.direction_unit(j);
        let (value, nominal) = match *direction {
            Direction::Parameter(i) => (run.p[i], signature.parameters[i].nominal),
            Direction::Start(i) => (solution.y(0)[i], signature.unknowns[i].nominal),
        };
        let size = if value == 0.0 { nominal.unwrap_or(unit.factor) } else { value };
        let h = CHANGE * size.abs();
        let shifted = |change: f64| {
            let (mut p, mut start) = (run.p.clone(), run.start.clone());
            match *direction {
                Direction::Parameter(i) => p[i] += change,
                Direction::Start(i) => {
                    start.retain(|(unknown, _)| *unknown != i);
                    start.push((i, value + change));
                }
            }
            let problem = Problem { p: &p, start: &start, ..run.problem() };
            simulate(&problem, &run.times, &options)
                .map_err(|failure| CommandError::Computation(failure.to_string()))
        };
        let (low, high) = (shifted(-h)?, shifted(h)?);
        for (i, unknown) in signature.unknowns.iter().enumerate() {
            let mut largest: f64 = 0.0;
            let mut worst = (0.0, solution.times.first().copied().unwrap_or(0.0));
            for (k, t) in solution.times.iter().enumerate() {
                let s = solution.s(k)[j * solution.n + i];
                let difference = (high.y(k)[i] - low.y(k)[i]) / (2.0 * h);
                // Undefined sensitivities have been reported and are not compared.
                if s.is_nan() {
                    continue;
                }
                largest = largest.max(s.abs()).max(difference.abs());
                if (s - difference).abs() > worst.0 {
                    worst = ((s - difference).abs(), *t);
                }
            }
            rows.push(Row {
                of: unknown.name.to_string(),
                to: signature.direction_name(j).into_owned(),
                difference: if largest == 0.0 { 0.0 } else { worst.0 / largest },
                at: worst.1,
            });
        }
    }
    let user = run.options.rtol.max(run.options.atol);
    Ok(Report { rows, allowed: ALLOWED + 100.0 * user })
}

impl Report {
    /// For programs.
    pub(crate) fn to_json(&self) -> Value {
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|row| {
                json!({ "of": row.of, "to": row.to, "difference": row.difference, "at": row.at })
            })
            .collect();
        json!({ "allowed": self.allowed, "sensitivities": rows })
    }

    /// Shows the comparison; an error where a sensitivity differs by more than is allowed.
    pub(crate) fn conclude(&self, console: Console<'_>) -> Result<(), CommandError> {
        let mut text = String::from("sensitivities against central differences, largest first:\n");
        let mut rows: Vec<&Row> = self.rows.iter().collect();
        rows.sort_by(|a, b| b.difference.total_cmp(&a.difference));
        for row in &rows {
            let verdict = if row.difference <= self.allowed { "" } else { "  too large" };
            let name = format!("d({})/d({})", row.of, row.to);
            let _ = writeln!(
                text,
                "  {name:<24} {:.1e} of its largest value, at {} s{verdict}",
                row.difference, row.at
            );
        }
        console.remark(text.trim_end());
        match rows.first() {
            Some(worst) if worst.difference.is_nan() || worst.difference > self.allowed => {
                Err(CommandError::Computation(format!(
                    "d({})/d({}) differs from its central difference by {:.1e} of its largest \
                     value at {} s; {:.1e} is allowed",
                    worst.of, worst.to, worst.difference, worst.at, self.allowed
                )))
            }
            _ => Ok(()),
        }
    }
}
