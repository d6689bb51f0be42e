//! Tables as files: their formats, and where the rows of an incomplete run go.

use std::path::{Path, PathBuf};

use dgd_data::write::{TableFormat, save};
use dgd_work::json_text;
use serde_json::Value;

use crate::args::OutputFormat;
use crate::failure::CommandError;

/// The format of a table file by its name or, if that has no known extension, by `--format`.
///
/// # Errors
///
/// The name is that of another kind of file, or of one that this build does not write.
pub(crate) fn table_format(path: &Path, format: OutputFormat) -> Result<TableFormat, CommandError> {
    let refused = |error| CommandError::Usage(format!("`-o {}`: {error}", path.display()));
    Ok(TableFormat::to_write(path).map_err(refused)?.unwrap_or(match format {
        OutputFormat::Text => TableFormat::Csv,
        OutputFormat::Json => TableFormat::Json,
    }))
}

/// `run.partial.csv` for `run.csv`, `run.partial.csv.gz` for `run.csv.gz`.
pub(crate) fn partial_path(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    let stem = plain.rfind('.').map_or(plain, |dot| &plain[..dot]);
    path.with_file_name(format!("{stem}.partial{}", &name[stem.len()..]))
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
    fn what_was_reached_is_kept_beside_the_file_asked_for() {
        let partial = |path: &str| partial_path(Path::new(path)).display().to_string();
        assert_eq!(partial("a/run.csv"), "a/run.partial.csv");
        assert_eq!(partial("run.1.csv.gz"), "run.1.partial.csv.gz");
        assert_eq!(partial("run"), "run.partial");
    }
}
