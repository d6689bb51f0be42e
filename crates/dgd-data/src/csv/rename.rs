//! Renames columns of a file.

use std::str::FromStr;

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use dgd_compiler::source::{SourceMap, Span};

use crate::csv::header::{ColumnRename, CsvHeader, parse, unit_at};
use crate::csv::kept::ShownText;

/// Another name for a column, as in `P_RIS=p_r`, or with its unit, as in `P_RIS=p_r [barg]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rename {
    /// Its name in the file.
    pub column: String,
    /// Its new name, optionally with a unit, which replaces that of the file.
    pub name: String,
}

impl FromStr for Rename {
    type Err = String;

    fn from_str(text: &str) -> Result<Rename, String> {
        // Names of columns may contain an equals sign, names in models cannot.
        match text.rsplit_once('=').map(|(column, name)| (column.trim(), name.trim())) {
            Some((column, name)) if !column.is_empty() && !name.is_empty() => {
                Ok(Rename { column: column.to_owned(), name: name.to_owned() })
            }
            _ => Err("it needs the form COLUMN=NAME, as in `P_RIS=p_r`".to_owned()),
        }
    }
}

impl Rename {
    /// Parses the name and the unit in a source of their own.
    fn read(
        &self,
        sources: &mut SourceMap,
        diagnostics: &mut Diagnostics,
    ) -> Result<ColumnRename, ErrorReported> {
        let text = format!("{}={}", self.column, self.name);
        let byte = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
        let (start, end) = (byte(self.column.len() + 1), byte(text.len()));
        // One source serves all files.
        let source = sources.add_argument_once(Argument::Rename, text);
        let place = Span { source, start, end };
        let parsed = parse(&self.name);
        if let Some(fault) = parsed.fault {
            let message = format!("malformed column name: {fault}");
            return Err(diagnostics.error(
                Diagnostic::new(Code::MalformedHeader, place, message)
                    .help("a column is called `name`, or `name [unit]`"),
            ));
        }
        let unit = parsed.unit.map(|unit| unit_at(unit, place, sources)).transpose();
        let unit = unit.map_err(|diagnostic| diagnostics.error(*diagnostic))?;
        Ok(ColumnRename { name: parsed.name.to_owned(), unit })
    }
}

impl CsvHeader {
    /// Renames columns. A file that has the new name but not the old one is left unchanged, so that files of several
    /// kinds can be read together.
    pub(crate) fn rename(
        &mut self,
        renames: &[Rename],
        kept: ShownText,
        sources: &mut SourceMap,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let names: Vec<String> =
            self.cells.iter().map(|cell| parse(&cell.text).name.to_owned()).collect();
        let mut reported = Ok(());
        for rename in renames {
            let new = match rename.read(sources, diagnostics) {
                Ok(new) => new,
                Err(error) => {
                    reported = Err(error);
                    continue;
                }
            };
            let mut called = (0..names.len()).filter(|at| names[*at] == rename.column);
            let (first, second) = (called.next(), called.next());
            if let (Some(first), Some(second)) = (first, second) {
                let message = format!(
                    "two columns are called `{}`, one of which is to be called `{}`",
                    rename.column, new.name
                );
                let place = |at: usize| kept.span(&self.cells[at].place);
                reported = Err(diagnostics.error(
                    Diagnostic::new(Code::MalformedHeader, place(second), message)
                        .label(place(first), "the first of them")
                        .help("name the columns apart in the file"),
                ));
            } else if let Some(at) = first {
                self.cells[at].renamed = Some(new);
            } else if !names.contains(&new.name) {
                let message = format!(
                    "there is no column `{}`, which is to be called `{}`",
                    rename.column, new.name
                );
                let near = suggestion(&rename.column, names.iter().map(String::as_str));
                reported = Err(diagnostics.error(
                    Diagnostic::new(Code::MalformedHeader, kept.span(&self.place), message)
                        .maybe_help(near.map(|near| format!("did you mean `{near}`?"))),
                ));
            }
        }
        reported
    }
}
