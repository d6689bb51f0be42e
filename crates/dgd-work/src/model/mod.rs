//! Loads a compiled model from a path and the choices of a request.

pub(crate) mod effects;
pub(crate) mod sets;

use std::path::{Path, PathBuf};

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::{Diagnostics, ErrorReported};
use dgd_compiler::effects::{
    EffectApplication, EffectBlending, ModelWithEffects, apply as apply_effects, write,
};
use dgd_compiler::model::{Model, ModelOptions, Setting, resolve};
use dgd_compiler::pipeline::{self, CompiledStages, SensitivityDirections, compile_asts};
use dgd_compiler::source::{SourceId, SourceMap, SourceText, Span};
use dgd_compiler::syntax;
use dgd_compiler::syntax::ast::{Ast, Name};
use dgd_data::FileSystem;
use dgd_data::open::{read_import, read_text};

use crate::error::{UnusableFile, UsageError, WorkError};
use crate::model::effects::asked;
use crate::output::provenance;
use crate::request::{FreeParameters, ModelChoices};
use crate::session::TaskContext;

/// A compiled model and its source texts.
#[non_exhaustive]
pub struct LoadedModel {
    /// Every stage of the compiler.
    pub compiled: CompiledStages,
    /// The source texts of the model, its imports and effects.
    pub sources: SourceMap,
    /// Digest of the source texts.
    pub digest: String,
    /// The syntax trees after effects were applied; `None` without effects.
    pub changed: Option<ChangedTrees>,
}

impl LoadedModel {
    /// A model compiled from the texts read so far.
    pub(crate) fn new(
        compiled: CompiledStages,
        sources: SourceMap,
        changed: Option<ChangedTrees>,
    ) -> Self {
        LoadedModel { digest: provenance::of_model(&sources), compiled, sources, changed }
    }
}

/// Trees to which effects were applied.
#[non_exhaustive]
pub struct ChangedTrees {
    /// The original trees: the model, then its libraries.
    pub before: Vec<Ast>,
    /// The trees with the effects applied.
    pub applied: ModelWithEffects,
}

impl ChangedTrees {
    /// The changed model as text; `sources` are its sources.
    pub fn text(&self, sources: &SourceMap) -> String {
        let ModelWithEffects { asts, brought } = &self.applied;
        write(&self.before[0], &asts[0], brought, sources)
    }
}

/// A compilation in progress, which collects diagnostics.
pub(crate) struct Compilation<'a> {
    pub files: &'a dyn FileSystem,
    pub sources: SourceMap,
    pub diagnostics: Diagnostics,
}

/// The syntax trees of a model and its libraries, and the changes by effects.
type ReadTrees = (Vec<Ast>, Option<ChangedTrees>);

impl<'a> Compilation<'a> {
    /// A compilation that reads these files.
    pub(crate) fn new(files: &'a dyn FileSystem) -> Self {
        Compilation { files, sources: SourceMap::default(), diagnostics: Diagnostics::default() }
    }

    /// Ends the compilation with the collected diagnostics.
    pub(crate) fn fail(self, _: ErrorReported) -> WorkError {
        WorkError::diagnosed(&self.diagnostics, self.sources)
    }

    /// Registers the value of an argument as a source, so that diagnostics can point to it.
    pub(crate) fn argument(&mut self, argument: Argument, text: &str) -> SourceId {
        self.sources.add_argument(argument, text.to_owned())
    }

    /// A name given by an argument.
    pub(crate) fn name(&mut self, argument: Argument, text: &str) -> Name {
        let source = self.argument(argument, text);
        let end = u32::try_from(text.len()).unwrap_or(u32::MAX);
        Name { text: text.to_owned(), span: Span { source, start: 0, end } }
    }

    /// The names of free and of fixed parameters.
    pub(crate) fn sought(&mut self, sought: &FreeParameters) -> (Vec<Name>, Vec<Name>) {
        let mut names = |argument: Argument, names: &[String]| -> Vec<Name> {
            names.iter().map(|name| self.name(argument, name.trim())).collect()
        };
        (names(Argument::Free, &sought.free), names(Argument::Fix, &sought.fix))
    }

    /// Variants and settings from outside the model file.
    pub(crate) fn options(&mut self, choices: &ModelChoices) -> Result<ModelOptions, WorkError> {
        let mut options = ModelOptions::default();
        for choice in &choices.variant {
            let Some((variant, chosen)) = choice.split_once('=') else {
                let form =
                    UsageError::form(Argument::Variant, choice, "NAME=CHOICE", "flow=static");
                return Err(form.into());
            };
            let variant = self.name(Argument::Variant, variant.trim());
            options.variants.push((variant, self.name(Argument::Variant, chosen.trim())));
        }
        for text in &choices.set {
            let source = self.argument(Argument::Set, text);
            if let Ok((name, value)) =
                syntax::parse_setting(source, &self.sources, &mut self.diagnostics)
            {
                options.settings.push(Setting { name, value });
            }
        }
        if choices.at_rest {
            options.starts_at_rest = Some(self.name(Argument::Start, "steady").span);
        }
        Ok(options)
    }

