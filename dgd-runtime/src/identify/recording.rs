//! One experiment: its simulation, and what its samples add to the normal equations.

use crate::error::IntegrateError;
use crate::identify::error::TrialFailure;
use crate::integrate::{simulate, simulate_with_sensitivities};
use crate::observe::{Observations, observe};
use crate::problem::{Options, Problem};
use crate::signal::Inputs;
use crate::system::System;

/// One experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Sample times, s, ascending; one that occurs twice means just before and just after a jump of
    /// the inputs.
    pub times: Vec<f64>,
    /// What drove the system.
    pub inputs: Inputs,
    /// For each output of the model, its samples in SI, one for each time and NaN where there is
    /// none; `None` for an output that was not measured.
    pub measured: Vec<Option<Vec<f64>>>,
    /// Start values that replace the model's, by position of the unknown, SI: first guesses of those
    /// that are free, given values of the others.
    pub start: Vec<(usize, f64)>,
    /// Samples before this time do not count, s.
    pub counts_from: f64,
}

impl Recording {
    /// A recording all of whose samples count, with the model's start values.
    pub fn new(times: Vec<f64>, inputs: Inputs, measured: Vec<Option<Vec<f64>>>) -> Self {
        Self { times, inputs, measured, start: Vec::new(), counts_from: f64::NEG_INFINITY }
    }

    /// The part up to a time, all of which counts.
    pub(crate) fn head(&self, until: f64) -> Self {
        let len = self.times.partition_point(|t| *t <= until);
        Self {
            times: self.times[..len].to_vec(),
            inputs: self.inputs.clone(),
            measured: self
                .measured
                .iter()
                .map(|samples| samples.as_ref().map(|samples| samples[..len].to_vec()))
                .collect(),
            start: self.start.clone(),
            counts_from: f64::NEG_INFINITY,
        }
    }

    /// Samples of an output that count: (position, value).
    pub(crate) fn counted(&self, output: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let from = self.times.partition_point(|t| *t < self.counts_from);
        let samples = self.measured[output].as_deref().unwrap_or_default();
        samples.iter().copied().enumerate().skip(from).filter(|(_, value)| value.is_finite())
    }
}

/// How far the simulated samples of an output are from the measured ones.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Misfit {
    /// Samples that count.
    pub samples: usize,
    /// Sum of their squared errors, SI.
    pub squares: f64,
}

impl Misfit {
    /// The root-mean-square error, SI; `None` without samples.
    pub fn rms(self) -> Option<f64> {
        (self.samples > 0).then(|| (self.squares / self.samples as f64).sqrt())
    }
}

impl std::iter::Sum for Misfit {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |sum, one| Self {
            samples: sum.samples + one.samples,
            squares: sum.squares + one.squares,
        })
    }
}

/// Whether derivatives are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Derivatives {
    /// Outputs only.
    No,
    /// Outputs and their sensitivities.
    Yes,
}

/// Outputs at the sample times of a recording, as its sensors would read them.
///
/// All estimation sees a model through this function.
pub(crate) fn outputs_of<S: System>(
    system: &S,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
    options: &Options,
    derivatives: Derivatives,
) -> Result<Observations, IntegrateError> {
    let problem = Problem { system, p, inputs: &recording.inputs, start };
    let solution = match derivatives {
        Derivatives::No => simulate(&problem, &recording.times, options),
        Derivatives::Yes => simulate_with_sensitivities(&problem, &recording.times, options),
    };
    match solution {
        Ok(solution) => Ok(observe(&problem, &solution)),
        Err(failure) => Err(failure.error),
    }
}

/// Outputs at the sample times of a recording, and their sensitivities to the directions of the model.
///
/// # Errors
///
/// What the simulation stopped for.
pub fn outputs_with_sensitivities<S: System>(
    system: &S,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
    options: &Options,
) -> Result<Observations, IntegrateError> {
    outputs_of(system, recording, p, start, options, Derivatives::Yes)
}

/// A direction of the model as a variable of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Column {
    /// Position among the model's directions.
    pub direction: usize,
    /// ∂θ/∂z: what the variable z changes of the direction θ.
    pub slope: f64,
}

/// What the samples of one output of one recording add, in the output's SI unit: the weight is the
/// business of who adds them up.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Sums {
    /// Samples that count.
    pub samples: usize,
    /// Those of them without defined sensitivities, which add to Σe² only.
    pub without_sensitivity: usize,
    /// Σ e².
    pub squares: f64,
    /// Σ (∂e/∂z) e.
    pub gradient: Vec<f64>,
    /// Σ (∂e/∂z)(∂e/∂z)ᵀ.
    pub information: Vec<f64>,
}

/// Sums over the samples of each measured output, with e = w − measured.
pub(crate) fn sums(
    recording: &Recording,
    observations: &Observations,
    columns: &[Column],
    output_name: impl Fn(usize) -> String,
) -> Result<Vec<Sums>, TrialFailure> {
    let n = columns.len();
    let n_w = observations.n_w;
    let mut slopes = vec![0.0; n];
    let mut all = Vec::with_capacity(n_w);
    for output in 0..n_w {
        let mut sums =
            Sums { gradient: vec![0.0; n], information: vec![0.0; n * n], ..Sums::default() };
        for (k, measured) in recording.counted(output) {
            let e = observations.w(k)[output] - measured;
            if !e.is_finite() {
                let (output, t) = (output_name(output), recording.times[k]);
                return Err(TrialFailure::OutputNotFinite { output, t });
            }
            sums.samples += 1;
            sums.squares += e * e;
            if n == 0 {
                continue;
            }
            let dw = observations.dw(k);
            for (slope, column) in slopes.iter_mut().zip(columns) {
                *slope = dw[column.direction * n_w + output] * column.slope;
            }
            if slopes.iter().any(|slope| !slope.is_finite()) {
                sums.without_sensitivity += 1;
                continue;
            }
            for (i, a) in slopes.iter().enumerate() {
                sums.gradient[i] += a * e;
                for (sum, b) in sums.information[i * n..].iter_mut().zip(&slopes[..=i]) {
                    *sum += a * b;
                }
            }
        }
        all.push(sums);
    }
    Ok(all)
}
