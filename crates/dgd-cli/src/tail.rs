//! Saves, plots and prints the result at the end of every command, and converts the outcome of its task.

use std::io::{self, Write};
use std::path::PathBuf;

use dgd_data::files::{ResultFolder, write_folder};
use dgd_work::{Ended, json_text};
use serde_json::Value;

use crate::console::{Console, print, print_text};
use crate::failure::CommandError;
use crate::picture::{self, Drawing};
use crate::table_file::{TableFormat, partial_path, save_json, save_rows};

/// The output of a command.
pub(crate) struct Shown<'a> {
    /// The result for programs, if any.
    pub json: Option<Value>,
    /// The content of `-o`.
    pub saved: Saved<'a>,
    /// Images and pages, by file.
    pub drawings: Vec<(PathBuf, Drawing)>,
    /// The text for standard output.
    pub printed: Printed,
    /// A remark about the result.
    pub closing: Option<String>,
    /// The outcome of the task.
    pub ended: Ended,
}

/// The content of `-o`.
pub(crate) enum Saved<'a> {
    /// The text that would be printed otherwise.
    Printed,
    /// A table.
    Table(Table<'a>),
    /// Files in a folder.
    Folder {
        /// The files.
        files: ResultFolder,
        /// Whether a remark reports their location.
        is_told: bool,
    },
    /// Nothing, or it was written before.
    Nothing,
}

/// A table that can be written.
pub(crate) struct Table<'a> {
    /// Writes it as CSV.
    pub write: &'a dyn Fn(&mut dyn Write) -> io::Result<()>,
    /// The JSON for programs if the file contains the table.
    pub details: Value,
    /// Number of its rows, if reported.
    pub rows: Option<usize>,
    /// Whether it contains the rows that a run reached before it stopped.
    ///
    /// The requested file is reserved for a complete run, so these rows go to another one: `run.partial.csv` instead of
    /// `run.csv`.
    pub is_partial: bool,
}

/// The text for standard output.
pub(crate) enum Printed {
    /// A text.
    Text(String),
    /// The table.
    Table,
    /// Nothing: images or files have it all.
    Nothing,
}

impl Shown<'_> {
    /// For a task with this outcome; the caller adds the rest.
    pub(crate) fn new(ended: Ended) -> Self {
        Shown {
            json: None,
            saved: Saved::Printed,
            drawings: Vec::new(),
            printed: Printed::Nothing,
            closing: None,
            ended,
        }
    }
}

/// Saves, plots and prints a result.
pub(crate) fn finish(shown: Shown<'_>, console: Console<'_>) -> Result<(), CommandError> {
    let Shown { json, saved, drawings, printed, closing, ended } = shown;
    let is_document = save(&saved, json.as_ref(), &printed, console)?;
    for (path, drawing) in &drawings {
        picture::save(drawing, path, console)?;
    }
    match (&saved, &json) {
        // The file contains it.
        (Saved::Printed, _) => {}
        (_, Some(_)) if is_document => {}
        (Saved::Table(table), Some(_)) if console.is_json() && console.out().is_some() => {
            print(&json_text(&table.details))?;
        }
        (_, Some(json)) if console.is_json() => print(&json_text(json))?,
        (Saved::Table(_), _) if console.out().is_some() => {}
        (Saved::Table(table), _) if matches!(printed, Printed::Table) => {
            let mut text = Vec::new();
            (table.write)(&mut text).map_err(|error| CommandError::Found(error.to_string()))?;
            print(&String::from_utf8_lossy(&text))?;
        }
        _ => {
            if let Printed::Text(text) = &printed {
                print_text(text)?;
            }
        }
    }
    if let Some(words) = closing {
        console.remark(&words);
    }
    CommandError::of(ended)
}

/// Writes the content of `-o`; returns whether that is a document, which contains everything for programs.
fn save(
    saved: &Saved<'_>,
    json: Option<&Value>,
    printed: &Printed,
    console: Console<'_>,
) -> Result<bool, CommandError> {
    match (saved, console.out()) {
        (Saved::Printed, _) => {
            match (json, printed) {
                (Some(json), _) if console.writes_json() => console.json(json)?,
                (_, Printed::Text(text)) => console.result(text)?,
                (_, Printed::Table | Printed::Nothing) => {}
            }
            Ok(false)
        }
        (Saved::Table(table), Some(path)) => {
            let partial = partial_path(path);
            let path = if table.is_partial { &partial } else { path };
            let format = console.table_format(path)?;
            match (format, json) {
                (TableFormat::Json, Some(json)) => save_json(path, json, true)?,
                (TableFormat::JsonLines, Some(json)) => save_json(path, json, false)?,
                _ => save_rows(path, format, |out| (table.write)(out))?,
            }
            let rows = table.rows.map_or_else(String::new, |rows| format!(" ({rows} rows)"));
            console.remark(&format!("wrote {}{rows}", path.display()));
            Ok(format.is_document())
        }
        (Saved::Folder { files, is_told }, Some(folder)) => {
            write_folder(folder, files)?;
            if *is_told {
                console.remark(&format!("wrote {}", folder.display()));
            }
            Ok(false)
        }
        (Saved::Table(_) | Saved::Folder { .. }, None) | (Saved::Nothing, _) => Ok(false),
    }
}
