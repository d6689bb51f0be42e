//! Models, variants, effects and results to be compared.

use std::path::PathBuf;

use super::{Keep, Solve, Sought};

/// Models, variants, effects and results to be compared.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct CompareRequest {
    /// What is compared: `MODEL`, `MODEL@VARIANT=CHOICE`, `MODEL+EFFECT`, or a folder of results.
    pub contenders: Vec<String>,
    /// Recordings that all are fitted to.
    pub data: Vec<PathBuf>,
    /// Recordings for validation, not used in the fits.
    pub valid: Vec<PathBuf>,
    /// What is estimated.
    pub sought: Sought,
    /// Constants, parameters and start values of those contenders that have them, each as `NAME=VALUE`.
    pub set: Vec<String>,
    /// Where finished work is kept.
    pub keep: Keep,
    /// Whether the first contender is a special case of each other one.
    pub nested: bool,
    /// Most simulations in a search; 200 where there is none.
    pub evaluations: Option<usize>,
    /// How the models are run.
    pub solve: Solve,
    /// What makes the same again, for the page: a command line, or a line of a program.
    pub command: String,
}

impl CompareRequest {
    /// Of these contenders, on these recordings.
    pub fn new(contenders: Vec<String>, data: Vec<PathBuf>) -> Self {
        CompareRequest {
            contenders,
            data,
            valid: Vec::new(),
            sought: Sought::default(),
            set: Vec::new(),
            keep: Keep::default(),
            nested: false,
            evaluations: None,
            solve: Solve::default(),
            command: String::new(),
        }
    }
}
