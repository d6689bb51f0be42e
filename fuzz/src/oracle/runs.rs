//! Checks runs: their end, their results, and derivatives.

use dgd_runtime::{
    Direction, Failure, InitialError, IntegrateError, Observations, Solution, observe,
};

use super::{Finding, written};
use crate::case::Case;
use crate::prepared::Prepared;
use crate::random::Random;

/// The default tolerance.
const DEFAULT: f64 = 1e-6;
/// The tolerance of reference runs.
const TIGHT: f64 = 1e-9;
/// Number of parameters whose sensitivities are compared.
const COMPARED: usize = 2;

/// Unknowns and outputs, and their sensitivities, row by row.
pub(super) struct Rows {
    pub solution: Solution,
    pub observations: Observations,
}

impl Rows {
    pub(super) fn new(prepared: &Prepared, p: &[f64], solution: Solution) -> Self {
        let observations = observe(&prepared.problem(p), &solution);
        Self { solution, observations }
    }

    /// Unknowns and outputs at a row.
    pub(super) fn values(&self, k: usize) -> Vec<f64> {
        [self.solution.y(k), self.observations.w(k)].concat()
    }

    /// Their sensitivities in the j-th direction.
    pub(super) fn derivatives(&self, k: usize, j: usize) -> Vec<f64> {
        let (n, n_w) = (self.solution.n, self.observations.n_w);
        [&self.solution.s(k)[j * n..(j + 1) * n], &self.observations.dw(k)[j * n_w..(j + 1) * n_w]]
            .concat()
    }

    /// Events up to a row.
    pub(super) fn events(&self, k: usize) -> usize {
        let t = self.solution.times[k];
        self.solution.events.iter().filter(|event| event.t <= t).count()
    }
}

pub(super) fn name(prepared: &Prepared, i: usize) -> String {
    let signature = prepared.signature();
    let n = signature.unknowns.len();
    if i < n {
        signature.unknowns.name(i).to_string()
    } else {
        signature.outputs[i - n].name.to_string()
    }
}

/// The kind of an error, without names and numbers.
fn kind(error: &IntegrateError) -> String {
    let text = format!("{error:?}");
    let word: String = text.chars().take_while(char::is_ascii_alphanumeric).collect();
    match error {
        IntegrateError::Initial(inner) => {
            let inner = format!("{inner:?}");
            let inner: String = inner.chars().take_while(char::is_ascii_alphanumeric).collect();
            format!("{word} {inner}")
        }
        IntegrateError::NotFinite { what, .. } => format!("{word} {what:?}"),
        _ => word,
    }
}

fn has_no_rest(failure: &Failure) -> bool {
    matches!(&failure.error, IntegrateError::Initial(InitialError::NoRest { .. }))
}

/// The finding for a failed run, with its kind.
fn failed(of: &str, failure: &Failure) -> Finding {
    Finding::new("runs", format!("{of}: {}", kind(&failure.error)), failure.error.to_string())
}

/// Largest values of unknowns and outputs along a run.
pub(super) fn largest(prepared: &Prepared, rows: &Rows) -> Vec<f64> {
    let signature = prepared.signature();
    let units = (signature.unknowns.iter().map(|x| x.unit.factor))
        .chain(signature.outputs.iter().map(|x| x.unit.factor));
    let mut largest: Vec<f64> = units.collect();
    for k in 0..rows.solution.len() {
        for (largest, value) in largest.iter_mut().zip(rows.values(k)) {
            *largest = largest.max(value.abs());
        }
    }
    largest
}

