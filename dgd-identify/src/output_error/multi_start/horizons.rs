//! Fits of models that switch, by way of ever longer beginnings of the recordings.
//!
//! Where a model switches when a state passes a threshold, a run with parameters that are a little off gets out of step
//! with the recording after some cycles, and a fit of the whole recording ends in a minimum in which cycles are
//! mistaken for their neighbours. Over a short beginning nothing is out of step yet; what fits that is close enough for a beginning that is half as long again, and so on to the whole.

use dgd_runtime::signature::Automaton;

use crate::error::EstimateError;
use crate::minimise::trust_region::StoppingRule;
use crate::output_error::fit::Fit;
use crate::output_error::{OutputErrorProblem, fit};
use crate::recording::Recording;

/// The first beginning has so many readings for each estimate.
const READINGS: usize = 3;

/// Each beginning is longer than the last one by this factor: what is off by less than a quarter of a cycle at the end
/// of one is off by less than half of a cycle at the end of the next.
const LONGER: f64 = 1.5;

/// The fit of a beginning ends where a step promises no more than this part of Σ r²: the next one goes on from there, and
/// what a short beginning hardly determines is not worth the search.
const NEAR: f64 = 0.01;

/// A fit, of a model that switches by way of ever longer beginnings.
///
/// # Errors
///
/// As [`fit`].
pub(super) fn fit_by_horizons(problem: &OutputErrorProblem<'_>) -> Result<Fit, EstimateError> {
    let Some(first) = first_part(problem) else { return fit(problem) };
    let parts = std::iter::successors(Some(first), |part| Some(LONGER * part));
    let mut near = Near { p: problem.p.to_vec(), recordings: problem.recordings.to_vec() };
    let mut spent = Spent::default();
    for part in parts.take_while(|part| *part < 1.0) {
        let heads: Vec<Recording> =
            near.recordings.iter().map(|recording| beginning(recording, part)).collect();
        // What a beginning does not tell, or cannot be simulated, a longer one may.
        let Ok(found) = fit(&OutputErrorProblem {
            p: &near.p,
            recordings: &heads,
            stopping: StoppingRule { reduction: NEAR, ..problem.stopping },
            ..problem.clone()
        }) else {
            continue;
        };
        spent.add(&found);
        near.go_to(&found);
    }
    let mut found =
        fit(&OutputErrorProblem { p: &near.p, recordings: &near.recordings, ..problem.clone() })?;
    found.iterations += spent.iterations;
    found.evaluations += spent.evaluations;
    found.failures += spent.failures;
    Ok(found)
}

/// Where the next fit starts.
struct Near {
    p: Vec<f64>,
    /// With start values as they were found.
    recordings: Vec<Recording>,
}

impl Near {
    fn go_to(&mut self, found: &Fit) {
        self.p.clone_from(&found.p);
        for (recording, start) in self.recordings.iter_mut().zip(&found.starts) {
            recording.start.clone_from(start);
        }
    }
}

/// What the fits of beginnings took.
#[derive(Default)]
struct Spent {
    iterations: usize,
    evaluations: usize,
    failures: usize,
}

impl Spent {
    fn add(&mut self, found: &Fit) {
        self.iterations += found.iterations;
        self.evaluations += found.evaluations;
        self.failures += found.failures;
    }
}

/// The part of the recordings to begin with: as many readings of each as [`READINGS`] says. `None` for a model that does
/// not switch, and where the whole is needed.
fn first_part(problem: &OutputErrorProblem<'_>) -> Option<f64> {
    let switches = |automaton: &Automaton| !automaton.kind.keeps_slopes();
    if !problem.system.signature().discrete.automata.iter().any(switches) {
        return None;
    }
    let estimates = problem.free.iter().filter(|free| **free).count();
    let outputs = problem.noise.iter().filter(|noise| noise.is_some()).count().max(1);
    let rows = (READINGS * estimates).div_ceil(outputs);
    let of_recording = |recording: &Recording| {
        let (from, until) = (recording.times.first()?, recording.times.last()?);
        Some((recording.times.get(rows)? - from) / (until - from))
    };
    let parts = problem.recordings.iter().filter_map(of_recording);
    parts.filter(|part| 0.0 < *part && *part < 1.0).min_by(f64::total_cmp)
}

/// A part of a recording, as if there were no more of it, but for what does not count.
fn beginning(recording: &Recording, part: f64) -> Recording {
    let (Some(from), Some(until)) = (recording.times.first(), recording.times.last()) else {
        return recording.clone();
    };
    let head = recording.head(from + part * (until - from));
    Recording { counts_from: recording.counts_from, ..head }
}
