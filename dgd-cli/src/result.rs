//! A table as a command's result: a file of CSV, Parquet or JSON, CSV text or JSON.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use dgd_runtime::{Event, IntegrateError, Solution, Unit};
use serde_json::{Value, json};

use crate::args::Format;
use crate::console::{Console, print};
use crate::data::WriteError;
use crate::data::write::{Written, save, save_parquet, write_table};
use crate::failure::CommandError;

/// A column of a result.
#[derive(Debug, Clone)]
pub(crate) struct NamedColumn {
    pub name: String,
    pub unit: Unit,
    /// Values, SI.
    pub values: Vec<f64>,
}

impl NamedColumn {
    pub(crate) fn new(name: &str, unit: &Unit, values: Vec<f64>) -> Self {
        NamedColumn { name: name.to_owned(), unit: unit.clone(), values }
    }
}

/// What a table is written as to a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TableFormat {
    Csv,
    Parquet,
    /// One document.
    Json,
    /// A document a line.
    JsonLines,
}

/// How files end that are not tables, or of a kind that is not written.
const NOT_WRITTEN: [&str; 16] = [
    "svg", "png", "pdf", "html", "xlsx", "xls", "ods", "tsv", "dgd", "mat", "h5", "feather", "zip",
    "bz2", "xz", "zst",
];

impl TableFormat {
    /// Whether it is JSON, which holds more than the table.
    pub(crate) fn is_document(self) -> bool {
        matches!(self, TableFormat::Json | TableFormat::JsonLines)
    }

    /// What a file is by its name, if that is the name of a table.
    pub(crate) fn named(path: &Path) -> Option<TableFormat> {
        match &*ending(path)? {
            "csv" => Some(TableFormat::Csv),
            "parquet" => Some(TableFormat::Parquet),
            "json" => Some(TableFormat::Json),
            "jsonl" | "ndjson" => Some(TableFormat::JsonLines),
            _ => None,
        }
    }

    /// What a file is by its name; where that says nothing, what `--format` asks for.
    ///
    /// # Errors
    ///
    /// The name is that of something else, which its readers would take it for.
    pub(crate) fn of(path: &Path, format: Format) -> Result<TableFormat, CommandError> {
        if let Some(named) = TableFormat::named(path) {
            return Ok(named);
        }
        match ending(path) {
            Some(ending) if NOT_WRITTEN.contains(&&*ending) => Err(CommandError::Usage(format!(
                "`-o {}`: a table is written as .csv, .parquet or .json, with .gz added to compress it, not as .{ending}",
                path.display()
            ))),
            _ => Ok(match format {
                Format::Text => TableFormat::Csv,
                Format::Json => TableFormat::Json,
            }),
        }
    }
}

/// How a file's name ends, before `.gz` and in small letters.
fn ending(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    plain.rsplit_once('.').map(|(_, ending)| ending.to_owned())
}

/// Writes a table: to `--out`, as CSV or JSON by its name, else as CSV to standard output, where it is left
/// out if a picture was drawn instead. With `--format json`, `details` go to standard output, with the columns
/// where no file has them.
pub(crate) fn write(
    console: Console<'_>,
    times: &[f64],
    columns: &[NamedColumn],
    details: &Value,
    drawn: bool,
) -> Result<(), CommandError> {
    write_to(console, console.out(), times, columns, details, drawn)
}

/// Writes the rows that a run reached before it stopped, and gives the error to end the command
/// with.
///
/// A file of the name asked for is that of a whole run, so these rows go into one beside it:
/// `run.csv` into `run.partial.csv`. JSON has the reason as `error`.
pub(crate) fn write_reached(
    console: Console<'_>,
    times: &[f64],
    columns: &[NamedColumn],
    mut details: Value,
    error: &IntegrateError,
) -> Result<(), CommandError> {
    let message = error.to_string();
    if let Some(details) = details.as_object_mut() {
        details.insert("error".to_owned(), json!(message));
    }
    let partial = console.out().map(partial_path);
    write_to(console, partial.as_deref(), times, columns, &details, false)?;
    Err(CommandError::Stopped(message))
}

/// `run.partial.csv` for `run.csv`, `run.partial.csv.gz` for `run.csv.gz`.
pub(crate) fn partial_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    let stem = plain.rfind('.').map_or(plain, |dot| &plain[..dot]);
    path.with_file_name(format!("{stem}.partial{}", &name[stem.len()..]))
}

