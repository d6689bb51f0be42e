//! The contenders of a comparison, as a user names them.
//!
//! | text | contender |
//! |---|---|
//! | `m.dgd` | a model |
//! | `m.dgd@flow=static` | the model with a choice of a variant |
//! | `m.dgd+leak` | the model with an effect, named as for `--apply` |
//! | `fitted` | a folder of results: the fitted or corrected model in it |

use std::path::{Path, PathBuf};

use dgd_data::FileSystem;

use crate::error::{UnusableFile, UsageError, WorkError};
use crate::request::ModelChoices;

/// File extension of models.
const ENDING: &str = ".dgd";

/// A model and its choices.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NamedModel {
    /// As it was typed.
    pub name: String,
    pub model: PathBuf,
    pub choices: ModelChoices,
}

/// The model file or the folder that a contender names.
pub fn model_of(text: &str) -> PathBuf {
    PathBuf::from(split(text).0)
}

/// The path, and the choices after it.
fn split(text: &str) -> (&str, &str) {
    let ends = text.match_indices(ENDING).map(|(at, _)| at + ENDING.len());
    let mut ends = ends.filter(|end| text[*end..].starts_with(['@', '+']));
    ends.next().map_or((text, ""), |end| text.split_at(end))
}

/// All contenders: at least two, without duplicates.
pub(super) fn all(texts: &[String], files: &dyn FileSystem) -> Result<Vec<NamedModel>, WorkError> {
    if texts.len() < 2 {
        return Err(UsageError::TooFewContenders.into());
    }
    let named: Vec<NamedModel> =
        texts.iter().map(|text| named(text, files)).collect::<Result<_, WorkError>>()?;
    for (k, one) in named.iter().enumerate() {
        if named[..k]
            .iter()
            .any(|other| (&other.model, &other.choices) == (&one.model, &one.choices))
        {
            return Err(UsageError::ContenderTwice(one.name.clone()).into());
        }
    }
    Ok(named)
}

fn named(text: &str, files: &dyn FileSystem) -> Result<NamedModel, WorkError> {
    let (path, rest) = split(text);
    let mut choices = ModelChoices::default();
    let mut rest = rest;
    while let Some(sign) = rest.chars().next() {
        let end = rest[1..].find(['@', '+']).map_or(rest.len(), |end| end + 1);
        let word = rest[1..end].trim().to_owned();
        if word.is_empty() {
            return Err(UsageError::NothingBehind { text: text.to_owned(), sign }.into());
        }
        if sign == '@' {
            choices.variant.push(word);
        } else {
            choices.apply.push(word);
        }
        rest = &rest[end..];
    }
    let model = if files.is_folder(Path::new(path)) {
        model_in(Path::new(path), files)?
    } else {
        PathBuf::from(path)
    };
    Ok(NamedModel { name: text.to_owned(), model, choices })
}

/// The one model in a folder of results; effects and formulas that were only described do not count.
fn model_in(folder: &Path, files: &dyn FileSystem) -> Result<PathBuf, WorkError> {
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let is_model = |path: &PathBuf| {
        name(path).is_some_and(|name| {
            let is_apart = name.starts_with("described_") || name.starts_with("law_");
            name.ends_with(ENDING) && !is_apart
        })
    };
    let entries = files.entries(folder).into_iter().filter(|entry| !entry.is_folder);
    let mut models: Vec<PathBuf> = entries.map(|entry| entry.path).filter(is_model).collect();
    models.sort();
    match models.as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(UnusableFile::NoModel(folder.to_owned()).into()),
        several => {
            let (folder, count) = (folder.to_owned(), several.len());
            Err(UnusableFile::SeveralModels { folder, count }.into())
        }
    }
}

impl NamedModel {
    /// Whether this is the other contender without some of its effects.
    pub(super) fn is_within(&self, other: &NamedModel) -> bool {
        let effects = &other.choices.apply;
        self.model == other.model
            && self.choices.variant == other.choices.variant
            && self.choices.apply.len() < effects.len()
            && self.choices.apply.iter().all(|effect| effects.contains(effect))
    }
}

#[cfg(test)]
mod tests {
    use dgd_data::InMemory;

    use super::*;

    #[test]
    fn variants_and_effects_stand_behind_the_model() {
        let files = InMemory::default()
            .with_file("out/tank.dgd", "")
            .with_file("out/law_1.dgd", "")
            .with_file("out/result.json", "")
            .with_file("two/a.dgd", "")
            .with_file("two/b.dgd", "");
        let parse = |text: &str| named(text, &files).unwrap_or_else(|error| panic!("{error}"));
        let both = parse("a/m.dgd@flow=static+leak(T, heat)+effects/x.dgd");
        assert_eq!(both.model, Path::new("a/m.dgd"));
        assert_eq!(both.choices.variant, ["flow=static"]);
        assert_eq!(both.choices.apply, ["leak(T, heat)", "effects/x.dgd"]);
        assert_eq!(parse("out").model, Path::new("out/tank.dgd"));
        assert!(named("two", &files).is_err() && named("m.dgd+", &files).is_err());
        assert!(all(&["m.dgd".into(), "m.dgd".into()], &files).is_err());
        assert!(all(&["m.dgd".into()], &files).is_err());
        let one = parse("a/m.dgd@flow=static+leak(T, heat)");
        assert!(one.is_within(&both) && !both.is_within(&one) && !one.is_within(&one));
        assert!(!parse("a/m.dgd+leak(T, heat)").is_within(&both), "another variant");
        assert_eq!(model_of("a/m.dgd+effects/x.dgd"), Path::new("a/m.dgd"));
    }
}
