//! `dgd fmt`: canonical layout.

use std::path::Path;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{Source, Sources};
use dgd_compiler::syntax::{layout, parse};

use crate::args::FmtArgs;
use crate::console::Console;
use crate::data::write_whole;
use crate::failure::CommandError;
use crate::load::read_model;

pub(crate) fn run(args: &FmtArgs, console: Console<'_>) -> Result<(), CommandError> {
    // Every file is read and laid out before the first is written.
    let mut changed = Vec::new();
    let mut sources = Sources::default();
    let mut diagnostics = Diagnostics::default();
    for path in &args.models {
        let text = read_model(path)?;
        if let Some(formatted) = formatted(path, &text, &mut sources, &mut diagnostics)
            && formatted != text
        {
            changed.push((path, formatted));
        }
    }
    if diagnostics.check().is_err() {
        return Err(CommandError::diagnosed(&diagnostics, sources));
    }
    if args.check {
        if changed.is_empty() {
            return Ok(());
        }
        let names: Vec<String> =
            changed.iter().map(|(path, _)| format!("`{}`", path.display())).collect();
        return Err(CommandError::Found(format!(
            "not laid out canonically: {}; run `dgd fmt` on them",
            names.join(", ")
        )));
    }
    for (path, formatted) in &changed {
        write_whole(path, |out| out.write_all(formatted.as_bytes()))?;
        console.remark(&format!("laid out {}", path.display()));
    }
    Ok(())
}

/// The canonical text of a file that parses.
fn formatted(
    path: &Path,
    text: &str,
    sources: &mut Sources,
    diagnostics: &mut Diagnostics,
) -> Option<String> {
    let id = sources.add(Source { name: path.display().to_string(), text: text.to_owned() });
    parse(id, sources, diagnostics).ok()?;
    layout::format(id, sources, diagnostics).ok()
}
