//! Models, variants, effects and results to be compared.

use std::path::PathBuf;

#[cfg(feature = "clap")]
use super::values;
use super::{FreeParameters, JournalChoice, SolverOptions};

/// Models, variants, effects and results to be compared.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct CompareRequest {
    /// Contenders: `MODEL`, `MODEL@VARIANT=CHOICE`, `MODEL+EFFECT`, or a folder of results of a fit or a discovery; at
    /// least two.
    #[cfg_attr(feature = "clap", arg(value_name = "CONTENDER", required = true, num_args = 2..))]
    pub contenders: Vec<String>,
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
    /// Set a constant, a parameter or a start value, as in `c0=280` or `'F2=1.8e8 [Pa*s^2/m^6]'`, in every contender that
    /// has it; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=VALUE"))]
    pub set: Vec<String>,
    /// Treat the first contender as nested in each of the others, and run likelihood-ratio tests; by default only for
    /// contenders of the same model that only have more effects.
    #[cfg_attr(feature = "clap", arg(long))]
    pub nested: bool,
    /// Maximum number of simulations in each search; 200 by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true))]
    pub evaluations: Option<usize>,
    /// Simulation settings.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub solve: SolverOptions,
    /// The command line or program line that reproduces the result, for the page.
    #[cfg_attr(feature = "clap", arg(skip))]
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