    /// Parses and resolves a model text that is or could be in a file.
    pub(crate) fn resolve(
        &mut self,
        path: &Path,
        text: String,
        options: &ModelOptions,
    ) -> Result<(Vec<Ast>, Model), ErrorReported> {
        let main = SourceText { name: path.display().to_string(), text };
        let files = self.files;
        let mut read = |path: &str| read_import(files, Path::new(path));
        let asts = pipeline::load(main, &mut read, &mut self.sources, &mut self.diagnostics)?;
        let model = resolve(&asts, options, &mut self.diagnostics)?;
        Ok((asts, model))
    }

    /// Reads a model file and its imports, and applies effects to it.
    pub(crate) fn read(
        &mut self,
        path: &Path,
        apply: &[String],
    ) -> Result<Result<ReadTrees, ErrorReported>, WorkError> {
        let sound_before = self.diagnostics.check();
        let files = self.files;
        let main = SourceText { name: path.display().to_string(), text: read_model(files, path)? };
        let (sources, diagnostics) = (&mut self.sources, &mut self.diagnostics);
        let mut read = |path: &str| read_import(files, Path::new(path));
        let asts = pipeline::load(main, &mut read, sources, diagnostics);
        let mut wanted = Vec::with_capacity(apply.len());
        for text in apply {
            let argument = self.argument(Argument::Apply, text);
            let effect = asked(path, argument, self)?;
            wanted.extend(effect.ok());
        }
        let asts =
            match sound_before.and(asts).and_then(|asts| self.diagnostics.check().map(|()| asts)) {
                Ok(asts) if !wanted.is_empty() => asts,
                other => return Ok(other.map(|asts| (asts, None))),
            };
        let applications: Vec<EffectApplication<'_>> =
            wanted.iter().map(|one| one.application()).collect();
        let applied =
            apply_effects(&asts, &applications, EffectBlending::Applied, &mut self.diagnostics);
        Ok(applied
            .map(|applied| (applied.asts.clone(), Some(ChangedTrees { before: asts, applied }))))
    }

    /// Compiles a model file whose text with effects is a source of its own, so that spans in the compiled model refer
    /// to one text.
    pub(crate) fn compile_text(
        &mut self,
        path: &Path,
        apply: &[String],
        options: &ModelOptions,
        directions: &SensitivityDirections,
    ) -> Result<Result<CompiledStages, ErrorReported>, WorkError> {
        let (asts, changed) = match self.read(path, apply)? {
            Ok(read) => read,
            Err(reported) => return Ok(Err(reported)),
        };
        Ok(match changed {
            None => compile_asts(asts, options, directions, &mut self.diagnostics),
            Some(changed) => {
                self.compile_source(path, changed.text(&self.sources), options, directions)
            }
        })
    }

    /// Compiles a text as if it were in a model file.
    pub(crate) fn compile_source(
        &mut self,
        path: &Path,
        text: String,
        options: &ModelOptions,
        directions: &SensitivityDirections,
    ) -> Result<CompiledStages, ErrorReported> {
        let main = SourceText { name: path.display().to_string(), text };
        let files = self.files;
        let mut read = |path: &str| read_import(files, Path::new(path));
        let asts = pipeline::load(main, &mut read, &mut self.sources, &mut self.diagnostics)?;
        compile_asts(asts, options, directions, &mut self.diagnostics)
    }

    /// Compiles a model file, with the requested effects.
    pub(crate) fn compile(
        &mut self,
        path: &Path,
        apply: &[String],
        options: &ModelOptions,
        directions: &SensitivityDirections,
    ) -> Result<Result<(CompiledStages, Option<ChangedTrees>), ErrorReported>, WorkError> {
        let (asts, changed) = match self.read(path, apply)? {
            Ok(read) => read,
            Err(reported) => return Ok(Err(reported)),
        };
        let compiled = compile_asts(asts, options, directions, &mut self.diagnostics);
        Ok(compiled.map(|compiled| (compiled, changed)))
    }
}

/// Compiles a model with variants, settings and effects, and with sensitivities to `directions`.
///
/// # Errors
///
/// [`WorkError`]: it cannot be read, or has mistakes.
pub fn load(
    path: &Path,
    choices: &ModelChoices,
    directions: &SensitivityDirections,
    session: TaskContext<'_>,
) -> Result<LoadedModel, WorkError> {
    let mut compilation = Compilation::new(session.files);
    let options = compilation.options(choices)?;
    match compilation.compile(path, &choices.apply, &options, directions)? {
        Ok((compiled, changed)) => Ok(LoadedModel::new(compiled, compilation.sources, changed)),
        Err(reported) => Err(compilation.fail(reported)),
    }
}

/// Digest of all texts of a model: its own, its imports, the applied effects, and those of further folders. For a model
/// that cannot be read, or has mistakes, the digest covers the part that was read.
pub fn digest_of_texts(
    path: &Path,
    apply: &[String],
    folders: &[PathBuf],
    files: &dyn FileSystem,
) -> String {
    let mut compilation = Compilation::new(files);
    // The caller that runs the model reports mistakes.
    let _ = compilation.read(path, apply);
    let Compilation { sources, diagnostics, .. } = &mut compilation;
    for folder in folders {
        let _ = effects::load_folder(files, folder, sources, diagnostics);
    }
    provenance::of_model(sources)
}

/// The text of a model file.
pub(crate) fn read_model(files: &dyn FileSystem, path: &Path) -> Result<String, WorkError> {
    read_text(files, path)
        .map_err(|reason| UnusableFile::Unreadable { path: path.to_owned(), reason }.into())
}
