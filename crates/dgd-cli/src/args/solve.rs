//! Options shared by commands: choices, estimates, and simulation settings.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use dgd_data::Rename;
use dgd_runtime::integrate::catalogue::AUTOMATIC;
use dgd_runtime::{PerSample, Steps};

use crate::numbers::{factor, moment, tolerance};

/// The quantities to estimate.
#[derive(Debug, Args)]
pub(crate) struct FreeArgs {
    /// Parameters to estimate, and `fixed` states whose initial values to estimate too [default: those
    /// that are not `fixed`]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub free: Vec<String>,
    /// Parameters not to estimate, and states whose initial values not to estimate
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub fix: Vec<String>,
}

/// The quantities to estimate, and the recordings.
#[derive(Debug, Args)]
pub(crate) struct RecordingArgs {
    /// A recording to fit to; repeatable
    #[arg(long, value_name = "FILE", required = true)]
    pub data: Vec<PathBuf>,
    /// A recording for validation, not used in fits; repeatable
    #[arg(long, value_name = "FILE")]
    pub valid: Vec<PathBuf>,
    #[command(flatten)]
    pub sought: FreeArgs,
    /// Continue an interrupted run, with the same input and `-o`; the result is the same
    #[arg(long)]
    pub resume: bool,
}

/// How a model is run.
#[derive(Debug, Clone, Args)]
pub(crate) struct SolveArgs {
    /// Source of the initial values
    #[arg(long, value_enum, default_value_t = StartArg::Model)]
    pub start: StartArg,
    /// Rename a column of the data, adding a unit if the file has none, as in `P_RIS=p_r` or
    /// 'P_RIS=p_r [barg]'; repeatable
    #[arg(long, value_name = "COLUMN=NAME")]
    pub rename: Vec<Rename>,
    /// First time since the data's first sample, in s or as in `2h` [default: 0]
    #[arg(long, value_name = "T", value_parser = moment, allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// Last time since the data's first sample, in s or as in `24h` [default: the data's last]
    #[arg(long, value_name = "T", value_parser = moment, allow_hyphen_values = true)]
    pub until: Option<f64>,
    /// Integration method, see `dgd methods`; `auto` chooses one for the model
    #[arg(long, value_name = "NAME", default_value = AUTOMATIC)]
    pub method: String,
    /// Step size control: `auto`, `adaptive`, `per-sample`, or `per-sample=N`
    ///
    /// `per-sample` takes equal steps between the samples of recorded inputs: as many as the tolerance
    /// requires, or N. `auto` means `adaptive`, and in fits `per-sample` where model and recordings allow it.
    #[arg(long, value_name = "STEPS", default_value = AUTOMATIC, value_parser = steps)]
    pub steps: Steps,
    /// Relative tolerance
    #[arg(long, value_name = "TOL", default_value_t = 1e-6, value_parser = tolerance, allow_hyphen_values = true)]
    pub rtol: f64,
    /// Absolute tolerance, as a fraction of each unknown's nominal size [default: rtol]
    #[arg(long, value_name = "TOL", value_parser = factor, allow_hyphen_values = true)]
    pub atol: Option<f64>,
    /// How the model is evaluated; does not affect results
    #[arg(long, value_enum, default_value_t = EngineArg::Auto)]
    pub engine: EngineArg,
    /// Plot the result as a picture (.svg, .pdf, .png) or a page to open in a browser (.html); repeatable
    #[arg(long, value_name = "FILE")]
    pub plot: Vec<PathBuf>,
}

/// How the model is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum EngineArg {
    /// Native code where it is available and worthwhile
    Auto,
    /// Native code
    Native,
    /// Interpreter
    Interpreter,
}

impl From<EngineArg> for dgd_execute::Engine {
    fn from(engine: EngineArg) -> Self {
        match engine {
            EngineArg::Auto => dgd_execute::Engine::Auto,
            EngineArg::Native => dgd_execute::Engine::Native,
            EngineArg::Interpreter => dgd_execute::Engine::Interpreter,
        }
    }
}

/// Reads the value of `--steps`.
fn steps(text: &str) -> Result<Steps, String> {
    match text {
        AUTOMATIC => Ok(Steps::Automatic),
        "adaptive" => Ok(Steps::Adaptive),
        "per-sample" => Ok(Steps::PerSample(PerSample::Automatic)),
        _ => match text.strip_prefix("per-sample=").map(str::parse) {
            Some(Ok(n)) => Ok(Steps::PerSample(PerSample::Exactly(n))),
            Some(Err(_)) => {
                Err("the number of steps per sample must be a whole number, 1 or more".to_owned())
            }
            None => Err(format!(
                "this must be `{AUTOMATIC}`, `adaptive`, `per-sample` or `per-sample=N`"
            )),
        },
    }
}

/// The source of start values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum StartArg {
    /// The model file
    Model,
    /// The first measured outputs, as far as they determine the states
    Measured,
    /// The steady state for the inputs of the first row, as `start steady` in the model
    Steady,
}

/// Choices and settings from outside the model file.
#[derive(Debug, Clone, Args)]
pub(crate) struct ChoiceArgs {
    /// Choose a variant, as in `flow=static`; repeatable
    #[arg(long, value_name = "NAME=CHOICE")]
    pub variant: Vec<String>,
    /// Set a constant, a parameter or a start value, as in `c0=280` or 'F2=1.8e8 [Pa*s^2/m^6]'
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Apply an effect: a file, or a name from the folder `effects` beside the model, with a form
    /// or arguments, as in `pump_wear`, `booster/column` or 'gain_error(q)'; repeatable
    #[arg(long, value_name = "EFFECT")]
    pub apply: Vec<String>,
}
