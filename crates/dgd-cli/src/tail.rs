//! Saves, plots and prints the result at the end of every command, and converts the outcome of its task.

use std::io::{self, Write};
use std::path::PathBuf;

use dgd_data::files::{ResultFolder, write_folder};
use dgd_data::write::TableFormat;
use dgd_work::{TaskEnd, json_text};
use serde_json::Value;

use crate::console::{Console, print, print_text};
use crate::failure::CommandError;
use crate::picture::{self, ImageContent};
use crate::table_file::{partial_path, save_json};

/// The output of a command.
pub(crate) struct CommandOutput<'a> {
    /// The result for programs, if any.
    pub json: Option<Value>,
    /// The content of `-o`.
    pub saved: SavedContent<'a>,
    /// Images and pages, by file.
    pub drawings: Vec<(PathBuf, ImageContent)>,
    /// The text for standard output.
    pub printed: PrintedText,
    /// A remark about the result.
    pub closing: Option<String>,
    /// The outcome of the task.
    pub ended: TaskEnd,
}

/// The content of `-o`.
pub(crate) enum SavedContent<'a> {
    /// The text that would be printed otherwise.
    Printed,
    /// A table.
    Table(WritableTable<'a>),
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
pub(crate) struct WritableTable<'a> {
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
pub(crate) enum PrintedText {
    /// A text.
    Text(String),
    /// The table.
    Table,
    /// Nothing: images or files have it all.
    Nothing,
}

impl CommandOutput<'_> {
    /// For a task with this outcome; the caller adds the rest.
    pub(crate) fn new(ended: TaskEnd) -> Self {
        CommandOutput {
            json: None,
            saved: SavedContent::Printed,
            drawings: Vec::new(),
            printed: PrintedText::Nothing,
            closing: None,
            ended,
        }
    }
}

/// Saves, plots and prints a result.
pub(crate) fn finish(shown: CommandOutput<'_>, console: Console<'_>) -> Result<(), CommandError> {
    let CommandOutput { json, saved, drawings, printed, closing, ended } = shown;
    let is_document = save(&saved, json.as_ref(), &printed, console)?;
    for (path, drawing) in &drawings {
        picture::save(drawing, path, console)?;
    }
    match (&saved, &json) {
        // The file contains it.
        (SavedContent::Printed, _) => {}
        (_, Some(_)) if is_document => {}
        (SavedContent::Table(table), Some(_)) if console.is_json() && console.out().is_some() => {
            print(&json_text(&table.details))?;
        }
        (_, Some(json)) if console.is_json() => print(&json_text(json))?,
        (SavedContent::Table(_), _) if console.out().is_some() => {}
        (SavedContent::Table(table), _) if matches!(printed, PrintedText::Table) => {
            let mut text = Vec::new();
            (table.write)(&mut text).map_err(|error| CommandError::Found(error.to_string()))?;
            print(&String::from_utf8_lossy(&text))?;
        }
        _ => {
            if let PrintedText::Text(text) = &printed {
                print_text(text)?;
            }
        }
    }
    if let Some(words) = closing {
        console.remark(&words);
    }
    CommandError::check(ended)
}

/// Writes the content of `-o`; returns whether that is a document, which contains everything for programs.
fn save(
    saved: &SavedContent<'_>,
    json: Option<&Value>,
    printed: &PrintedText,
    console: Console<'_>,
) -> Result<bool, CommandError> {
    match (saved, console.out()) {
        (SavedContent::Printed, _) => {
            match (json, printed) {
                (Some(json), _) if console.writes_json() => console.json(json)?,
                (_, PrintedText::Text(text)) => console.result(text)?,
                (_, PrintedText::Table | PrintedText::Nothing) => {}
            }
            Ok(false)
        }
        (SavedContent::Table(table), Some(path)) => {
            let partial = partial_path(path);
            let path = if table.is_partial { &partial } else { path };
            let format = console.table_format(path)?;
            match (format, json) {
                (TableFormat::Json, Some(json)) => save_json(path, json, true)?,
                (TableFormat::JsonLines, Some(json)) => save_json(path, json, false)?,
                (_, _) => format.save(path, |out| (table.write)(out))?,
            }
            let rows = table.rows.map_or_else(String::new, |rows| format!(" ({rows} rows)"));
            console.remark(&format!("wrote {}{rows}", path.display()));
            Ok(format.is_document())
        }
        (SavedContent::Folder { files, is_told }, Some(folder)) => {
            write_folder(folder, files)?;
            if *is_told {
                console.remark(&format!("wrote {}", folder.display()));
            }
            Ok(false)
        }
        (SavedContent::Table(_) | SavedContent::Folder { .. }, None)
        | (SavedContent::Nothing, _) => Ok(false),
    }
}
