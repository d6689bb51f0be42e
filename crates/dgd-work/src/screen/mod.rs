//! Screens recordings for faults before anything is fitted to them.
//!
//! ```text
//!   files ─ tables ─ units ─ dgd-screen ─┬─ notice: findings in the user's words
//!                                        │   against_model, balances: findings of a model
//!                                        └─ summary (terminal), json, figure, page, tables (steady.csv)
//! ```

mod against_model;
mod balances;
mod figure;
mod json;
mod notice;
mod page;
mod prediction;
mod summary;
mod tables;
mod units;

use std::path::{Path, PathBuf};

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_compiler::source::SourceMap;
use dgd_data::files::ResultFolder;
use dgd_data::{DataTable, FileSystem, ReadOptions};
use dgd_identify::Total;
use dgd_plot::{Figure, MathText};
use dgd_runtime::Options;
use dgd_screen::redundant::PairComparison;
use dgd_screen::{Channel, ScreenOptions, ScreenedRecord, Screening, Severity, TimeStretch, kin};
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::error::{TaskEnd, UsageError, WorkError};
use crate::model::{LoadedModel, load};
use crate::output::json_text;
use crate::output::provenance::{DataFile, Provenance};
use crate::request::ScreenRequest;
use crate::session::TaskContext;
use against_model::ScreenModel;
use notice::{difference_unit, unit_of};

pub use notice::{Amount, Notice};

/// Recordings with their faults.
#[derive(Debug)]
#[non_exhaustive]
pub struct ScreeningResults {
    /// Each recording.
    pub recordings: Vec<ScreenedRecording>,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
    is_check: bool,
    command: String,
}

/// Screens recordings, and compares them with a model if one is given.
///
/// # Errors
///
/// [`WorkError`]: a file cannot be read, or a name does not exist.
pub fn screen(
    request: &ScreenRequest,
    session: TaskContext<'_>,
) -> Result<ScreeningResults, WorkError> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let mut tables = read(request, session.files, &mut sources, &mut diagnostics);
    if diagnostics.check().is_err() {
        return Err(WorkError::diagnosed(&diagnostics, sources));
    }
    let wishes = wishes(request, &tables)?;
    if units::unify(&mut tables, &wishes.same, &mut diagnostics).is_err() {
        return Err(WorkError::diagnosed(&diagnostics, sources));
    }
    session.listener.begins(false);
    let mut recordings = screen_all(tables, &wishes, session);
    let mut of_model = None;
    if let Some(model) = &request.model {
        let LoadedModel { compiled, sources, digest, .. } =
            load(model, &request.choices, &SensitivityDirections::None, session)?;
        of_model = Some(digest);
        session.spare(&sources)?;
        let system = dgd_execute::LoadedSystem::new(compiled.program);
        let model =
            ScreenModel { system: &system, dae: &compiled.dae, options: Options::default() };
        let n = recordings.len();
        for (k, one) in recordings.iter_mut().enumerate() {
            session.advanced("recordings compared with the model", k, Total::Exactly(n));
            model.look_at(one);
        }
    }
    session.listener.ends();
    let (is_check, command) = (request.check, request.command.clone());
    let data = recordings.iter().map(|one| DataFile::new(&one.path, one.table.digest));
    let provenance = Provenance::new(session, of_model, data.collect());
    Ok(ScreeningResults { recordings, provenance, is_check, command })
}

impl ScreeningResults {
    /// For programs.
    pub fn to_json(&self) -> Value {
        let mut result = json::to_json(&self.recordings);
        self.provenance.push_json(&mut result);
        result
    }

    /// As text; with the folder of the files, if they were written.
    pub fn to_text(&self, folder: Option<&Path>) -> String {
        summary::text(&self.recordings, folder)
    }

    /// A page, the result for programs, and steady intervals: [`FILES`].
    ///
    /// # Errors
    ///
    /// The page cannot be made.
    pub fn files(&self) -> Result<ResultFolder, WorkError> {
        let mut files = ResultFolder::default();
        let json = json_text(&self.to_json());
        let page = self.page()?.into_bytes();
        let steady = tables::steady(&self.recordings).into_bytes();
        let contents = [json.into_bytes(), page, steady];
        files.written.extend(FILES.map(str::to_owned).into_iter().zip(contents));
        Ok(files)
    }

    /// The page: the findings of all recordings, with a figure of each.
    ///
    /// # Errors
    ///
    /// The page cannot be made.
    pub fn page(&self) -> Result<String, WorkError> {
        page::write(self)
    }

    /// The columns of a recording, with findings shaded; those of the last recording if there is no such one.
    pub fn figure(&self, recording: usize) -> Figure {
        let last = self.recordings.len().saturating_sub(1);
        let one = self.recordings.get(recording.min(last));
        one.map_or_else(|| Figure::new(MathText::default(), Vec::new()), figure::figure)
    }

