//! From a finished search and the fits that are reported to a [`Discovery`].
//!
//! [`Found`] is all that is said of an effect, [`reason()`] the sentence that gives the verdict's reason,
//! [`corrected()`] the model's new text; the account has all that is said besides.

mod account;
mod corrected;
mod described;
mod discovery;
mod found;
mod model_spread;
mod power;
mod reason;

pub(crate) use account::{
    gap, given_up, left_over, not_tried, ranking_of, screened, traces, unexplained,
};
pub(crate) use corrected::corrected;
pub(crate) use described::described;
pub use discovery::{
    Described, Discovery, FoundEffect, Gap, OutputTrace, ParameterValue, Ranked, RecordingTrace,
    Screened, Unexplained,
};
pub(crate) use found::{Found, parameters};
pub(crate) use model_spread::ModelSpread;
pub use power::Power;
pub(crate) use power::power;
pub(crate) use reason::reason;
