//! One experiment: its simulation, and what its samples add to the normal equations.

use dgd_runtime::for_identify::can_stream;
use dgd_runtime::linearize::LinearAt;
use dgd_runtime::model::{Model, Samples, observe, stream};
use dgd_runtime::{Inputs, Observations, Options, Problem, simulate, simulate_with_sensitivities};

use crate::error::TrialFailure;
use crate::keep_by_fields;
use crate::loss::{Robust, Scaled};
use crate::output_error::linearised;

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
    /// Where the linear model is that stands in for the model; `None` for the model itself.
    pub linear: Option<LinearAt>,
}

impl Recording {
    /// A recording all of whose samples count, with the model's start values.
    pub fn new(times: Vec<f64>, inputs: Inputs, measured: Vec<Option<Vec<f64>>>) -> Self {
        Self {
            times,
            inputs,
            measured,
            start: Vec::new(),
            counts_from: f64::NEG_INFINITY,
            linear: None,
        }
    }

    /// The part before a time, all of which counts.
    pub(crate) fn head(&self, until: f64) -> Self {
        let len = self.times.partition_point(|t| *t < until);
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
            linear: self.linear.clone(),
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
/// All estimation sees a model through this function and [`simulated_sums`].
pub(crate) fn outputs_of(
    system: &dyn Model,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
    options: &Options,
    derivatives: Derivatives,
) -> Result<Observations, TrialFailure> {
    let problem = Problem { system: &system, p, inputs: &recording.inputs, start };
    if let Some(at) = &recording.linear {
        return linearised::outputs_of(&problem, recording, at, options, derivatives)
            .map_err(|error| TrialFailure::NotLinearised(Box::new(error)));
    }
    let solution = match derivatives {
        Derivatives::No => simulate(&problem, &recording.times, options),
        Derivatives::Yes => simulate_with_sensitivities(&problem, &recording.times, options),
    };
    match solution {
        Ok(solution) => Ok(observe(&problem, &solution)),
        Err(failure) => Err(TrialFailure::Simulation(failure.error)),
    }
}

/// Outputs at the sample times of a recording, and their sensitivities to the directions of the model.
///
/// # Errors
///
/// [`TrialFailure::Simulation`], and [`TrialFailure::NotLinearised`] where [`Recording::linear`] asks for that.
pub fn outputs_with_sensitivities(
    system: &dyn Model,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
    options: &Options,
) -> Result<Observations, TrialFailure> {
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
    /// Σ w (∂e/∂z) e, with the weights of the loss.
    pub gradient: Vec<f64>,
    /// Σ w (∂e/∂z)(∂e/∂z)ᵀ.
    pub information: Vec<f64>,
    /// What else there is under a loss that is not squares, of which all w are 1.
    pub robust: Option<Robust>,
}

keep_by_fields!(Sums { samples, without_sensitivity, squares, gradient, information, robust });

impl Sums {
    fn zeros(n: usize, scaled: Option<Scaled>) -> Self {
        Self {
            gradient: vec![0.0; n],
            information: vec![0.0; n * n],
            robust: scaled.map(|_| Robust::zeros(n)),
            ..Self::default()
        }
    }

    /// Σ σ² ρ(e/σ), which is Σ e² where the loss is squares.
    pub(crate) fn loss(&self) -> f64 {
        self.robust.as_ref().map_or(self.squares, |robust| robust.loss)
    }

    /// Adds a sample: its error e and ∂e/∂z.
    #[inline]
    fn add(&mut self, e: f64, slopes: &[f64], scaled: Option<Scaled>) {
        self.samples += 1;
        self.squares += e * e;
        if let (Some(scaled), Some(robust)) = (scaled, &mut self.robust) {
            let weight = robust.add(e, slopes, scaled);
            self.add_slopes(e, slopes, |slope| weight * slope);
        } else {
            self.add_slopes(e, slopes, |slope| slope);
        }
    }

    #[inline]
    fn add_slopes(&mut self, e: f64, slopes: &[f64], weighted: impl Fn(f64) -> f64) {
        let n = slopes.len();
        if n == 0 {
            return;
        }
        if slopes.iter().any(|slope| !slope.is_finite()) {
            self.without_sensitivity += 1;
            return;
        }
        let rows = self.information.chunks_exact_mut(n).zip(&mut self.gradient);
        for (i, ((row, gradient), a)) in rows.zip(slopes).enumerate() {
            let a = weighted(*a);
            *gradient += a * e;
            for (sum, b) in row[..=i].iter_mut().zip(slopes) {
                *sum += a * b;
            }
        }
    }
}

/// Sums over the samples of each measured output, with e = w − measured; `losses` are those of outputs
/// whose loss is not squares.
pub(crate) fn sums(
    recording: &Recording,
    observations: &Observations,
    columns: &[Column],
    losses: &[Option<Scaled>],
    output_name: impl Fn(usize) -> String,
) -> Result<Vec<Sums>, TrialFailure> {
    let n_w = observations.n_w;
    let mut slopes = vec![0.0; columns.len()];
    let mut all = Vec::with_capacity(n_w);
    for (output, scaled) in losses.iter().copied().enumerate() {
        let mut sums = Sums::zeros(columns.len(), scaled);
        for (k, measured) in recording.counted(output) {
            let e = observations.w(k)[output] - measured;
            if !e.is_finite() {
                let (output, t) = (output_name(output), recording.times[k]);
                return Err(TrialFailure::OutputNotFinite { output, t });
            }
            if !columns.is_empty() {
                write_slopes(observations.dw(k), n_w, output, columns, &mut slopes);
            }
            sums.add(e, &slopes, scaled);
        }
        all.push(sums);
    }
    Ok(all)
}

/// ∂w/∂z of one output.
#[inline]
pub(crate) fn write_slopes(
    dw: &[f64],
    n_w: usize,
    output: usize,
    columns: &[Column],
    slopes: &mut [f64],
) {
    for (slope, column) in slopes.iter_mut().zip(columns) {
        *slope = dw[column.direction * n_w + output] * column.slope;
    }
}

/// Of what sums are taken: derivatives to some variables, and the loss of each output that counts.
#[derive(Clone, Copy)]
pub(crate) struct SumsOf<'a> {
    pub(crate) columns: &'a [Column],
    pub(crate) losses: &'a [Option<Scaled>],
}

/// [`sums`] of a simulation, with derivatives; where it can be, each sample is added as it is reached.
pub(crate) fn simulated_sums(
    system: &dyn Model,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
    options: &Options,
    of: SumsOf<'_>,
    output_name: impl Fn(usize) -> String,
) -> Result<Vec<Sums>, TrialFailure> {
    let SumsOf { columns, losses } = of;
    let problem = Problem { system: &system, p, inputs: &recording.inputs, start };
    if recording.linear.is_some() || !can_stream(&problem, options) {
        let observations = outputs_of(system, recording, p, start, options, Derivatives::Yes)?;
        return sums(recording, &observations, columns, losses, output_name);
    }
    let mut adding = Adding::new(recording, columns, losses);
    stream(&problem, &recording.times, options, &mut adding).map_err(TrialFailure::Simulation)?;
    match adding.spoilt {
        None => Ok(adding.sums),
        Some((k, output)) => {
            let (output, t) = (output_name(output), recording.times[k]);
            Err(TrialFailure::OutputNotFinite { output, t })
        }
    }
}

/// Adds samples while a simulation goes on.
struct Adding<'a> {
    /// Measured values of each output, none for one that was not measured.
    measured: Vec<&'a [f64]>,
    /// Samples before this one do not count.
    first: usize,
    columns: &'a [Column],
    losses: &'a [Option<Scaled>],
    slopes: Vec<f64>,
    sums: Vec<Sums>,
    /// The first output that is not a number where it was measured, with its sample.
    spoilt: Option<(usize, usize)>,
}

