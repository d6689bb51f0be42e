//! The result of a fit.

use serde::{Deserialize, Serialize};

use super::ByName;
use crate::output::provenance::Provenance;

/// `dgd fit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "fit"))]
#[non_exhaustive]
pub struct FitDocument {
    /// Name of the model.
    pub model: String,
    /// The estimator, if it is not `output-error`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimator: Option<String>,
    /// The choice of each variant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variants: Option<ByName<Option<String>>>,
    /// Estimated parameters.
    pub parameters: ByName<EstimateEntry>,
    /// Parameters that were not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed: Option<ByName<ValueEntry>>,
    /// Errors of each output.
    pub outputs: ByName<OutputEntry>,
    /// Estimated initial values of each recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub starts: Option<Vec<RecordingValues<EstimateEntry>>>,
    /// Initial values of the validation recordings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub starts_valid: Option<Vec<RecordingValues<ValueEntry>>>,
    /// The time from which readings of each validation recording count, s; null if all count, or without validation.
    pub counts_from: Option<Vec<Option<f64>>>,
    /// The equations and outputs of a regression.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<Vec<RegressionRowEntry>>,
    /// Standard deviation by which each state strays within a minute.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process_noise_in_a_minute: Option<ByName<EstimateEntry>>,
    /// Names of the rows and columns of the matrices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub names: Option<Vec<String>>,
    /// Covariance of the estimated parameters in their units; null for undetermined entries.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Vec<Vec<Option<f64>>>>,
    /// Correlation of the estimated parameters; null for undetermined entries.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<Vec<Vec<Option<f64>>>>,
    /// Combinations of estimates that can change together without changing any output.
    pub undetermined: Vec<Vec<UndeterminedTerm>>,
    /// The details of a regression.
    #[serde(flatten)]
    pub regression: Option<RegressionDetails>,
    /// Outputs with too few samples to estimate their noise.
    pub few_samples: ByName<FewSamplesEntry>,
    /// Reasons to doubt that the recordings can determine the estimates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reservations: Option<Vec<String>>,
    /// Number of samples.
    pub samples: usize,
    /// The details of a fit by simulation.
    #[serde(flatten)]
    pub simulation: Option<SimulationDetails>,
    /// The cost at the minimum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cost: Option<f64>,
    /// −2 ln of the likelihood.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deviance: Option<f64>,
    /// Steps of the search.
    pub iterations: usize,
    /// Simulations, or evaluations of all rows.
    pub evaluations: usize,
    /// Why the search ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub termination: Option<String>,
    /// Whether the search converged.
    pub converged: bool,
    /// The outcome of the fit.
    pub status: FitStatus,
    /// Parts of the fit that are missing.
    pub left_out: Vec<String>,
    /// 95 % confidence intervals by profile likelihood.
    pub profiles: ByName<ProfileEntry>,
    /// Confidence intervals by resampling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bootstrap: Option<BootstrapResult>,
    /// The fits from several starting points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub multi_start: Option<MultiStartResult>,
    /// The operating points of a fit to linear models.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linearised: Option<LinearisedResult>,
    /// The samples that determine each estimate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub information: Option<ByName<InformationEntry>>,
    /// The steady operating points of the recordings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operating_points: Option<Vec<OperatingPointEntry>>,
    /// Inputs, seed and versions.
    pub provenance: Provenance,
}

impl FitDocument {
    /// Correlation of two estimated parameters by their positions in `names`.
    pub fn correlation_of(&self, i: usize, j: usize) -> Option<f64> {
        *self.correlation.as_ref()?.get(i)?.get(j)?
    }
}

/// The outcome of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum FitStatus {
    /// All of it is there.
    #[serde(rename = "done")]
    Done,
    /// It was cancelled.
    #[serde(rename = "stopped")]
    Stopped,
    /// The search ended without a minimum.
    #[serde(rename = "not converged")]
    NotConverged,
}

impl FitStatus {
    /// As in JSON.
    pub(crate) fn name(self) -> &'static str {
        match self {
            FitStatus::Done => "done",
            FitStatus::Stopped => "stopped",
            FitStatus::NotConverged => "not converged",
        }
    }
}

/// A value in its declared unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ValueEntry {
    /// In the unit; null if it is not finite.
    pub value: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
}

