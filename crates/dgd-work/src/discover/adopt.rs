//! Adopts a described formula or effect of a discovery into the library of its model.

use std::path::{Path, PathBuf};

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::Effect;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse;
use dgd_data::FileSystem;
use dgd_data::open::read_text;
use serde::Serialize;

use crate::error::{UnusableFile, UsageError, WorkError};
use crate::model::effects::folder_of;
use crate::request::AdoptRequest;
use crate::result::discover::DiscoverDocument;
use crate::session::TaskContext;

/// A file for the library.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct AdoptedFile {
    /// Name of the effect in the library.
    pub name: String,
    /// The source file.
    pub from: PathBuf,
    /// Target path, in the folder `effects` next to the model.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

/// Names a formula or an effect that a discovery described and chooses its path in the library. Writes nothing.
///
/// # Errors
///
/// [`WorkError`]: the result has nothing to adopt or several such files, or the name is taken or not a name.
pub fn adopt(request: &AdoptRequest, session: TaskContext<'_>) -> Result<AdoptedFile, WorkError> {
    let files = session.files;
    let (from, folder) = chosen(request, files)?;
    let model = model_of(&folder, files)?;
    let original = text_of(&from, files)?;
    let text = renamed(&from, &original, &request.name)?;
    let beside = folder_of(&model);
    let path = beside.join(format!("{}.dgd", request.name));
    if read_text(files, &path).is_ok() || files.is_folder(&beside.join(&request.name)) {
        return Err(UsageError::EffectExists(request.name.clone()).into());
    }
    Ok(AdoptedFile { name: request.name.clone(), from, path, text })
}

/// The file to adopt, and the folder of the result.
fn chosen(request: &AdoptRequest, files: &dyn FileSystem) -> Result<(PathBuf, PathBuf), WorkError> {
    let source = &request.result;
    if !files.is_folder(source) {
        let folder = source.parent().map_or_else(PathBuf::new, Path::to_owned);
        return Ok((source.clone(), folder));
    }
    let result = result_of(source, files)?;
    let laws = result.unexplained.into_iter().filter_map(|place| Some(place.law?.file));
    let described = result.described.into_iter().map(|effect| effect.file);
    let named: Vec<String> = laws.chain(described).collect();
    match named.as_slice() {
        [] => Err(UnusableFile::NothingToAdopt(source.clone()).into()),
        [one] => Ok((source.join(one), source.clone())),
        several => {
            let files = several.iter().map(|file| source.join(file)).collect();
            Err(UsageError::SeveralToAdopt { folder: source.clone(), files }.into())
        }
    }
}

/// Path of the model, as it was given to the discovery.
fn model_of(folder: &Path, files: &dyn FileSystem) -> Result<PathBuf, WorkError> {
    Ok(PathBuf::from(result_of(folder, files)?.model_file))
}

fn result_of(folder: &Path, files: &dyn FileSystem) -> Result<DiscoverDocument, WorkError> {
    let path = folder.join("result.json");
    serde_json::from_str(&text_of(&path, files)?)
        .map_err(|error| UnusableFile::NotADiscovery { path, error }.into())
}

fn text_of(path: &Path, files: &dyn FileSystem) -> Result<String, WorkError> {
    read_text(files, path)
        .map_err(|reason| UnusableFile::Unreadable { path: path.to_owned(), reason }.into())
}

/// The text of an effect with its name replaced in the first line.
fn renamed(path: &Path, text: &str, name: &str) -> Result<String, WorkError> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let id = sources.add(SourceText { name: path.display().to_string(), text: text.to_owned() });
    let effect = parse(id, &sources, &mut diagnostics)
        .and_then(|ast| Effect::read(ast, &mut diagnostics))
        .map_err(|_| WorkError::diagnosed(&diagnostics, sources.clone()))?;
    let span = effect.name.span;
    let (start, end) = (span.start as usize, span.end as usize);
    let text = format!("{}{name}{}", &text[..start], &text[end..]);
    let is_read = {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let id = sources.add(SourceText { name: name.to_owned(), text: text.clone() });
        let ast = parse(id, &sources, &mut diagnostics);
        ast.and_then(|ast| Effect::read(ast, &mut diagnostics)).is_ok_and(|e| e.name.text == name)
    };
    if is_read { Ok(text) } else { Err(UsageError::NotAName(name.to_owned()).into()) }
}
