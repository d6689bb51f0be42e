//! Possible causes, with the models in which the suspected value is estimated or corrected, and their fits.

use std::sync::Arc;

use dgd_compiler::units::Unit;

use super::column_fault::ColumnFault;
use super::groups::RecordingGroups;
use super::model_number::ModelNumber;
use super::search::CorrectedRecordings;
use crate::fit::{FittedStructure, SearchData};
use crate::library::BaseModel;

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

/// A start value that is held.
#[derive(Debug, Clone)]
pub(crate) struct HeldStart {
    pub(crate) state: String,
    pub(crate) unit: Unit,
}

impl HeldStart {
    /// The start of each training recording in a fit that estimates it, with its standard deviation, SI.
    pub(crate) fn values(&self, fitted: &FittedStructure) -> Vec<(usize, f64, Option<f64>)> {
        let name = format!("{}(0)", self.state);
        let estimates = fitted.estimates.iter().filter(|estimate| estimate.name == name);
        estimates.filter_map(|one| Some((one.recording?, one.value, one.std))).collect()
    }
}

/// A suspicion with the model in which the suspected value is estimated or corrected.
#[derive(Debug, Clone)]
pub(super) struct SuspectModel {
    /// Its position among all: numbers in the order of the text, then columns, the nearest first.
    pub(super) position: usize,
    pub(super) suspicion: Suspicion,
    /// The model, if it differs from the base model.
    pub(super) base: Option<BaseModel>,
    pub(super) changed: Option<Arc<CorrectedRecordings>>,
}

impl SuspectModel {
    pub(super) fn data<'a>(&'a self, data: &SearchData<'a>) -> SearchData<'a> {
        self.changed.as_ref().map_or_else(|| data.clone(), |changed| changed.data(data))
    }
}

/// A suspicion, fitted.
#[derive(Debug, Clone)]
pub(crate) struct FittedSuspicion {
    pub(super) position: usize,
    pub(crate) suspicion: Suspicion,
    pub(crate) fitted: FittedStructure,
    /// The recordings that it was fitted to, if they are not those of the request.
    pub(crate) changed: Option<Arc<CorrectedRecordings>>,
}

impl FittedSuspicion {
    /// Σ ε² + k ln N of the training recordings; readings that were left out count as noise about a further number in
    /// each recording.
    pub(super) fn criterion(&self) -> f64 {
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
