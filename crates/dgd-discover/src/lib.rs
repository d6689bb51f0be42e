//! Finds where a model and recordings disagree, which known effect is missing, and the term that each equation lacks.
//!
//! ```text
//!   model, effects, recordings  → discover: a verdict, the corrected model, its uncertainty
//!
//!   measured                    → SensorNoise: σ of each sensor, from the data itself
//!   measured − simulated, σ     → Whiteness: is there anything but noise?
//!                               → Windows: when does it stand out?
//!   Model → MissingTerms        → UnknownInput per equation and sensor: d(t) that is missing there
//!                               → reconstruct: the same where d is too large for one linearisation
//! ```
//!
//! Residuals are measured − simulated, in SI units; a missing sample is NaN. Nothing here reads files, prints, or
//! depends on the subject of a model.

mod conditions;
mod discover;
mod fit;
mod guess;
mod law;
mod library;
mod missing_input;
mod noise;
mod plain;
mod report;
mod request;
mod search;
mod unexplained;
#[cfg(test)]
#[path = "../../../tests/support/uniform.rs"]
mod uniform;

pub use conditions::{Condition, ConditionKind, KnownKind, KnownQuantity, condition};
pub use dgd_screen::noise::{Colour, SensorNoise, quantisation_step, white_noise};
pub use discover::discover;
pub use guess::{Course, Guess, GuessedTerm, LawParameter, LawRange, Together};
pub use law::LawTerm;
pub use library::{BaseModel, Scales, templates};
pub use missing_input::{
    ClosedPlace, Deviations, LinearizeError, MissingInput, MissingTerms, NoSuchTerm, Place,
    PlaceKind, ReconstructError, Recording, UnknownInput, inputs_with, reconstruct, unknown_input,
};
pub use noise::{
    Check, CheckKind, FEWEST, Whiteness, Window, averaging_lengths, discrepancy_windows,
    effective_sample_size, whiteness,
};
pub use report::{
    Described, Discovery, FoundEffect, FoundLaw, FoundRegime, Gap, NearForm, OutputTrace,
    ParameterValue, PlainCause, PlainCauses, PlainKind, Power, Ranked, RecordingTrace,
    RecordingsValue, RivalLaw, Screened, StuckSince, Unexplained,
};
pub use request::{DiscoverError, Request};
pub use search::{Alternative, Evidence, Verdict};
