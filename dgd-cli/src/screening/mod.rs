//! What is wrong with recordings, as `dgd screen` says it.
//!
//! ```text
//!   files ─ tables ─ units ─ dgd-screen ─┬─ notice: findings in the user's words
//!                                        │   against_model, balances: what a model adds
//!                                        └─ summary (terminal), json, figure, page, tables (steady.csv)
//! ```

pub(crate) mod against_model;
pub(crate) mod args;
mod balances;
pub(crate) mod figure;
mod json;
pub(crate) mod notice;
mod page;
mod prediction;
mod summary;
mod tables;
pub(crate) mod units;

use std::path::{Path, PathBuf};

use dgd_screen::redundant::Compared;
use dgd_screen::{Channel, Record, Request, Screening, Stretch, Weight, kin, screen};

use crate::data::{Files, Table, write_folder};
use crate::failure::CommandError;

pub(crate) use json::to_json;
use notice::{Notice, difference_unit, unit_of};
pub(crate) use summary::text;

/// A recording with all that was found in it.
pub(crate) struct Screened {
    pub path: PathBuf,
    pub table: Table,
    pub screening: Screening,
    pub notices: Vec<Notice>,
}

impl Screened {
    /// Seconds since the first sample.
    pub(crate) fn times(&self) -> &[f64] {
        self.table.time.as_deref().unwrap_or_default()
    }

    pub(crate) fn count(&self, weight: Weight) -> usize {
        self.notices.iter().filter(|notice| notice.weight == weight).count()
    }
}

/// What the command line says besides the files.
#[derive(Debug, Default)]
pub(crate) struct Wishes {
    /// Names of columns that measure the same.
    pub same: Vec<[String; 2]>,
    pub window: Option<f64>,
    /// Largest slopes at rest, per second.
    pub rest: Vec<(String, f64)>,
}

/// Screens recordings, of which columns of one name have one unit, and those that measure the same.
/// What one recording says of two columns with alike names holds for all.
pub(crate) fn screen_all(tables: Vec<(PathBuf, Table)>, wishes: &Wishes) -> Vec<Screened> {
    let units: Vec<Vec<String>> = tables
        .iter()
        .map(|(_, table)| table.columns.iter().map(|c| unit_of(c.unit.as_ref())).collect())
        .collect();
    let records: Vec<Record<'_>> =
        tables.iter().zip(&units).map(|((_, table), units)| record(table, units)).collect();
    let (mut alike, mut different): (Vec<[String; 2]>, Vec<[String; 2]>) = (Vec::new(), Vec::new());
    if tables.len() > 1 {
        for record in &records {
            for pair in kin(record, &Request::default()) {
                let names = pair.channels.map(|i| record.channels[i].name.to_owned());
                match pair.compared {
                    Compared::Same(comparison) if comparison.gain.is_some() => alike.push(names),
                    Compared::Different { .. } => different.push(names),
                    Compared::Same(_) | Compared::Unknown => {}
                }
            }
        }
        // Two that move apart in one recording do not measure the same, unless the user says so.
        alike.retain(|names| !different.contains(names));
    }
    let screenings: Vec<Screening> = records
        .iter()
        .map(|record| {
            let at = |name: &String| record.channels.iter().position(|c| c.name == name);
            let pairs = |names: &[[String; 2]]| -> Vec<[usize; 2]> {
                let pair = |[a, b]: &[String; 2]| {
                    let (a, b) = (at(a)?, at(b)?);
                    (a != b).then_some([a.min(b), a.max(b)])
                };
                names.iter().filter_map(pair).collect()
            };
            let limits = wishes.rest.iter().filter_map(|(name, rate)| Some((at(name)?, *rate)));
            let request = Request {
                same: pairs(&wishes.same),
                alike: pairs(&alike),
                different: pairs(&different),
                window: wishes.window,
                limits: limits.collect(),
            };
            screen(record, &request)
        })
        .collect();
    tables
        .into_iter()
        .zip(screenings)
        .map(|((path, table), screening)| {
            let mut notices = of_reading(&table);
            notices.extend(screening.findings.iter().map(|f| notice::notice(&table, f)));
            Screened { path, table, screening, notices }
        })
        .collect()
}

/// A table as `dgd-screen` sees it.
fn record<'a>(table: &'a Table, units: &'a [String]) -> Record<'a> {
    let columns = table.columns.iter().zip(units);
    let channels =
        columns.map(|(c, unit)| Channel { name: &c.name, unit, values: &c.values }).collect();
    Record { times: table.time.as_deref().unwrap_or_default(), channels }
}

/// What reading the file came across.
fn of_reading(table: &Table) -> Vec<Notice> {
    let mut notices = Vec::new();
    let mut add = |kind, channels: Vec<String>, text: String, advice: &str| {
        notices.push(Notice {
            kind,
            weight: Weight::Fault,
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
pub(crate) const FILES: [&str; 3] = ["screen.json", "screen.html", "steady.csv"];

/// Writes the folder of results.
pub(crate) fn write(
    folder: &Path,
    screened: &[Screened],
    command: &str,
) -> Result<(), CommandError> {
    let mut files = Files::default();
    let json = format!("{:#}\n", to_json(screened));
    let page = page::write(screened, command)?.into_bytes();
    let contents = [json.into_bytes(), page, tables::steady(screened).into_bytes()];
    files.written.extend(FILES.map(str::to_owned).into_iter().zip(contents));
    Ok(write_folder(folder, &files)?)
}

/// All columns as words.
pub(super) fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// A stretch as two numbers.
pub(super) fn ends(stretch: &Stretch) -> [f64; 2] {
    [stretch.from, stretch.until]
}

/// The unit of differences of a column of a table.
pub(super) fn apart(table: &Table, column: usize) -> String {
    difference_unit(table.columns[column].unit.as_ref())
}
