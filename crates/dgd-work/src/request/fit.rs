//! Estimation of parameters and initial values from recordings.

use std::path::PathBuf;

use dgd_identify::regression::{Normalisation, RegressionMethod};
use dgd_identify::{DrawnFrom, Loss};
use dgd_runtime::signature::choices;

use super::{FreeParameters, JournalChoice, LinearizeAt, ModelChoices, SolverOptions};
#[cfg(feature = "clap")]
use super::{chosen, values};

/// A fit.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct FitRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub choices: ModelChoices,
    /// A recording to fit to; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE", required = true))]
    pub data: Vec<PathBuf>,
    /// A recording for validation, not used in fits; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub valid: Vec<PathBuf>,
    /// Parameters and initial values to estimate.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub sought: FreeParameters,
    /// Location of the journal.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub keep: JournalChoice,
    /// Outputs to fit; all measured ones by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES", value_delimiter = ','))]
    pub outputs: Vec<String>,
    /// Source of the weights of the outputs.
    #[cfg_attr(feature = "clap", arg(long, value_parser = chosen::parser::<NoiseFrom>(), default_value_t = NoiseFrom::default()))]
    pub noise: NoiseFrom,
    /// Maximum number of simulations in a search, or of evaluations without simulations; by default 200, 2000 for
    /// regressions, and 5000 for models without states.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true))]
    pub evaluations: Option<usize>,
    /// Search of a simulating estimator.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub search: SearchRequest,
    /// Intervals of estimates.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub intervals: IntervalRequest,
    /// The estimator and its options.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub regression: RegressionRequest,
    /// Simulation settings.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub solve: SolverOptions,
    /// Whether to make figures, which takes more computation.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub figures: bool,
    /// The command line or program line that reproduces the result, for the page.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub command: String,
}

impl FitRequest {
    /// Fits these recordings.
    pub fn new(model: impl Into<PathBuf>, data: Vec<PathBuf>) -> Self {
        FitRequest {
            model: model.into(),
            choices: ModelChoices::default(),
            data,
            valid: Vec::new(),
            sought: FreeParameters::default(),
            outputs: Vec::new(),
            noise: NoiseFrom::default(),
            keep: JournalChoice::default(),
            evaluations: None,
            search: SearchRequest::default(),
            intervals: IntervalRequest::default(),
            regression: RegressionRequest::default(),
            solve: SolverOptions::default(),
            figures: false,
            command: String::new(),
        }
    }
}

choices! {
    /// Source of the weights of the outputs.
    pub enum NoiseFrom {
        /// The residuals of each output, refitted until the weights no longer change.
        Estimated = "estimated",
        /// The noise declared in the model; for outputs that declare none, the residuals of the fit.
        Declared = "declared",
    }
}

/// Search of a simulating estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct SearchRequest {
    /// Loss function; all but `squares` are robust to outliers.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME", value_parser = chosen::parser::<Loss>(), default_value_t = SearchRequest::default().loss))]
    pub loss: Loss,
    /// Run N fits from different starting points, the model's own and others drawn with the seed, and keep the best.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = SearchRequest::default().starts, value_parser = clap::value_parser!(u32).range(1..=100_000), allow_negative_numbers = true))]
    pub starts: u32,
    /// Run only the fit from point K of all starting points, counted from 0, to share the work between machines.
    #[cfg_attr(feature = "clap", arg(long, value_name = "K", value_parser = values::whole::<u32>, allow_negative_numbers = true))]
    pub start_point: Option<u32>,
    /// Distribution of the starting points.
    #[cfg_attr(feature = "clap", arg(long, value_parser = chosen::parser::<DrawnFrom>(), default_value_t = SearchRequest::default().spread))]
    pub spread: DrawnFrom,
}

impl Default for SearchRequest {
    fn default() -> Self {
        SearchRequest {
            loss: Loss::Squares,
            starts: 1,
            spread: DrawnFrom::Values,
            start_point: None,
        }
    }
}

