//! The data of a search for plain causes, as recorded and as corrected.

use dgd_compiler::model::Model;
use dgd_identify::Recording;
use dgd_screen::noise::SensorNoise;

use crate::fit::{FittedStructure, SearchData};
use crate::library::BaseModel;

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

/// Recordings as they would have been without a fault.
#[derive(Debug, Clone)]
pub(crate) struct CorrectedRecordings {
    pub(crate) train: Vec<Recording>,
    pub(crate) valid: Vec<Recording>,
    pub(super) noise: Vec<Option<SensorNoise>>,
    pub(super) counts_from: Vec<f64>,
}

impl CorrectedRecordings {
    /// The data with these recordings.
    pub(super) fn data<'a>(&'a self, data: &SearchData<'a>) -> SearchData<'a> {
        let CorrectedRecordings { train, valid, noise, counts_from } = self;
        let (noise, counts_from) = (noise.clone(), counts_from.clone());
        SearchData { train, valid, noise, counts_from, ..data.clone() }
    }
}
