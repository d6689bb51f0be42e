//! Requests about one model, or one run of it.

use std::path::PathBuf;

use super::{Choices, LinearizeAt, Solve, model};

/// A model, or an effect, to be checked.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct CheckRequest {
    /// The model file, or that of an effect.
    pub model: PathBuf,
    /// What is chosen of it.
    pub choices: Choices,
}

impl CheckRequest {
    /// As the file has it.
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
    /// What is chosen of it.
    pub choices: Choices,
    /// Inputs, and measured outputs to compare with.
    pub data: Option<PathBuf>,
    /// Time between rows, s; the data's rows where there is none.
    pub every: Option<f64>,
    /// How it is run.
    pub solve: Solve,
}

impl RunRequest {
    /// Of a model that needs nothing besides, but an end: [`Solve::until`] or data.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let (model, choices) = model(path);
        RunRequest { model, choices, data: None, every: None, solve: Solve::default() }
    }
}

/// States and outputs over time.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SimulateRequest {
    /// The run.
    pub run: RunRequest,
    /// A file with sets of parameters and start values, for `simulate_each`.
    pub ensemble: Option<PathBuf>,
    /// The quantity over which outputs are drawn, if it is not time.
    pub over: Option<String>,
    /// Arrays of outputs, each with the array whose values stand at the ends of its curves over that quantity.
    pub labels: Vec<(String, String)>,
    /// Outputs, or arrays of them, over that quantity and above it, whose points are marked.
    pub marks: Vec<(String, String)>,
    /// Seed of measurement noise that is added to the outputs.
    pub noise_seed: Option<u64>,
    /// Whether arrays of unknowns are kept, which figures show over place and time.
    pub fields: bool,
}

impl SimulateRequest {
    /// Of this run.
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

/// Derivatives of states and outputs to parameters over time.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SensitivityRequest {
    /// The run.
    pub run: RunRequest,
    /// States and outputs to differentiate; all where there is none.
    pub of: Vec<String>,
    /// Parameters, or states for their initial values; all parameters where there is none.
    pub to: Vec<String>,
    /// Whether each derivative is multiplied by its parameter.
    pub scaled: bool,
    /// Whether the derivatives are compared with finite differences.
    pub verify_sensitivities: bool,
}

impl SensitivityRequest {
    /// All of this run.
    pub fn new(run: RunRequest) -> Self {
        let (of, to) = (Vec::new(), Vec::new());
        SensitivityRequest { run, of, to, scaled: false, verify_sensitivities: false }
    }
}

/// The linear model close to a point.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct LinearizeRequest {
    /// The model file.
    pub model: PathBuf,
    /// What is chosen of it.
    pub choices: Choices,
    /// Inputs.
    pub data: Option<PathBuf>,
    /// The point.
    pub at: LinearizeAt,
    /// How the run to it is made.
    pub solve: Solve,
}

impl LinearizeRequest {
    /// Close to this point.
    pub fn new(path: impl Into<PathBuf>, at: LinearizeAt) -> Self {
        let (model, choices) = model(path);
        LinearizeRequest { model, choices, data: None, at, solve: Solve::default() }
    }
}

/// What an equation lacks, from what was measured.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct InvertRequest {
    /// The model, and the recording with what was measured.
    pub run: RunRequest,
    /// Label of the equation.
    pub equation: String,
    /// Outputs to take readings of; all that were measured where there is none.
    pub outputs: Vec<String>,
    /// Half the width of the window that means are taken over, s; the most likely where there is none.
    pub bandwidth: Option<f64>,
    /// Unit of what is missing; where there is none, that of the first quantity of the model which measures the same.
    pub unit: Option<String>,
    /// Whether a smoother's estimate with the whole model stands beside it.
    pub with_estimate: bool,
}

impl InvertRequest {
    /// Of this equation.
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
