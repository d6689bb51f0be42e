//! Requests that estimate something from recordings.

use std::path::PathBuf;

use dgd_runtime::signature::choices;

use super::{FreeParameters, ModelChoices, SolverOptions};
#[cfg(feature = "clap")]
use super::{chosen, values};

/// Location of the journal, from which an interrupted run can be resumed until its result is written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct JournalChoice {
    /// The folder of results, next to which the journal is kept; without one there is no journal.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub out: Option<PathBuf>,
    /// Continue an interrupted run, with the same input and folder of results; the result is the same.
    #[cfg_attr(feature = "clap", arg(long))]
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
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct DiscoverRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub choices: ModelChoices,
    /// A recording to fit to; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE", required = true))]
    pub data: Vec<PathBuf>,
    /// A recording for validation, not used in fits; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE"))]
    pub valid: Vec<PathBuf>,
    /// Parameters and initial values to estimate.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub sought: FreeParameters,
    /// Location of the journal.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub keep: JournalChoice,
    /// Another folder of effects, in addition to `effects` beside the model; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "DIR"))]
    pub effects: Vec<PathBuf>,
    /// End the search after this time, such as 60s, with the best so far; unlimited by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "TIME", value_parser = values::time, allow_hyphen_values = true))]
    pub budget: Option<f64>,
    /// Simulation settings.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub solve: SolverOptions,
    /// The command line or program line that reproduces the result, for the report.
    #[cfg_attr(feature = "clap", arg(skip))]
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
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct AdoptRequest {
    /// The folder of a discovery's result, or a file in it such as `law_1.dgd`.
    pub result: PathBuf,
    /// New name of the effect.
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
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct TrackRequest {
    /// The model file.
    pub model: PathBuf,
    /// Variants, settings and effects of the model.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub choices: ModelChoices,
    /// The recording; `-` reads CSV from standard input and prints each estimate as soon as its row arrives.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE|-"))]
    pub data: PathBuf,
    /// Estimator.
    #[cfg_attr(feature = "clap", arg(long, value_parser = chosen::parser::<TrackerKind>(), default_value_t = TrackerKind::default()))]
    pub estimator: TrackerKind,
    /// Parameters and initial values to estimate.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub sought: FreeParameters,
    /// Outputs to use; all measured ones by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES", value_delimiter = ','))]
    pub outputs: Vec<String>,
    /// Process noise: standard deviation of the random walk after one minute, as in `F2=2e6` or `'h_r=5 [cm]'`;
    /// repeatable; by default 0.1 % of the size of a state, and for parameters 10 % in an hour.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=VALUE"))]
    pub process_noise: Vec<String>,
    /// Initial standard deviation of a state or parameter; repeatable; by default 10 % of the size of a state, and for
    /// parameters that of their prior, or 30 %.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=VALUE"))]
    pub start_std: Vec<String>,
    /// Measurement noise: standard deviation of an output; repeatable; by default as the model declares.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=VALUE"))]
    pub noise: Vec<String>,
    /// Forgetting factor per row, for `recursive`; 0.999 by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FACTOR", value_parser = values::factor, allow_hyphen_values = true))]
    pub forgetting: Option<f64>,
    /// Stop at a row that cannot be read, instead of skipping it.
    #[cfg_attr(feature = "clap", arg(long))]
    pub strict: bool,
    /// Ignore samples more than N standard deviations from their prediction.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = values::positive, allow_hyphen_values = true))]
    pub gate: Option<f64>,
    /// Simulation settings.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub solve: SolverOptions,
    /// Whether the result keeps the rows, for figures and programs.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub keeps_rows: bool,
}

impl TrackRequest {
    /// Tracks this recording.
    pub fn new(model: impl Into<PathBuf>, data: impl Into<PathBuf>) -> Self {
        TrackRequest {
            model: model.into(),
            choices: ModelChoices::default(),
            data: data.into(),
            estimator: TrackerKind::default(),
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

choices! {
    /// Algorithm of the tracking filter.
    pub enum TrackerKind {
        /// Extended Kalman filter: states and parameters, from derivatives.
        Ekf = "ekf",
        /// Unscented Kalman filter: states and parameters, from sigma points.
        Ukf = "ukf",
        /// Recursive prediction error: parameters and initial values of the simulated model, with forgetting.
        Recursive = "recursive",
    }
}
