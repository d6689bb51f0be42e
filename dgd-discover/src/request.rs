//! What a discovery works on, and why there may be none.

use std::fmt;

use dgd_compiler::diagnostics::Reported;
use dgd_compiler::effects::Effect;
use dgd_compiler::source::Sources;
use dgd_identify::journal::{Digest, Journal};
use dgd_identify::{Recording, Watch};
use dgd_runtime::Options;

use crate::library::BaseModel;

/// What a discovery works on.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The model that may lack something.
    pub base: &'a BaseModel,
    /// Effects that it may lack.
    pub library: &'a [Effect],
    /// Templates that fit any model ([`templates`](crate::templates)), for what the library does
    /// not explain.
    pub templates: &'a [Effect],
    /// The texts of the model, the library and the templates.
    pub sources: &'a Sources,
    /// Recordings to fit to, one at least, with what they are called. Their start values are first
    /// guesses.
    pub train: (&'a [Recording], &'a [String]),
    /// Recordings kept out of the fits, with what they are called.
    pub valid: (&'a [Recording], &'a [String]),
    /// How to integrate.
    pub options: Options,
    /// Whether the user named the method: it is kept then where structures are ranked, too.
    pub is_method_named: bool,
    /// Structures refitted at a time; the result does not depend on it.
    pub threads: usize,
    /// Seed of resampling.
    pub seed: u64,
    /// How long the search may take, s; it then ends with the best so far. Results depend on it.
    pub budget: Option<f64>,
    /// Keeps fits and screens, so that a run that was ended goes on where it was. The result does not
    /// depend on it.
    pub journal: &'a dyn Journal,
    /// Is told how far it is. Where it says to stop, the search ends as if its time had passed: between fits, with
    /// the best so far.
    pub watch: &'a dyn Watch,
}

impl Request<'_> {
    /// Digest of all that fits and screens depend on: texts, settings and recordings.
    pub fn digest(&self) -> Digest {
        let BaseModel { asts, options, free, fix, engine: _ } = self.base;
        let texts: Vec<&str> = self.sources.iter().map(|source| &*source.text).collect();
        Digest::EMPTY
            .of(&env!("CARGO_PKG_VERSION"))
            .of(&texts)
            .of(&(self.library.len(), self.templates.len()))
            .of(&(asts, options, free, fix))
            .of(&(self.train.0, self.valid.0))
            .of(&(self.options, self.is_method_named))
    }
}

/// Why there is no discovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiscoverError {
    /// The model has mistakes, which were reported.
    Model(Reported),
    /// There is no recording to fit to.
    NoRecording,
    /// No output of the model was measured often enough to know its noise.
    NothingMeasured,
    /// The model cannot be fitted as it is.
    BaseModel(String),
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
        }
    }
}

impl std::error::Error for DiscoverError {}
