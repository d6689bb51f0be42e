//! The command line, as typed.

pub(crate) mod compare;
pub(crate) mod fit;
pub(crate) mod invert;
mod requests;
pub(crate) mod screen;
mod sweep;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use dgd_data::Rename;
use dgd_runtime::integrate::catalogue::AUTOMATIC;
use dgd_runtime::{PerSample, Steps};
use dgd_work::LinearizeAt;

use crate::numbers::{count, factor, finite, positive, whole};
use compare::CompareArgs;
use fit::{IntervalArgs, RegressionArgs, SearchArgs};
use invert::InvertArgs;
use screen::ScreenArgs;
use sweep::{label, mark};

/// Check, simulate, differentiate and fit models written in a small equation language
#[derive(Debug, Parser)]
#[command(name = "dgd", version, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub global: Global,
    #[command(subcommand)]
    pub command: Command,
}

/// Options of every command.
#[derive(Debug, Args)]
pub(crate) struct Global {
    /// Output format of results and diagnostics
    #[arg(long, global = true, value_enum, default_value_t = Format::Text)]
    pub format: Format,
    /// Print errors only
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// When to use colours; `NO_COLOR` is respected
    #[arg(long, global = true, value_enum, default_value_t = Color::Auto)]
    pub color: Color,
    /// Seed of the random number generator
    #[arg(long, global = true, value_name = "N", default_value_t = 0, value_parser = whole::<u64>, allow_negative_numbers = true)]
    pub seed: u64,
    /// Number of threads; does not affect results [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// File to write the result to; `fit`, `discover` and `screen` write a folder [default: standard output]
    #[arg(long, short, global = true, value_name = "PATH")]
    pub out: Option<PathBuf>,
}

/// How results are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people
    Text,
    /// For programs
    Json,
}

/// When to use colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Color {
    /// On a terminal
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Check a model: syntax, names, units, structure, in all its variants
    Check(CheckArgs),
    /// Format model files; comments are kept
    Fmt(FmtArgs),
    /// Print the output of a compiler stage
    Emit(EmitArgs),
    /// Explain an error code in detail
    Explain(ExplainArgs),
    /// Simulate a model: states and outputs over time
    Simulate(SimulateArgs),
    /// Compute sensitivities: derivatives of states and outputs with respect to parameters, over time
    Sensitivity(SensitivityArgs),
    /// Linearise a model at an operating point: A, B, C, D, poles and time constants
    Linearize(LinearizeArgs),
    /// Find what an equation lacks, from what was measured of everything else in it
    ///
    /// For example the flow that a level misses: `dgd invert models/mud_circulation.dgd --data run.csv --for riser
    /// --unit lpm --plot missing.png`.
    Invert(InvertArgs),
    /// Estimate parameters and initial values from recordings
    ///
    /// Ctrl-C stops the fit, writes the best estimates so far, and lists what was left out; the exit code is
    /// then 130. A second Ctrl-C ends it at once.
    Fit(FitArgs),
    /// Compare models, variants, effects or results on the same recordings
    ///
    /// All contenders are fitted alike:
    /// `dgd compare m.dgd m.dgd+leak --data monday.csv --valid tuesday.csv`
    Compare(CompareArgs),
    /// Estimate states and parameters row by row, as the data comes in
    Track(TrackArgs),
    /// Find where a model and recordings disagree, and name the effect that is missing
    ///
    /// With `-o`, finished work is kept as it goes: if Ctrl-C or a kill ends the run, continue it with
    /// `--resume`.
    Discover(DiscoverArgs),
    /// Take a formula or an effect that a discovery described into the library of its model
    Adopt(AdoptArgs),
    /// Check recordings for faults before anything is fitted to them
    Screen(ScreenArgs),
    /// List the integration methods
    Methods,
    /// Serve an editor on standard input and output, by the Language Server Protocol
    ///
    /// Editors start it themselves: `vim.lsp.start({ cmd = { "dgd", "lsp" } })`; settings for Neovim, Helix, Zed
    /// and VS Code are in docs/editors.md.
    Lsp(LspArgs),
}

/// Arguments of `lsp`.
#[derive(Debug, Args)]
pub(crate) struct LspArgs {
    /// Taken and ignored: many editors say it
    #[arg(long, hide = true)]
    pub stdio: bool,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: Choices,
}

