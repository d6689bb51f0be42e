//! The report on a fleet: which wells have missing terms, since when; their parameters over time; outliers among the
//! wells, and what to look at first.
//!
//! ```text
//!   results of pieces ─ reading ─► findings of each occasion ───────┬─ lacks ───► missing terms of a well, since when
//!                                                                   ├─ changes ─► parameters that changed
//!                                                                   └─ unlike ──► outliers among the wells
//!                                                 all of them ─ first ─► what to look at first ─► text, tables, pages
//! ```

mod bulk;
mod changes;
mod first;
mod lacks;
mod page;
mod reading;
mod table;
mod tail;
mod unlike;

use std::path::Path;

use crate::identity::BuildIdentity;
use crate::job::{Job, JobError};
use crate::name::PieceKeys;
use crate::store::{FleetStore, PieceState};
use crate::syntax::OptionSyntax;
use changes::ParameterChange;
use first::TriageReason;
use lacks::AssetLack;
use reading::PeriodResults;
use unlike::FleetComparison;

/// Files of every report; the pages of wells, `wells_1.html` and so on, are added.
pub const FILES: [&str; 3] = ["index.html", "wells.csv", "result.json"];

/// Significance level of all tests of a fleet together.
const CHANCE: f64 = 0.01;

/// The results of a fleet.
#[derive(Debug)]
pub struct Fleet {
    counts: FleetCounts,
    /// Parameters of all wells with their units, in order of appearance.
    parameters: Vec<(String, String)>,
    wells: Vec<AssetResults>,
    compared: FleetComparison,
    /// Wells with the reasons to look at them, the most urgent first.
    first: Vec<(usize, TriageReason)>,
    identity: BuildIdentity,
    seed: u64,
    /// Names of the models, with their number of wells.
    models: Vec<(String, usize)>,
}

/// Progress of a fleet.
#[derive(Debug, Clone, Copy, Default)]
struct FleetCounts {
    pieces: usize,
    done: usize,
    failed: usize,
}

/// The findings of a well.
#[derive(Debug)]
struct AssetResults {
    name: String,
    occasions: Vec<PeriodResults>,
    /// Missing terms at the last searched occasion.
    lacks: Vec<AssetLack>,
    changes: Vec<ParameterChange>,
}

impl AssetResults {
    /// The last occasion with estimates.
    fn latest(&self) -> Option<&PeriodResults> {
        self.occasions.iter().rev().find(|found| !found.estimates.is_empty())
    }
}

/// Collects the results of a job, as far as there are any.
///
/// # Errors
///
/// The results cannot be listed.
pub fn collect(
    job: &Job,
    store: &FleetStore,
    identity: &BuildIdentity,
    syntax: OptionSyntax,
) -> Result<Fleet, JobError> {
    let names = PieceKeys::new(&job.folder, identity, syntax);
    let there = store.all()?;
    let mut counts = FleetCounts { pieces: job.len(), ..FleetCounts::default() };
    let mut parameters: Vec<(String, String)> = Vec::new();
    let mut models: Vec<(String, usize)> = Vec::new();
    let mut wells = Vec::with_capacity(job.wells.len());
    for (w, well) in job.wells.iter().enumerate() {
        let model = well.model.as_ref().unwrap_or(&job.model);
        match models.iter_mut().find(|(known, _)| known == model) {
            Some((_, count)) => *count += 1,
            None => models.push((model.clone(), 1)),
        }
        let mut occasions = Vec::with_capacity(well.occasions.len());
        for (o, occasion) in well.occasions.iter().enumerate() {
            let end = job.first(w, o) + job.todo.iter().map(|one| one.kinds.len()).sum::<usize>();
            let mut results = Vec::new();
            for piece in (job.first(w, o)..end).filter_map(|index| job.piece(index)) {
                let name = names.key(&piece);
                let state = there.get(&name).copied();
                counts.done += usize::from(state == Some(PieceState::Done));
                counts.failed += usize::from(state == Some(PieceState::Failed));
                let text = match state {
                    None => None,
                    Some(_) => store.read(&name)?.map(|(_, text)| text),
                };
                results.push((piece.kind, text));
            }
            let findings = PeriodResults::read(&occasion.when, &results);
            for (name, estimate) in &findings.estimates {
                if !parameters.iter().any(|(known, _)| known == name) {
                    parameters.push((name.clone(), estimate.unit.clone()));
                }
            }
            occasions.push(findings);
        }
        let lacks = lacks::collect(&occasions);
        wells.push(AssetResults { name: well.name.clone(), occasions, lacks, changes: Vec::new() });
    }
    changes::find(&mut wells);
    let compared = unlike::compare(&wells, &parameters);
    let first = first::order(&wells, &compared, &parameters);
    let (identity, seed) = (identity.clone(), job.seed);
    Ok(Fleet { counts, parameters, wells, compared, first, identity, seed, models })
}

impl Fleet {
    /// The files of its report; `command` reproduces them.
    pub fn files(&self, command: &str) -> Vec<(String, Vec<u8>)> {
        let mut files = page::all(self, command);
        files.push((FILES[1].to_owned(), table::csv(self).into_bytes()));
        files.push((FILES[2].to_owned(), dgd_work::json_text(&self.to_json()).into_bytes()));
        files
    }

    /// Pages of an earlier report in the folder that this report no longer has.
    pub fn stale(&self, folder: Option<&Path>) -> Vec<String> {
        let names = (page::count(self) + 1..).map(page::name);
        let is_there = |name: &String| folder.is_some_and(|folder| folder.join(name).is_file());
        names.take_while(is_there).collect()
    }
}
