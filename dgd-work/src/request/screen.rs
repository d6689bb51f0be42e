//! Recordings to be screened.

use std::path::PathBuf;

use dgd_data::Rename;

use super::Choices;

/// Recordings to be screened.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct ScreenRequest {
    /// A model; the columns are checked against what it says of them too.
    pub model: Option<PathBuf>,
    /// What is chosen of it.
    pub choices: Choices,
    /// The recordings.
    pub data: Vec<PathBuf>,
    /// Other names for their columns.
    pub rename: Vec<Rename>,
    /// Columns that measure the same quantity, each as `NAME,NAME`; where there is none, those whose names differ
    /// only in the last letter or digit and that move together.
    pub same: Vec<String>,
    /// Length of the windows over which slopes are taken, s; 30 usual sampling intervals where there is none.
    pub window: Option<f64>,
    /// Largest slopes at which columns count as at rest, each as `NAME=RATE`, in its unit per second.
    pub rest: Vec<String>,
    /// Whether it ends badly where a fault is found.
    pub check: bool,
    /// What makes the same again, for the page: a command line, or a line of a program.
    pub command: String,
}

impl ScreenRequest {
    /// Of these recordings.
    pub fn new(data: Vec<PathBuf>) -> Self {
        ScreenRequest { data, ..ScreenRequest::default() }
    }
}