pub(super) fn judge(case: &Case, prepared: &Prepared, findings: &mut Vec<Finding>) {
    let p = &prepared.p;
    let run = |p: &[f64], tolerance: f64, sensitivities: bool| {
        prepared.run(p, "rodas5p", tolerance, sensitivities).map(|s| Rows::new(prepared, p, s))
    };
    let (loose, tight) = match (run(p, DEFAULT, true), run(p, TIGHT, true)) {
        (Ok(loose), Ok(tight)) => (loose, tight),
        (Err(failure), Ok(_)) => return findings.push(failed("rodas5p at 1e-6 alone", &failure)),
        (Ok(_), Err(failure)) => return findings.push(failed("rodas5p at 1e-9 alone", &failure)),
        // A random model need not have a steady state to start in.
        (Err(failure), Err(_)) if has_no_rest(&failure) => return,
        (Err(failure), Err(_)) => return findings.push(failed("rodas5p", &failure)),
    };
    let _ = case;
    let rows = tight.solution.len();
    let size = largest(prepared, &tight);
    // The same without sensitivities.
    written::judge(prepared, &loose.solution, &loose.observations, DEFAULT, findings);
    if findings.is_empty() {
        written::judge(prepared, &tight.solution, &tight.observations, TIGHT, findings);
    }

    let signature = prepared.signature();
    let directions: Vec<usize> = (0..signature.directions.len())
        .filter(|j| matches!(signature.directions[*j], Direction::Parameter(_)))
        .collect();
    let sensitive = directions.iter().any(|j| {
        let Direction::Parameter(position) = signature.directions[*j] else { return false };
        let step = if p[position] == 0.0 { 1.0 } else { p[position].abs() };
        (0..rows).any(|k| {
            tight
                .derivatives(k, *j)
                .iter()
                .zip(&size)
                .any(|(d, size)| (d * step).abs() > 30.0 * size)
        })
    });
    for k in 0..rows {
        if sensitive || loose.events(k) != tight.events(k) {
            continue;
        }
        let both = loose.values(k).into_iter().zip(tight.values(k)).zip(&size);
        for (i, ((a, b), size)) in both.enumerate() {
            if !((a - b).abs() <= 3e-3 * size) && i < tight.solution.n {
                let detail = format!(
                    "{} at {}: {a:e} at 1e-6, {b:e} at 1e-9",
                    name(prepared, i),
                    tight.solution.times[k]
                );
                findings.push(Finding::new("runs", "two tolerances differ", detail));
                return;
            }
        }
    }

    let mut random = Random::new(5);
    let mut chosen = directions;
    while chosen.len() > COMPARED {
        let out = random.below(chosen.len());
        chosen.remove(out);
    }
    let mut flagged = 0;
    for j in chosen {
        let Direction::Parameter(position) = signature.directions[j] else { continue };
        let step = 1e-4 * if p[position] == 0.0 { 1.0 } else { p[position].abs() };
        let moved = |by: f64| {
            let mut p = p.clone();
            p[position] += by;
            run(&p, 1e-10, false)
        };
        let around = [step, -step, step / 2.0, -step / 2.0, 0.0].map(moved);
        let Ok(around) = around.into_iter().collect::<Result<Vec<Rows>, _>>() else { continue };
        // Central differences over the run, their errors, and half the difference between the two sides.
        let differences: Vec<Vec<(f64, f64, f64)>> = (0..rows)
            .map(|k| {
                let v: Vec<Vec<f64>> = around.iter().map(|rows| rows.values(k)).collect();
                (0..size.len())
                    .map(|i| {
                        let coarse = (v[0][i] - v[1][i]) / (2.0 * step);
                        let fine = (v[2][i] - v[3][i]) / step;
                        let sides = (v[2][i] - 2.0 * v[4][i] + v[3][i]) / step;
                        (fine, (fine - coarse).abs(), sides.abs())
                    })
                    .collect()
            })
            .collect();
        for i in 0..size.len() {
            let scale = differences.iter().fold(0.0f64, |m, row| m.max(row[i].0.abs()));
            for k in 1..rows {
                let events = tight.events(k);
                if around.iter().any(|rows| rows.events(k) != events) {
                    continue;
                }
                let (fine, error, sides) = differences[k][i];
                let rounding = 1e-9 * size[i] / step;
                if error > 0.01 * scale || rounding > 0.01 * scale {
                    continue;
                }
                // At a corner, such as a row just at the end of a delay, the derivative on either side is correct.
                let corner = if sides > 1e-3 * scale { sides } else { 0.0 };
                let (own, default) = (tight.derivatives(k, j)[i], loose.derivatives(k, j)[i]);
                if own.is_nan() {
                    flagged += usize::from(corner == 0.0);
                    if tight.solution.undefined.is_empty() {
                        let detail =
                            format!("d({})/d({})", name(prepared, i), signature.direction_name(j));
                        findings.push(Finding::new(
                            "runs",
                            "a derivative is NaN without a note",
                            detail,
                        ));
                        return;
                    }
                    continue;
                }
                // Smallest sensitivity that the tolerance resolves, relative to both sizes.
                let least = size[i] / (1e4 * step);
                let allowed =
                    20.0 * error + rounding + 2e-3 * scale + 1e3 * TIGHT * least + 1.01 * corner;
                let detail = |value: f64, tolerance: &str| {
                    format!(
                        "d({})/d({}) at {}, rtol {tolerance}: {value:e}, by differences {fine:e} ± {error:e}, largest {scale:e}",
                        name(prepared, i),
                        signature.direction_name(j),
                        tight.solution.times[k],
                    )
                };
                let kind = if i < tight.solution.n {
                    "a sensitivity"
                } else {
                    "a sensitivity of an output"
                };
                if (own - fine).abs() > allowed {
                    findings.push(Finding::new(
                        "runs",
                        format!("{kind} is wrong"),
                        detail(own, "1e-9"),
                    ));
                    return;
                }
                if loose.events(k) == events
                    && (default - fine).abs() > allowed + 0.05 * scale + 1e3 * DEFAULT * least
                {
                    findings.push(Finding::new(
                        "runs",
                        format!("{kind} is wrong at the default tolerance"),
                        detail(default, "1e-6"),
                    ));
                    return;
                }
            }
        }
    }
    if flagged > 0 {
        let why = tight.solution.undefined.iter().map(ToString::to_string).collect::<Vec<_>>();
        let cause = tight.solution.undefined.first().map(|u| format!("{:?}", u.cause));
        findings.push(Finding::new(
            "undefined",
            cause.unwrap_or_default(),
            format!("undefined where differences are not: {}", why.join("; ")),
        ));
    }
}