impl<'a> Adding<'a> {
    fn new(recording: &'a Recording, columns: &'a [Column], losses: &'a [Option<Scaled>]) -> Self {
        Self {
            measured: recording
                .measured
                .iter()
                .map(|samples| samples.as_deref().unwrap_or_default())
                .collect(),
            first: recording.times.partition_point(|t| *t < recording.counts_from),
            columns,
            losses,
            slopes: vec![0.0; columns.len()],
            sums: losses.iter().map(|scaled| Sums::zeros(columns.len(), *scaled)).collect(),
            spoilt: None,
        }
    }
}

impl Samples for Adding<'_> {
    #[inline]
    fn wants(&mut self, k: usize) -> bool {
        let counts = |samples: &&[f64]| samples.get(k).is_some_and(|value| value.is_finite());
        k >= self.first && self.measured.iter().any(counts)
    }

    #[inline]
    fn take(&mut self, k: usize, w: &[f64], dw: &[f64]) {
        for (output, (sums, samples)) in self.sums.iter_mut().zip(&self.measured).enumerate() {
            let Some(measured) = samples.get(k).filter(|value| value.is_finite()) else { continue };
            let e = w[output] - measured;
            if !e.is_finite() {
                self.spoilt.get_or_insert((k, output));
                continue;
            }
            write_slopes(dw, w.len(), output, self.columns, &mut self.slopes);
            sums.add(e, &self.slopes, self.losses[output]);
        }
    }
}
