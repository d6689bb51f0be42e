//! Columns by other names than the file has: field files have their own.

use std::str::FromStr;

use dgd_compiler::diagnostics::{Code, Diagnostic, Diagnostics, Reported, suggestion};

use super::header::{Header, parse};
use super::rows::Kept;

/// Another name for a column, as in `P_RIS=p_r`, or with its unit, as in `P_RIS=p_r [barg]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rename {
    /// What the file calls it.
    pub column: String,
    /// What it is to be called; may have a unit, which replaces that of the file.
    pub name: String,
}

impl FromStr for Rename {
    type Err = String;

    fn from_str(text: &str) -> Result<Rename, String> {
        // Names of columns may have an equals sign, names in models have none.
        match text.rsplit_once('=').map(|(column, name)| (column.trim(), name.trim())) {
            Some((column, name)) if !column.is_empty() && !name.is_empty() => {
                Ok(Rename { column: column.to_owned(), name: name.to_owned() })
            }
            _ => Err("it needs the form COLUMN=NAME, as in `P_RIS=p_r`".to_owned()),
        }
    }
}

impl Header {
    /// Gives columns other names. A file that has the new name already and not the old one is left
    /// alone, so that files of several kinds can be read together.
    pub(super) fn rename(
        &mut self,
        renames: &[Rename],
        kept: Kept,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), Reported> {
        let names: Vec<String> =
            self.cells.iter().map(|(text, _)| parse(text).name.to_owned()).collect();
        let mut reported = Ok(());
        for rename in renames {
            let new = parse(&rename.name);
            if let Some(at) = names.iter().position(|name| *name == rename.column) {
                let (text, _) = &self.cells[at];
                let unit = new.unit.or(parse(text).unit);
                let unit = unit.map(|unit| format!(" [{unit}]")).unwrap_or_default();
                self.cells[at].0 = format!("{}{unit}", new.name);
            } else if !names.iter().any(|name| name == new.name) {
                let message = format!(
                    "there is no column `{}`, which is to be called `{}`",
                    rename.column, new.name
                );
                let near = suggestion(&rename.column, names.iter().map(String::as_str));
                reported = Err(diagnostics.error(
                    Diagnostic::new(Code::E609, kept.span(&self.place), message)
                        .maybe_help(near.map(|near| format!("did you mean `{near}`?"))),
                ));
            }
        }
        reported
    }
}
