//! The normal equations of a fit: simulates recordings, and weights and adds up their contributions.

use dgd_runtime::model::Model;
use dgd_runtime::parallel::in_parallel_by_model;
use dgd_runtime::signature::Distribution;
use nalgebra::DMatrix;

use crate::error::{TrialFailed, TrialFailure};
use crate::minimise::trust_region::NormalEquations;
use crate::noise::NoiseSource;
use crate::noise::density::SampleWeighting;
use crate::noise::loss::Loss;
use crate::output_error::OutputErrorProblem;
use crate::output_error::prior::PriorTerm;
use crate::recording::{OutputMisfit, OutputSums, Recording, SumsOf, simulated_sums};
use crate::variables::FitVariables;

/// Weighted sums over all recordings.
pub(crate) struct WeightedSums {
    pub normal: NormalEquations,
    pub sums: Vec<Vec<OutputSums>>,
}

impl AsRef<NormalEquations> for WeightedSums {
    fn as_ref(&self) -> &NormalEquations {
        &self.normal
    }
}

/// Sums over the samples of all recordings at z, which depend on σ for a loss other than squares.
pub(crate) fn simulate_all(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
    sigma: &[Option<f64>],
) -> Result<Vec<Vec<OutputSums>>, TrialFailed> {
    let OutputErrorProblem { system, recordings, options, threads, noise, loss, .. } = problem;
    let p = variables.parameters(problem.p, z);
    let names = output_names(*system);
    let results = in_parallel_by_model(*system, recordings.len(), *threads, |system, r| {
        let recording = &recordings[r];
        let start = variables.starts(r, &recording.start, z);
        let columns = variables.columns(r, z);
        let name = |i: usize| names[i].clone();
        let counting = counting(noise, *loss, sigma, recording);
        let sums_of = SumsOf { columns: &columns, counting: &counting };
        simulated_sums(system, recording, &p, &start, options, sums_of, name)
    });
    let failed = |(recording, result): (usize, Result<Vec<OutputSums>, TrialFailure>)| {
        result.map_err(|reason| TrialFailed { recording, reason })
    };
    results.into_iter().enumerate().map(failed).collect()
}

/// How the samples of each output of a recording contribute.
fn counting<'r>(
    noise: &[Option<NoiseSource>],
    loss: Loss,
    sigma: &[Option<f64>],
    recording: &'r Recording,
) -> Vec<SampleWeighting<'r>> {
    let counting_of = |i: usize| match noise[i] {
        Some(NoiseSource::Density(density)) => SampleWeighting::Density(density),
        Some(NoiseSource::Stabilised(density, shape)) => {
            SampleWeighting::Stabilised(density, shape)
        }
        Some(NoiseSource::Recorded) => {
            let rows = recording.deviations_of(i);
            rows.map_or(SampleWeighting::Squares, |rows| {
                SampleWeighting::Rows(rows, Distribution::Normal)
            })
        }
        Some(NoiseSource::Known(_) | NoiseSource::Estimated) | None => {
            loss.scaled(sigma[i]).map_or(SampleWeighting::Squares, SampleWeighting::Robust)
        }
    };
    (0..sigma.len()).map(counting_of).collect()
}

/// Weights and adds up contributions: recordings and their outputs in order, then priors.
pub(crate) fn weigh(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
    sigma: &[Option<f64>],
    sums: Vec<Vec<OutputSums>>,
) -> WeightedSums {
    let mut normal = NormalEquations::zeros(variables.len());
    for (r, of_recording) in sums.iter().enumerate() {
        for (sums, sigma) in of_recording.iter().zip(sigma) {
            let Some(sigma) = sigma else { continue };
            let weight = sums.weight(*sigma);
            normal.cost += weight * sums.loss();
            if let Some(likelihood) = &sums.likelihood {
                normal.cost += likelihood.logarithms;
                normal.logarithms += likelihood.logarithms;
            }
            normal.is_whole &= sums.without_sensitivity == 0;
            for (i, gradient) in sums.gradient.iter().enumerate() {
                normal.gradient[variables.position(r, i)] += weight * gradient;
            }
            add(&mut normal.information, variables, r, weight, &sums.information);
        }
    }
    for term in prior_terms(problem, variables, z) {
        normal.cost += term.cost + term.logarithm;
        normal.logarithms += term.logarithm;
        term.add_gradient(&mut normal.gradient);
        term.add_curvature(&mut normal.information);
    }
    normal.information.fill_upper_triangle_with_lower_triangle();
    WeightedSums { normal, sums }
}

