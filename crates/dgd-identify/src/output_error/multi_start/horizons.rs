//! Fits of models that switch, over increasing horizons of the recordings.
//!
//! If a model switches when a state passes a threshold, a run with slightly wrong parameters gets out of phase with the
//! recording after some cycles, and a fit of the whole recording ends in a minimum that confuses cycles with their
//! neighbours. Over a short horizon nothing is out of phase yet; its fit is close enough for a horizon that is half as
//! long again, and so on up to the whole recording.

use dgd_runtime::signature::Automaton;
use dgd_runtime::{Options, Problem, simulate};

use crate::error::EstimateError;
use crate::minimise::trust_region::StoppingRule;
use crate::output_error::fit::Fit;
use crate::output_error::multi_start::next_switch::next_switch;
use crate::output_error::{OutputErrorProblem, Starts, fit};
use crate::recording::Recording;

/// Number of readings in the first horizon for each estimate.
const READINGS: usize = 3;

/// Factor between horizons: a run that is off by less than a quarter of a cycle at the end of one is off by less than
/// half a cycle at the end of the next.
const LONGER: f64 = 1.5;

/// Limit on the steps of a simulation, as a multiple of those with the initial values or of its readings, whichever is
/// larger. A visible period has at least two readings, and so forty steps.
const TIMES: usize = 20;

/// The fit of a horizon ends when a step promises no more than this fraction of Σ r²: the next one continues from
/// there, and parameters that a short horizon hardly determines are not worth the search.
const NEAR: f64 = 0.01;

/// A fit, over increasing horizons if the model switches.
///
/// # Errors
///
/// As [`fit`].
pub(super) fn fit_by_horizons(problem: &OutputErrorProblem<'_>) -> Result<Fit, EstimateError> {
    let Some(first) = first_part(problem) else { return fit(problem) };
    let options = Options { max_steps: most_steps(problem), ..problem.options };
    let patient = problem;
    let problem = &OutputErrorProblem { options, ..problem.clone() };
    let parts = std::iter::successors(Some(first), |part| Some(LONGER * part));
    let mut near = NextStart { p: problem.p.to_vec(), recordings: problem.recordings.to_vec() };
    let mut spent = HorizonWork::default();
    for part in parts.take_while(|part| *part < 1.0) {
        let heads: Vec<Recording> =
            near.recordings.iter().map(|recording| beginning(recording, part)).collect();
        let stopping = StoppingRule { reduction: NEAR, ..problem.stopping };
        let head =
            OutputErrorProblem { p: &near.p, recordings: &heads, stopping, ..problem.clone() };
        // A longer horizon may determine more, or be possible to simulate.
        let Ok(found) = fit_with_next_switch(&head, &mut spent) else { continue };
        spent.add(&found);
        near.go_to(&found);
    }
    let whole = OutputErrorProblem { p: &near.p, recordings: &near.recordings, ..problem.clone() };
    let by_horizons = fit_with_next_switch(&whole, &mut spent);
    let options = patient.options;
    let mut best = by_horizons.or_else(|_| fit(&OutputErrorProblem { options, ..whole }))?;
    best.iterations += spent.iterations;
    best.evaluations += spent.evaluations;
    best.failures += spent.failures;
    Ok(best)
}

/// Limit on the steps of a simulation: endless switching, as by a thermostat whose thresholds have met, is a minimum of
/// its own, and takes unlimited time.
fn most_steps(problem: &OutputErrorProblem<'_>) -> usize {
    let tried = |(recording, start): (&Recording, &Starts)| {
        let inputs = &recording.inputs;
        let run = Problem { system: &problem.system, p: problem.p, inputs, start };
        let run = simulate(&run, &recording.times, &problem.options);
        // A failed run has taken steps as well.
        let statistics =
            run.map_or_else(|failure| failure.partial.statistics, |run| run.statistics);
        (statistics.steps + statistics.rejected).max(recording.times.len())
    };
    let starts = problem.recordings.iter().map(|recording| &recording.start);
    let most = problem.recordings.iter().zip(starts).map(tried).max().unwrap_or(0);
    problem.options.max_steps.min(TIMES * most)
}

/// Fits, and refits from points with an additional switch of the model as long as that improves the result.
fn fit_with_next_switch(
    problem: &OutputErrorProblem<'_>,
    spent: &mut HorizonWork,
) -> Result<Fit, EstimateError> {
    let mut best = fit(problem)?;
    loop {
        let (switched, simulations) = next_switch(problem, &best, NEAR);
        spent.evaluations += simulations;
        let Some(p) = switched else { return Ok(best) };
        let recordings: Vec<Recording> = (problem.recordings.iter().zip(&best.starts))
            .map(|(recording, start)| Recording { start: start.clone(), ..recording.clone() })
            .collect();
        let again = OutputErrorProblem { p: &p, recordings: &recordings, ..problem.clone() };
        match fit(&again) {
            Ok(other) if other.deviance < best.deviance => {
                spent.add(&best);
                best = other;
            }
            Ok(other) => {
                spent.add(&other);
                return Ok(best);
            }
            Err(_) => return Ok(best),
        }
    }
}

/// The starting point of the next fit.
struct NextStart {
    p: Vec<f64>,
    /// Recordings with the start values found.
    recordings: Vec<Recording>,
}

impl NextStart {
    fn go_to(&mut self, found: &Fit) {
        self.p.clone_from(&found.p);
        for (recording, start) in self.recordings.iter_mut().zip(&found.starts) {
            recording.start.clone_from(start);
        }
    }
}

/// Work spent on the fits of horizons.
#[derive(Default)]
struct HorizonWork {
    iterations: usize,
    evaluations: usize,
    failures: usize,
}

impl HorizonWork {
    fn add(&mut self, found: &Fit) {
        self.iterations += found.iterations;
        self.evaluations += found.evaluations;
        self.failures += found.failures;
    }
}

/// The first horizon as a fraction of the recordings: with as many readings of each as [`READINGS`] requires. `None`
/// for a model that does not switch, and if the whole is needed.
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

/// The first part of a recording, with the same uncounted burn-in.
fn beginning(recording: &Recording, part: f64) -> Recording {
    let (Some(from), Some(until)) = (recording.times.first(), recording.times.last()) else {
        return recording.clone();
    };
    let head = recording.head(from + part * (until - from));
    Recording { counts_from: recording.counts_from, ..head }
}