/// Intervals of estimates.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct IntervalRequest {
    /// Compute confidence intervals of these estimates by profile likelihood: parameters, initial values as `x(0)`, or
    /// `all` for all parameters.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES", value_delimiter = ','))]
    pub profile: Vec<String>,
    /// Refit to N data sets with resampled residuals, for intervals that account for autocorrelated noise.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = IntervalRequest::default().bootstrap, value_parser = values::count_or_none, allow_negative_numbers = true))]
    pub bootstrap: usize,
    /// First of these data sets, counted from 0, to share the work between machines; the result lists all estimates.
    #[cfg_attr(feature = "clap", arg(long, value_name = "K", value_parser = values::count_or_none, allow_negative_numbers = true))]
    pub bootstrap_from: Option<usize>,
    /// Report which samples and outputs determine each parameter.
    #[cfg_attr(feature = "clap", arg(long))]
    pub information: bool,
}

choices! {
    /// How parameters are estimated.
    pub enum Estimator {
        /// Output error: simulate each recording from its start; initial values are estimated too.
        OutputError = "output-error",
        /// Output error of the model linearised at an operating point, `at`.
        Linearised = "linearised" | "linearized",
        /// Prediction error of an extended Kalman filter; the process noise is estimated too.
        PredictionError = "prediction-error",
        /// Linear least squares on equations and outputs, without bounds.
        LeastSquares = "least-squares",
        /// Linear least squares on equations and outputs, within the parameters' bounds.
        Bounded = "bounded",
        /// Linear parameters by least squares, the others by variable projection around them.
        Separable = "separable",
        /// Linear parameters by least squares, the others by a Nelder–Mead simplex around them.
        NelderMead = "nelder-mead",
        /// Recursive linear least squares, sample by sample, with optional forgetting.
        Recursive = "recursive",
    }
}

/// How an estimator works. Everything else about an estimator follows from this.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EstimationApproach {
    /// Simulates the model, and compares its outputs with the measured ones.
    Simulation,
    /// Simulates the model linearised at an operating point.
    LinearSimulation,
    /// Predicts each sample from the one before, by a filter.
    Filter,
    /// Solves the equations for the parameters at the samples, without simulation.
    Regression(RegressionMethod),
    /// Does so sample by sample.
    RecursiveRegression,
}

impl Estimator {
    /// How it works.
    pub(crate) fn approach(self) -> EstimationApproach {
        match self {
            Self::OutputError => EstimationApproach::Simulation,
            Self::Linearised => EstimationApproach::LinearSimulation,
            Self::PredictionError => EstimationApproach::Filter,
            Self::LeastSquares => EstimationApproach::Regression(RegressionMethod::LeastSquares),
            Self::Bounded => EstimationApproach::Regression(RegressionMethod::Bounded),
            Self::Separable => EstimationApproach::Regression(RegressionMethod::VariableProjection),
            Self::NelderMead => EstimationApproach::Regression(RegressionMethod::NelderMead),
            Self::Recursive => EstimationApproach::RecursiveRegression,
        }
    }

    /// Whether it compares simulated outputs with measured ones, sample by sample.
    pub fn simulates(self) -> bool {
        match self.approach() {
            EstimationApproach::Simulation | EstimationApproach::LinearSimulation => true,
            EstimationApproach::Filter
            | EstimationApproach::Regression(_)
            | EstimationApproach::RecursiveRegression => false,
        }
    }

    /// Whether it simulates the model itself. Only then can a fit resume from a journal, readings have densities of
    /// their own, and residuals be evaluated one by one.
    pub(crate) fn simulates_model(self) -> bool {
        match self.approach() {
            EstimationApproach::Simulation => true,
            EstimationApproach::LinearSimulation
            | EstimationApproach::Filter
            | EstimationApproach::Regression(_)
            | EstimationApproach::RecursiveRegression => false,
        }
    }

