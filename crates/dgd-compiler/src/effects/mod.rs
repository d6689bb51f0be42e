//! Effects: small files that change a model, and their application.
//!
//! An effect adds items and changes uses of a name, an output or an equation of the model. [`apply`] makes an ordinary
//! tree of a model's tree and some effects, so that all later stages treat it like any model; [`write()`] writes it as
//! text that keeps the text of the model's author.
//!
//! | step | function | from | to |
//! |---|---|---|---|
//! | 1 | [`Effect::read`] | a parsed file | [`Effect`]: complete and consistent |
//! | 2 | [`bind`] | `Effect`, `Model` | the arguments that a template can have there |
//! | 3 | [`apply`] | trees of the model, [`EffectApplication`]s | [`ModelWithEffects`]: the changed trees |
//! | 4 | [`write()`] | trees before and after | text |
//!
//! [`EffectReach`] decides which effects can be blended in together.

mod apply;
mod bind;
mod blend;
mod declared;
mod exclusive;
mod instance;
mod open;
mod read;
mod signs;
mod splice;
mod units;
mod write;

#[cfg(test)]
mod tests;

use crate::source::{SourceId, Span};
use crate::syntax::ast::{Ast, EffectKind, EffectTarget, Name};

pub use apply::apply;
pub use bind::bind;
pub use exclusive::EffectReach;
pub use write::write;

/// An effect: its kind, its items and its changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Its name, which all its forms share.
    pub name: Name,
    /// Its form, if it has several.
    pub form: Option<Name>,
    /// Plant, sensor or input.
    pub kind: EffectKind,
    /// Doc comment above it.
    pub doc: Vec<String>,
    /// Its possible targets.
    pub target: EffectTarget,
    /// The file: items, and clauses after `effect`.
    pub ast: Ast,
}

impl Effect {
    /// Its name with its form: `booster_u_tubing/column`.
    pub fn full_name(&self) -> String {
        match &self.form {
            Some(form) => format!("{}/{}", self.name.text, form.text),
            None => self.name.text.clone(),
        }
    }
}

/// An effect with its arguments.
#[derive(Debug, Clone)]
pub struct EffectApplication<'a> {
    /// The effect.
    pub effect: &'a Effect,
    /// Names in the model, one for each argument of a template; none for an effect `on` a model.
    pub arguments: Vec<Name>,
    /// Place of the request, for errors that concern the whole.
    pub span: Span,
}

impl EffectApplication<'_> {
    /// Its source form: `gain_error(q_ssp)`.
    pub fn name(&self) -> String {
        let arguments: Vec<&str> = self.arguments.iter().map(|name| name.text.as_str()).collect();
        match arguments.as_slice() {
            [] => self.effect.full_name(),
            _ => format!("{}({})", self.effect.full_name(), arguments.join(", ")),
        }
    }
}

/// The share of an effect that acts in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EffectBlending {
    /// Full effect. Two plant effects that replace the same use are refused.
    Applied,
    /// No effect at the values of the parameters: those named by `null` have their null value, and an effect without
    /// `null` is blended in, new = old + λ (new − old), by a parameter λ that is zero. Effects on one use are stacked.
    Null,
    /// No effect because λ is zero, whatever the effect's `null`: for effects without a derivative at their null.
    Blended,
}

/// A model with effects.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelWithEffects {
    /// The model's tree, then those of its libraries, as stage 2 expects them.
    pub asts: Vec<Ast>,
    /// The items of each application, in the given order.
    pub brought: Vec<AddedItems>,
}

/// The items that one application added to a model, by their names there.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AddedItems {
    /// The application in source form.
    pub name: String,
    /// Doc comment of the effect.
    pub doc: Vec<String>,
    /// Names in the effect file with their names in the model, in the order written.
    pub names: Vec<(String, String)>,
    /// Parameters, in the order written, without the blend.
    pub parameters: Vec<String>,
    /// The parameters for which the effect has a `null`.
    pub null: Vec<String>,
    /// λ, if the effect is blended in.
    pub blend: Option<String>,
    /// The effect's file.
    pub source: SourceId,
}
