//! The estimators of `dgd fit`, one row each.

use clap::{Args, ValueEnum};

/// How parameters are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Estimator {
    /// Simulates each recording from its start; start values are estimated, too
    OutputError,
    /// The innovations of an extended Kalman filter; states may stray, and how far is estimated
    PredictionError,
    /// Linear least squares on equations and outputs, without bounds
    LeastSquares,
    /// Linear least squares on equations and outputs, within the parameters' bounds
    Bounded,
    /// Linear parameters by least squares, the others by variable projection around them
    Separable,
    /// Linear parameters by least squares, the others by Nelder's and Mead's simplex around them
    NelderMead,
    /// Linear least squares that goes along with the samples and may forget
    Recursive,
}

/// Options of the estimators that do not simulate.
#[derive(Debug, Clone, Args)]
pub(crate) struct RegressionArgs {
    /// How parameters are estimated
    #[arg(long, value_enum, value_name = "NAME", default_value_t = Estimator::OutputError)]
    pub estimator: Estimator,
    /// Regressions: half of the width of the windows in which slopes of readings are taken, s [default: 5
    /// samples]
    #[arg(long, value_name = "SECONDS")]
    pub smoothing: Option<f64>,
    /// Regressions: only samples at which a state moves no faster, in its unit per second, as in `q=5`;
    /// repeatable
    #[arg(long, value_name = "STATE=RATE")]
    pub steady: Vec<String>,
    /// Recursive: time constants of the filter 1/Λ(s), s: `5` is Λ = 5s + 1, `5,5` is (5s + 1)²
    #[arg(long, value_name = "SECONDS", value_delimiter = ',', default_value = "5")]
    pub filter: Vec<f64>,
    /// Recursive: forgetting rate β, 1/s
    #[arg(long, value_name = "RATE", default_value_t = 0.0)]
    pub forgetting: f64,
    /// Recursive: P₀, the variance that each parameter starts with, in squares of its size
    #[arg(long, value_name = "P0", default_value_t = 10.0)]
    pub start_variance: f64,
    /// Recursive: R₀, above which P does not grow, in squares of the parameters' sizes [default: none]
    #[arg(long, value_name = "R0")]
    pub most_variance: Option<f64>,
    /// Recursive: n_s in the normalisation m² = 1 + n_s²
    #[arg(long, value_enum, value_name = "NAME", default_value_t = Normalise::None)]
    pub normalise: Normalise,
}

/// What n_s² is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Normalise {
    /// Zero: m is 1
    None,
    /// φᵀφ
    Regressors,
    /// φᵀPφ
    Covariance,
}
