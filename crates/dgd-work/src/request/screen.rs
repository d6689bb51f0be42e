//! Recordings to be screened.

use std::path::PathBuf;

use dgd_data::Rename;

use super::ModelChoices;
#[cfg(feature = "clap")]
use super::values;

/// Recordings to be screened.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
#[non_exhaustive]
pub struct ScreenRequest {
    /// A model whose declarations the columns are also checked against.
    pub model: Option<PathBuf>,
    /// Variants, settings and effects of the model.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub choices: ModelChoices,
    /// A recording to check; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE", required = true))]
    pub data: Vec<PathBuf>,
    /// Rename a column, adding a unit if the file has none, as in `P_RIS=p_r` or `'P_RIS=p_r [barg]'`; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "COLUMN=NAME"))]
    pub rename: Vec<Rename>,
    /// Columns that measure the same quantity, as in `p_main,p_backup`; repeatable; by default those whose names differ only
    /// in the last letter or digit and that move together.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAMES"))]
    pub same: Vec<String>,
    /// Length of the windows over which slopes are computed, in s or as in `5min`; 30 usual sampling intervals by default.
    #[cfg_attr(feature = "clap", arg(long, value_name = "T", value_parser = values::time, allow_hyphen_values = true))]
    pub window: Option<f64>,
    /// Largest slope at which a column counts as at rest, in its unit per second, as in `q_ssp=2`; repeatable.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME=RATE"))]
    pub rest: Vec<String>,
    /// Fail if a fault is found.
    #[cfg_attr(feature = "clap", arg(long))]
    pub check: bool,
    /// The command line or program line that reproduces the result, for the page.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub command: String,
}

impl ScreenRequest {
    /// Screens these recordings.
    pub fn new(data: Vec<PathBuf>) -> Self {
        ScreenRequest { data, ..ScreenRequest::default() }
    }
}
