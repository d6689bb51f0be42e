//! Requests that estimate something from recordings.

use std::path::PathBuf;

use super::{FreeParameters, ModelChoices, SolverOptions};

/// Location of the journal, from which an interrupted run can be resumed until its result is written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct JournalChoice {
    /// The folder of results, next to which the journal is kept; without one there is no journal.
    pub out: Option<PathBuf>,
    /// Whether to resume from the journal of an earlier run with the same request.
    pub resume: bool,
}

impl JournalChoice {
    /// A journal beside this folder of results.
    pub fn new(out: Option<PathBuf>, resume: bool) -> Self {
        JournalChoice { out, resume }
    }
}

/// A search for the missing terms of a model.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct DiscoverRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    pub choices: ModelChoices,
    /// Training recordings.
    pub data: Vec<PathBuf>,
    /// Recordings for validation, not used in fits.
    pub valid: Vec<PathBuf>,
    /// Folders of effects, in addition to `effects` beside the model.
    pub effects: Vec<PathBuf>,
    /// Parameters and initial values to estimate.
    pub sought: FreeParameters,
    /// Time limit of the search, s; unlimited by default.
    pub budget: Option<f64>,
    /// Location of the journal.
    pub keep: JournalChoice,
    /// Simulation settings.
    pub solve: SolverOptions,
    /// The command line or program line that reproduces the result, for the report.
    pub command: String,
}

impl DiscoverRequest {
    /// Searches in these recordings.
    pub fn new(model: impl Into<PathBuf>, data: Vec<PathBuf>) -> Self {
        DiscoverRequest {
            model: model.into(),
            choices: ModelChoices::default(),
            data,
            valid: Vec::new(),
            effects: Vec::new(),
            sought: FreeParameters::default(),
            budget: None,
            keep: JournalChoice::default(),
            solve: SolverOptions::default(),
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
    /// Name of the effect in the library.
    pub name: String,
}

impl AdoptRequest {
    /// Adopts this result under this name.
    pub fn new(result: impl Into<PathBuf>, name: impl Into<String>) -> Self {
        AdoptRequest { result: result.into(), name: name.into() }
    }
}

/// Tracking of states and parameters, row by row.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TrackRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    pub choices: ModelChoices,
    /// The recording.
    pub data: PathBuf,
    /// Estimator.
    pub estimator: TrackerKind,
    /// Parameters and initial values to estimate.
    pub sought: FreeParameters,
    /// Outputs to use; all measured ones by default.
    pub outputs: Vec<String>,
    /// Process noise: standard deviations of random walks after one minute, each as `NAME=VALUE`.
    pub process_noise: Vec<String>,
    /// Initial standard deviations of states and parameters, each as `NAME=VALUE`.
    pub start_std: Vec<String>,
    /// Measurement noise: standard deviations of outputs, each as `NAME=VALUE`.
    pub noise: Vec<String>,
    /// Forgetting factor per row, for [`TrackerKind::Recursive`]; 0.999 by default.
    pub forgetting: Option<f64>,
    /// Whether an unreadable row is an error.
    pub strict: bool,
    /// Samples further from their prediction than this many standard deviations are ignored.
    pub gate: Option<f64>,
    /// Simulation settings.
    pub solve: SolverOptions,
    /// Whether the result keeps the rows, for figures and programs.
    pub keeps_rows: bool,
}

impl TrackRequest {
    /// Tracks this recording.
    pub fn new(model: impl Into<PathBuf>, data: impl Into<PathBuf>) -> Self {
        TrackRequest {
            model: model.into(),
            choices: ModelChoices::default(),
            data: data.into(),
            estimator: TrackerKind::Ekf,
            sought: FreeParameters::default(),
            outputs: Vec::new(),
            process_noise: Vec::new(),
            start_std: Vec::new(),
            noise: Vec::new(),
            forgetting: None,
            strict: false,
            gate: None,
            solve: SolverOptions::default(),
            keeps_rows: false,
        }
    }
}

/// Algorithm of the tracking filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrackerKind {
    /// Extended Kalman filter: states and parameters, from derivatives.
    Ekf,
    /// Unscented Kalman filter: states and parameters, from sigma points.
    Ukf,
    /// Recursive prediction error: parameters and initial values of the simulated model, with forgetting.
    Recursive,
}
