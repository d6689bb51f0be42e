//! Sets of terms to be fitted, and where their fits begin.

use std::sync::Arc;

use super::columns::LawDraft;
use super::sighting::FollowedRecordings;

/// A set of terms to be fitted, with the sighting that suggests it.
#[derive(Clone)]
pub(super) struct ProposedTerms {
    pub(super) draft: LawDraft,
    pub(super) sighting: Arc<FollowedRecordings>,
    pub(super) begin: FitOrigin,
}

/// Where the fit of a proposed set begins.
#[derive(Debug, Clone, Copy)]
pub(super) enum FitOrigin {
    /// At the states of the sighting in all recordings.
    All,
    /// At those of one recording; the start values of the others follow from its fit.
    Alone(usize),
}
