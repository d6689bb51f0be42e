//! Lists effects that may be missing: effects and templates in, candidates and compiled structures out.
//!
//! A [`EffectCandidate`] is an effect of the library, or one of the [`templates()`] that fit any model, with its
//! arguments. A [`ModelStructure`] is the compiled [`BaseModel`] with some of them.

mod adapted;
mod balance;
mod candidates;
mod fields;
mod further_inputs;
mod levels;
mod number;
mod refused;
mod scale;
mod structure;
mod structure_id;
mod templates;

pub(crate) use adapted::{AdaptedTemplate, TemplateScales, adapted};
pub(crate) use candidates::{EffectCandidate, candidates, generic, unbound};
pub(crate) use further_inputs::{with_constant_inputs, with_further_inputs};
pub(crate) use levels::QuantityRanges;
pub(crate) use number::signed;
pub use scale::OutputScales;
pub(crate) use scale::is_weight;
pub use structure::BaseModel;
pub(crate) use structure::{CarriedValues, ModelStructure, StructureError};
pub(crate) use structure_id::{MOST_EFFECTS, StructureId};
pub use templates::templates;
