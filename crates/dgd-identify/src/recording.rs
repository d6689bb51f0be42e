//! One experiment: its simulation, and the contribution of its samples to the normal equations.

use dgd_runtime::for_identify::can_stream;
use dgd_runtime::linearize::LinearAt;
use dgd_runtime::model::{Model, SampleReceiver, observe, stream};
use dgd_runtime::signature::Distribution;
use dgd_runtime::{Inputs, Observations, Options, Problem, simulate, simulate_with_sensitivities};

use crate::error::TrialFailure;
use crate::keep_by_fields;
use crate::noise::density::{
    DensityTerm, LikelihoodSums, PredictedReading, SampleDefect, SampleWeighting,
};
use crate::noise::loss::RobustWeighting;
use crate::output_error::linearised;

/// One experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Sample times, s, ascending; two equal times are just before and just after a jump of the inputs.
    pub times: Vec<f64>,
    /// The inputs.
    pub inputs: Inputs,
    /// For each output of the model, its samples in SI, one for each time and NaN where missing; `None` for an output
    /// that was not measured.
    pub measured: Vec<Option<Vec<f64>>>,
    /// For each output of the model, the recorded standard deviations of its samples in SI, one for each time; may be
    /// shorter or empty if none were recorded.
    pub deviations: Vec<Option<Vec<f64>>>,
    /// Start values that replace the model's, by position of the unknown, SI: first guesses of free ones, values of
    /// fixed ones.
    pub start: Vec<(usize, f64)>,
    /// Samples before this time do not count, s.
    pub counts_from: f64,
    /// The operating point of the linear model that replaces the model; `None` for the model itself.
    pub linear: Option<LinearAt>,
}

impl Recording {
    /// A recording whose samples all count, with the model's start values.
    pub fn new(times: Vec<f64>, inputs: Inputs, measured: Vec<Option<Vec<f64>>>) -> Self {
        Self {
            times,
            inputs,
            measured,
            deviations: Vec::new(),
            start: Vec::new(),
            counts_from: f64::NEG_INFINITY,
            linear: None,
        }
    }

    /// The part before a time, with all its samples counting.
    #[must_use]
    pub fn head(&self, until: f64) -> Self {
        let len = self.times.partition_point(|t| *t < until);
        let head = |all: &[Option<Vec<f64>>]| -> Vec<Option<Vec<f64>>> {
            all.iter()
                .map(|samples| samples.as_ref().map(|samples| samples[..len].to_vec()))
                .collect()
        };
        Self {
            times: self.times[..len].to_vec(),
            inputs: self.inputs.clone(),
            measured: head(&self.measured),
            deviations: head(&self.deviations),
            start: self.start.clone(),
            counts_from: f64::NEG_INFINITY,
            linear: self.linear.clone(),
        }
    }

    /// Recorded standard deviations of an output's samples.
    pub fn deviations_of(&self, output: usize) -> Option<&[f64]> {
        self.deviations.get(output)?.as_deref()
    }

    /// Samples of an output that count: (position, value).
    pub(crate) fn counted(&self, output: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let from = self.times.partition_point(|t| *t < self.counts_from);
        let samples = self.measured[output].as_deref().unwrap_or_default();
        samples.iter().copied().enumerate().skip(from).filter(|(_, value)| value.is_finite())
    }
}

/// Errors of the simulated samples of an output.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OutputMisfit {
    /// Samples that count.
    pub samples: usize,
    /// Sum of their squared errors, SI.
    pub squares: f64,
}

impl OutputMisfit {
    /// The root-mean-square error, SI; `None` without samples.
    pub fn rms(self) -> Option<f64> {
        (self.samples > 0).then(|| (self.squares / self.samples as f64).sqrt())
    }
}

impl std::iter::Sum for OutputMisfit {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |sum, one| Self {
            samples: sum.samples + one.samples,
            squares: sum.squares + one.squares,
        })
    }
}

/// Whether derivatives are needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DerivativeUse {
    /// Outputs only.
    No,
    /// Outputs and their sensitivities.
    Yes,
}

