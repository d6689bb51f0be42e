//! Estimates the missing term of each equation and sensor: a model, a recording and its residuals in, an input d(t) for
//! each place out.
//!
//! [`MissingTerms`] is the model with an unknown input everywhere, [`Deviations`] its linearisation along a trajectory,
//! [`unknown_input()`] the smoothed estimate for one place, [`reconstruct()`] the same around the trajectory that
//! includes it. [`missing_inputs`] does this for all places.

mod around;
mod deviations;
mod filtered;
mod joint;
mod kalman;
mod missing;
mod missing_terms;
mod place_fit;
mod plausible;
mod reconstruct;
mod thinned;
mod unknown_input;

pub use deviations::{DeviationError, Deviations};
pub(crate) use joint::{JointModel, JointRecording, SmoothedRecording};
pub use missing::MissingInput;
pub(crate) use missing::{
    FoundPlace, MissingInputs, PlaceTrace, TIE, alone, free_places, missing_inputs, place_of,
    windows,
};
pub use missing_terms::{ClosedPlace, MissingPlace, MissingTerms, NoSuchTerm, PlaceKind};
pub(crate) use plausible::PlaceObjection;
pub use reconstruct::{ReconstructError, ReconstructedRecording, inputs_with, reconstruct};
pub use unknown_input::{UnknownInput, unknown_input};
