//! Syntax, names, units and structure of a model, in every variant.

mod dependent;
mod description;
mod unused;

use std::path::{Path, PathBuf};

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::{Diagnostics, ErrorReported};
use dgd_compiler::effects::Effect;
use dgd_compiler::model::Variant;
use dgd_compiler::pipeline::{SensitivityDirections, compile_asts};
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::error::WorkError;
use crate::model::Compilation;
use crate::model::effects::{model_of, parsed};
use crate::output::provenance::{self, Provenance};
use crate::request::{CheckRequest, ModelChoices};
use crate::session::TaskContext;

pub use description::{
    ArrayDescription, ConstantDescription, EquationDescription, EventDescription, InputDescription,
    ModeDescription, ModelDescription, ModesDescription, OutputDescription, ParameterDescription,
    PartDescription, SizeDescription, TransitionDescription, UnknownDescription, VariantChoices,
};

/// A checked model or effect without mistakes.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum CheckedModel {
    /// An effect without a model to apply it to.
    Effect {
        /// Its file.
        path: PathBuf,
        /// Its name.
        name: String,
    },
    /// A model, with the effects that were applied to it.
    Model(Box<ModelDescription>),
}

impl CheckedModel {
    /// For programs; `None` for an effect without a model.
    pub fn to_json(&self) -> Option<Value> {
        match self {
            CheckedModel::Effect { .. } => None,
            CheckedModel::Model(description) => serde_json::to_value(description).ok(),
        }
    }

    /// One line to print.
    pub fn summary(&self) -> String {
        match self {
            CheckedModel::Effect { path, name } => {
                format!("{}: effect `{name}` is sound by itself", path.display())
            }
            CheckedModel::Model(description) => description.summary.clone(),
        }
    }
}

impl Serialize for CheckedModel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

/// Checks a model, or an effect together with its model.
///
/// # Errors
///
/// [`WorkError::Diagnosed`] if it has mistakes.
pub fn check(request: &CheckRequest, session: TaskContext<'_>) -> Result<CheckedModel, WorkError> {
    let Some(effect) = effect(&request.model, session)? else {
        return check_model(&request.model, &request.choices, session);
    };
    let Some(model) = model_of(session.files, &request.model, &effect) else {
        let (path, name) = (request.model.clone(), effect.full_name());
        return Ok(CheckedModel::Effect { path, name });
    };
    // The effect is applied in addition to those of the request.
    let mut choices = request.choices.clone();
    choices.apply.push(request.model.display().to_string());
    check_model(&model, &choices, session)
}

/// The effect in a file; `None` if the file holds a model.
fn effect(path: &Path, session: TaskContext<'_>) -> Result<Option<Effect>, WorkError> {
    let mut compilation = Compilation::new(session.files);
    let read = match parsed(path, &mut compilation)? {
        Ok(ast) if ast.effect.is_none() => return Ok(None),
        Ok(ast) => Effect::read(ast, &mut compilation.diagnostics),
        Err(reported) => Err(reported),
    };
    match read {
        Ok(effect) => Ok(Some(effect)),
        Err(reported) => Err(compilation.fail(reported)),
    }
}

/// Checks a model with its effects applied.
fn check_model(
    path: &Path,
    choices: &ModelChoices,
    session: TaskContext<'_>,
) -> Result<CheckedModel, WorkError> {
    let mut compilation = Compilation::new(session.files);
    let options = compilation.options(choices)?;
    let compiled =
        match compilation.compile(path, &choices.apply, &options, &SensitivityDirections::None)? {
            Ok((compiled, _)) => compiled,
            Err(reported) => return Err(compilation.fail(reported)),
        };
    let digest = provenance::of_model(&compilation.sources);

    let mut notes = dependent::notes(&compiled);
    // Other choices of the variants must be sound too; they are tried one at a time.
    for Variant { name, choices, chosen } in &compiled.model.variants {
        if options.variants.iter().any(|(variant, _)| variant.text == *name) {
            continue;
        }
        for (_, choice) in choices.iter().enumerate().filter(|(i, _)| i != chosen) {
            let mut other = options.clone();
            let variant = compilation.name(Argument::Variant, name);
            other.variants.push((variant, compilation.name(Argument::Variant, choice)));
            let mut own_diagnostics = Diagnostics::default();
            // Each choice gets its own diagnostics, independent of the next.
            let other: Result<_, ErrorReported> = compile_asts(
                compiled.asts.clone(),
                &other,
                &SensitivityDirections::None,
                &mut own_diagnostics,
            );
            notes.extend(other.iter().flat_map(dependent::notes));
            for diagnostic in own_diagnostics.sorted() {
                compilation.diagnostics.error(diagnostic.clone());
            }
        }
    }
    if let Err(reported) = compilation.diagnostics.check() {
        return Err(compilation.fail(reported));
    }

    session.spare(&compilation.sources)?;
    let mut messages = Vec::new();
    for note in unused::notes(&compiled.asts, &compilation.sources).into_iter().chain(notes) {
        // A note that holds for every choice is given once.
        if messages.contains(&note.message) {
            continue;
        }
        messages.push(note.message.clone());
        session.note(&note, &compilation.sources);
    }
    let path = path.display().to_string();
    let provenance = Provenance::new(session, Some(digest), Vec::new());
    let description = ModelDescription::describe(&path, &compiled.model, &compiled.dae, provenance);
    Ok(CheckedModel::Model(Box::new(description)))
}