/// Outputs at the sample times of a recording, as read by its sensors.
///
/// All estimation evaluates a model through this function and `simulated_sums`.
///
/// # Errors
///
/// As [`outputs_with_sensitivities`].
pub fn outputs_of(
    system: &dyn Model,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
    options: &Options,
    derivatives: DerivativeUse,
) -> Result<Observations, TrialFailure> {
    let problem = Problem { system: &system, p, inputs: &recording.inputs, start };
    if let Some(at) = &recording.linear {
        return linearised::outputs_of(&problem, recording, at, options, derivatives)
            .map_err(|error| TrialFailure::NotLinearised(Box::new(error)));
    }
    let solution = match derivatives {
        DerivativeUse::No => simulate(&problem, &recording.times, options),
        DerivativeUse::Yes => simulate_with_sensitivities(&problem, &recording.times, options),
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
/// [`TrialFailure::Simulation`], and [`TrialFailure::NotLinearised`] if [`Recording::linear`] requests a linear model.
pub fn outputs_with_sensitivities(
    system: &dyn Model,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
    options: &Options,
) -> Result<Observations, TrialFailure> {
    outputs_of(system, recording, p, start, options, DerivativeUse::Yes)
}

/// A direction of the model as a variable of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DirectionColumn {
    /// Position among the model's directions.
    pub direction: usize,
    /// ∂θ/∂z: derivative of the direction θ with respect to the variable z.
    pub slope: f64,
}

/// Contributions of the samples of one output of one recording, in the output's SI unit: the weight is applied when
/// they are added up.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct OutputSums {
    /// Samples that count.
    pub samples: usize,
    /// Samples without defined sensitivities, which only add to Σe².
    pub without_sensitivity: usize,
    /// Σ e².
    pub squares: f64,
    /// Σ w (∂e/∂z) e, with the weights of the loss.
    pub gradient: Vec<f64>,
    /// Σ w (∂e/∂z)(∂e/∂z)ᵀ.
    pub information: Vec<f64>,
    /// Additional sums under a loss other than squares; for squares, all w are 1.
    pub robust: Option<RobustWeighting>,
    /// Their likelihood, if they contribute by it: the sums are then weighted.
    pub likelihood: Option<LikelihoodSums>,
}

keep_by_fields!(OutputSums {
    samples,
    without_sensitivity,
    squares,
    gradient,
    information,
    robust,
    likelihood
});

impl OutputSums {
    fn zeros(n: usize, counting: SampleWeighting<'_>) -> Self {
        Self {
            gradient: vec![0.0; n],
            information: vec![0.0; n * n],
            robust: matches!(counting, SampleWeighting::Robust(_))
                .then(|| RobustWeighting::zeros(n)),
            likelihood: counting.distribution().map(|_| LikelihoodSums::default()),
            ..Self::default()
        }
    }

    /// Σ σ² ρ(e/σ), which is Σ e² for squares.
    pub(crate) fn loss(&self) -> f64 {
        match (&self.robust, &self.likelihood) {
            (Some(robust), _) => robust.loss,
            (None, Some(likelihood)) => likelihood.cost,
            (None, None) => self.squares,
        }
    }

    /// The factor of its sums: 1/σ², unless they contain it.
    pub(crate) fn weight(&self, sigma: f64) -> f64 {
        if self.likelihood.is_some() { 1.0 } else { 1.0 / (sigma * sigma) }
    }

    /// Adds a sample: its error e and ∂e/∂z.
    #[inline]
    fn add(&mut self, e: f64, slopes: &[f64], counting: SampleWeighting<'_>) {
        self.samples += 1;
        self.squares += e * e;
        if let (SampleWeighting::Robust(scaled), Some(robust)) = (counting, &mut self.robust) {
            let weight = robust.add(e, slopes, scaled);
            self.add_slopes(e, slopes, |slope| weight * slope);
        } else {
            self.add_slopes(e, slopes, |slope| slope);
        }
    }

