//! The request for a discovery, and its errors.

use std::fmt;

use dgd_compiler::diagnostics::ErrorReported;
use dgd_compiler::effects::Effect;
use dgd_compiler::source::SourceMap;
use dgd_identify::journal::{Digest, Journal};
use dgd_identify::{Monitor, Recording};
use dgd_runtime::Options;

use crate::library::BaseModel;

/// The request for a discovery.
#[derive(Debug, Clone, Copy)]
pub struct DiscoveryOptions<'a> {
    /// The base model.
    pub base: &'a BaseModel,
    /// Effects that may be missing from it.
    pub library: &'a [Effect],
    /// Templates that fit any model ([`templates`](crate::templates)), tried if the library does not explain the
    /// recordings.
    pub templates: &'a [Effect],
    /// The texts of the model, the library and the templates.
    pub sources: &'a SourceMap,
    /// Recordings to fit to, at least one, with their names. Their start values are initial guesses.
    pub train: (&'a [Recording], &'a [String]),
    /// Validation recordings, with their names.
    pub valid: (&'a [Recording], &'a [String]),
    /// How to integrate.
    pub options: Options,
    /// Whether the user named the method: it is then also used to rank structures.
    pub is_method_named: bool,
    /// Number of structures refitted at a time; the result does not depend on it.
    pub threads: usize,
    /// Seed of resampling.
    pub seed: u64,
    /// Time limit of the search, s; it then ends with the best so far. Results depend on it.
    pub budget: Option<f64>,
    /// Stores fits and screens, so that an interrupted run can resume. The result does not depend on it.
    pub journal: &'a dyn Journal,
    /// Receives progress. Cancelling ends the search as if its time were over: between fits, with the best so far.
    pub watch: &'a dyn Monitor,
}

impl DiscoveryOptions<'_> {
    /// Digest of everything on which fits and screens depend: texts, settings and recordings.
    pub fn digest(&self) -> Digest {
        let BaseModel { asts, options, free, fix, engine: _, scales: _ } = self.base;
        let texts: Vec<&str> = self.sources.iter().map(|source| &*source.text).collect();
        Digest::EMPTY
            .debug(&env!("CARGO_PKG_VERSION"))
            .debug(&texts)
            .debug(&(self.library.len(), self.templates.len()))
            .debug(&(asts, options, free, fix))
            .debug(&(self.train.0, self.valid.0))
            .debug(&(self.options, self.is_method_named))
    }
}

/// Why a discovery failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiscoverError {
    /// The model has errors, which were reported.
    Model(ErrorReported),
    /// There is no training recording.
    NoRecording,
    /// No output of the model was measured often enough to estimate its noise.
    NothingMeasured,
    /// The base model cannot be fitted.
    BaseModel(String),
    /// The text of the corrected model cannot be read.
    Corrected(String),
}

impl fmt::Display for DiscoverError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Model(_) => f.write_str("the model has mistakes"),
            Self::NoRecording => f.write_str("there is no recording to fit to"),
            Self::NothingMeasured => {
                f.write_str("no output of the model was measured often enough to tell its noise")
            }
            Self::BaseModel(reason) => write!(f, "the model cannot be fitted as it is: {reason}"),
            Self::Corrected(reason) => {
                write!(f, "the text of the corrected model cannot be read: {reason}")
            }
        }
    }
}

impl std::error::Error for DiscoverError {}