impl ValueEntry {
    pub(crate) fn new(si: f64, unit: &dgd_runtime::Unit) -> Self {
        Self { value: Some(unit.from_si(si)), unit: unit.symbol.to_string() }
    }
}

/// An estimate in its declared unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct EstimateEntry {
    /// In the unit; null if it is not finite.
    pub value: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
    /// Standard deviation; null if it is not determined.
    #[serde(default)]
    pub std: Option<f64>,
    /// The bound that the estimate reached.
    #[serde(default)]
    pub at_bound: Option<BoundEntry>,
    /// How far model error may have moved the estimate: the spread of estimates over parts of the recordings, and how far
    /// it moves without an output; null if the residuals are white noise, and if it is unknown.
    #[serde(default)]
    pub std_model: Option<f64>,
    /// The details of a regression.
    #[serde(flatten)]
    pub regression: Option<RegressionEstimate>,
}

/// A bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum BoundEntry {
    /// The lower bound.
    Lower,
    /// The upper bound.
    Upper,
}

impl BoundEntry {
    /// In sentences.
    pub fn name(self) -> &'static str {
        match self {
            BoundEntry::Lower => "lower",
            BoundEntry::Upper => "upper",
        }
    }
}

impl From<dgd_identify::BoundReached> for BoundEntry {
    fn from(bound: dgd_identify::BoundReached) -> Self {
        match bound {
            dgd_identify::BoundReached::Lower => BoundEntry::Lower,
            dgd_identify::BoundReached::Upper => BoundEntry::Upper,
        }
    }
}

/// Details of an estimate by regression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RegressionEstimate {
    /// Whether all rows are linear in it.
    pub linear: bool,
    /// The estimate without bounds; null if it is nonlinear.
    pub unbounded: Option<f64>,
}

/// Errors of an output in its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct OutputEntry {
    /// Symbol of the unit.
    pub unit: String,
    /// Whether the fit used it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fitted: Option<bool>,
    /// Standard deviation of its noise; with its own uncertainty if the likelihood of innovations determines it.
    #[serde(default)]
    pub noise: Option<NoiseEntry>,
    /// Size of its residuals relative to the declared noise.
    #[serde(default)]
    pub over_declared_noise: Option<ExcessEntry>,
    /// Samples that weigh less than half.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light_samples: Option<usize>,
    /// Root-mean-square error in training.
    pub rms_train: Option<f64>,
    /// Root-mean-square error in validation.
    pub rms_valid: Option<f64>,
    /// Agreement and tests of the residuals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<QualityPair>,
}

/// The noise of an output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum NoiseEntry {
    /// Its standard deviation.
    Std(f64),
    /// An estimate of its standard deviation.
    Estimate(Box<EstimateEntry>),
}

/// Size of the residuals of an output relative to its declared noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ExcessEntry {
    /// Ratio of their sizes.
    pub times: f64,
    /// Probability of such residuals under the declared noise.
    pub p_value: f64,
}

/// Quality of an output in training and in validation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct QualityPair {
    /// On the training recordings; null if it was not measured.
    pub train: Option<QualityEntry>,
    /// On the validation recordings.
    pub valid: Option<QualityEntry>,
}

/// Agreement of an output with measurements, and tests of its residuals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct QualityEntry {
    /// Number of samples.
    pub samples: usize,
    /// Share of the variance that the model explains.
    pub r_squared: Option<f64>,
    /// 100 (1 − root of the unexplained share): 0 % is as good as the mean.
    pub fit_percent: Option<f64>,
    /// Mean squared error.
    pub mse: Option<f64>,
    /// Unit of the mean squared error.
    pub mse_unit: String,
    /// Mean error.
    pub bias: Option<f64>,
    /// Autocorrelation of the residuals.
    pub whiteness: Option<WhitenessEntry>,
    /// Correlation of the residuals with each input.
    pub inputs: ByName<InputTestEntry>,
}

/// A portmanteau test of the residuals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct WhitenessEntry {
    /// Number of lags.
    pub lags: usize,
    /// The test statistic.
    pub statistic: Option<f64>,
    /// Probability of such a statistic for white noise.
    pub p_value: Option<f64>,
    /// By lag.
    pub autocorrelation: Vec<Option<f64>>,
    /// Autocorrelations of white noise stay below it.
    pub limit: Option<f64>,
}

