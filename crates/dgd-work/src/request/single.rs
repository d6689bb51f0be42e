//! Requests about one model, or one run of it.

use std::path::PathBuf;

#[cfg(feature = "clap")]
use super::values;
use super::{LinearizeAt, ModelChoices, SolverOptions, model};

/// A model, or an effect, to be checked.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct CheckRequest {
    /// The model file, or an effect.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub choices: ModelChoices,
}

impl CheckRequest {
    /// Checks the file as it is.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let (model, choices) = model(path);
        CheckRequest { model, choices }
    }
}

/// One run of a model.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct RunRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub choices: ModelChoices,
    /// Inputs, and measured outputs to compare with.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub data: Option<PathBuf>,
    /// Time between rows, in s or as in `5min`; the data's rows by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "DT", value_parser = values::time, allow_hyphen_values = true))]
    pub every: Option<f64>,
    /// Simulation settings.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub solve: SolverOptions,
}

impl RunRequest {
    /// Runs a model without data, which needs an end: [`SolverOptions::until`].
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let (model, choices) = model(path);
        RunRequest { model, choices, data: None, every: None, solve: SolverOptions::default() }
    }
}

/// States and outputs over time.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct SimulateRequest {
    /// The run.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub run: RunRequest,
    /// Simulate once for each row of this file; its columns are parameters, or states for their initial values, as in
    /// `c0 [m]`.
    #[cfg_attr(feature = "clap", arg(long, value_name = "SETS"))]
    pub ensemble: Option<PathBuf>,
    /// Plot the outputs over this input, state or output instead of time, one panel for each unit.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME", conflicts_with = "ensemble"))]
    pub over: Option<String>,
    /// Draw the elements of an array of outputs in one colour, and label the end of each with its value in another array, as
    /// in `head=speed`; needs another abscissa than time.
    #[cfg_attr(feature = "clap", arg(long = "label", value_name = "CURVES=BY", requires = "over", value_parser = values::label))]
    pub labels: Vec<(String, String)>,
    /// Mark points whose coordinates are two outputs, or arrays of outputs, as in `q_op,h_op`; needs another abscissa than
    /// time.
    #[cfg_attr(feature = "clap", arg(long = "mark", value_name = "X,Y", requires = "over", value_parser = values::mark))]
    pub marks: Vec<(String, String)>,
    /// Add measurement noise to the outputs, drawn with this seed.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = values::whole::<u64>, allow_negative_numbers = true))]
    pub noise_seed: Option<u64>,
    /// Whether to keep arrays of unknowns, for figures over place and time.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub fields: bool,
}

impl SimulateRequest {
    /// Simulates this run.
    pub fn new(run: RunRequest) -> Self {
        SimulateRequest {
            run,
            ensemble: None,
            over: None,
            labels: Vec::new(),
            marks: Vec::new(),
            noise_seed: None,
            fields: false,
        }
    }
}

/// Derivatives of states and outputs with respect to parameters over time.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct SensitivityRequest {
    /// The run.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub run: RunRequest,
    /// States and outputs to differentiate; all by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES", value_delimiter = ','))]
    pub of: Vec<String>,
    /// Differentiate with respect to these parameters, or states for their initial values; all parameters by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES", value_delimiter = ','))]
    pub to: Vec<String>,
    /// Multiply each derivative by its parameter.
    #[cfg_attr(feature = "clap", arg(long))]
    pub scaled: bool,
    /// Compare the derivatives with finite differences, and report the errors.
    #[cfg_attr(feature = "clap", arg(long))]
    pub verify_sensitivities: bool,
}

impl SensitivityRequest {
    /// All sensitivities of this run.
    pub fn new(run: RunRequest) -> Self {
        let (of, to) = (Vec::new(), Vec::new());
        SensitivityRequest { run, of, to, scaled: false, verify_sensitivities: false }
    }
}

/// The linear model at a point.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct LinearizeRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub choices: ModelChoices,
    /// Inputs.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub data: Option<PathBuf>,
    /// Operating point: a time in s since the data's first sample, `steady` (steady state with the inputs of the first
    /// time) or `mean` (steady state with the mean inputs).
    #[cfg_attr(feature = "clap", arg(long, value_name = "T|steady|mean", allow_negative_numbers = true, value_parser = values::point))]
    pub at: LinearizeAt,
    /// Settings of the run to the point.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub solve: SolverOptions,
}

impl LinearizeRequest {
    /// Linearises the model at this point.
    pub fn new(path: impl Into<PathBuf>, at: LinearizeAt) -> Self {
        let (model, choices) = model(path);
        LinearizeRequest { model, choices, data: None, at, solve: SolverOptions::default() }
    }
}

/// The missing term of an equation, from measurements.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct InvertRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub choices: ModelChoices,
    /// Inputs and measured outputs.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub data: PathBuf,
    /// Label of the equation, as in `equation LABEL: …`.
    #[cfg_attr(feature = "clap", arg(long = "for", value_name = "LABEL"))]
    pub equation: String,
    /// Outputs whose readings are used; all measured ones by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES", value_delimiter = ','))]
    pub outputs: Vec<String>,
    /// Half the width of the averaging window, as in `20s` or `2min`; by default the most likely.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TIME", value_parser = values::time, allow_hyphen_values = true))]
    pub bandwidth: Option<f64>,
    /// Unit of the missing term; by default that of the first quantity of the model with the same dimension.
    #[cfg_attr(feature = "clap", arg(long, value_name = "UNIT"))]
    pub unit: Option<String>,
    /// Add the estimate of a smoother with the whole model, as plotted by `discover`.
    #[cfg_attr(feature = "clap", arg(long))]
    pub with_estimate: bool,
    /// Simulation settings.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub solve: SolverOptions,
}

impl InvertRequest {
    /// Inverts this equation.
    pub fn new(
        path: impl Into<PathBuf>,
        data: impl Into<PathBuf>,
        equation: impl Into<String>,
    ) -> Self {
        let (model, choices) = model(path);
        InvertRequest {
            model,
            choices,
            data: data.into(),
            equation: equation.into(),
            outputs: Vec::new(),
            bandwidth: None,
            unit: None,
            with_estimate: false,
            solve: SolverOptions::default(),
        }
    }

    /// Its model on its recording.
    pub(crate) fn run(&self) -> RunRequest {
        let (model, choices, solve) =
            (self.model.clone(), self.choices.clone(), self.solve.clone());
        RunRequest { model, choices, data: Some(self.data.clone()), every: None, solve }
    }
}
