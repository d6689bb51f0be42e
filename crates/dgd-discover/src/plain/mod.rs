//! Plain causes: wrong numbers and faults of recordings, which come before any effect.
//!
//! ```text
//!   the model's text ─► each constant, each parameter that is not estimated      (numbers)
//!                       start values that are held                                (starts)
//!                       and the rate of the clock                                 (own_values)
//!     ─► the model with it estimated, from its value and from those that
//!        a slip of the unit would give                                           (trial)
//!   the recordings   ─► columns in another unit, exchanged, held or not, times    (columns)
//!                       and columns that are stuck                                (stuck)
//!     ─► the model fitted to them without the fault                               (trial)
//!     ─► those that leave only noise, the likeliest first, with their twins      (judged)
//!   otherwise, recordings that differ in one thing                               (differ, own_values)
//! ```
//!
//! A cause is an answer only if it leaves no more than noise, and if no effect or law is clearly more likely.

mod columns;
mod differ;
mod judged;
mod numbers;
mod own_values;
mod starts;
mod stuck;
mod trial;

use std::sync::Arc;

use dgd_compiler::model::Model;
use dgd_identify::Recording;
use dgd_screen::noise::SensorNoise;

use crate::fit::{FittedStructure, SearchData};
use crate::library::BaseModel;
use crate::search::EffectSearch;
pub(crate) use columns::{ColumnFault, between};
pub(crate) use differ::RecordingGroups;
pub(crate) use judged::{AnsweringCauses, PlainAnswer};
pub(crate) use numbers::ModelNumber;
pub(crate) use own_values::{DifferingValue, RATE, is_brought};
pub(crate) use starts::HeldStart;
pub(crate) use stuck::StuckColumn;

/// The data for a search.
#[derive(Clone, Copy)]
pub(crate) struct PlainSearch<'a> {
    pub(crate) base: &'a BaseModel,
    pub(crate) model: &'a Model,
    pub(crate) fitted: &'a FittedStructure,
    /// Names of the training and of the validation recordings.
    pub(crate) names: [&'a [String]; 2],
    pub(crate) data: &'a SearchData<'a>,
    pub(crate) threads: usize,
}

/// A possible cause.
#[derive(Debug, Clone)]
pub(crate) enum Suspicion {
    /// A number of the model's text.
    Number(ModelNumber),
    /// Recorded columns.
    Column(ColumnFault),
    /// A start value that is held.
    Start(HeldStart),
    /// The rate of the clock of all recordings.
    Rate,
    /// Something that differs between recordings.
    Recordings(RecordingGroups),
}

/// Recordings as they would have been without a fault.
#[derive(Debug, Clone)]
pub(crate) struct CorrectedRecordings {
    pub(crate) train: Vec<Recording>,
    pub(crate) valid: Vec<Recording>,
    noise: Vec<Option<SensorNoise>>,
    counts_from: Vec<f64>,
}

impl CorrectedRecordings {
    /// The data with these recordings.
    fn data<'a>(&'a self, data: &SearchData<'a>) -> SearchData<'a> {
        let CorrectedRecordings { train, valid, noise, counts_from } = self;
        let (noise, counts_from) = (noise.clone(), counts_from.clone());
        SearchData { train, valid, noise, counts_from, ..data.clone() }
    }
}

/// A suspicion with the model in which the suspected value is estimated or corrected.
#[derive(Debug, Clone)]
struct SuspectModel {
    /// Its position among all: numbers in the order of the text, then columns, the nearest first.
    position: usize,
    suspicion: Suspicion,
    /// The model, if it differs from the base model.
    base: Option<BaseModel>,
    changed: Option<Arc<CorrectedRecordings>>,
}

/// A suspicion, fitted.
#[derive(Debug, Clone)]
pub(crate) struct FittedSuspicion {
    position: usize,
    pub(crate) suspicion: Suspicion,
    pub(crate) fitted: FittedStructure,
    /// The recordings that it was fitted to, if they are not those of the request.
    pub(crate) changed: Option<Arc<CorrectedRecordings>>,
}

impl FittedSuspicion {
    /// Σ ε² + k ln N of the training recordings; readings that were left out count as noise about a further number in
    /// each recording.
    fn criterion(&self) -> f64 {
        let lost = match &self.suspicion {
            Suspicion::Column(ColumnFault::Stuck { since, lost, .. }) => {
                let numbers = since.iter().filter(|one| !one.is_held_out).count() as f64;
                *lost as f64 + numbers * ((self.fitted.error.1 + lost) as f64).ln()
            }
            _ => 0.0,
        };
        self.fitted.criterion() + lost
    }

    /// The data that it was fitted to.
    pub(crate) fn data<'a>(&'a self, data: &SearchData<'a>) -> SearchData<'a> {
        self.changed.as_ref().map_or_else(|| data.clone(), |changed| changed.data(data))
    }
}

impl PlainSearch<'_> {
    /// Causes that leave only noise, the likeliest first. Beside an effect of the library that explains the recordings,
    /// only numbers are tried: they may be its twins.
    fn search(&self, search: &EffectSearch<'_>, is_explained: bool) -> Vec<FittedSuspicion> {
        let mut suspects = numbers::suspects(self.base, self.model, self.fitted);
        if !is_explained {
            suspects.extend(starts::suspects(self.base, self.model, self.fitted));
            suspects.extend(own_values::rate(self.base));
            suspects.extend(self.likeliest(columns::suspects(self)));
        }
        for (position, suspect) in suspects.iter_mut().enumerate() {
            suspect.position = position;
        }
        self.explaining(search, &suspects)
    }
}