/// Correlation of the residuals of an output with an input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct InputTestEntry {
    /// Lag of the largest correlation, s.
    pub lag: Option<f64>,
    /// The largest correlation.
    pub largest: Option<f64>,
    /// Correlations of unrelated signals stay below it.
    pub limit: Option<f64>,
    /// Probability of such a correlation for unrelated signals.
    pub p_value: Option<f64>,
    /// By lag.
    pub correlation: Vec<Option<f64>>,
}

/// Values that belong to a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RecordingValues<T> {
    /// The file of the recording.
    pub data: String,
    /// By name.
    pub values: ByName<T>,
}

/// An equation or output of a regression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RegressionRowEntry {
    /// Name of the equation or output.
    pub name: String,
    /// `output` or `equation`.
    pub of: String,
    /// Unit of its residuals.
    pub unit: String,
    /// Number of samples.
    pub samples: usize,
    /// Mean squared error.
    pub mse: Option<f64>,
    /// Share of the variance that is explained.
    pub r_squared: Option<f64>,
    /// The parameter that the equation was multiplied by, which makes it linear.
    pub multiplied_by: Option<String>,
}

/// A term of a combination of estimates that no output depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum UndeterminedTerm {
    /// An estimate and its relative change, %.
    Change {
        /// Name of the estimate.
        name: String,
        /// Relative change, %.
        relative_change: Option<f64>,
    },
    /// An estimate, or a level of noise.
    Name(String),
}

impl UndeterminedTerm {
    /// The name of the estimate.
    pub fn name(&self) -> &str {
        match self {
            UndeterminedTerm::Change { name, .. } | UndeterminedTerm::Name(name) => name,
        }
    }
}

/// Details that only a regression has.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RegressionDetails {
    /// Rank of the regression.
    pub rank: usize,
    /// Condition number; null if it is infinite.
    pub condition_number: Option<f64>,
    /// Samples that were left out.
    pub samples_left_out: SamplesLeftOut,
    /// The recursive estimates.
    pub recursive: Option<RecursiveResult>,
}

/// Samples that a regression leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct SamplesLeftOut {
    /// Samples with delayed values from before the record.
    pub before_record: usize,
    /// Samples whose mode is unknown, since the model cannot be simulated up to them.
    pub without_mode: usize,
}

/// The end of recursive estimation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RecursiveResult {
    /// Number of samples.
    pub samples: usize,
    /// Time without excitation, during which the estimates were frozen, s.
    pub frozen_seconds: f64,
    /// The last covariance.
    pub p: Vec<Vec<Option<f64>>>,
}

/// An output with too few samples to estimate its noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct FewSamplesEntry {
    /// Number of samples.
    pub samples: usize,
    /// The declared standard deviation, which the fit used.
    pub declared_noise: Option<f64>,
    /// Symbol of its unit.
    pub unit: Option<String>,
}

/// Details that only a fit by simulation has.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct SimulationDetails {
    /// Model error in the residuals; null if they are white noise of the declared size.
    pub left_over: Option<ModelErrorEntry>,
    /// Samples without defined sensitivities.
    pub samples_without_sensitivity: usize,
    /// Samples minus estimates.
    pub degrees_of_freedom: usize,
    /// Name of the loss.
    pub loss: String,
    /// Σ (e/σ)² over the degrees of freedom; null without any.
    pub reduced_chi_square: Option<f64>,
    /// Akaike's criterion: the deviance plus 2 for each estimate that is not at a bound, estimated noise included; null
    /// under a loss other than squares, and with priors.
    pub aic: Option<f64>,
    /// Akaike's criterion for few samples.
    pub aicc: Option<f64>,
    /// Schwarz's criterion.
    pub bic: Option<f64>,
    /// Trials that could not be simulated.
    pub failures: usize,
    /// Relative tolerance of the last simulations: tighter than that of the request if the search stalled with it.
    pub rtol: f64,
    /// The steps of the integrator.
    pub steps: SteppingEntry,
}

/// The steps of the integrator in a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum SteppingEntry {
    /// `adaptive` or `exact`.
    Name(String),
    /// A fixed number of steps for each sample.
    PerSample {
        /// Their number.
        per_sample: usize,
        /// Name of the method.
        method: String,
    },
}

