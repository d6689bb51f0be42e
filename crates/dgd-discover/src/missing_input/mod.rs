//! Estimates the missing term of each equation and sensor: a model, a recording and its residuals in, an input d(t) for
//! each place out.
//!
//! [`MissingTerms`] is the model with an unknown input everywhere, [`Deviations`] its linearisation along a trajectory,
//! [`unknown_input()`] the smoothed estimate for one place, [`reconstruct()`] the same around the trajectory that
//! includes it. [`missing_inputs`] does this for all places.

mod around;
mod deviations;
mod estimated;
mod filtered;
mod found_place;
mod joint;
mod kalman;
mod missing;
mod missing_terms;
mod place_fit;
mod place_search;
mod plausible;
mod reconstruct;
mod thinned;
mod unknown_input;

pub use deviations::{DeviationError, Deviations};
pub use found_place::MissingInput;
pub(crate) use found_place::{FoundPlace, PlaceObjection, PlaceTrace, windows};
pub(crate) use joint::{JointModel, JointRecording, SmoothedRecording};
pub(crate) use missing::{MissingInputs, TIE, alone, missing_inputs, place_of};
pub use missing_terms::{ClosedPlace, MissingPlace, MissingTerms, NoSuchTerm, PlaceKind};
pub(crate) use place_search::free_places;
pub use reconstruct::{ReconstructError, ReconstructedRecording, inputs_with, reconstruct};
pub use unknown_input::{UnknownInput, unknown_input};
