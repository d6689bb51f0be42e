//! Parameters and start values from recordings.

use std::path::PathBuf;

use dgd_identify::{DrawnFrom, Loss};

use super::{Choices, Keep, LinearizeAt, Solve, Sought};
use crate::error::WorkError;

/// A fit.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct FitRequest {
    /// The model file.
    pub model: PathBuf,
    /// What is chosen of it.
    pub choices: Choices,
    /// Recordings to fit to.
    pub data: Vec<PathBuf>,
    /// Recordings for validation, not used in the fit.
    pub valid: Vec<PathBuf>,
    /// What is estimated.
    pub sought: Sought,
    /// Outputs to fit; all that were measured where there is none.
    pub outputs: Vec<String>,
    /// Where the weights of the outputs come from.
    pub noise: NoiseFrom,
    /// Where finished work is kept.
    pub keep: Keep,
    /// Most simulations in a search, or evaluations where nothing is simulated; 200, of regressions 2000, of models
    /// without states 5000 where there is none.
    pub evaluations: Option<usize>,
    /// How a fit of simulations searches.
    pub search: SearchRequest,
    /// Intervals of estimates.
    pub intervals: IntervalRequest,
    /// Which estimator, and options of single ones.
    pub regression: RegressionRequest,
    /// How the model is run.
    pub solve: Solve,
    /// Whether figures are made, which takes more computation.
    pub figures: bool,
    /// What makes the same again, for the page: a command line, or a line of a program.
    pub command: String,
}

impl FitRequest {
    /// To these recordings.
    pub fn new(model: impl Into<PathBuf>, data: Vec<PathBuf>) -> Self {
        FitRequest {
            model: model.into(),
            choices: Choices::default(),
            data,
            valid: Vec::new(),
            sought: Sought::default(),
            outputs: Vec::new(),
            noise: NoiseFrom::Estimated,
            keep: Keep::default(),
            evaluations: None,
            search: SearchRequest::default(),
            intervals: IntervalRequest::default(),
            regression: RegressionRequest::default(),
            solve: Solve::default(),
            figures: false,
            command: String::new(),
        }
    }
}

/// Where the weights of the outputs come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseFrom {
    /// The noise declared in the model; for outputs that declare none, the residuals of the fit.
    Declared,
    /// The residuals of each output, refitted until the weights no longer change.
    Estimated,
}

/// How a fit of simulations searches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct SearchRequest {
    /// Loss function; all but squares are robust to outliers.
    pub loss: Loss,
    /// Fits from so many starting points, the model's own and others that are drawn; the best is kept.
    pub starts: u32,
    /// Of these points the fit from one alone, by its number from 0: a share of the work, which has the same numbers.
    pub start_point: Option<u32>,
    /// What they are drawn from.
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
    /// Estimates whose confidence intervals are found by profile likelihood: parameters, initial values as `x(0)`, or
    /// `all` for all parameters.
    pub profile: Vec<String>,
    /// Refits to so many data sets with resampled residuals.
    pub bootstrap: usize,
    /// The number of the first of them, where they are a share of many: the result then lists the estimates of each.
    pub bootstrap_from: Option<usize>,
    /// Whether to say which samples and outputs determine each parameter.
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

    /// Whether start values of states are among the estimates.
    pub fn estimates_starts(self) -> bool {
        self.simulates() || matches!(self, Self::PredictionError)
    }

    /// Whether the likelihood can be followed along an estimate.
    pub fn has_profiles(self) -> bool {
        !matches!(self, Self::Recursive)
    }

    /// What it is called on the command line and in results.
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

/// Which estimator, and options of single ones.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RegressionRequest {
    /// How parameters are estimated.
    pub estimator: Estimator,
    /// Linearised: operating point of each recording; the steady state with its mean inputs where there is none.
    pub at: Option<LinearizeAt>,
    /// Regressions: half the width of the windows over which slopes of the measurements are taken, s; 5 samples where
    /// there is none.
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

impl RegressionRequest {
    /// Checks that there is a search for which `--evaluations` has a meaning.
    pub(crate) fn verify_evaluations(&self, most: Option<usize>) -> Result<(), WorkError> {
        let searches = !matches!(
            self.estimator,
            Estimator::LeastSquares | Estimator::Bounded | Estimator::Recursive
        );
        if most.is_none() || searches {
            return Ok(());
        }
        let name = self.estimator.name();
        Err(WorkError::Usage(format!(
            "`--evaluations` limits a search, and `--estimator {name}` has none"
        )))
    }

    /// Where linear models are, if the estimator makes them.
    ///
    /// # Errors
    ///
    /// Where `--at` is given to another estimator.
    pub(crate) fn place(&self) -> Result<Option<LinearizeAt>, WorkError> {
        match (self.estimator, self.at) {
            (Estimator::Linearised, at) => Ok(Some(at.unwrap_or(LinearizeAt::Mean))),
            (_, None) => Ok(None),
            (_, Some(_)) => {
                Err(WorkError::Usage("`--at` needs `--estimator linearised`".to_owned()))
            }
        }
    }
}

/// What n_s² is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Normalise {
    /// Zero: m is 1.
    None,
    /// φᵀφ.
    Regressors,
    /// φᵀPφ.
    Covariance,
}