/// Arguments of `fmt`.
#[derive(Debug, Args)]
pub(crate) struct FmtArgs {
    /// Model files
    #[arg(required = true)]
    pub models: Vec<PathBuf>,
    /// Change nothing; fail if a file is not formatted
    #[arg(long)]
    pub check: bool,
}

/// Arguments of `emit`.
#[derive(Debug, Args)]
pub(crate) struct EmitArgs {
    /// The model file
    pub model: PathBuf,
    /// Compiler stage to print
    #[arg(long, value_enum)]
    pub stage: Stage,
    #[command(flatten)]
    pub choices: Choices,
}

/// Stages of the compiler.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Stage {
    /// The file as it was understood
    Ast,
    /// Names, units and SI values
    Model,
    /// The system that is solved
    Dae,
    /// Operations in execution order
    Program,
    /// Generated Rust
    Rust,
    /// Equations, typeset
    Latex,
    /// A page: what is declared, and the equations, typeset
    Markdown,
}

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub(crate) struct ExplainArgs {
    /// The code, such as E301
    pub code: String,
}

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
    /// With `--over`, draw the elements of an array of outputs in one colour, and write at the end of each
    /// what another one says of it, as in `head=speed`
    #[arg(long, value_name = "CURVES=BY", requires = "over", value_parser = label)]
    pub label: Vec<(String, String)>,
    /// With `--over`, mark the points that two outputs, or arrays of them, are the coordinates of, as in
    /// `q_op,h_op`
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
    pub choices: Choices,
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

/// What commands that run a model once share.
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: Choices,
    /// Inputs, and measured outputs to compare with
    #[arg(long, value_name = "FILE")]
    pub data: Option<PathBuf>,
    /// Time between rows, s [default: the data's rows]
    #[arg(long, value_name = "DT", value_parser = positive, allow_hyphen_values = true)]
    pub every: Option<f64>,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// Arguments of `fit`.
#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: Choices,
    /// A recording to fit to; repeatable
    #[arg(long, value_name = "FILE", required = true)]
    pub data: Vec<PathBuf>,
    /// A recording for validation, not used in the fit; repeatable
    #[arg(long, value_name = "FILE")]
    pub valid: Vec<PathBuf>,
    #[command(flatten)]
    pub sought: Sought,
    /// Outputs to fit [default: all that were measured]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub outputs: Vec<String>,
    /// Where the weights of the outputs come from
    #[arg(long, value_enum, default_value_t = NoiseFrom::Estimated)]
    pub noise: NoiseFrom,
    /// Continue an earlier run that was ended, with the same input and `-o`; the result is the same
    #[arg(long)]
    pub resume: bool,
    /// Maximum number of simulations in a search, or of evaluations where nothing is simulated [default: 200;
    /// regressions 2000, models without states 5000]
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub evaluations: Option<usize>,
    #[command(flatten)]
    pub search: SearchArgs,
    #[command(flatten)]
    pub intervals: IntervalArgs,
    #[command(flatten)]
    pub regression: RegressionArgs,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// Arguments of `track`.
#[derive(Debug, Args)]
pub(crate) struct TrackArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: Choices,
    /// The recording; `-` reads CSV from standard input and prints each estimate as soon as its row is there
    #[arg(long, value_name = "FILE|-")]
    pub data: PathBuf,
    /// Estimator
    #[arg(long, value_enum, default_value_t = Tracker::Ekf)]
    pub estimator: Tracker,
    #[command(flatten)]
    pub sought: Sought,
    /// Outputs to use [default: all that are measured]
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
pub(crate) enum Tracker {
    /// Extended Kalman filter: states and parameters, from derivatives
    Ekf,
    /// Unscented Kalman filter: states and parameters, from sigma points
    Ukf,
    /// Recursive prediction error: parameters and initial values of the simulated model, with forgetting
    Recursive,
}