    /// Whether it is a filter, which also estimates noise.
    pub(crate) fn is_filter(self) -> bool {
        match self.approach() {
            EstimationApproach::Filter => true,
            EstimationApproach::Simulation
            | EstimationApproach::LinearSimulation
            | EstimationApproach::Regression(_)
            | EstimationApproach::RecursiveRegression => false,
        }
    }

    /// Whether it estimates initial values of states.
    pub fn estimates_starts(self) -> bool {
        self.simulates() || self.is_filter()
    }

    /// Whether profile likelihoods can be computed.
    pub fn has_profiles(self) -> bool {
        match self.approach() {
            EstimationApproach::RecursiveRegression => false,
            EstimationApproach::Simulation
            | EstimationApproach::LinearSimulation
            | EstimationApproach::Filter
            | EstimationApproach::Regression(_) => true,
        }
    }

    /// Whether it searches, so that the number of evaluations can be limited.
    pub(crate) fn searches(self) -> bool {
        match self.approach() {
            EstimationApproach::Simulation
            | EstimationApproach::LinearSimulation
            | EstimationApproach::Filter => true,
            EstimationApproach::Regression(method) => method.searches(),
            EstimationApproach::RecursiveRegression => false,
        }
    }
}

/// The estimator and its options.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct RegressionRequest {
    /// Parameter estimator.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME", value_parser = chosen::parser::<Estimator>(), default_value_t = RegressionRequest::default().estimator))]
    pub estimator: Estimator,
    /// Linearised: operating point of each recording: a time in s since the data's first sample, `steady` (steady state
    /// with the inputs of the first time) or `mean` (steady state with the mean inputs); `mean` by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "T|steady|mean", allow_negative_numbers = true, value_parser = values::point))]
    pub at: Option<LinearizeAt>,
    /// Regressions: half the width of the windows over which slopes of the measurements are taken, in s or as in `2min`;
    /// 5 samples by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "T", value_parser = values::time, allow_hyphen_values = true))]
    pub smoothing: Option<f64>,
    /// Regressions: use only samples at which this state changes no faster, in its unit per second, as in `q=5`;
    /// repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "STATE=RATE"))]
    pub steady: Vec<String>,
    /// Recursive: time constants of the filter 1/Λ(s), s: `5` gives Λ = 5s + 1, `5,5` gives (5s + 1)².
    #[cfg_attr(feature = "clap", arg(long, value_name = "SECONDS", value_delimiter = ',', default_values_t = RegressionRequest::default().filter, value_parser = values::positive, allow_hyphen_values = true))]
    pub filter: Vec<f64>,
    /// Recursive: forgetting rate β, 1/s.
    #[cfg_attr(feature = "clap", arg(long, value_name = "RATE", default_value_t = RegressionRequest::default().forgetting, value_parser = values::not_negative, allow_hyphen_values = true))]
    pub forgetting: f64,
    /// Recursive: P₀, the initial variance of each parameter, relative to its size squared.
    #[cfg_attr(feature = "clap", arg(long, value_name = "P0", default_value_t = RegressionRequest::default().start_variance, value_parser = values::positive, allow_hyphen_values = true))]
    pub start_variance: f64,
    /// Recursive: R₀, the maximum variance in P, relative to the parameters' sizes squared; none by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "R0", value_parser = values::positive, allow_hyphen_values = true))]
    pub most_variance: Option<f64>,
    /// Recursive: n_s² in the normalisation m² = 1 + n_s².
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME", value_parser = chosen::parser::<Normalisation>(), default_value_t = RegressionRequest::default().normalise))]
    pub normalise: Normalisation,
}

impl Default for RegressionRequest {
    fn default() -> Self {
        RegressionRequest {
            estimator: Estimator::OutputError,
            at: None,
            smoothing: None,
            steady: Vec::new(),
            filter: vec![5.0],
            forgetting: 0.0,
            start_variance: 10.0,
            most_variance: None,
            normalise: Normalisation::None,
        }
    }
}
