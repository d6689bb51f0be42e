//! Validation recordings: start values from their beginnings, then a simulation.
//!
//! If fewer outputs than states are read, the first readings do not determine all start values, and fitting them may
//! end in the wrong minimum. So fits also begin at the states of training recordings from which the outputs continued
//! alike.

use dgd_execute::LoadedSystem;
use dgd_identify::journal::kept;
use dgd_identify::{OutputErrorProblem, Recording, Starts, evaluate, fit_starts};
use dgd_runtime::{Observations, Problem, Solution, System, simulate};

use super::data::SearchData;
use super::fitted::{FittedStructure, VERY_STRONG, problem};
use super::residuals::whitened_square;

/// Number of readings that are compared between the beginning of a recording and the course of another.
const COMPARED: usize = 8;
/// Number of samples of each training recording from which start values are tried.
const ALIKE: usize = 3;
/// Start values whose Σ ε² over the beginning differ by less are equally good there; the whole recording decides
/// between them.
const EVEN: f64 = VERY_STRONG;

impl FittedStructure {
    /// Simulates the validation recordings.
    pub(crate) fn hold_out(&mut self, data: &SearchData<'_>, evaluations: usize) {
        self.valid = self.held_out(data, evaluations);
    }

    /// Outputs of the validation recordings; `None` if one cannot be simulated.
    fn held_out(&self, data: &SearchData<'_>, evaluations: usize) -> Option<Vec<Observations>> {
        let starts = self.held_out_starts(data, evaluations)?;
        let problem = problem(&self.structure, &self.p, data.valid, data, evaluations);
        Some(evaluate(&problem, &self.p, &starts).ok()?.observations)
    }

    /// Start values of the validation recordings from their beginnings; `None` if one cannot be simulated.
    pub(crate) fn held_out_starts(
        &self,
        data: &SearchData<'_>,
        evaluations: usize,
    ) -> Option<Vec<Starts>> {
        let FittedStructure { structure, p, values, .. } = self;
        let key = data.keeping.key(&("held out", &structure.id), |digest| {
            let options = data.options_for(&structure.system);
            let with = digest
                .debug(p)
                .debug(values)
                .debug(&data.noise)
                .debug(&options)
                .debug(&evaluations);
            with.debug(&data.counts_from)
        });
        kept(data.keeping.journal, key, || {
            let problem = problem(structure, p, data.valid, data, evaluations);
            let plain = fit_starts(&problem, &data.counts_from).ok();
            if self.has_hidden_states(data) {
                self.likeliest(&problem, plain.as_deref(), data)
            } else {
                plain
            }
        })
    }

    /// Σ ε² of the validation recordings; infinite if they cannot be simulated.
    pub(crate) fn held_out_error(&self, data: &SearchData<'_>) -> f64 {
        let residuals = self.held_out_residuals(data);
        residuals.map_or(f64::INFINITY, |all| whitened_square(data.valid, &all, &data.noise).0)
    }

    /// Mean square of the residuals of the validation recordings relative to the noise; `None` without any.
    pub(crate) fn held_out_square(&self, data: &SearchData<'_>) -> Option<f64> {
        let residuals = self.held_out_residuals(data)?;
        let (sum, n) = whitened_square(data.valid, &residuals, &data.noise);
        (n > 0).then(|| sum / n as f64)
    }

    /// Whether fewer outputs are read than there are states.
    pub(crate) fn has_hidden_states(&self, data: &SearchData<'_>) -> bool {
        let states = self.structure.system.signature().unknowns.differential().count();
        data.noise.iter().flatten().count() < states
    }

