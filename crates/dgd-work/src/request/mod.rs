//! Requests: the options of each task, each written once.
//!
//! A field is an option: its comment is the help of the command, and its attribute the form on the command line, from which
//! Python reads it, too. A default is that of `Default`.

#[cfg(feature = "clap")]
mod chosen;
mod compare;
mod estimate;
mod fit;
mod screen;
mod single;
pub mod values;

use std::fmt;
use std::path::PathBuf;

use dgd_data::Rename;
use dgd_runtime::integrate::catalogue::AUTOMATIC;
use dgd_runtime::linearize::LinearAt;
use dgd_runtime::signature::choices;
use dgd_runtime::{Inputs, Steps};

pub use compare::CompareRequest;
pub use dgd_execute::Engine;
pub use estimate::{AdoptRequest, DiscoverRequest, JournalChoice, TrackRequest, TrackerKind};
pub(crate) use fit::EstimationApproach;
pub use fit::{
    Estimator, FitRequest, IntervalRequest, NoiseFrom, RegressionRequest, SearchRequest,
};
pub use screen::ScreenRequest;
pub use single::{
    CheckRequest, InvertRequest, LinearizeRequest, RunRequest, SensitivityRequest, SimulateRequest,
};

/// Choices and settings from outside the model file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct ModelChoices {
    /// Choose a variant, as in `flow=static`; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=CHOICE"))]
    pub variant: Vec<String>,
    /// Set a constant, a parameter or a start value, as in `c0=280` or `'F2=1.8e8 [Pa*s^2/m^6]'`; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=VALUE"))]
    pub set: Vec<String>,
    /// Apply an effect: a file, or a name from the folder `effects` beside the model, with a form or arguments, as in
    /// `pump_wear`, `booster/column` or `'gain_error(q)'`; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "EFFECT"))]
    pub apply: Vec<String>,
    /// Whether a run starts in steady state, regardless of the model: [`StartChoice::Steady`].
    #[cfg_attr(feature = "clap", arg(skip))]
    pub(crate) at_rest: bool,
}

impl ModelChoices {
    /// These variants, settings and effects.
    pub fn new(variant: Vec<String>, set: Vec<String>, apply: Vec<String>) -> Self {
        ModelChoices { variant, set, apply, at_rest: false }
    }

    /// The same for runs with these settings, which may start in steady state.
    pub(crate) fn starting(&self, solve: &SolverOptions) -> Self {
        let at_rest = self.at_rest || solve.start == StartChoice::Steady;
        ModelChoices { at_rest, ..self.clone() }
    }
}

/// Simulation settings.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct SolverOptions {
    /// Source of the initial values.
    #[cfg_attr(feature = "clap", arg(long, value_parser = chosen::parser::<StartChoice>(), default_value_t = SolverOptions::default().start))]
    pub start: StartChoice,
    /// Rename a column of the data, adding a unit if the file has none, as in `P_RIS=p_r` or `'P_RIS=p_r [barg]'`;
    /// repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "COLUMN=NAME"))]
    pub rename: Vec<Rename>,
    /// First time since the data's first sample, in s or as in `2h`; 0 by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "T", value_parser = values::moment, allow_hyphen_values = true))]
    pub from: Option<f64>,
    /// Last time since the data's first sample, in s or as in `24h`; the data's last by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "T", value_parser = values::moment, allow_hyphen_values = true))]
    pub until: Option<f64>,
    /// Integration method, see `dgd methods`; `auto` chooses one for the model.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME", default_value_t = SolverOptions::default().method))]
    pub method: String,
    /// Step size control: `auto`, `adaptive`, `per-sample`, or `per-sample=N`.
    ///
    /// `per-sample` takes equal steps between the samples of recorded inputs: as many as the tolerance requires, or N.
    /// `auto` means `adaptive`, and in fits `per-sample` where model and recordings allow it.
    #[cfg_attr(feature = "clap", arg(long, value_name = "STEPS", default_value = AUTOMATIC, value_parser = values::steps))]
    pub steps: Steps,
    /// Relative tolerance.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOL", default_value_t = SolverOptions::default().rtol, value_parser = values::tolerance, allow_hyphen_values = true))]
    pub rtol: f64,
    /// Absolute tolerance, as a fraction of each unknown's nominal size; `rtol` by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TOL", value_parser = values::factor, allow_hyphen_values = true))]
    pub atol: Option<f64>,
    /// How the model is evaluated; does not affect results.
    #[cfg_attr(feature = "clap", arg(long, value_parser = chosen::parser::<Engine>(), default_value_t = SolverOptions::default().engine))]
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

choices! {
    /// Source of the initial values.
    pub enum StartChoice {
        /// The model file.
        Model = "model",
        /// The first measured outputs, as far as they determine the states.
        Measured = "measured",
        /// The steady state for the inputs of the first row, as `start steady` in the model.
        Steady = "steady",
    }
}

/// Parameters and initial values to estimate.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct FreeParameters {
    /// Parameters to estimate, and `fixed` states whose initial values to estimate too; by default those that are not
    /// `fixed`.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES", value_delimiter = ','))]
    pub free: Vec<String>,
    /// Parameters not to estimate, and states whose initial values not to estimate.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES", value_delimiter = ','))]
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
