//! Effects: small files that change a model, and what becomes of a model when they are applied.
//!
//! An effect brings items of its own and says which uses of a name, which output or which equation
//! of the model change. [`apply`] makes an ordinary tree of a model's tree and some effects, so that
//! all later stages work on it as on any model; [`write()`] makes a text of it that keeps
//! what the author of the model wrote.
//!
//! | step | function | from | to |
//! |---|---|---|---|
//! | 1 | [`Effect::read`] | a parsed file | [`Effect`]: it is complete and fits together |
//! | 2 | [`bind`] | `Effect`, `Model` | the arguments that a template can have there |
//! | 3 | [`apply`] | trees of the model, [`Application`]s | [`Applied`]: the changed trees |
//! | 4 | [`write()`] | trees before and after | text |
//!
//! [`Reach`] says which effects can be blended in together.

mod apply;
mod bind;
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
use crate::syntax::ast::{Ast, EffectKind, Name, Target};

pub use apply::apply;
pub use bind::bind;
pub use exclusive::Reach;
pub use write::write;

/// An effect: what it is, what it brings and what it changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// Its name, which all forms of it share.
    pub name: Name,
    /// Which realisation of it this is.
    pub form: Option<Name>,
    /// Plant, sensor or input.
    pub kind: EffectKind,
    /// Doc comment above it.
    pub doc: Vec<String>,
    /// What it can be applied to.
    pub target: Target,
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

/// An effect with the arguments it is applied to.
#[derive(Debug, Clone)]
pub struct Application<'a> {
    /// The effect.
    pub effect: &'a Effect,
    /// Names in the model, one for each argument of a template; none for an effect `on` a model.
    pub arguments: Vec<Name>,
    /// Where it was asked for, to say what is wrong with it as a whole.
    pub span: Span,
}

impl Application<'_> {
    /// As one writes it: `gain_error(q_ssp)`.
    pub fn name(&self) -> String {
        let arguments: Vec<&str> = self.arguments.iter().map(|name| name.text.as_str()).collect();
        match arguments.as_slice() {
            [] => self.effect.full_name(),
            _ => format!("{}({})", self.effect.full_name(), arguments.join(", ")),
        }
    }
}

/// How much of an effect stands in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blending {
    /// All of it. Two plant effects that replace the same use are refused.
    Applied,
    /// Nothing, at the values that the parameters have: those named by `null` have their null
    /// value, and an effect without `null` is blended in, new = old + λ (new − old), by a parameter
    /// λ that is zero. Effects on one use are stacked.
    Null,
    /// Nothing, by a λ that is zero, whatever the effect has a `null` for: for effects that have no
    /// derivative there.
    Blended,
}

/// A model with effects.
#[derive(Debug, Clone, PartialEq)]
pub struct Applied {
    /// The model's tree, then those of its libraries, as stage 2 takes them.
    pub asts: Vec<Ast>,
    /// What every application brought, in the order in which they were given.
    pub brought: Vec<Brought>,
}

/// What one application brought into a model, by the names that it has there.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Brought {
    /// The application as one writes it.
    pub name: String,
    /// Doc comment of the effect.
    pub doc: Vec<String>,
    /// Names in the effect file with their names in the model, in the order written.
    pub names: Vec<(String, String)>,
    /// Parameters, in the order written, without the blend.
    pub parameters: Vec<String>,
    /// Those of the parameters for which the effect has a `null`.
    pub null: Vec<String>,
    /// λ, where the effect is blended in.
    pub blend: Option<String>,
    /// The effect's file.
    pub source: SourceId,
}
