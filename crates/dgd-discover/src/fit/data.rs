//! The recordings with which structures are compared.

use std::fmt;

use dgd_execute::LoadedSystem;
use dgd_identify::Recording;
use dgd_runtime::{Method, Options, System};
use dgd_screen::noise::SensorNoise;

use super::budget::SearchBudget;
use super::keeping::WorkJournal;
use crate::library::OutputScales;

/// Recordings and settings shared by all structures.
#[derive(Debug, Clone)]
pub(crate) struct SearchData<'a> {
    /// Recordings to fit to.
    pub train: &'a [Recording],
    /// Validation recordings, of which only start values are fitted.
    pub valid: &'a [Recording],
    /// Noise of each output; `None` if it is not measured.
    pub noise: Vec<Option<SensorNoise>>,
    /// Time from which each of `valid` counts, s: start values are estimated from the samples before it.
    pub counts_from: Vec<f64>,
    /// How to integrate.
    pub options: Options,
    /// The method for structures without algebraic unknowns, if another one suits them better.
    pub explicit: Option<&'static Method>,
    /// Whether fits end with weights from their own residuals, like those of `dgd fit`, so that it reproduces the
    /// parameters of a corrected model.
    pub own_weights: bool,
    /// The scales of the outputs of all structures and recordings.
    pub scales: &'a OutputScales,
    /// The time budget.
    pub budget: SearchBudget,
    /// Earlier results, and progress.
    pub keeping: WorkJournal<'a>,
}

/// Why a search ended before everything was tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SearchEnd {
    /// It was cancelled.
    Stopped,
    /// Its time had passed.
    TimePassed,
}

impl fmt::Display for SearchEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            SearchEnd::Stopped => "not tried: the search was stopped",
            SearchEnd::TimePassed => "not tried: the time that the search was given had passed",
        })
    }
}

impl<'a> SearchData<'a> {
    /// How to integrate a structure.
    pub(crate) fn options_for(&self, system: &LoadedSystem) -> Options {
        let is_explicit = || system.signature().unknowns.iter().all(|unknown| unknown.differential);
        let method = self.explicit.filter(|_| is_explicit()).unwrap_or(self.options.method);
        Options { method, ..self.options }
    }

    /// Whether the search for names must end: its time is over, or it was cancelled.
    pub(crate) fn is_spent(&self) -> bool {
        self.budget.is_spent() || self.keeping.is_stopped()
    }

    /// Whether the search for places and formulas must end too.
    pub(crate) fn is_over(&self) -> bool {
        self.budget.is_over() || self.keeping.is_stopped()
    }

    /// The reason to report for everything that was not tried after that.
    pub(crate) fn not_tried(&self) -> SearchEnd {
        if self.keeping.is_stopped() { SearchEnd::Stopped } else { SearchEnd::TimePassed }
    }

    /// These data for fits that are not stored: keys identify a structure by the positions of its candidates, and do
    /// not cover recordings other than the request's.
    pub(crate) fn not_kept(&self) -> SearchData<'a> {
        SearchData { keeping: WorkJournal::NONE, own_weights: false, ..self.clone() }
    }
}