fn write_to(
    console: Console<'_>,
    out: Option<&Path>,
    times: &[f64],
    columns: &[NamedColumn],
    details: &Value,
    drawn: bool,
) -> Result<(), CommandError> {
    let written: Vec<Written<'_>> = columns
        .iter()
        .map(|column| Written { name: &column.name, unit: &column.unit, values: &column.values })
        .collect();
    let whole = || {
        let columns: Vec<Value> = columns
            .iter()
            .map(|column| {
                let unit = &column.unit;
                let values: Vec<f64> = column.values.iter().map(|v| unit.from_si(*v)).collect();
                json!({ "name": column.name, "unit": unit.symbol, "values": values })
            })
            .collect();
        let mut all = details.clone();
        if let Some(all) = all.as_object_mut() {
            all.insert("time".to_owned(), json!(times));
            all.insert("columns".to_owned(), json!(columns));
        }
        all
    };
    if let Some(path) = out {
        let format = console.table_format(path)?;
        match format {
            TableFormat::Csv | TableFormat::Parquet => {
                save_rows(path, format, |out| write_table(out, Some(times), &written))?;
            }
            TableFormat::Json => save_json(path, &whole(), true)?,
            TableFormat::JsonLines => save_json(path, &whole(), false)?,
        }
        console.remark(&format!("wrote {} ({} rows)", path.display(), times.len()));
        if console.is_json() && !format.is_document() {
            return print(&format!("{details:#}\n"));
        }
        return Ok(());
    }
    if console.is_json() {
        return print(&format!("{:#}\n", whole()));
    }
    if drawn {
        return Ok(());
    }
    let mut text = Vec::new();
    write_table(&mut text, Some(times), &written)
        .map_err(|error| CommandError::Found(error.to_string()))?;
    print(&String::from_utf8_lossy(&text))
}

/// Writes a table to a file, as CSV or as Parquet.
pub(crate) fn save_rows(
    path: &Path,
    format: TableFormat,
    write_csv: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    if format == TableFormat::Parquet {
        save_parquet(path, write_csv)
    } else {
        save(path, write_csv)
    }
}

/// Writes a document to a file, with its lines indented or as one line.
pub(crate) fn save_json(path: &Path, document: &Value, indented: bool) -> Result<(), CommandError> {
    let written = save(path, |out| {
        if indented { writeln!(out, "{document:#}") } else { writeln!(out, "{document}") }
    });
    Ok(written?)
}

/// The unit of a derivative.
pub(crate) fn quotient(of: &Unit, to: &Unit) -> Unit {
    let symbol = match &*to.symbol {
        "1" => of.symbol.to_string(),
        to if to.contains(['*', '/', '·', ' ']) => format!("{}/({to})", of.symbol),
        to => format!("{}/{to}", of.symbol),
    };
    Unit { symbol: symbol.into(), factor: of.factor / to.factor, offset: 0.0 }
}

/// Equal steps per sample, for `--format json`: none where steps were adaptive.
pub(crate) fn per_sample(solution: &Solution) -> Option<u32> {
    Some(solution.statistics.per_sample).filter(|n| *n > 0)
}

/// What happened at events, for `--format json`: the modes of a `when` have no names.
pub(crate) fn events(solution: &Solution) -> Vec<Value> {
    let event = |event: &Event| {
        json!({
            "t": event.t,
            "modes": event.automaton,
            "from": event.from,
            "to": event.to,
        })
    };
    solution.events.iter().map(event).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_what_its_name_says() {
        let of = |name: &str, format| TableFormat::of(Path::new(name), format).ok();
        for (name, text, json) in [
            ("a.csv", Some(TableFormat::Csv), Some(TableFormat::Csv)),
            ("a.CSV.gz", Some(TableFormat::Csv), Some(TableFormat::Csv)),
            ("a.json", Some(TableFormat::Json), Some(TableFormat::Json)),
            ("a.json.gz", Some(TableFormat::Json), Some(TableFormat::Json)),
            ("a.jsonl", Some(TableFormat::JsonLines), Some(TableFormat::JsonLines)),
            ("a", Some(TableFormat::Csv), Some(TableFormat::Json)),
            ("run.2", Some(TableFormat::Csv), Some(TableFormat::Json)),
            ("a.parquet", Some(TableFormat::Parquet), Some(TableFormat::Parquet)),
            ("a.svg", None, None),
        ] {
            assert_eq!((of(name, Format::Text), of(name, Format::Json)), (text, json), "{name}");
        }
    }

    #[test]
    fn what_was_reached_is_kept_beside_the_file_asked_for() {
        let partial = |path: &str| partial_path(Path::new(path)).display().to_string();
        assert_eq!(partial("a/run.csv"), "a/run.partial.csv");
        assert_eq!(partial("run.1.csv.gz"), "run.1.partial.csv.gz");
        assert_eq!(partial("run"), "run.partial");
    }
}
