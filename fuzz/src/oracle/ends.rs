//! Checks that results do not depend on the end of a run (`--until`) or on its rows (`--every`).

use dgd_runtime::{Direction, Signature, Solution};

use super::Finding;
use super::runs::{Rows, largest, name};
use crate::case::Case;
use crate::prepared::Prepared;

/// Tolerance of the compared runs.
const TOLERANCE: f64 = 1e-6;
/// Differences up to this many tolerances are explained by other steps.
const TOLERANCES: f64 = 10.0;
/// Rows closer to an event than this fraction of the run may be on either side of it.
const BESIDE: f64 = 1e-6;

/// The same run with other rows.
fn others(times: &[f64]) -> Vec<(&'static str, Vec<f64>)> {
    let until = |part: usize| times[..=times.len() * part / 10].to_vec();
    let between = |pair: &[f64]| [pair[0], pair[0] + 0.37 * (pair[1] - pair[0])];
    let mut finer: Vec<f64> = times.windows(2).flat_map(between).collect();
    finer.extend(times.last());
    let coarser = times.iter().copied().step_by(3).chain(times.last().copied());
    let mut coarser: Vec<f64> = coarser.collect();
    coarser.dedup();
    vec![
        ("until", until(3)),
        ("until", until(5)),
        ("until", until(8)),
        ("every", finer),
        ("every", coarser),
    ]
}

/// The scale of changes along a direction, as in tolerances of derivatives.
fn size_of(signature: &Signature, j: usize, sizes: &[f64]) -> f64 {
    match signature.directions[j] {
        Direction::Parameter(position) => {
            let parameter = &signature.parameters[position];
            let size = parameter.nominal.unwrap_or(parameter.value).abs();
            if size == 0.0 { parameter.unit.factor } else { size }
        }
        Direction::Start(i) => sizes[i],
    }
}

/// Indices of rows at equal times.
fn in_common(own: &Solution, other: &Solution) -> Vec<(usize, usize)> {
    let place = |t: &f64| other.times.iter().position(|other| other == t);
    own.times.iter().enumerate().filter_map(|(k, t)| Some((k, place(t)?))).collect()
}

pub(super) fn judge(_: &Case, prepared: &Prepared, findings: &mut Vec<Finding>) {
    let p = &prepared.p;
    let run = |times: &[f64], tolerance: f64| {
        let solution = prepared.run_at(times, p, "rodas5p", tolerance, true);
        solution.map(|solution| Rows::new(prepared, p, solution))
    };
    let times = &prepared.times;
    if times.len() < 5 {
        return;
    }
    let (Ok(whole), Ok(tight)) = (run(times, TOLERANCE), run(times, 0.1 * TOLERANCE)) else {
        return;
    };
    let size = largest(prepared, &whole);
    let span = times[times.len() - 1] - times[0];
    let signature = prepared.signature();
    let steps = signature.directions.len();
    let automata = &signature.discrete.automata;
    let is_piece = |i: usize| automata.get(i).is_some_and(|automaton| automaton.kind.is_piece());
    // The largest derivatives of the whole run.
    let largest_of = |j: usize, i: usize| {
        let along = (0..whole.solution.len()).map(|k| whole.derivatives(k, j)[i].abs());
        along.filter(|value| value.is_finite()).fold(0.0, f64::max)
    };
    let scales: Vec<Vec<f64>> =
        (0..steps).map(|j| (0..size.len()).map(|i| largest_of(j, i)).collect()).collect();
    for (what, rows) in others(times) {
        let other = match run(&rows, TOLERANCE) {
            Ok(other) => other,
            Err(failure) => {
                let detail = failure.error.to_string();
                findings.push(Finding::new("ends", format!("{what}: the run fails"), detail));
                return;
            }
        };
        for (k, at) in in_common(&whole.solution, &other.solution) {
            let t = whole.solution.times[k];
            let beside = |rows: &Rows| {
                rows.solution.events.iter().any(|event| (event.t - t).abs() <= BESIDE * span)
            };
            if beside(&whole) || beside(&other) || whole.events(k) != tight.events(k) {
                continue;
            }
            // Pieces agree where they meet, so rounding may select either of them for a solution that stays there.
            let z = |rows: &Rows, k: usize| -> Vec<f64> {
                let modes = rows.solution.z(k).iter().enumerate();
                let kept = modes.filter(|(i, _)| !is_piece(*i));
                kept.map(|(_, z)| *z).collect()
            };
            if whole.events(k) != other.events(at) || z(&whole, k) != z(&other, at) {
                // Counts step without an event.
                let around = [times[0], t - BESIDE * span, t + BESIDE * span];
                let steps = |rows: &Rows| z(rows, 1) != z(rows, 2);
                if run(&around, TOLERANCE).is_ok_and(|rows| steps(&rows)) {
                    continue;
                }
                let detail =
                    format!("at {t}: {:?} and {:?}", whole.solution.z(k), other.solution.z(at));
                findings.push(Finding::new("ends", format!("{what}: other events"), detail));
                return;
            }
            let values = whole.values(k).into_iter().zip(other.values(at)).zip(tight.values(k));
            for (i, ((a, b), c)) in values.enumerate() {
                let allowed = TOLERANCES * (TOLERANCE * size[i] + (a - c).abs());
                let agree = (a - b).abs() <= allowed || (a.is_nan() && b.is_nan());
                if !agree {
                    let detail = format!("{} at {t}: {a:e} and {b:e}", name(prepared, i));
                    findings.push(Finding::new("ends", format!("{what}: another value"), detail));
                    return;
                }
            }
            for (j, scales) in scales.iter().enumerate() {
                let (own, others) = (whole.derivatives(k, j), other.derivatives(at, j));
                let tight = tight.derivatives(k, j);
                for (i, ((a, b), c)) in own.into_iter().zip(others).zip(tight).enumerate() {
                    let least = size[i] / size_of(signature, j, &size);
                    let allowed = TOLERANCES * (TOLERANCE * (scales[i] + least) + (a - c).abs());
                    // An undefined value in one run at either tolerance makes the other as doubtful.
                    if c.is_nan() || (a.is_nan() && b.is_nan()) || (a - b).abs() <= allowed {
                        continue;
                    }
                    let detail = format!(
                        "d({})/d({}) at {t}: {a:e} and {b:e}, {c:e} at a tenth of the tolerance, largest {:e}",
                        name(prepared, i),
                        signature.direction_name(j),
                        scales[i],
                    );
                    let kind = if a.is_nan() == b.is_nan() { "another" } else { "blank" };
                    let symptom = format!("{what}: {kind} derivative");
                    findings.push(Finding::new("ends", symptom, detail));
                    return;
                }
            }
        }
    }
}
