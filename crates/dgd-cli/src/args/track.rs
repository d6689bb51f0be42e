//! Options of `track`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{ChoiceArgs, FreeArgs, SolveArgs};
use crate::numbers::{factor, positive};

/// Arguments of `track`.
#[derive(Debug, Args)]
pub(crate) struct TrackArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: ChoiceArgs,
    /// The recording; `-` reads CSV from standard input and prints each estimate as soon as its row arrives
    #[arg(long, value_name = "FILE|-")]
    pub data: PathBuf,
    /// Estimator
    #[arg(long, value_enum, default_value_t = TrackerArg::Ekf)]
    pub estimator: TrackerArg,
    #[command(flatten)]
    pub sought: FreeArgs,
    /// Outputs to use [default: all measured ones]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub outputs: Vec<String>,
    /// Process noise: standard deviation of the random walk after one minute, as in 'F2=2e6' or 'h_r=5 [cm]';
    /// repeatable [default: states 0.1 % of their size, parameters 10 % in an hour]
    #[arg(long, value_name = "NAME=VALUE")]
    pub process_noise: Vec<String>,
    /// Initial standard deviation of a state or parameter; repeatable [default: states 10 % of their size,
    /// parameters that of their prior, or 30 %]
    #[arg(long, value_name = "NAME=VALUE")]
    pub start_std: Vec<String>,
    /// Measurement noise: standard deviation of an output; repeatable [default: as the model declares]
    #[arg(long, value_name = "NAME=VALUE")]
    pub noise: Vec<String>,
    /// Forgetting factor per row, for `recursive` [default: 0.999]
    #[arg(long, value_name = "FACTOR", value_parser = factor, allow_hyphen_values = true)]
    pub forgetting: Option<f64>,
    /// Stop at a row that cannot be read, instead of skipping it
    #[arg(long)]
    pub strict: bool,
    /// Ignore samples more than N standard deviations from their prediction
    #[arg(long, value_name = "N", value_parser = positive, allow_hyphen_values = true)]
    pub gate: Option<f64>,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// How estimates are moved and corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TrackerArg {
    /// Extended Kalman filter: states and parameters, from derivatives
    Ekf,
    /// Unscented Kalman filter: states and parameters, from sigma points
    Ukf,
    /// Recursive prediction error: parameters and initial values of the simulated model, with forgetting
    Recursive,
}
