//! Requests about one model, or one run of it.

use std::path::PathBuf;

use super::{LinearizeAt, ModelChoices, SolverOptions, model};

/// A model, or an effect, to be checked.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct CheckRequest {
    /// The model or effect file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
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
#[non_exhaustive]
pub struct RunRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    pub choices: ModelChoices,
    /// Inputs, and measured outputs to compare with.
    pub data: Option<PathBuf>,
    /// Time between rows, s; by default the data's rows.
    pub every: Option<f64>,
    /// Simulation settings.
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
#[non_exhaustive]
pub struct SimulateRequest {
    /// The run.
    pub run: RunRequest,
    /// A file with sets of parameters and initial values, for `simulate_each`.
    pub ensemble: Option<PathBuf>,
    /// Abscissa of the outputs' plots, if not time.
    pub over: Option<String>,
    /// Arrays of outputs, each with the array whose values label the ends of its curves over that quantity.
    pub labels: Vec<(String, String)>,
    /// Outputs, or arrays of them, that are the abscissas and ordinates of marked points.
    pub marks: Vec<(String, String)>,
    /// Seed of measurement noise that is added to the outputs.
    pub noise_seed: Option<u64>,
    /// Whether to keep arrays of unknowns, for figures over place and time.
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
#[non_exhaustive]
pub struct SensitivityRequest {
    /// The run.
    pub run: RunRequest,
    /// States and outputs to differentiate; all by default.
    pub of: Vec<String>,
    /// Parameters, or states for their initial values; all parameters by default.
    pub to: Vec<String>,
    /// Whether each derivative is multiplied by its parameter.
    pub scaled: bool,
    /// Whether to compare the derivatives with finite differences.
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
#[non_exhaustive]
pub struct LinearizeRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    pub choices: ModelChoices,
    /// Inputs.
    pub data: Option<PathBuf>,
    /// The point.
    pub at: LinearizeAt,
    /// Settings of the run to the point.
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
#[non_exhaustive]
pub struct InvertRequest {
    /// The model and the recording.
    pub run: RunRequest,
    /// Label of the equation.
    pub equation: String,
    /// Outputs to use; all measured ones by default.
    pub outputs: Vec<String>,
    /// Half the width of the averaging window, s; by default the most likely.
    pub bandwidth: Option<f64>,
    /// Unit of the missing term; by default that of the first quantity of the model with the same dimension.
    pub unit: Option<String>,
    /// Whether to add a smoothed estimate from the whole model.
    pub with_estimate: bool,
}

impl InvertRequest {
    /// Inverts this equation.
    pub fn new(run: RunRequest, equation: impl Into<String>) -> Self {
        InvertRequest {
            run,
            equation: equation.into(),
            outputs: Vec::new(),
            bandwidth: None,
            unit: None,
            with_estimate: false,
        }
    }
}