/// Methods, and whether they refuse a model with algebraic unknowns according to docs/methods.md.
const METHODS: [(&str, bool); 4] =
    [("kencarp4", true), ("bdf", true), ("tsit5", false), ("taylor", false)];

/// All methods against the default one.
pub(super) fn methods(_: &Case, prepared: &Prepared, findings: &mut Vec<Finding>) {
    let p = &prepared.p;
    let Ok(reference) = prepared.run(p, "rodas5p", 1e-9, true) else { return };
    let Ok(again) = prepared.run(p, "rodas5p", 1e-7, false) else { return };
    let reference = Rows::new(prepared, p, reference);
    let again = Rows::new(prepared, p, again);
    let size = largest(prepared, &reference);
    for (method, _) in METHODS {
        let rows = match prepared.run(p, method, 1e-7, false) {
            Ok(solution) => Rows::new(prepared, p, solution),
            Err(failure) => {
                match &failure.error {
                    // docs/methods.md documents these refusals.
                    IntegrateError::UnsuitedMethod { .. }
                    | IntegrateError::NoTaylorSeries { .. }
                    | IntegrateError::HeldInputMoves { .. }
                    | IntegrateError::TooStiff { .. } => {}
                    _ => {
                        let mut finding = failed(method, &failure);
                        finding.oracle = "methods";
                        findings.push(finding);
                    }
                }
                continue;
            }
        };
        'rows: for k in 0..reference.solution.len() {
            let events = reference.events(k);
            if rows.events(k) != events || again.events(k) != events {
                continue;
            }
            let values = rows.values(k).into_iter().zip(reference.values(k)).zip(again.values(k));
            for (i, (((a, b), c), size)) in values.zip(&size).enumerate().take(reference.solution.n)
            {
                let allowed = 1e-3 * size + 300.0 * (b - c).abs();
                if !((a - b).abs() <= allowed) {
                    let detail = format!(
                        "{} at {}: {a:e} by {method}, {b:e} by rodas5p",
                        name(prepared, i),
                        reference.solution.times[k]
                    );
                    findings.push(Finding::new("methods", format!("{method} differs"), detail));
                    break 'rows;
                }
            }
        }
    }
}
