//! Tables as files: CSV, Parquet or JSON.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use dgd_data::files::WriteError;
use dgd_data::write::{HAS_PARQUET, save, save_parquet};
use dgd_work::json_text;
use serde_json::Value;

use crate::args::OutputFormat;
use crate::failure::CommandError;

/// The format of a table file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TableFormat {
    Csv,
    Parquet,
    /// One document.
    Json,
    /// One document per line.
    JsonLines,
}

/// Extensions of files that are not tables, or of unsupported formats.
const NOT_WRITTEN: [&str; 16] = [
    "svg", "png", "pdf", "html", "xlsx", "xls", "ods", "tsv", "dgd", "mat", "h5", "feather", "zip",
    "bz2", "xz", "zst",
];

impl TableFormat {
    /// Whether it is JSON, which has more than the table.
    pub(crate) fn is_document(self) -> bool {
        matches!(self, TableFormat::Json | TableFormat::JsonLines)
    }

    /// The format of a file by its name, if that is the name of a table.
    pub(crate) fn named(path: &Path) -> Option<TableFormat> {
        match &*ending(path)? {
            "csv" => Some(TableFormat::Csv),
            "parquet" => Some(TableFormat::Parquet),
            "json" => Some(TableFormat::Json),
            "jsonl" | "ndjson" => Some(TableFormat::JsonLines),
            _ => None,
        }
    }

    /// The format of a file by its name or, if that has no known extension, by `--format`.
    ///
    /// # Errors
    ///
    /// The name is that of another kind of file, or of one that this build does not write.
    pub(crate) fn from_path(
        path: &Path,
        format: OutputFormat,
    ) -> Result<TableFormat, CommandError> {
        match TableFormat::named(path) {
            Some(TableFormat::Parquet) if !HAS_PARQUET => {
                return Err(CommandError::not_built("Parquet", "or write a `.csv` file"));
            }
            Some(named) => return Ok(named),
            None => {}
        }
        match ending(path) {
            Some(ending) if NOT_WRITTEN.contains(&&*ending) => Err(CommandError::Usage(format!(
                "`-o {}`: a table is written as .csv, .parquet or .json, with .gz added to compress it, not as .{ending}",
                path.display()
            ))),
            _ => Ok(match format {
                OutputFormat::Text => TableFormat::Csv,
                OutputFormat::Json => TableFormat::Json,
            }),
        }
    }
}

/// The extension of a file, before `.gz` and in lower case.
fn ending(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    plain.rsplit_once('.').map(|(_, ending)| ending.to_owned())
}

/// `run.partial.csv` for `run.csv`, `run.partial.csv.gz` for `run.csv.gz`.
pub(crate) fn partial_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    let stem = plain.rfind('.').map_or(plain, |dot| &plain[..dot]);
    path.with_file_name(format!("{stem}.partial{}", &name[stem.len()..]))
}

/// Writes a table to a file, as CSV or Parquet.
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

/// Writes a document to a file, indented or on one line.
pub(crate) fn save_json(path: &Path, document: &Value, indented: bool) -> Result<(), CommandError> {
    let written = save(path, |out| {
        if indented { write!(out, "{}", json_text(document)) } else { writeln!(out, "{document}") }
    });
    Ok(written?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_what_its_name_says() {
        let format_of = |name: &str, format| TableFormat::from_path(Path::new(name), format).ok();
        for (name, text, json) in [
            ("a.csv", Some(TableFormat::Csv), Some(TableFormat::Csv)),
            ("a.CSV.gz", Some(TableFormat::Csv), Some(TableFormat::Csv)),
            ("a.json", Some(TableFormat::Json), Some(TableFormat::Json)),
            ("a.json.gz", Some(TableFormat::Json), Some(TableFormat::Json)),
            ("a.jsonl", Some(TableFormat::JsonLines), Some(TableFormat::JsonLines)),
            ("a", Some(TableFormat::Csv), Some(TableFormat::Json)),
            ("run.2", Some(TableFormat::Csv), Some(TableFormat::Json)),
            ("a.svg", None, None),
        ] {
            assert_eq!(
                (format_of(name, OutputFormat::Text), format_of(name, OutputFormat::Json)),
                (text, json),
                "{name}"
            );
        }
        let parquet = HAS_PARQUET.then_some(TableFormat::Parquet);
        assert_eq!(format_of("a.parquet", OutputFormat::Text), parquet);
    }

    #[test]
    fn what_was_reached_is_kept_beside_the_file_asked_for() {
        let partial = |path: &str| partial_path(Path::new(path)).display().to_string();
        assert_eq!(partial("a/run.csv"), "a/run.partial.csv");
        assert_eq!(partial("run.1.csv.gz"), "run.1.partial.csv.gz");
        assert_eq!(partial("run"), "run.partial");
    }
}