    /// Adds a sample by its likelihood: ∂w/∂z and ∂σ/∂z.
    fn add_likely(
        &mut self,
        seen: PredictedReading,
        term: DensityTerm,
        distribution: Distribution,
        slopes: &[f64],
        of_sigma: &[f64],
    ) {
        let Some(likelihood) = &mut self.likelihood else {
            unreachable!("sums are made for what counts")
        };
        self.samples += 1;
        self.squares += (seen.simulated - seen.measured).powi(2);
        likelihood.add(seen, term, distribution);
        if slopes.iter().chain(of_sigma).any(|slope| !slope.is_finite()) {
            self.without_sensitivity += 1;
            return;
        }
        term.add(slopes, of_sigma, &mut self.gradient, &mut self.information);
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

/// Sums over the samples of each measured output, with e = w − measured.
pub(crate) fn sums(
    recording: &Recording,
    observations: &Observations,
    of: SumsOf<'_>,
    output_name: impl Fn(usize) -> String,
) -> Result<Vec<OutputSums>, TrialFailure> {
    let SumsOf { columns, counting } = of;
    let n_w = observations.n_w;
    let mut slopes = SampleSlopes::new(columns);
    let mut sums_of_outputs = Vec::with_capacity(n_w);
    for (output, counting) in counting.iter().copied().enumerate() {
        let mut sums = OutputSums::zeros(columns.len(), counting);
        for (k, measured) in recording.counted(output) {
            let (w, dw) =
                (observations.w(k), if columns.is_empty() { &[][..] } else { observations.dw(k) });
            let sample = SimulatedSample { k, output, measured, w, dw };
            if let Some(spoilt) = sample.add(&mut sums, counting, &mut slopes) {
                return Err(spoilt.failure(output_name(output), recording.times[k]));
            }
        }
        sums_of_outputs.push(sums);
    }
    Ok(sums_of_outputs)
}

/// ∂w/∂z of one output.
#[inline]
pub(crate) fn write_slopes(
    dw: &[f64],
    n_w: usize,
    output: usize,
    columns: &[DirectionColumn],
    slopes: &mut [f64],
) {
    for (slope, column) in slopes.iter_mut().zip(columns) {
        *slope = dw[column.direction * n_w + output] * column.slope;
    }
}

/// Buffers for the derivatives of a sample.
struct SampleSlopes<'a> {
    columns: &'a [DirectionColumn],
    of_output: Vec<f64>,
    of_sigma: Vec<f64>,
}

impl<'a> SampleSlopes<'a> {
    fn new(columns: &'a [DirectionColumn]) -> Self {
        let zeros = || vec![0.0; columns.len()];
        Self { columns, of_output: zeros(), of_sigma: zeros() }
    }
}

/// A measured sample, and the simulated outputs at its time with their sensitivities.
struct SimulatedSample<'a> {
    k: usize,
    output: usize,
    measured: f64,
    w: &'a [f64],
    dw: &'a [f64],
}

impl SimulatedSample<'_> {
    /// Adds it to the sums of its output, or returns its defect.
    #[inline]
    fn add(
        &self,
        sums: &mut OutputSums,
        counting: SampleWeighting<'_>,
        slopes: &mut SampleSlopes<'_>,
    ) -> Option<SampleDefect> {
        let Self { k, output, measured, w, dw } = *self;
        let SampleSlopes { columns, of_output, of_sigma } = slopes;
        let Some(distribution) = counting.distribution() else {
            let e = w[output] - measured;
            if !e.is_finite() {
                return Some(SampleDefect::NotFinite);
            }
            if !columns.is_empty() {
                write_slopes(dw, w.len(), output, columns, of_output);
            }
            sums.add(e, of_output, counting);
            return None;
        };
        let reading =
            PredictedReading { measured, simulated: w[output], sigma: counting.deviation(k, w) };
        let shape = counting.shape();
        let spoilt =
            reading.spoilt(distribution).or_else(|| shape.and_then(|shape| shape.spoilt(reading)));
        if spoilt.is_none() {
            if !columns.is_empty() {
                write_slopes(dw, w.len(), output, columns, of_output);
                if let Some(deviation) = counting.computed_by() {
                    write_slopes(dw, w.len(), deviation, columns, of_sigma);
                } else {
                    of_sigma.fill(0.0);
                }
            }
            let term = match shape {
                Some(shape) => {
                    // The scale accounts for the dependence of σ on the output.
                    let growth = reading.sigma * shape.growth(reading.simulated);
                    for (of_sigma, of_output) in of_sigma.iter_mut().zip(&*of_output) {
                        *of_sigma -= growth * of_output;
                    }
                    shape.term(reading, distribution)
                }
                None => reading.term(distribution),
            };
            sums.add_likely(reading, term, distribution, of_output, of_sigma);
        }
        spoilt
    }
}