/// Model error in the residuals of a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ModelErrorEntry {
    /// Outputs whose residuals are autocorrelated.
    pub autocorrelated: Vec<String>,
    /// Whether residuals exceed the declared noise by more than chance explains.
    pub exceeds_declared_noise: bool,
    /// The parts behind `std_model`; empty if recordings cannot be divided, and without convergence.
    pub parts: Vec<RecordingPartEntry>,
    /// Parameters that a single part determines, and that part, from 0: they have no `std_model`.
    pub rests_on_part: ByName<usize>,
}

/// A part of the recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RecordingPartEntry {
    /// The recording, or the first and the last of several.
    pub recordings: Vec<String>,
    /// Its first time, s.
    pub from: Option<f64>,
    /// Its last time, s.
    pub until: Option<f64>,
}

/// A profile of the likelihood over an estimate, in its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ProfileEntry {
    /// Symbol of the unit.
    pub unit: String,
    /// The 95 % confidence interval; null for an open end.
    pub interval: [Option<f64>; 2],
    /// The lower end.
    pub lower: ProfileEndEntry,
    /// The upper end.
    pub upper: ProfileEndEntry,
    /// Estimates that change along with the lower end.
    pub with_lower: Vec<UndeterminedTerm>,
    /// Estimates that change along with the upper end.
    pub with_upper: Vec<UndeterminedTerm>,
    /// Values of the estimate.
    pub values: Vec<Option<f64>>,
    /// Rise of the deviance at each of them.
    pub deviance: Vec<Option<f64>>,
    /// Rise of the deviance at the ends of the interval.
    pub threshold: f64,
    /// Simulations.
    pub evaluations: usize,
}

/// An end of a profile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ProfileEndEntry {
    /// In the unit of the estimate.
    pub value: Option<f64>,
    /// The kind of end.
    pub end: ProfileEndKind,
}

/// The kind of an end of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum ProfileEndKind {
    /// The end of the confidence interval.
    Interval,
    /// A bound of the parameter.
    Bound,
    /// The deviance stays below the threshold.
    Open,
    /// The model cannot be simulated beyond.
    Unsimulated,
}

/// Confidence intervals by resampling.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct BootstrapResult {
    /// Number of the first data set.
    pub first: usize,
    /// Fitted data sets.
    pub replicates: usize,
    /// Data sets without a minimum.
    pub failures: usize,
    /// Mean block length of each recording, in rows.
    pub block_lengths: Vec<Option<f64>>,
    /// By estimate.
    pub estimates: ByName<BootstrapEntry>,
}

/// A confidence interval by resampling, in the unit of the estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct BootstrapEntry {
    /// Symbol of the unit.
    pub unit: String,
    /// Standard deviation.
    pub std: Option<f64>,
    /// 95 % confidence interval.
    pub interval: Option<[Option<f64>; 2]>,
    /// All values, if the data sets are a share of a larger bootstrap.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub values: Option<Vec<Option<f64>>>,
}

/// The fits from several starting points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct MultiStartResult {
    /// Number of points, that of the model included.
    pub points: usize,
    /// The distribution of the other points.
    pub spread: StartSpread,
    /// The outcome of each point.
    pub ends: Vec<StartEntry>,
    /// A minimum that is reached from more than this part of the volume would have been found with 95 % confidence; null
    /// if that is all of it.
    pub found_volume: Option<f64>,
    /// Points that could not be simulated and were drawn again.
    pub failed_draws: usize,
    /// The point that led to the result.
    pub best: usize,
    /// The best first.
    pub minima: Vec<MinimumEntry>,
    /// Points that could not be fitted.
    pub failed: usize,
    /// Points whose fits did not converge.
    pub without_minimum: usize,
    /// Points whose fits were cancelled or not begun.
    pub left_out: usize,
}

/// The distribution of starting points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum StartSpread {
    /// Around the values of the model.
    Values,
    /// Between the bounds.
    Bounds,
}

/// The outcome of a fit from one starting point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct StartEntry {
    /// The `termination` of its fit, `failed` or `left out`.
    pub end: String,
    /// Its deviance minus that of the result.
    pub deviance_above: Option<f64>,
    /// The position in `minima` of the minimum that it reached.
    pub minimum: Option<usize>,
}

