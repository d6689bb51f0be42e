//! Turns a finished search and the reported fits into a [`Discovery`].
//!
//! [`EffectReport`] reports an effect, [`reason()`] gives the reason for the verdict, [`corrected()`] the model's new
//! text; `account` has everything else.

mod account;
mod corrected;
mod described;
mod discovery;
mod found;
mod law;
mod model_spread;
mod plain;
mod power;
mod reason;
mod regime;

pub(crate) use account::{
    gap, given_up, left_over, not_tried, ranking_of, screened, traces, unexplained,
};
pub(crate) use corrected::corrected;
pub(crate) use described::described;
pub use discovery::{
    Discovery, FoundEffect, FoundLaw, FoundRegime, NearForm, OutputGap, OutputTrace,
    ParameterValue, PlainCause, PlainCauses, PlainKind, RankedStructure, RecordingTrace,
    RecordingsValue, ResemblingEffect, RivalLaw, ScreenedCandidate, StuckSince, UnexplainedError,
};
pub(crate) use found::{EffectReport, parameters};
pub(crate) use law::{found_law, rival_laws};
pub(crate) use model_spread::ModelSpread;
pub(crate) use plain::plain_causes;
pub use power::DetectionPower;
pub(crate) use power::power;
pub(crate) use reason::{reason, reason_of_law};
pub(crate) use regime::found_regime;
