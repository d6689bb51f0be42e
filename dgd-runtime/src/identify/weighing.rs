//! The normal equations of a fit: recordings simulated, weighed and added up.

use crate::identify::error::{TrialFailed, TrialFailure};
use crate::identify::levenberg_marquardt::NormalEquations;
use crate::identify::output_error::OutputErrorProblem;
use crate::identify::parallel::in_parallel;
use crate::identify::recording::{Misfit, Sums, simulated_sums};
use crate::identify::variables::Variables;
use crate::system::System;

/// Sums of all recordings with their weights.
pub(super) struct Weighted {
    pub normal: NormalEquations,
    pub sums: Vec<Vec<Sums>>,
}

impl AsRef<NormalEquations> for Weighted {
    fn as_ref(&self) -> &NormalEquations {
        &self.normal
    }
}

/// Sums over the samples of all recordings at z.
pub(super) fn simulate_all<S: System + Clone + Send>(
    problem: &OutputErrorProblem<'_, S>,
    variables: &Variables,
    z: &[f64],
) -> Result<Vec<Vec<Sums>>, TrialFailed> {
    let OutputErrorProblem { system, recordings, options, threads, .. } = problem;
    let p = variables.parameters(problem.p, z);
    let names = output_names(*system);
    let results = in_parallel(*system, recordings.len(), *threads, |system, r| {
        let recording = &recordings[r];
        let start = variables.starts(r, &recording.start, z);
        let columns = variables.columns(r, z);
        let name = |i: usize| names[i].clone();
        simulated_sums(system, recording, (&p, &start), options, &columns, name)
    });
    let failed = |(recording, result): (usize, Result<Vec<Sums>, TrialFailure>)| {
        result.map_err(|reason| TrialFailed { recording, reason })
    };
    results.into_iter().enumerate().map(failed).collect()
}

/// Weighs and adds up: recordings in their order, outputs in theirs, then priors.
pub(super) fn weigh<S: System>(
    problem: &OutputErrorProblem<'_, S>,
    variables: &Variables,
    z: &[f64],
    sigma: &[Option<f64>],
    sums: Vec<Vec<Sums>>,
) -> Weighted {
    let mut normal = NormalEquations::zeros(variables.len());
    let own = variables.n_shared + variables.n_start;
    for (r, of_recording) in sums.iter().enumerate() {
        for (sums, sigma) in of_recording.iter().zip(sigma) {
            let Some(sigma) = sigma else { continue };
            let weight = 1.0 / (sigma * sigma);
            normal.cost += weight * sums.squares;
            for i in 0..own {
                let row = variables.position(r, i);
                normal.gradient[row] += weight * sums.gradient[i];
                for j in 0..=i {
                    let column = variables.position(r, j);
                    normal.information[(row, column)] += weight * sums.information[i * own + j];
                }
            }
        }
    }
    for prior in &problem.priors {
        let Some(i) = variables.parameter(prior.parameter) else { continue };
        let variable = &variables.all[i];
        let (r, slope) =
            ((variable.value(z[i]) - prior.mean) / prior.std, variable.slope(z[i]) / prior.std);
        normal.cost += r * r;
        normal.gradient[i] += slope * r;
        normal.information[(i, i)] += slope * slope;
    }
    normal.information.fill_upper_triangle_with_lower_triangle();
    Weighted { normal, sums }
}

/// Priors of parameters that are free.
pub(super) fn effective_priors<S: System>(
    problem: &OutputErrorProblem<'_, S>,
    variables: &Variables,
) -> usize {
    problem.priors.iter().filter(|prior| variables.parameter(prior.parameter).is_some()).count()
}

/// Simulated against measured, by recording and output.
pub(super) fn misfits(sums: &[Vec<Sums>]) -> Vec<Vec<Misfit>> {
    let of = |sums: &Sums| Misfit { samples: sums.samples, squares: sums.squares };
    sums.iter().map(|of_recording| of_recording.iter().map(of).collect()).collect()
}

/// For messages.
pub(super) fn output_names<S: System>(system: &S) -> Vec<String> {
    system.signature().outputs.iter().map(|output| output.name.to_string()).collect()
}
