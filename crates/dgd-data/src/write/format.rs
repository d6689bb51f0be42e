//! Formats of table files, by the names of the files.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use dgd_runtime::signature::{FULL_BUILD, NamedChoice, choices};

use super::{HAS_PARQUET, save, save_parquet};
use crate::files::WriteError;

choices! {
    /// The format of a table file. Its name is the extension of the file.
    pub enum TableFormat {
        /// Comma-separated values.
        Csv = "csv",
        /// Apache Parquet.
        Parquet = "parquet",
        /// One document.
        Json = "json",
        /// One document per line.
        JsonLines = "jsonl" | "ndjson",
    }
}

/// Extensions of files that are not tables, or of unsupported formats.
const NOT_WRITTEN: [&str; 16] = [
    "svg", "png", "pdf", "html", "xlsx", "xls", "ods", "tsv", "dgd", "mat", "h5", "feather", "zip",
    "bz2", "xz", "zst",
];

/// Error: the name of a file is that of a format that is not written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UnwritableFormat {
    /// This build does not write Parquet.
    Parquet,
    /// The extension is that of something else.
    Other(String),
}

impl fmt::Display for UnwritableFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            UnwritableFormat::Parquet => write!(
                f,
                "this build does not write Parquet: write a `.csv` file, or install the whole program: `{FULL_BUILD}`"
            ),
            UnwritableFormat::Other(extension) => {
                let all: Vec<String> =
                    TableFormat::ALL.iter().map(|format| format!(".{format}")).collect();
                let (last, others) = all.split_last().unwrap_or_else(|| unreachable!("formats"));
                write!(
                    f,
                    "a table is written as {} or {last}, with .gz added to compress it, not as .{extension}",
                    others.join(", ")
                )
            }
        }
    }
}

impl std::error::Error for UnwritableFormat {}

impl TableFormat {
    /// Whether it is JSON, which has more than the table.
    pub fn is_document(self) -> bool {
        match self {
            TableFormat::Csv | TableFormat::Parquet => false,
            TableFormat::Json | TableFormat::JsonLines => true,
        }
    }

    /// The format of a file by its name, if that is the name of a table.
    pub fn from_path(path: &Path) -> Option<TableFormat> {
        TableFormat::from_name(&extension(path)?)
    }

    /// The format in which to write a file, by its name; `None` if that has no known extension.
    ///
    /// # Errors
    ///
    /// The name is that of another kind of file, or of one that this build does not write.
    pub fn to_write(path: &Path) -> Result<Option<TableFormat>, UnwritableFormat> {
        match (TableFormat::from_path(path), extension(path)) {
            (Some(TableFormat::Parquet), _) if !HAS_PARQUET => Err(UnwritableFormat::Parquet),
            (None, Some(other)) if NOT_WRITTEN.contains(&&*other) => {
                Err(UnwritableFormat::Other(other))
            }
            (format, _) => Ok(format),
        }
    }

    /// Writes rows to a file atomically. `write` writes them as CSV; the caller writes documents itself.
    pub fn save(
        self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), WriteError> {
        match self {
            TableFormat::Parquet => save_parquet(path, write),
            TableFormat::Csv | TableFormat::Json | TableFormat::JsonLines => save(path, write),
        }
    }
}

/// The extension of a file, before `.gz` and in lower case.
fn extension(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    plain.rsplit_once('.').map(|(_, extension)| extension.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_file_gives_its_format() {
        for (name, format) in [
            ("a.csv", Ok(Some(TableFormat::Csv))),
            ("a.CSV.gz", Ok(Some(TableFormat::Csv))),
            ("a.json", Ok(Some(TableFormat::Json))),
            ("a.json.gz", Ok(Some(TableFormat::Json))),
            ("a.jsonl", Ok(Some(TableFormat::JsonLines))),
            ("a.ndjson", Ok(Some(TableFormat::JsonLines))),
            ("a", Ok(None)),
            ("run.2", Ok(None)),
            ("a.svg", Err(UnwritableFormat::Other("svg".to_owned()))),
        ] {
            assert_eq!(TableFormat::to_write(Path::new(name)), format, "{name}");
        }
        let parquet = TableFormat::to_write(Path::new("a.parquet"));
        assert_eq!(parquet.is_ok(), HAS_PARQUET);
    }
}
