//! Effect files: their location, and their names in requests.
//!
//! | name | file |
//! |---|---|
//! | `path/to/file.dgd` | that file |
//! | `NAME` | `effects/NAME.dgd` beside the model, or the one file of the folder `effects/NAME/` |
//! | `NAME/FORM` | `effects/NAME/FORM.dgd` |
//!
//! Each may be followed by arguments: `'NAME(q)'`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use dgd_compiler::effects::{Effect, EffectApplication};
use dgd_compiler::source::{SourceId, SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::{Ast, EffectTarget, Name};
use dgd_compiler::syntax::parse;
use dgd_data::FileSystem;
use dgd_data::open::{FolderEntry, read_import};

use crate::error::{UnusableFile, UsageError, WorkError};
use crate::model::{Compilation, read_model};

/// The folder of a model's effects.
pub const FOLDER: &str = "effects";

/// File extension of effects.
const ENDING: &str = "dgd";

/// A requested effect, with its arguments.
#[derive(Debug)]
pub(crate) struct RequestedEffect {
    effect: Effect,
    arguments: Vec<Name>,
    span: Span,
}

impl RequestedEffect {
    pub(crate) fn application(&self) -> EffectApplication<'_> {
        EffectApplication {
            effect: &self.effect,
            arguments: self.arguments.clone(),
            span: self.span,
        }
    }
}

/// Reads the argument of an `--apply`, stored as the source `argument`.
pub(crate) fn asked(
    model: &Path,
    argument: SourceId,
    compilation: &mut Compilation<'_>,
) -> Result<Result<RequestedEffect, ErrorReported>, WorkError> {
    let text = compilation.sources.get(argument).text.clone();
    let (file, arguments) = words(&text, argument)?;
    let path = path_of(compilation.files, model, file)?;
    let ast = match parsed(&path, compilation)? {
        Ok(ast) => ast,
        Err(reported) => return Ok(Err(reported)),
    };
    let end = u32::try_from(text.len()).unwrap_or(u32::MAX);
    let span = Span { source: argument, start: 0, end };
    Ok(Effect::read(ast, &mut compilation.diagnostics).map(|effect| RequestedEffect {
        effect,
        arguments,
        span,
    }))
}

/// All effects of a folder and of the folders in it, in order of path.
///
/// # Errors
///
/// [`ErrorReported`] if a file cannot be read or is not an effect; the others are checked as well.
pub fn load_folder(
    files: &dyn FileSystem,
    folder: &Path,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Effect>, ErrorReported> {
    let mut effects = Vec::new();
    let mut failed = None;
    for (_, path) in effect_files(files, folder) {
        let name = path.display().to_string();
        let read = match read_import(files, &path) {
            Ok(text) => {
                let id = sources.add(SourceText { name, text });
                parse(id, sources, diagnostics).and_then(|ast| Effect::read(ast, diagnostics))
            }
            Err(error) => {
                let message = format!("cannot read this file: {error}");
                let source = sources.add(SourceText { name, text: String::new() });
                let span = Span { source, start: 0, end: 0 };
                Err(diagnostics.error(Diagnostic::new(Code::EmptyFile, span, message)))
            }
        };
        match read {
            Ok(effect) => effects.push(effect),
            Err(reported) => failed = Some(reported),
        }
    }
    failed.map_or(Ok(effects), Err)
}

/// An effect that may be applied to a model.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ApplicableEffect {
    /// Its argument for `--apply`: `NAME`, or `NAME/FORM` if there are several forms.
    pub name: String,
    /// Its documentation.
    pub doc: String,
}

/// The effects beside a model that are for it and need no arguments, by name. Unreadable files are skipped.
pub fn applicable(files: &dyn FileSystem, path: &Path, model: &str) -> Vec<ApplicableEffect> {
    let one = |(name, file): (String, PathBuf)| {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let text = read_import(files, &file).ok()?;
        let id = sources.add(SourceText { name: file.display().to_string(), text });
        let header = parse(id, &sources, &mut diagnostics).ok()?.effect?;
        match header.target {
            EffectTarget::Model(target) if target.text == model => {
                Some(ApplicableEffect { name, doc: header.doc.join(" ").trim().to_owned() })
            }
            EffectTarget::Model(_) | EffectTarget::Template(_) => None,
        }
    };
    effect_files(files, &folder_of(path)).into_iter().filter_map(one).collect()
}

