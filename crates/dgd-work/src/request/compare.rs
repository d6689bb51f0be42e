//! Models, variants, effects and results to be compared.

use std::path::PathBuf;

use super::{FreeParameters, JournalChoice, SolverOptions};

/// Models, variants, effects and results to be compared.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CompareRequest {
    /// The contenders: `MODEL`, `MODEL@VARIANT=CHOICE`, `MODEL+EFFECT`, or a folder of results.
    pub contenders: Vec<String>,
    /// Training recordings, common to all contenders.
    pub data: Vec<PathBuf>,
    /// Recordings for validation, not used in the fits.
    pub valid: Vec<PathBuf>,
    /// Parameters and initial values to estimate.
    pub sought: FreeParameters,
    /// Constants, parameters and initial values for those contenders that have them, each as `NAME=VALUE`.
    pub set: Vec<String>,
    /// Location of the journal.
    pub keep: JournalChoice,
    /// Whether the first contender is a special case of each other one.
    pub nested: bool,
    /// Most simulations in a search; 200 by default.
    pub evaluations: Option<usize>,
    /// Simulation settings.
    pub solve: SolverOptions,
    /// The command line or program line that reproduces the result, for the page.
    pub command: String,
}

impl CompareRequest {
    /// Compares these contenders on these recordings.
    pub fn new(contenders: Vec<String>, data: Vec<PathBuf>) -> Self {
        CompareRequest {
            contenders,
            data,
            valid: Vec::new(),
            sought: FreeParameters::default(),
            set: Vec::new(),
            keep: JournalChoice::default(),
            nested: false,
            evaluations: None,
            solve: SolverOptions::default(),
            command: String::new(),
        }
    }
}
