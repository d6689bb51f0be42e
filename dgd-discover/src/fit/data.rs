//! What structures are compared with.

use dgd_identify::Recording;
use dgd_runtime::Options;
use dgd_screen::noise::SensorNoise;

use super::budget::Budget;
use super::keeping::WorkJournal;

/// Recordings, as all structures see them.
#[derive(Debug, Clone)]
pub(crate) struct Data<'a> {
    /// Recordings to fit to.
    pub train: &'a [Recording],
    /// Recordings that take no part in fits, but for their start values.
    pub valid: &'a [Recording],
    /// Standard deviation of each output's white noise; `None` where it is not measured.
    pub noise: Vec<Option<SensorNoise>>,
    /// Where each of `valid` begins to count, s: start values are estimated from what is before.
    pub counts_from: Vec<f64>,
    /// How to integrate.
    pub options: Options,
    /// Whether fits end with weights of what they leave, as those of `dgd fit` do, so that it finds a
    /// corrected model's numbers again.
    pub own_weights: bool,
    /// How long all may take.
    pub budget: Budget,
    /// What was computed before, and who looks on.
    pub keeping: WorkJournal<'a>,
}

impl<'a> Data<'a> {
    /// Whether the search for names ends: its time has passed, or who looks on stops it.
    pub(crate) fn is_spent(&self) -> bool {
        self.budget.is_spent() || self.keeping.is_stopped()
    }

    /// Whether the search for places and formulas ends, too.
    pub(crate) fn is_over(&self) -> bool {
        self.budget.is_over() || self.keeping.is_stopped()
    }

    /// Why something was not tried after that.
    pub(crate) fn not_tried(&self) -> String {
        let why = if self.keeping.is_stopped() {
            "the search was stopped"
        } else {
            "the time that the search was given had passed"
        };
        format!("not tried: {why}")
    }

    /// The same for fits that are not kept: their keys know a structure by the positions of its candidates, and nothing
    /// of recordings that are not the request's.
    pub(crate) fn not_kept(&self) -> Data<'a> {
        Data { keeping: WorkJournal::NONE, own_weights: false, ..self.clone() }
    }
}