/// Arguments of `discover`.
#[derive(Debug, Args)]
pub(crate) struct DiscoverArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: Choices,
    /// A recording to search in; repeatable
    #[arg(long, value_name = "FILE", required = true)]
    pub data: Vec<PathBuf>,
    /// A recording for validation, not used in fits; repeatable
    #[arg(long, value_name = "FILE")]
    pub valid: Vec<PathBuf>,
    /// Another folder of effects, in addition to `effects` beside the model; repeatable
    #[arg(long, value_name = "DIR")]
    pub effects: Vec<PathBuf>,
    /// End the search after this time, such as 60s, with the best so far
    #[arg(long, value_name = "TIME", value_parser = crate::numbers::time, allow_hyphen_values = true)]
    pub budget: Option<f64>,
    #[command(flatten)]
    pub sought: Sought,
    /// Continue an earlier run that was ended, with the same input and `-o`; the result is the same
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// Arguments of `adopt`.
#[derive(Debug, Args)]
pub(crate) struct AdoptArgs {
    /// The folder that `dgd discover -o` wrote, or a file in it such as law_1.dgd
    pub result: PathBuf,
    /// What the effect is to be called
    pub name: String,
}

/// What is estimated.
#[derive(Debug, Args)]
pub(crate) struct Sought {
    /// Parameters to estimate, and `fixed` states whose initial values to estimate too [default: those
    /// that are not `fixed`]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub free: Vec<String>,
    /// Parameters, and states for their initial values, not to estimate
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub fix: Vec<String>,
}

/// Where the weights of the outputs come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum NoiseFrom {
    /// The noise declared in the model; for outputs that declare none, the residuals of the fit
    Declared,
    /// The residuals of each output, refitted until the weights no longer change
    Estimated,
}

/// How a model is run.
#[derive(Debug, Clone, Args)]
pub(crate) struct SolveArgs {
    /// Source of the initial values
    #[arg(long, value_enum, default_value_t = Start::Model)]
    pub start: Start,
    /// Rename a column of the data, adding a unit if the file has none, as in `P_RIS=p_r` or
    /// 'P_RIS=p_r [barg]'; repeatable
    #[arg(long, value_name = "COLUMN=NAME")]
    pub rename: Vec<Rename>,
    /// First time, s since the data's first sample [default: 0]
    #[arg(long, value_name = "T", value_parser = finite, allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// Last time, s since the data's first sample [default: the data's last]
    #[arg(long, value_name = "T", value_parser = finite, allow_hyphen_values = true)]
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
    #[arg(long, value_name = "TOL", default_value_t = 1e-6, value_parser = positive, allow_hyphen_values = true)]
    pub rtol: f64,
    /// Absolute tolerance, as a fraction of each unknown's nominal size [default: rtol]
    #[arg(long, value_name = "TOL", value_parser = positive, allow_hyphen_values = true)]
    pub atol: Option<f64>,
    /// How the model is evaluated; does not affect results
    #[arg(long, value_enum, default_value_t = Engine::Auto)]
    pub engine: Engine,
    /// Plot the result; a picture, .svg, .pdf or .png, or a page to open in a browser, .html; repeatable
    #[arg(long, value_name = "FILE")]
    pub plot: Vec<PathBuf>,
}

/// How the model is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Engine {
    /// Native code where it is available and worthwhile
    Auto,
    /// Native code
    Native,
    /// Interpreter
    Interpreter,
}

impl From<Engine> for dgd_execute::Engine {
    fn from(engine: Engine) -> Self {
        match engine {
            Engine::Auto => dgd_execute::Engine::Auto,
            Engine::Native => dgd_execute::Engine::Native,
            Engine::Interpreter => dgd_execute::Engine::Interpreter,
        }
    }
}

/// Reads what `--steps` says.
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

/// Reads what `--at` says.
pub(crate) fn place(text: &str) -> Result<LinearizeAt, String> {
    match text.parse::<f64>() {
        _ if text == "steady" => Ok(LinearizeAt::Steady),
        _ if text == "mean" => Ok(LinearizeAt::Mean),
        Ok(t) if t.is_finite() => Ok(LinearizeAt::Time(t)),
        _ => Err("this must be a time in s, `steady` or `mean`".to_owned()),
    }
}

/// Where start values come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Start {
    /// The model file
    Model,
    /// The first measured outputs, as far as they determine the states
    Measured,
}

/// What is chosen and set from outside the model file.
#[derive(Debug, Clone, Args)]
pub(crate) struct Choices {
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
