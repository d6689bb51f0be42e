//! The files of a discovery: a page to read, a result for programs, the corrected model.
//!
//! ```text
//!   Discovery ─┬─ page (figures, equations, diff) ─► report.html
//!              ├─ result_json ──────────────────────► result.json
//!              ├─ corrected text, diff ─────────────► MODEL.dgd, MODEL.diff
//!              ├─ trace ────────────────────────────► unexplained.csv
//!              └─ kept apart ───────────────────────► described_1.dgd, law_1.dgd
//! ```
//!
//! Either all files appear or none; equal discoveries give equal files.

mod condition;
mod diff;
mod equations;
mod figures;
mod guess;
mod kept_apart;
mod law;
mod page;
mod plain;
mod result_json;
mod summary;
#[cfg(test)]
mod tests;
mod together;
mod trace;
mod verdict;

use std::path::{Path, PathBuf};

use dgd_data::FileSystem;
use dgd_data::files::ResultFolder;
use dgd_discover::Discovery;
use dgd_plot::{Figure, MathText};

use crate::error::WorkError;
use crate::output::provenance::Provenance;
use crate::request::ModelChoices;
use crate::result::discover::DiscoverDocument;
use figures::CorrectionState;
pub(crate) use summary::text as summary;

/// File with the missing terms that no effect explains.
const UNEXPLAINED: &str = "unexplained.csv";

/// Input of a report.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DiscoverySubject<'a> {
    /// The result.
    pub(crate) discovery: &'a Discovery,
    /// The file of the base model, as given.
    pub(crate) model: &'a Path,
    /// Its text.
    pub(crate) base: &'a str,
    /// The source files, with imports.
    pub(crate) files: &'a dyn FileSystem,
    /// Variants and settings.
    pub(crate) choices: &'a ModelChoices,
    /// Training recordings.
    pub(crate) training: &'a [PathBuf],
    /// Validation recordings.
    pub(crate) held_out: &'a [PathBuf],
    /// Reasons to doubt that the recordings can answer.
    pub(crate) reservations: &'a [String],
    /// The command line that reproduces the result.
    pub(crate) command: &'a str,
    /// Versions and digests of the inputs, if known.
    pub(crate) provenance: Option<&'a Provenance>,
}

impl DiscoverySubject<'_> {
    /// The model file's name without its extension.
    fn model_name(&self) -> String {
        self.model.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
    }
}

/// All files that a report about this model may have.
pub fn file_names(model: &Path) -> Vec<String> {
    let name = model.file_stem().unwrap_or_default().to_string_lossy();
    let fixed = ["report.html", "result.json", UNEXPLAINED].map(str::to_owned);
    let model_files = [format!("{name}.diff"), format!("{name}.dgd")];
    model_files.into_iter().chain(fixed).chain(kept_apart::names()).collect()
}

/// The result for programs.
pub(super) fn result(subject: &DiscoverySubject<'_>) -> DiscoverDocument {
    result_json::result(subject)
}

/// Residuals before and after the correction, on validation data if there is any.
pub(crate) fn gap_figure(discovery: &Discovery) -> Figure {
    let traces = &discovery.traces;
    let Some(trace) = traces.iter().find(|trace| trace.held_out).or(traces.first()) else {
        return figures::below_each_other(&[]);
    };
    let mut panels = figures::error_panels(trace, CorrectionState::from_discovery(discovery));
    // Shaded windows need a caption, and a figure on its own has none.
    for panel in &mut panels {
        panel.bands.clear();
    }
    let role = if trace.held_out { "validation" } else { "training" };
    let title = format!("Measured less simulated, {role} recording {}", trace.name);
    Figure { title: MathText::plain(&title), ..figures::below_each_other(&panels) }
}

/// The page to read.
pub(super) fn page(subject: &DiscoverySubject<'_>) -> Result<String, WorkError> {
    page::write(subject, &patch(subject))
}

/// The change of the model's file.
fn patch(subject: &DiscoverySubject<'_>) -> String {
    let file = format!("{}.dgd", subject.model_name());
    diff::unified(subject.base, &subject.discovery.corrected, &file)
}

pub(super) fn files(subject: &DiscoverySubject<'_>) -> Result<ResultFolder, WorkError> {
    let name = subject.model_name();
    let file = format!("{name}.dgd");
    let patch = patch(subject);
    let mut files = ResultFolder::default();
    let mut add = |name: &str, content: Vec<u8>| files.written.push((name.to_owned(), content));
    add("report.html", page::write(subject, &patch)?.into_bytes());
    add("result.json", result_json::write(subject).into_bytes());
    add(&format!("{name}.diff"), patch.into_bytes());
    add(&file, subject.discovery.corrected.clone().into_bytes());
    match trace::table(&subject.discovery.unexplained)? {
        Some(table) => add(UNEXPLAINED, table),
        None => files.removed.push(UNEXPLAINED.to_owned()),
    }
    let apart = kept_apart::files(subject.discovery);
    let gone = kept_apart::names().filter(|name| apart.iter().all(|(other, _)| other != name));
    files.removed.extend(gone);
    files.written.extend(apart.into_iter().map(|(name, text)| (name, text.into_bytes())));
    Ok(files)
}
