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

pub use conditions::{ConditionKind, KnownKind, KnownQuantity, WindowCondition, condition};
pub use dgd_screen::noise::{NoiseColour, SensorNoise, quantisation_step, white_noise};
pub use discover::discover;
pub use guess::{
    CorrelatedQuantity, FormulaGuess, GuessedTerm, LawParameter, LawRange, TraceCourse,
};
pub use law::LawTerm;
pub use library::{BaseModel, OutputScales, templates};
pub use missing_input::{
    ClosedPlace, DeviationError, Deviations, MissingInput, MissingPlace, MissingTerms, NoSuchTerm,
    PlaceKind, ReconstructError, ReconstructedRecording, UnknownInput, inputs_with, reconstruct,
    unknown_input,
};
pub use noise::{
    CheckKind, FEWEST, SignalWindow, Whiteness, WhitenessCheck, averaging_lengths,
    discrepancy_windows, effective_sample_size, whiteness,
};
pub use report::{
    DetectionPower, Discovery, FoundEffect, FoundLaw, FoundRegime, NearForm, OutputGap,
    OutputTrace, ParameterValue, PlainCause, PlainCauses, PlainKind, RankedStructure,
    RecordingTrace, RecordingsValue, ResemblingEffect, RivalLaw, ScreenedCandidate, StuckSince,
    UnexplainedError,
};
pub use request::{DiscoverError, DiscoveryOptions};
pub use search::{Alternative, Evidence, Verdict};
