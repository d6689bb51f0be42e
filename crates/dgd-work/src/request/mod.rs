//! Requests. Every field has the default of the command line, and is documented there in the same words.

mod compare;
mod estimate;
mod fit;
mod screen;
mod single;

use std::fmt;
use std::path::PathBuf;

use dgd_data::Rename;
use dgd_runtime::integrate::catalogue::AUTOMATIC;
use dgd_runtime::linearize::LinearAt;
use dgd_runtime::{Inputs, Steps};

pub use compare::CompareRequest;
pub use dgd_execute::Engine;
pub use estimate::{AdoptRequest, DiscoverRequest, JournalChoice, TrackRequest, TrackerKind};
pub use fit::{
    Estimator, FitRequest, IntervalRequest, NoiseFrom, Normalise, RegressionRequest, SearchRequest,
};
pub use screen::ScreenRequest;
pub use single::{
    CheckRequest, InvertRequest, LinearizeRequest, RunRequest, SensitivityRequest, SimulateRequest,
};

/// Choices and settings from outside the model file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ModelChoices {
    /// Variants, each as `NAME=CHOICE`.
    pub variant: Vec<String>,
    /// Constants, parameters and initial values, each as `NAME=VALUE` or `NAME=VALUE [UNIT]`.
    pub set: Vec<String>,
    /// Effects: files, or names from the folder `effects` beside the model, with arguments in parentheses.
    pub apply: Vec<String>,
    /// Whether a run starts in steady state, regardless of the model.
    pub at_rest: bool,
}

impl ModelChoices {
    /// These variants, settings and effects.
    pub fn new(variant: Vec<String>, set: Vec<String>, apply: Vec<String>) -> Self {
        ModelChoices { variant, set, apply, at_rest: false }
    }
}

/// Simulation settings.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SolverOptions {
    /// Source of the initial values.
    pub start: StartChoice,
    /// Other names for columns of the data.
    pub rename: Vec<Rename>,
    /// First time, s since the data's first sample; by default the data's first.
    pub from: Option<f64>,
    /// Last time, s since the data's first sample; by default the data's last.
    pub until: Option<f64>,
    /// Name of the integration method; `auto` chooses one for the model.
    pub method: String,
    /// Step size control.
    pub steps: Steps,
    /// Relative tolerance.
    pub rtol: f64,
    /// Absolute tolerance, as a fraction of each unknown's nominal size; `rtol` by default.
    pub atol: Option<f64>,
    /// How the model is evaluated; does not affect results.
    pub engine: Engine,
}

impl Default for SolverOptions {
    fn default() -> Self {
        SolverOptions {
            start: StartChoice::Model,
            rename: Vec::new(),
            from: None,
            until: None,
            method: AUTOMATIC.to_owned(),
            steps: Steps::Automatic,
            rtol: 1e-6,
            atol: None,
            engine: Engine::Auto,
        }
    }
}

/// Source of the initial values.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum StartChoice {
    /// The model file.
    #[default]
    Model,
    /// The first measured outputs, where they determine the states.
    Measured,
}

/// Parameters and initial values to estimate.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct FreeParameters {
    /// Parameters to estimate, and `fixed` states whose initial values to estimate too; by default all that are not
    /// `fixed`.
    pub free: Vec<String>,
    /// Parameters, and states for their initial values, not to estimate.
    pub fix: Vec<String>,
}

impl FreeParameters {
    /// Estimates `free`, but not `fix`.
    pub fn new(free: Vec<String>, fix: Vec<String>) -> Self {
        FreeParameters { free, fix }
    }
}

/// The point of a linearisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LinearizeAt {
    /// The point of a run at this time, s.
    Time(f64),
    /// The steady state with the inputs of the first time.
    Steady,
    /// The steady state with the means of the inputs.
    Mean,
}

impl LinearizeAt {
    /// Whether the point is a steady state.
    pub fn is_rest(self) -> bool {
        match self {
            LinearizeAt::Time(_) => false,
            LinearizeAt::Steady | LinearizeAt::Mean => true,
        }
    }

    /// The point in a run over these times.
    pub fn locate(self, inputs: &Inputs, times: &[f64]) -> Option<LinearAt> {
        let (first, last) = (*times.first()?, *times.last()?);
        Some(match self {
            LinearizeAt::Time(t) => LinearAt::Reached(t),
            LinearizeAt::Steady => LinearAt::Rest(inputs.mean(first, first)),
            LinearizeAt::Mean => LinearAt::Rest(inputs.mean(first, last)),
        })
    }
}

/// A time as a number, `steady` or `mean`.
impl fmt::Display for LinearizeAt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinearizeAt::Time(t) => t.fmt(f),
            LinearizeAt::Steady => f.write_str("steady"),
            LinearizeAt::Mean => f.write_str("mean"),
        }
    }
}

/// A model file with default choices.
pub(crate) fn model(path: impl Into<PathBuf>) -> (PathBuf, ModelChoices) {
    (path.into(), ModelChoices::default())
}
