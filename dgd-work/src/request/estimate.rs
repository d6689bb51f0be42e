//! Requests that estimate something from recordings.

use std::path::PathBuf;

use super::{Choices, Solve, Sought};

/// Where finished work is kept until the result is written, so that a run that is ended can be gone on from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Keep {
    /// The folder of results, beside which it is kept; nothing is kept without one.
    pub out: Option<PathBuf>,
    /// Whether to go on from what an earlier run with the same request has kept.
    pub resume: bool,
}

impl Keep {
    /// Beside this folder of results.
    pub fn new(out: Option<PathBuf>, resume: bool) -> Self {
        Keep { out, resume }
    }
}

/// What a model lacks.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct DiscoverRequest {
    /// The model file.
    pub model: PathBuf,
    /// What is chosen of it.
    pub choices: Choices,
    /// Recordings to search in.
    pub data: Vec<PathBuf>,
    /// Recordings for validation, not used in fits.
    pub valid: Vec<PathBuf>,
    /// Folders of effects, in addition to `effects` beside the model.
    pub effects: Vec<PathBuf>,
    /// What is estimated.
    pub sought: Sought,
    /// How long the search may take, s; as long as it takes where that is open.
    pub budget: Option<f64>,
    /// Where finished work is kept.
    pub keep: Keep,
    /// How the model is run.
    pub solve: Solve,
    /// What makes the same again, for the report: a command line, or a line of a program.
    pub command: String,
}

impl DiscoverRequest {
    /// By these recordings.
    pub fn new(model: impl Into<PathBuf>, data: Vec<PathBuf>) -> Self {
        DiscoverRequest {
            model: model.into(),
            choices: Choices::default(),
            data,
            valid: Vec::new(),
            effects: Vec::new(),
            sought: Sought::default(),
            budget: None,
            keep: Keep::default(),
            solve: Solve::default(),
            command: String::new(),
        }
    }
}

/// A formula or an effect that a discovery described, for the library of its model.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct AdoptRequest {
    /// The folder of the discovery's result, or a file in it.
    pub result: PathBuf,
    /// What the effect is to be called.
    pub name: String,
}

impl AdoptRequest {
    /// Of this result, by this name.
    pub fn new(result: impl Into<PathBuf>, name: impl Into<String>) -> Self {
        AdoptRequest { result: result.into(), name: name.into() }
    }
}

/// States and parameters row by row.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TrackRequest {
    /// The model file.
    pub model: PathBuf,
    /// What is chosen of it.
    pub choices: Choices,
    /// The recording.
    pub data: PathBuf,
    /// Estimator.
    pub estimator: Tracker,
    /// What is estimated.
    pub sought: Sought,
    /// Outputs to use; all that are measured where there is none.
    pub outputs: Vec<String>,
    /// Process noise: standard deviations of random walks after one minute, each as `NAME=VALUE`.
    pub process_noise: Vec<String>,
    /// Initial standard deviations of states and parameters, each as `NAME=VALUE`.
    pub start_std: Vec<String>,
    /// Measurement noise: standard deviations of outputs, each as `NAME=VALUE`.
    pub noise: Vec<String>,
    /// Forgetting factor per row, for [`Tracker::Recursive`]; 0.999 where there is none.
    pub forgetting: Option<f64>,
    /// Whether a row that cannot be read ends it.
    pub strict: bool,
    /// Samples more than so many standard deviations from their prediction are ignored.
    pub gate: Option<f64>,
    /// How the model is run.
    pub solve: Solve,
    /// Whether the result has the rows, for figures and programs.
    pub keeps_rows: bool,
}

impl TrackRequest {
    /// Of this recording.
    pub fn new(model: impl Into<PathBuf>, data: impl Into<PathBuf>) -> Self {
        TrackRequest {
            model: model.into(),
            choices: Choices::default(),
            data: data.into(),
            estimator: Tracker::Ekf,
            sought: Sought::default(),
            outputs: Vec::new(),
            process_noise: Vec::new(),
            start_std: Vec::new(),
            noise: Vec::new(),
            forgetting: None,
            strict: false,
            gate: None,
            solve: Solve::default(),
            keeps_rows: false,
        }
    }
}

/// How estimates are moved and corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tracker {
    /// Extended Kalman filter: states and parameters, from derivatives.
    Ekf,
    /// Unscented Kalman filter: states and parameters, from sigma points.
    Ukf,
    /// Recursive prediction error: parameters and initial values of the simulated model, with forgetting.
    Recursive,
}
