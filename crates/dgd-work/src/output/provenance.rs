//! Provenance of a result: inputs, seed and versions.

use std::path::Path;

use dgd_compiler::source::SourceMap;
use dgd_data::Sha256Digest;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::session::TaskContext;

/// Version of the schema of results, `docs/results.schema.json`.
///
/// It is incremented if a key is removed or changes its meaning; new keys leave it unchanged.
pub const SCHEMA_VERSION: u32 = 3;

/// Provenance of a result: equal provenances and requests give equal results. Digests are SHA-256, as `sha256:` and 64
/// hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "provenance"))]
#[non_exhaustive]
pub struct Provenance {
    /// Version of the schema of results: [`SCHEMA_VERSION`].
    #[cfg_attr(test, schemars(extend("enum" = [SCHEMA_VERSION])))]
    pub schema: u32,
    /// Version of dgd.
    pub version: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Digest of the model: its text, imports, effects, choices and settings.
    pub model: Option<String>,
    /// The data files.
    pub data: Vec<DataFile>,
}

/// A data file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct DataFile {
    /// As it was given.
    pub file: String,
    /// Digest of its bytes; none for a stream.
    pub digest: Option<String>,
}

impl DataFile {
    pub(crate) fn new(path: &Path, digest: Option<Sha256Digest>) -> Self {
        DataFile {
            file: path.display().to_string(),
            digest: digest.map(|digest| digest.to_string()),
        }
    }
}

impl Provenance {
    pub(crate) fn new(
        session: TaskContext<'_>,
        model: Option<String>,
        data: Vec<DataFile>,
    ) -> Self {
        Provenance {
            schema: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: session.seed,
            model,
            data,
        }
    }

    /// Adds it to a result for programs.
    pub(crate) fn push_json(&self, all: &mut Value) {
        if let Some(all) = all.as_object_mut() {
            all.insert("provenance".to_owned(), json!(self));
        }
    }
}

/// Digest of all texts that a model was compiled from; of a single text, that of the text.
pub(crate) fn of_model(sources: &SourceMap) -> String {
    let texts = sources.iter().map(|source| source.text.as_str());
    // A byte that texts cannot contain separates them.
    let separated = texts.enumerate().flat_map(|(k, text)| [if k == 0 { "" } else { "\0" }, text]);
    Sha256Digest::from_parts(separated).to_string()
}