    /// The outcome: with `check`, a failure if there are faults.
    pub fn ended(&self) -> TaskEnd {
        let faults: usize = self.recordings.iter().map(|one| one.count(Severity::Fault)).sum();
        match faults {
            0 => TaskEnd::Done,
            _ if !self.is_check => TaskEnd::Done,
            1 => TaskEnd::Found("one fault was found".into()),
            n => TaskEnd::Found(format!("{n} faults were found").into()),
        }
    }
}

impl Serialize for ScreeningResults {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

/// A recording with all findings.
#[derive(Debug)]
#[non_exhaustive]
pub struct ScreenedRecording {
    /// Its file.
    pub path: PathBuf,
    /// Its contents.
    pub table: DataTable,
    /// Results of the tests.
    pub screening: Screening,
    /// Findings in words.
    pub notices: Vec<Notice>,
}

impl ScreenedRecording {
    /// Seconds since the first sample.
    pub fn times(&self) -> &[f64] {
        self.table.time.as_deref().unwrap_or_default()
    }

    /// Number of findings of this weight.
    pub fn count(&self, weight: Severity) -> usize {
        self.notices.iter().filter(|notice| notice.weight == weight).count()
    }
}

/// Options of the request in addition to the files.
#[derive(Debug, Default)]
struct ScreenSettings {
    /// Names of columns that measure the same quantity.
    pub same: Vec<[String; 2]>,
    pub window: Option<f64>,
    /// Largest slopes in steady state, per second.
    pub rest: Vec<(String, f64)>,
}

/// All recordings, with columns renamed as the user asked; mistakes are reported.
fn read(
    request: &ScreenRequest,
    files: &dyn FileSystem,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Vec<(PathBuf, DataTable)> {
    let mut tables = Vec::with_capacity(request.data.len());
    for path in &request.data {
        let reading = ReadOptions::default().as_it_is().renamed(&request.rename);
        let Ok(table) = reading.read(files, path, sources, diagnostics) else {
            continue;
        };
        // Rows without a time are not a recording.
        if table.recording(diagnostics).is_ok() {
            tables.push((path.clone(), table));
        }
    }
    tables
}

/// The options, with existing names.
fn wishes(
    request: &ScreenRequest,
    tables: &[(PathBuf, DataTable)],
) -> Result<ScreenSettings, WorkError> {
    let mut known: Vec<&str> =
        tables.iter().flat_map(|(_, table)| &table.columns).map(|c| c.name.as_str()).collect();
    known.sort_unstable();
    known.dedup();
    let verify = |argument: Argument, name: &str| {
        if known.contains(&name) {
            return Ok(name.to_owned());
        }
        let known = known.iter().map(|&name| name.to_owned()).collect();
        let (given, kind, name) = (Some(argument.into()), "column", name.to_owned());
        Err(WorkError::from(UsageError::Unknown { given, kind, name, known }))
    };
    let mut same = Vec::new();
    for text in &request.same {
        let names: Vec<String> = text
            .split(',')
            .map(|name| verify(Argument::Same, name.trim()))
            .collect::<Result<_, WorkError>>()?;
        if names.len() < 2 {
            return Err(UsageError::OneName(Argument::Same.with(text)).into());
        }
        for (at, one) in names.iter().enumerate() {
            for other in &names[at + 1..] {
                let has_both = |(_, table): &(PathBuf, DataTable)| {
                    table.column(one).is_some() && table.column(other).is_some()
                };
                if !tables.iter().any(has_both) {
                    return Err(UsageError::NeverTogether([one.clone(), other.clone()]).into());
                }
                same.push([one.clone(), other.clone()]);
            }
        }
    }
    let mut rest = Vec::new();
    for text in &request.rest {
        let parsed = text.split_once('=').and_then(|(name, rate)| {
            let rate: f64 = rate.trim().parse().ok()?;
            (rate.is_finite() && rate > 0.0).then_some((name.trim(), rate))
        });
        let Some((name, rate)) = parsed else {
            let form = "NAME=RATE, a positive change per second in the column's unit";
            return Err(UsageError::form(Argument::Rest, text, form, "q_ssp=2").into());
        };
        rest.push((verify(Argument::Rest, name)?, rate));
    }
    Ok(ScreenSettings { same, window: request.window, rest })
}

/// Screens recordings, in which columns of one name, or of one quantity, have one unit. A conclusion from one recording
/// about two columns with similar names holds for all.
fn screen_all(
    tables: Vec<(PathBuf, DataTable)>,
    wishes: &ScreenSettings,
    session: TaskContext<'_>,
) -> Vec<ScreenedRecording> {
    let units: Vec<Vec<String>> = tables
        .iter()
        .map(|(_, table)| table.columns.iter().map(|c| unit_of(c.unit.as_ref())).collect())
        .collect();
    let records: Vec<ScreenedRecord<'_>> =
        tables.iter().zip(&units).map(|((_, table), units)| record(table, units)).collect();
    let (mut alike, mut different): (Vec<[String; 2]>, Vec<[String; 2]>) = (Vec::new(), Vec::new());
    if tables.len() > 1 {
        for record in &records {
            for pair in kin(record, &ScreenOptions::default()) {
                let names = pair.channels.map(|i| record.channels[i].name.to_owned());
                match pair.compared {
                    PairComparison::Same(comparison) if comparison.gain.is_some() => {
                        alike.push(names);
                    }
                    PairComparison::Different { .. } => different.push(names),
                    PairComparison::Same(_) | PairComparison::Unknown => {}
                }
            }
        }
        // Columns that differ in any recording are not sensors of one quantity, unless the user pairs them.
        alike.retain(|names| !different.contains(names));
    }
    let screenings: Vec<Screening> = records
        .iter()
        .enumerate()
        .map(|(k, record)| {
            session.advanced("recordings", k, Total::Exactly(records.len()));
            let position = |name: &String| record.channels.iter().position(|c| c.name == name);
            let pairs = |names: &[[String; 2]]| -> Vec<[usize; 2]> {
                let pair = |[a, b]: &[String; 2]| {
                    let (a, b) = (position(a)?, position(b)?);
                    (a != b).then_some([a.min(b), a.max(b)])
                };
                names.iter().filter_map(pair).collect()
            };
            let limits =
                wishes.rest.iter().filter_map(|(name, rate)| Some((position(name)?, *rate)));
            let request = ScreenOptions {
                same: pairs(&wishes.same),
                alike: pairs(&alike),
                different: pairs(&different),
                window: wishes.window,
                limits: limits.collect(),
            };
            dgd_screen::screen(record, &request)
        })
        .collect();
    tables
        .into_iter()
        .zip(screenings)
        .map(|((path, table), screening)| {
            let mut notices = of_reading(&table);
            notices.extend(screening.findings.iter().map(|f| notice::notice(&table, f)));
            ScreenedRecording { path, table, screening, notices }
        })
        .collect()
}

/// A table as input of `dgd-screen`.
fn record<'a>(table: &'a DataTable, units: &'a [String]) -> ScreenedRecord<'a> {
    let columns = table.columns.iter().zip(units);
    let channels =
        columns.map(|(c, unit)| Channel { name: &c.name, unit, values: &c.values }).collect();
    ScreenedRecord { times: table.time.as_deref().unwrap_or_default(), channels }
}

/// Notices from reading the file.
fn of_reading(table: &DataTable) -> Vec<Notice> {
    let mut notices = Vec::new();
    let mut add = |kind, channels: Vec<String>, text: String, advice: &str| {
        notices.push(Notice {
            kind,
            weight: Severity::Fault,
            channels,
            stretches: Vec::new(),
            amount: None,
            p_value: None,
            text,
            advice: advice.to_owned(),
        });
    };
    let disorder = &table.disorder;
    if let Some(text) = &disorder.backwards {
        let rows = match disorder.left_out {
            1 => "one row is".to_owned(),
            n => format!("{n} rows are"),
        };
        add(
            "time_backwards",
            Vec::new(),
            format!("time runs backwards: {text}; {rows} out of order"),
            "left out here; mend the clock or sort the rows before a fit",
        );
    } else if let Some(text) = &disorder.crowded {
        add(
            "crowded_time",
            Vec::new(),
            format!("more than two rows have the time `{text}`"),
            "keep one row of each time, or two where values jump",
        );
    }
    for column in &table.columns {
        let names = vec![column.name.clone()];
        if let Some(fault) = &column.fault {
            add("header", names.clone(), fault.message.clone(), "a column is headed `name [unit]`");
        }
        if let Some(cells) = &column.not_numbers {
            let (text, count) = (&cells.text, cells.count);
            let text =
                format!("`{}` has {count} cells that are not numbers: `{text}`", column.name);
            add("not_a_number", names, text, "empty them, or write decimals with a point");
        }
    }
    notices
}

/// Files of a folder of results.
pub const FILES: [&str; 3] = ["screen.json", "report.html", "steady.csv"];

/// All names as code.
pub(super) fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// The ends of an interval.
pub(super) fn ends(stretch: &TimeStretch) -> [f64; 2] {
    [stretch.from, stretch.until]
}

/// The unit of differences of a column of a table.
pub(super) fn apart(table: &DataTable, column: usize) -> String {
    difference_unit(table.columns[column].unit.as_ref())
}
