//! Turns a finished search and the reported fits into a [`Discovery`].
//!
//! [`Found`] reports an effect, [`reason()`] gives the reason for the verdict, [`corrected()`] the model's new text;
//! `account` has everything else.

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
    Described, Discovery, FoundEffect, FoundLaw, FoundRegime, Gap, NearForm, OutputTrace,
    ParameterValue, PlainCause, PlainCauses, PlainKind, Ranked, RecordingTrace, RecordingsValue,
    RivalLaw, Screened, StuckSince, Unexplained,
};
pub(crate) use found::{Found, parameters};
pub(crate) use law::{found_law, rival_laws};
pub(crate) use model_spread::ModelSpread;
pub(crate) use plain::plain_causes;
pub use power::Power;
pub(crate) use power::power;
pub(crate) use reason::{reason, reason_of_law};
pub(crate) use regime::found_regime;
