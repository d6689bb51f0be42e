//! Options of commands that run a model once.

use std::path::PathBuf;

use clap::Args;
use dgd_work::LinearizeAt;

use super::sweep::{label, mark};
use super::{ChoiceArgs, SolveArgs};
use crate::numbers::{time, whole};

/// Arguments of `simulate`.
#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    #[command(flatten)]
    pub run: RunArgs,
    /// Simulate once for each row of this file; its columns are parameters, or states for their initial
    /// values, as in `c0 [m]`
    #[arg(long, value_name = "SETS")]
    pub ensemble: Option<PathBuf>,
    /// Plot the outputs over this input, state or output instead of time, one panel for each unit
    #[arg(long, value_name = "NAME", requires = "plot", conflicts_with = "ensemble")]
    pub over: Option<String>,
    /// With `--over`, draw the elements of an array of outputs in one colour, and label the end of each
    /// with its value in another array, as in `head=speed`
    #[arg(long, value_name = "CURVES=BY", requires = "over", value_parser = label)]
    pub label: Vec<(String, String)>,
    /// With `--over`, mark points whose coordinates are two outputs, or arrays of outputs, as in `q_op,h_op`
    #[arg(long, value_name = "X,Y", requires = "over", value_parser = mark)]
    pub mark: Vec<(String, String)>,
    /// Add measurement noise to the outputs, drawn with this seed
    #[arg(long, value_name = "N", value_parser = whole::<u64>, allow_negative_numbers = true)]
    pub noise_seed: Option<u64>,
}

/// Arguments of `sensitivity`.
#[derive(Debug, Args)]
pub(crate) struct SensitivityArgs {
    #[command(flatten)]
    pub run: RunArgs,
    /// States and outputs to differentiate [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub of: Vec<String>,
    /// Differentiate with respect to these parameters, or states for their initial values [default: all
    /// parameters]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub to: Vec<String>,
    /// Multiply each derivative by its parameter
    #[arg(long)]
    pub scaled: bool,
    /// Compare the derivatives with finite differences, and report the errors
    #[arg(long)]
    pub verify_sensitivities: bool,
}

/// Arguments of `linearize`.
#[derive(Debug, Args)]
pub(crate) struct LinearizeArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: ChoiceArgs,
    /// Inputs
    #[arg(long, value_name = "FILE")]
    pub data: Option<PathBuf>,
    /// Operating point: a time in s since the data's first sample, `steady` (steady state with the inputs of
    /// the first time) or `mean` (steady state with the mean inputs)
    #[arg(long, value_name = "T|steady|mean", allow_negative_numbers = true, value_parser = place)]
    pub at: LinearizeAt,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// Arguments shared by commands that run a model once.
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: ChoiceArgs,
    /// Inputs, and measured outputs to compare with
    #[arg(long, value_name = "FILE")]
    pub data: Option<PathBuf>,
    /// Time between rows, in s or as in `5min` [default: the data's rows]
    #[arg(long, value_name = "DT", value_parser = time, allow_hyphen_values = true)]
    pub every: Option<f64>,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// Reads the value of `--at`.
pub(crate) fn place(text: &str) -> Result<LinearizeAt, String> {
    match text.parse::<f64>() {
        _ if text == "steady" => Ok(LinearizeAt::Steady),
        _ if text == "mean" => Ok(LinearizeAt::Mean),
        Ok(t) if t.is_finite() => Ok(LinearizeAt::Time(t)),
        _ => Err("this must be a time in s, `steady` or `mean`".to_owned()),
    }
}