/// Settings for sums: variables of the derivatives, and contributions of the samples of each output.
#[derive(Clone, Copy)]
pub(crate) struct SumsOf<'a> {
    pub(crate) columns: &'a [DirectionColumn],
    pub(crate) counting: &'a [SampleWeighting<'a>],
}

/// [`sums`] of a simulation, with derivatives; if possible, each sample is added as it is reached.
pub(crate) fn simulated_sums(
    system: &dyn Model,
    recording: &Recording,
    p: &[f64],
    start: &[(usize, f64)],
    options: &Options,
    of: SumsOf<'_>,
    output_name: impl Fn(usize) -> String,
) -> Result<Vec<OutputSums>, TrialFailure> {
    let problem = Problem { system: &system, p, inputs: &recording.inputs, start };
    if recording.linear.is_some() || !can_stream(&problem, options) {
        let observations = outputs_of(system, recording, p, start, options, DerivativeUse::Yes)?;
        return sums(recording, &observations, of, output_name);
    }
    let mut adding = StreamingSums::new(recording, of);
    stream(&problem, &recording.times, options, &mut adding).map_err(TrialFailure::Simulation)?;
    match adding.spoilt {
        None => Ok(adding.sums),
        Some((k, output, spoilt)) => Err(spoilt.failure(output_name(output), recording.times[k])),
    }
}

/// Adds samples during a simulation.
struct StreamingSums<'a> {
    /// Measured values of each output, empty if it was not measured.
    measured: Vec<&'a [f64]>,
    /// Samples before this one do not count.
    first: usize,
    counting: &'a [SampleWeighting<'a>],
    slopes: SampleSlopes<'a>,
    sums: Vec<OutputSums>,
    /// The first measured sample that cannot be compared, and its output.
    spoilt: Option<(usize, usize, SampleDefect)>,
}

impl<'a> StreamingSums<'a> {
    fn new(recording: &'a Recording, of: SumsOf<'a>) -> Self {
        let SumsOf { columns, counting } = of;
        Self {
            measured: recording
                .measured
                .iter()
                .map(|samples| samples.as_deref().unwrap_or_default())
                .collect(),
            first: recording.times.partition_point(|t| *t < recording.counts_from),
            counting,
            slopes: SampleSlopes::new(columns),
            sums: counting.iter().map(|of| OutputSums::zeros(columns.len(), *of)).collect(),
            spoilt: None,
        }
    }
}

impl SampleReceiver for StreamingSums<'_> {
    #[inline]
    fn wants(&mut self, k: usize) -> bool {
        let counts = |samples: &&[f64]| samples.get(k).is_some_and(|value| value.is_finite());
        k >= self.first && self.measured.iter().any(counts)
    }

    #[inline]
    fn take(&mut self, k: usize, w: &[f64], dw: &[f64]) {
        for (output, (sums, samples)) in self.sums.iter_mut().zip(&self.measured).enumerate() {
            let Some(measured) = samples.get(k).filter(|value| value.is_finite()) else { continue };
            let sample = SimulatedSample { k, output, measured: *measured, w, dw };
            if let Some(spoilt) = sample.add(sums, self.counting[output], &mut self.slopes) {
                self.spoilt.get_or_insert((k, output, spoilt));
            }
        }
    }
}