/// A minimum of a fit from several starting points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct MinimumEntry {
    /// The points that led to it.
    pub points: Vec<usize>,
    /// Its deviance minus that of the result.
    pub deviance_above: Option<f64>,
    /// The estimates there.
    pub estimates: ByName<ValueEntry>,
}

/// The operating points of a fit to linear models, and the nonlinear model with its estimates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LinearisedResult {
    /// The choice of the operating point: `steady`, `mean`, or a time, s.
    pub at: LinearisedAt,
    /// The operating point of each recording; null for a recording without one.
    pub points: Vec<Option<LinearisedPoint>>,
    /// The nonlinear model with the same estimates.
    pub model: NonlinearCheck,
}

/// The choice of an operating point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum LinearisedAt {
    /// A time, s.
    Time(f64),
    /// A steady state.
    Name(String),
}

/// The operating point of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LinearisedPoint {
    /// The file of the recording.
    pub data: String,
    /// Its time, s.
    pub t: f64,
    /// Values of the inputs.
    pub inputs: ByName<ValueEntry>,
    /// Values of the unknowns.
    pub unknowns: ByName<ValueEntry>,
    /// The mode of each automaton.
    pub modes: ByName<String>,
}

/// The nonlinear model with the estimates of linear models.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum NonlinearCheck {
    /// Its errors.
    Simulated {
        /// By output.
        outputs: ByName<NonlinearOutput>,
    },
    /// It could not be simulated.
    NotSimulated {
        /// The reason.
        not_simulated: String,
    },
}

/// Errors of an output of the nonlinear model in its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct NonlinearOutput {
    /// Symbol of the unit.
    pub unit: String,
    /// Root-mean-square error.
    pub rms: Option<f64>,
    /// Root-mean-square difference from the linear model.
    pub difference: Option<f64>,
    /// Agreement and tests of the residuals.
    pub quality: Option<QualityEntry>,
}

/// The samples that determine an estimate, as shares of the information on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct InformationEntry {
    /// By output.
    pub outputs: ByName<Option<f64>>,
    /// By recording.
    pub recordings: Vec<RecordingShare>,
    /// Share of samples in steady operation.
    pub steady: Option<f64>,
    /// Share of samples in transients.
    pub transient: Option<f64>,
    /// Share of samples at each operating point.
    pub operating_points: Vec<Option<f64>>,
    /// The standard deviation with twice the samples, relative to the present one.
    pub std_with_as_much_again: StdWithMore,
    /// The sample with most information.
    pub best: Option<BestSample>,
}

/// The share of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct RecordingShare {
    /// The file of the recording.
    pub data: String,
    /// Its share.
    pub part: Option<f64>,
}

/// Standard deviations with twice the samples of a kind, relative to the present one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct StdWithMore {
    /// If all recordings are repeated.
    pub all: Option<f64>,
    /// If the transients are repeated; null without any.
    pub transient: Option<f64>,
    /// If the samples at an operating point are repeated, by operating point.
    pub operating_points: Vec<Option<f64>>,
}

/// The sample with most information on an estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct BestSample {
    /// The file of its recording.
    pub data: String,
    /// Its output.
    pub output: String,
    /// Its time, s.
    pub time: f64,
}

/// A steady operating point of the recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct OperatingPointEntry {
    /// Share of the samples.
    pub share: Option<f64>,
    /// Values of the inputs.
    pub inputs: ByName<ValueEntry>,
    /// Values of the outputs.
    pub outputs: ByName<ValueEntry>,
}

#[cfg(test)]
pub(crate) mod tests {
    use serde_json::{Value, json};

    use super::*;

    /// A result of a model without anything, with these keys.
    pub(crate) fn with(keys: &Value) -> FitDocument {
        let mut all = json!({
            "model": "m", "parameters": {}, "outputs": {}, "counts_from": null, "undetermined": [], "few_samples": {},
            "samples": 9, "iterations": 3, "evaluations": 4, "converged": true, "status": "done", "left_out": [],
            "profiles": {},
            "provenance": { "schema": 0, "version": "", "seed": 0, "model": null, "data": [] },
        });
        for (key, value) in keys.as_object().into_iter().flatten() {
            all[key] = value.clone();
        }
        serde_json::from_value(all).expect("a result")
    }
}
