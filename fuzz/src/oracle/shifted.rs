//! The same model at a later time: delays and functions of time are shifted with it.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::Finding;
use super::rewritten::replaced;
use super::runs::{Rows, largest, name};
use crate::case::Case;
use crate::prepared::Prepared;

/// The shift, s: times stay exact up to the last bit.
const LATER: f64 = 8.0;

/// The case with a shifted clock, unless something in it is tied to time 0.
fn shifted(case: &Case) -> Option<Case> {
    if !case.files.is_empty() || case.model.contains("every ") {
        return None;
    }
    let names = BTreeMap::from([("time".to_owned(), format!("(time - {LATER} [s])"))]);
    let mut data = String::new();
    for (k, line) in case.data.lines().enumerate() {
        if k == 0 {
            data = format!("{line}\n");
            continue;
        }
        let (time, rest) = line.split_once(',')?;
        let time: f64 = time.parse().ok()?;
        let _ = writeln!(data, "{},{rest}", time + LATER);
    }
    Some(Case { model: replaced(&case.model, &names), data, ..case.clone() })
}

pub(super) fn judge(case: &Case, prepared: &Prepared, findings: &mut Vec<Finding>) {
    let Some(other) = shifted(case) else { return };
    let runs = [1e-8, 1e-6].map(|tolerance| prepared.run(&prepared.p, "rodas5p", tolerance, false));
    let [Ok(own), Ok(loose)] = runs else { return };
    let mut later = match Prepared::new(&other) {
        Ok(later) => later,
        Err(finding) => {
            let detail = format!("{}\n{}", finding.detail, other.model);
            return findings.push(Finding::new("shifted", finding.symptom, detail));
        }
    };
    later.times = prepared.times.iter().map(|t| t + LATER).collect();
    let shifted_solution = match later.run(&later.p, "rodas5p", 1e-8, false) {
        Ok(found) => found,
        Err(failure) => {
            let detail = format!("{}\n{}", failure.error, other.model);
            return findings.push(Finding::new("shifted", "the run fails", detail));
        }
    };
    let original = Rows::new(prepared, &prepared.p, own);
    let loose = Rows::new(prepared, &prepared.p, loose);
    let shifted_solution = Rows::new(&later, &later.p, shifted_solution);
    let size = largest(prepared, &original);
    for k in 0..original.solution.len() {
        // An event at the time of a row may be before it or after it.
        if original.events(k) != loose.events(k) || original.events(k) != shifted_solution.events(k)
        {
            continue;
        }
        let values =
            original.values(k).into_iter().zip(shifted_solution.values(k)).zip(loose.values(k));
        for (i, (((a, b), c), size)) in values.zip(&size).enumerate().take(original.solution.n) {
            if !((a - b).abs() <= 1e-4 * size + 300.0 * (a - c).abs()) {
                let (of, t) = (name(prepared, i), original.solution.times[k]);
                let detail = format!("{of} at {t}: {a:e}, later {b:e}\n{}", other.model);
                return findings.push(Finding::new("shifted", "another solution", detail));
            }
        }
    }
}