/// Adds the contribution of a recording's samples to its own variables.
fn add(
    information: &mut DMatrix<f64>,
    variables: &FitVariables,
    r: usize,
    weight: f64,
    of_recording: &[f64],
) {
    let n_own = variables.n_shared + variables.n_start;
    for i in 0..n_own {
        let row = variables.position(r, i);
        for j in 0..=i {
            let column = variables.position(r, j);
            information[(row, column)] += weight * of_recording[i * n_own + j];
        }
    }
}

/// H and G of the covariance H⁻¹ G H⁻¹ for a loss other than squares ([`crate::noise::loss`]).
pub(crate) fn curvature_and_influence(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
    sigma: &[Option<f64>],
    at: &WeightedSums,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = variables.len();
    let (mut h, mut g) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    let robust_sums = || at.sums.iter().flatten().filter(|sums| sums.robust.is_some());
    let samples = robust_sums().map(|sums| sums.samples).sum::<usize>();
    let data = samples + effective_priors(problem, variables);
    let unheld = variables.unheld(z);
    let spread = data as f64 / data.saturating_sub(unheld).max(1) as f64;
    for (i, sigma) in sigma.iter().enumerate() {
        let Some(sigma) = sigma else { continue };
        let of_output =
            || at.sums.iter().enumerate().map(|(r, of_recording)| (r, &of_recording[i]));
        let robust = || of_output().filter_map(|(r, sums)| Some((r, sums.robust.as_ref()?)));
        let samples = of_output().map(|(_, sums)| sums.samples).sum::<usize>().max(1) as f64;
        let mean = robust().map(|(_, sums)| sums.curvature).sum::<f64>() / samples;
        let squares = robust().map(|(_, sums)| sums.curvature_squares).sum::<f64>() / samples;
        // var ψ′ of a sample.
        let scatter = (squares - mean * mean) * samples / (samples - 1.0).max(1.0);
        let kappa = 1.0 + unheld as f64 / data as f64 * scatter / (mean * mean);
        // If most errors are outliers the sum does not curve upwards, and gives no information.
        let curvature = if mean > 0.0 { mean / kappa } else { 0.0 };
        let influence = robust().map(|(_, sums)| sums.influence).sum::<f64>() / samples * spread;
        for (r, sums) in robust() {
            add(&mut h, variables, r, curvature / (sigma * sigma), &sums.information);
            add(&mut g, variables, r, influence / (sigma * sigma), &sums.information);
        }
    }
    for term in prior_terms(problem, variables, z) {
        term.add_information(&mut h);
        term.add_information(&mut g);
    }
    h.fill_upper_triangle_with_lower_triangle();
    g.fill_upper_triangle_with_lower_triangle();
    (h, g)
}

/// The information of a fit at z: steps may have used another curvature of the priors.
pub(crate) fn information(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
    at: &WeightedSums,
) -> DMatrix<f64> {
    let mut information = at.normal.information.clone();
    for term in prior_terms(problem, variables, z) {
        term.put_information(&mut information);
    }
    information
}

/// The contribution at z of each prior with a free parameter.
fn prior_terms(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
    z: &[f64],
) -> impl Iterator<Item = PriorTerm> {
    let p = variables.parameters(problem.p, z);
    problem.priors.iter().filter_map(move |prior| prior.term(variables, &p, z))
}

/// Priors with a free parameter.
pub(crate) fn effective_priors(
    problem: &OutputErrorProblem<'_>,
    variables: &FitVariables,
) -> usize {
    let is_free = |i| variables.parameter(i).is_some();
    problem.priors.iter().filter(|prior| prior.concerns(is_free)).count()
}

/// Simulated against measured, by recording and output.
pub(crate) fn misfits(sums: &[Vec<OutputSums>]) -> Vec<Vec<OutputMisfit>> {
    let misfit = |sums: &OutputSums| OutputMisfit { samples: sums.samples, squares: sums.squares };
    sums.iter().map(|of_recording| of_recording.iter().map(misfit).collect()).collect()
}

/// Names of the outputs, for messages.
pub(crate) fn output_names(system: &dyn Model) -> Vec<String> {
    system.signature().outputs.iter().map(|output| output.name.to_string()).collect()
}
