//! The estimators of `dgd fit`, one row each.

use clap::{Args, ValueEnum};

use crate::args::{Place, place};
use crate::failure::CommandError;
use crate::numbers::{not_negative, positive};

/// How parameters are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Estimator {
    /// Output error: simulate each recording from its start; initial values are estimated too
    OutputError,
    /// Output error of the model linearised at an operating point, `--at`
    #[value(alias = "linearized")]
    Linearised,
    /// Prediction error of an extended Kalman filter; the process noise is estimated too
    PredictionError,
    /// Linear least squares on equations and outputs, without bounds
    LeastSquares,
    /// Linear least squares on equations and outputs, within the parameters' bounds
    Bounded,
    /// Linear parameters by least squares, the others by variable projection around them
    Separable,
    /// Linear parameters by least squares, the others by a Nelder–Mead simplex around them
    NelderMead,
    /// Recursive linear least squares, sample by sample, with optional forgetting
    Recursive,
}

impl Estimator {
    /// Whether it compares simulated outputs with measured ones, sample by sample.
    pub(crate) fn simulates(self) -> bool {
        matches!(self, Self::OutputError | Self::Linearised)
    }

    /// Whether start values of states are among the estimates.
    pub(crate) fn estimates_starts(self) -> bool {
        self.simulates() || matches!(self, Self::PredictionError)
    }

    /// Whether the likelihood can be followed along an estimate.
    pub(crate) fn has_profiles(self) -> bool {
        !matches!(self, Self::Recursive)
    }
}

/// Which estimator, and options of single ones.
#[derive(Debug, Clone, Args)]
pub(crate) struct RegressionArgs {
    /// How parameters are estimated
    #[arg(long, value_enum, value_name = "NAME", default_value_t = Estimator::OutputError)]
    pub estimator: Estimator,
    /// Linearised: operating point of each recording: a time in s since the data's first sample, `steady`
    /// (steady state with the inputs of the first time) or `mean` (steady state with the mean inputs)
    /// [default: mean]
    #[arg(long, value_name = "T|steady|mean", allow_negative_numbers = true, value_parser = place)]
    pub at: Option<Place>,
    /// Regressions: half the width of the windows over which slopes of the measurements are taken, s
    /// [default: 5 samples]
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_hyphen_values = true)]
    pub smoothing: Option<f64>,
    /// Regressions: use only samples at which this state changes no faster, in its unit per second, as in
    /// `q=5`; repeatable
    #[arg(long, value_name = "STATE=RATE")]
    pub steady: Vec<String>,
    /// Recursive: time constants of the filter 1/Λ(s), s: `5` gives Λ = 5s + 1, `5,5` gives (5s + 1)²
    #[arg(long, value_name = "SECONDS", value_delimiter = ',', default_value = "5", value_parser = positive, allow_hyphen_values = true)]
    pub filter: Vec<f64>,
    /// Recursive: forgetting rate β, 1/s
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = not_negative, allow_hyphen_values = true)]
    pub forgetting: f64,
    /// Recursive: P₀, the initial variance of each parameter, relative to its size squared
    #[arg(long, value_name = "P0", default_value_t = 10.0, value_parser = positive, allow_hyphen_values = true)]
    pub start_variance: f64,
    /// Recursive: R₀, the upper limit of the variances in P, relative to the parameters' sizes squared
    /// [default: none]
    #[arg(long, value_name = "R0", value_parser = positive, allow_hyphen_values = true)]
    pub most_variance: Option<f64>,
    /// Recursive: n_s² in the normalisation m² = 1 + n_s²
    #[arg(long, value_enum, value_name = "NAME", default_value_t = Normalise::None)]
    pub normalise: Normalise,
}

impl RegressionArgs {
    /// Checks that there is a search for which `--evaluations` has a meaning.
    pub(crate) fn verify_evaluations(&self, most: Option<usize>) -> Result<(), CommandError> {
        let searches = !matches!(
            self.estimator,
            Estimator::LeastSquares | Estimator::Bounded | Estimator::Recursive
        );
        if most.is_none() || searches {
            return Ok(());
        }
        let name = self.estimator.to_possible_value();
        let name = name.as_ref().map_or("", |value| value.get_name());
        Err(CommandError::Usage(format!(
            "`--evaluations` limits a search, and `--estimator {name}` has none"
        )))
    }

    /// Where linear models are, if the estimator makes them.
    ///
    /// # Errors
    ///
    /// Where `--at` is given to another estimator.
    pub(crate) fn place(&self) -> Result<Option<Place>, CommandError> {
        match (self.estimator, self.at) {
            (Estimator::Linearised, at) => Ok(Some(at.unwrap_or(Place::Mean))),
            (_, None) => Ok(None),
            (_, Some(_)) => {
                Err(CommandError::Usage("`--at` needs `--estimator linearised`".to_owned()))
            }
        }
    }
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
