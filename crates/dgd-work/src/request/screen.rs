//! Recordings to be screened.

use std::path::PathBuf;

use dgd_data::Rename;

use super::ModelChoices;

/// Recordings to be screened.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct ScreenRequest {
    /// A model; the columns are also checked against it.
    pub model: Option<PathBuf>,
    /// Variants, settings and effects of the model.
    pub choices: ModelChoices,
    /// The recordings.
    pub data: Vec<PathBuf>,
    /// Other names for their columns.
    pub rename: Vec<Rename>,
    /// Columns that measure the same quantity, each as `NAME,NAME`; by default, columns whose names differ only in the
    /// last letter or digit and whose values move together.
    pub same: Vec<String>,
    /// Length of the windows over which slopes are taken, s; 30 typical sample intervals by default.
    pub window: Option<f64>,
    /// Largest slopes at which columns count as steady, each as `NAME=RATE`, in its unit per second.
    pub rest: Vec<String>,
    /// Whether a fault is an error.
    pub check: bool,
    /// The command line or program line that reproduces the result, for the page.
    pub command: String,
}

impl ScreenRequest {
    /// Screens these recordings.
    pub fn new(data: Vec<PathBuf>) -> Self {
        ScreenRequest { data, ..ScreenRequest::default() }
    }
}
