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

pub use deviations::{Deviations, LinearizeError};
pub(crate) use joint::{Joint, Path, Recorded};
pub use missing::MissingInput;
pub(crate) use missing::{
    FoundPlace, Missing, PlaceTrace, TIE, alone, free_places, missing_inputs, place_of, windows,
};
pub use missing_terms::{ClosedPlace, MissingTerms, NoSuchTerm, Place, PlaceKind};
pub(crate) use plausible::Objection;
pub use reconstruct::{ReconstructError, Recording, inputs_with, reconstruct};
pub use unknown_input::{UnknownInput, unknown_input};