    /// For each recording, the start values among `plain` and those found from the courses of the training recordings
    /// that follow its beginning best.
    fn likeliest(
        &self,
        problem: &OutputErrorProblem<'_>,
        plain: Option<&[Starts]>,
        data: &SearchData<'_>,
    ) -> Option<Vec<Starts>> {
        let courses = self.courses(data);
        let mut best_starts = Vec::with_capacity(data.valid.len());
        for (r, (recording, before)) in data.valid.iter().zip(&data.counts_from).enumerate() {
            let head = [recording.head(*before)];
            let whole = std::slice::from_ref(recording);
            let left = |starts: &Starts, recordings: &[Recording]| {
                let problem = OutputErrorProblem { recordings, ..problem.clone() };
                let starts = std::slice::from_ref(starts);
                evaluate(&problem, &self.p, starts).map_or(f64::INFINITY, |one| one.cost)
            };
            let alike = courses.iter().flat_map(|(train, course, outputs)| {
                let samples = most_alike(&head[0], train, outputs, data);
                let system = &self.structure.system;
                samples.into_iter().map(|k| states_at(system, course, k)).collect::<Vec<_>>()
            });
            let fitted = alike.filter_map(|start| {
                let begun = [Recording { start, ..recording.clone() }];
                let problem = OutputErrorProblem { recordings: &begun, ..problem.clone() };
                fit_starts(&problem, std::slice::from_ref(before)).ok()?.pop()
            });
            let plain = plain.map(|plain| plain[r].clone());
            let starts: Vec<(f64, Starts)> = (plain.into_iter().chain(fitted))
                .map(|starts| (left(&starts, &head), starts))
                .collect();
            let least = starts.iter().map(|(left, _)| *left).fold(f64::INFINITY, f64::min);
            let as_good = starts.into_iter().filter(|(left, _)| *left <= least + EVEN);
            let best = as_good
                .map(|(_, starts)| (left(&starts, whole), starts))
                .min_by(|(a, _), (b, _)| a.total_cmp(b));
            best_starts.push(best?.1);
        }
        Some(best_starts)
    }

    /// Training recordings with their unknowns and outputs; without those that cannot be simulated.
    fn courses<'a>(
        &'a self,
        data: &SearchData<'a>,
    ) -> Vec<(&'a Recording, Solution, &'a Observations)> {
        let system = &self.structure.system;
        let options = data.options_for(system);
        let recordings = data.train.iter().zip(&self.train).enumerate();
        recordings
            .filter_map(|(r, (recording, outputs))| {
                let start = self.values.starts(system, r);
                let Recording { inputs, times, .. } = recording;
                let problem = Problem { system, p: &self.p, inputs, start: &start };
                Some((recording, simulate(&problem, times, &options).ok()?, outputs))
            })
            .collect()
    }
}

/// The differential unknowns of a trajectory at a sample.
pub(crate) fn states_at(system: &LoadedSystem, trajectory: &Solution, k: usize) -> Starts {
    let states = system.signature().unknowns.differential();
    states.map(|i| (i, trajectory.y(k)[i])).collect()
}

/// The samples of a training recording from which its outputs continue most like the beginning of another one, the best
/// first: local minima of the distance.
fn most_alike(
    head: &Recording,
    train: &Recording,
    outputs: &Observations,
    data: &SearchData<'_>,
) -> Vec<usize> {
    let n = head.times.len();
    let Some(begin) = head.times.first() else { return Vec::new() };
    let compared: Vec<usize> = (0..COMPARED.min(n)).map(|j| j * n / COMPARED.min(n)).collect();
    let apart = |k: usize| -> f64 {
        let mut sum = 0.0;
        for &j in &compared {
            let t = train.times[k] + head.times[j] - begin;
            let sample = train.times.partition_point(|own| *own < t);
            if sample >= train.times.len() {
                return f64::INFINITY;
            }
            for (i, noise) in data.noise.iter().enumerate() {
                let (Some(noise), Some(read)) = (noise, &head.measured[i]) else { continue };
                let error = (read[j] - outputs.w(sample)[i]) / noise.total();
                sum += if error.is_finite() { error * error } else { 0.0 };
            }
        }
        sum
    };
    let distances: Vec<f64> = (0..train.times.len()).map(apart).collect();
    let before = |k: usize| k.checked_sub(1).map_or(f64::INFINITY, |k| distances[k]);
    let after = |k: usize| distances.get(k + 1).copied().unwrap_or(f64::INFINITY);
    let mut least: Vec<usize> = (0..distances.len())
        .filter(|k| {
            distances[*k].is_finite() && distances[*k] < before(*k) && distances[*k] <= after(*k)
        })
        .collect();
    least.sort_by(|a, b| distances[*a].total_cmp(&distances[*b]));
    least.truncate(ALIKE);
    least
}
