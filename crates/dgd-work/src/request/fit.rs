//! Estimation of parameters and initial values from recordings.

use std::path::PathBuf;

use dgd_identify::{DrawnFrom, Loss};

use super::{FreeParameters, JournalChoice, LinearizeAt, ModelChoices, SolverOptions};

/// A fit.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct FitRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    pub choices: ModelChoices,
    /// Training recordings.
    pub data: Vec<PathBuf>,
    /// Recordings for validation, not used in the fit.
    pub valid: Vec<PathBuf>,
    /// Parameters and initial values to estimate.
    pub sought: FreeParameters,
    /// Outputs to fit; all measured ones by default.
    pub outputs: Vec<String>,
    /// Source of the weights of the outputs.
    pub noise: NoiseFrom,
    /// Location of the journal.
    pub keep: JournalChoice,
    /// Most simulations in a search, or evaluations for estimators that do not simulate. By default 200, 2000 for
    /// regressions, and 5000 for models without states.
    pub evaluations: Option<usize>,
    /// Search of a simulating estimator.
    pub search: SearchRequest,
    /// Intervals of estimates.
    pub intervals: IntervalRequest,
    /// The estimator and its options.
    pub regression: RegressionRequest,
    /// Simulation settings.
    pub solve: SolverOptions,
    /// Whether to make figures, which takes more computation.
    pub figures: bool,
    /// The command line or program line that reproduces the result, for the page.
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
            noise: NoiseFrom::Estimated,
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

/// Source of the weights of the outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseFrom {
    /// The noise declared in the model; for outputs that declare none, the residuals of the fit.
    Declared,
    /// The residuals of each output, refitted until the weights no longer change.
    Estimated,
}

/// Search of a simulating estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct SearchRequest {
    /// Loss function; all except squares are robust to outliers.
    pub loss: Loss,
    /// Number of starting points, the model's own and others drawn at random; the best fit is kept.
    pub starts: u32,
    /// Runs the fit from one of these points only, by its number from 0: a share of the work with identical numbers.
    pub start_point: Option<u32>,
    /// Distribution of the random starting points.
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
#[non_exhaustive]
pub struct IntervalRequest {
    /// Estimates whose confidence intervals are computed by profile likelihood: parameters, initial values as `x(0)`,
    /// or `all` for all parameters.
    pub profile: Vec<String>,
    /// Number of refits to data sets with resampled residuals.
    pub bootstrap: usize,
    /// The number of the first of them, for a share of a larger bootstrap; the result then lists the estimates of each.
    pub bootstrap_from: Option<usize>,
    /// Whether to report which samples and outputs determine each parameter.
    pub information: bool,
}

/// How parameters are estimated.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Output error: each recording is simulated from its start; initial values are estimated too.
    #[default]
    OutputError,
    /// Output error of the model linearised at an operating point.
    Linearised,
    /// Prediction error of an extended Kalman filter; the process noise is estimated too.
    PredictionError,
    /// Linear least squares on equations and outputs, without bounds.
    LeastSquares,
    /// Linear least squares on equations and outputs, within the parameters' bounds.
    Bounded,
    /// Linear parameters by least squares, the others by variable projection around them.
    Separable,
    /// Linear parameters by least squares, the others by a Nelder–Mead simplex around them.
    NelderMead,
    /// Recursive linear least squares, sample by sample, with optional forgetting.
    Recursive,
}

impl Estimator {
    /// Whether it compares simulated outputs with measured ones, sample by sample.
    pub fn simulates(self) -> bool {
        matches!(self, Self::OutputError | Self::Linearised)
    }

    /// Whether it estimates initial values of states.
    pub fn estimates_starts(self) -> bool {
        self.simulates() || matches!(self, Self::PredictionError)
    }

    /// Whether profile likelihoods can be computed.
    pub fn has_profiles(self) -> bool {
        !matches!(self, Self::Recursive)
    }

    /// Its name on the command line and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::OutputError => "output-error",
            Self::Linearised => "linearised",
            Self::PredictionError => "prediction-error",
            Self::LeastSquares => "least-squares",
            Self::Bounded => "bounded",
            Self::Separable => "separable",
            Self::NelderMead => "nelder-mead",
            Self::Recursive => "recursive",
        }
    }
}

/// The estimator and its options.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RegressionRequest {
    /// The estimator.
    pub estimator: Estimator,
    /// Linearised: operating point of each recording; by default the steady state with its mean inputs.
    pub at: Option<LinearizeAt>,
    /// Regressions: half the width of the windows over which slopes of the measurements are taken, s; 5 samples by
    /// default.
    pub smoothing: Option<f64>,
    /// Regressions: use only samples at which a state changes no faster, each as `STATE=RATE`.
    pub steady: Vec<String>,
    /// Recursive: time constants of the filter 1/Λ(s), s.
    pub filter: Vec<f64>,
    /// Recursive: forgetting rate β, 1/s.
    pub forgetting: f64,
    /// Recursive: P₀, the initial variance of each parameter, relative to its size squared.
    pub start_variance: f64,
    /// Recursive: R₀, the upper limit of the variances in P, relative to the parameters' sizes squared.
    pub most_variance: Option<f64>,
    /// Recursive: n_s² in the normalisation m² = 1 + n_s².
    pub normalise: Normalise,
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
            normalise: Normalise::None,
        }
    }
}

/// The definition of n_s².
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Normalise {
    /// Zero: m is 1.
    None,
    /// φᵀφ.
    Regressors,
    /// φᵀPφ.
    Covariance,
}