/// The model of an effect, if it is at the usual place, above the folder of effects.
pub(crate) fn model_of(files: &dyn FileSystem, path: &Path, effect: &Effect) -> Option<PathBuf> {
    let EffectTarget::Model(name) = &effect.target else { return None };
    let file = format!("{}.{ENDING}", name.text);
    // effects/NAME.dgd or effects/NAME/FORM.dgd
    let above = path.ancestors().skip(2).take(2).map(|folder| folder.join(&file));
    above.into_iter().find(|model| files.is_file(model))
}

/// `effects` beside a model file.
pub(crate) fn folder_of(model: &Path) -> PathBuf {
    model.parent().unwrap_or_else(|| Path::new("")).join(FOLDER)
}

/// The syntax tree of a file.
pub(crate) fn parsed(
    path: &Path,
    compilation: &mut Compilation<'_>,
) -> Result<Result<Ast, ErrorReported>, WorkError> {
    let Compilation { files, sources, diagnostics } = compilation;
    let source = SourceText { name: path.display().to_string(), text: read_model(*files, path)? };
    let id = sources.add(source);
    Ok(parse(id, sources, diagnostics))
}

/// The file or name before any `(`, and the names between the parentheses.
fn words(text: &str, source: SourceId) -> Result<(&str, Vec<Name>), WorkError> {
    let Some((file, rest)) = text.split_once('(') else {
        return Ok((text.trim(), Vec::new()));
    };
    let wrong = || -> WorkError {
        let form = "EFFECT or EFFECT(NAME, …)";
        UsageError::form(Argument::Apply, text, form, "gain_error(q)").into()
    };
    let inside = rest.trim_end().strip_suffix(')').ok_or_else(wrong)?;
    let mut arguments = Vec::new();
    let mut position = file.len() + 1;
    for part in inside.split(',') {
        let name = part.trim();
        if name.is_empty() || name.contains(['(', ')']) {
            return Err(wrong());
        }
        let start = position + (part.len() - part.trim_start().len());
        let place = |position: usize| u32::try_from(position).unwrap_or(u32::MAX);
        let span = Span { source, start: place(start), end: place(start + name.len()) };
        arguments.push(Name { text: name.to_owned(), span });
        position += part.len() + 1;
    }
    Ok((file.trim(), arguments))
}

/// The file for a word of the command line.
fn path_of(files: &dyn FileSystem, model: &Path, word: &str) -> Result<PathBuf, WorkError> {
    let path = Path::new(word);
    if path.extension().is_some_and(|ending| ending == ENDING) {
        return Ok(path.to_owned());
    }
    let folder = folder_of(model);
    let effects = effect_files(files, &folder);
    let forms: Vec<&(String, PathBuf)> = effects
        .iter()
        .filter(|(name, _)| name == word || name.split('/').next() == Some(word))
        .collect();
    match forms.as_slice() {
        [(_, path)] => return Ok(path.clone()),
        [] => {}
        [..] => {
            if let Some((_, path)) = forms.iter().find(|(name, _)| name == word) {
                return Ok(path.clone());
            }
            let forms = forms.iter().map(|(name, _)| name.clone()).collect();
            return Err(UnusableFile::SeveralForms { name: word.to_owned(), forms }.into());
        }
    }
    let families = effects.iter().filter_map(|(name, _)| name.split('/').next());
    let names: BTreeSet<&str> =
        effects.iter().map(|(name, _)| name.as_str()).chain(families).collect();
    let mut begun = names.iter().copied().filter(|name| name.starts_with(word));
    let only = begun.next().filter(|_| begun.next().is_none());
    let near = only.or_else(|| suggestion(word, names.iter().copied())).map(str::to_owned);
    let known = effects.iter().map(|(name, _)| name.clone()).collect();
    Err(UnusableFile::NoEffect { name: word.to_owned(), folder, near, known }.into())
}

/// The effect files of a folder and of the folders in it, by name, in order: `NAME` or `NAME/FORM`.
fn effect_files(files: &dyn FileSystem, folder: &Path) -> Vec<(String, PathBuf)> {
    let mut effects = Vec::new();
    for entry in files.entries(folder) {
        let Some(name) = entry.path.file_stem().and_then(|name| name.to_str()) else { continue };
        if is_effect_file(&entry) {
            effects.push((name.to_owned(), entry.path));
            continue;
        }
        for form in files.entries(&entry.path).into_iter().filter(is_effect_file) {
            if let Some(form_name) = form.path.file_stem().and_then(|name| name.to_str()) {
                effects.push((format!("{name}/{form_name}"), form.path));
            }
        }
    }
    effects.sort();
    effects
}

/// Whether an entry looks like an effect file. Reading one that is not a regular file fails with a reason.
fn is_effect_file(entry: &FolderEntry) -> bool {
    entry.path.extension().is_some_and(|ending| ending == ENDING) && !entry.is_folder
}
