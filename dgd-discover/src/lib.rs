//! Where a model and recordings disagree, which known effect is missing, and what each equation would
//! have needed.
//!
//! ```text
//!   model, effects, recordings  → discover: a verdict, the corrected model, how sure it is
//!
//!   measured                    → SensorNoise: σ of each sensor, from the data itself
//!   measured − simulated, σ     → Whiteness: is there anything but noise?
//!                               → Windows: when does it stand out?
//!   Model → MissingTerms        → UnknownInput per equation and sensor: d(t) that is missing there
//!                               → reconstruct: the same where d is too large for one linearisation
//! ```
//!
//! Residuals are measured − simulated, in SI units; a missing sample is not a number. Nothing here
//! reads files, prints, or knows what a model is about.

mod account;
mod activity;
mod adapted;
mod cancelling;
mod candidates;
mod colour;
mod condition;
mod corrected;
mod correlated;
mod deviations;
mod discover;
mod discovery;
mod discrepancy;
mod evidence;
mod exponential;
mod fitted;
mod foreseen;
mod forms;
mod formula;
mod found;
mod gates;
mod guess;
mod kalman;
mod keeping;
mod known;
mod levels;
mod missing;
mod missing_terms;
mod moments;
mod parallel;
mod patience;
mod projection;
mod reason;
mod reconstruct;
mod regression;
mod resampled;
mod screen;
mod search;
mod structure;
mod templates;
#[cfg(test)]
#[path = "../../tests/support/uniform.rs"]
mod uniform;
mod unknown_input;
mod verdict;
mod weights;
mod whiteness;
mod windows;

pub use condition::{Condition, ConditionKind, condition};
pub use deviations::{Deviations, LinearizeError};
pub use dgd_screen::noise::{Colour, SensorNoise, quantisation_step, white_noise};
pub use discover::{DiscoverError, Request, discover};
pub use discovery::{
    Alternative, Discovery, Evidence, FoundEffect, Gap, Guess, GuessedTerm, MissingInput,
    OutputTrace, ParameterValue, Ranked, RecordingTrace, Screened, Unexplained, Verdict,
};
pub use discrepancy::{averaging_lengths, discrepancy_windows};
pub use known::{KnownKind, KnownQuantity};
pub use missing_terms::{MissingTerms, Place, PlaceKind};
pub use reconstruct::{ReconstructError, Recording, reconstruct};
pub use structure::BaseModel;
pub use templates::templates;
pub use unknown_input::{UnknownInput, unknown_input};
pub use whiteness::{Check, CheckKind, FEWEST, Whiteness, effective_sample_size, whiteness};
pub use windows::Window;
