//! `dgd fmt`: canonical layout.

use std::path::Path;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::{layout, parse};
use dgd_data::DiskFiles;
use dgd_data::files::write_whole;
use dgd_data::open::read_text;

use crate::args::FmtArgs;
use crate::console::Console;
use crate::failure::CommandError;

pub(crate) fn run(args: &FmtArgs, console: Console<'_>) -> Result<(), CommandError> {
    if let Some(out) = console.out() {
        return lay_out_into(out, args, console);
    }
    // All files are read and formatted before the first is written.
    let mut changed = Vec::new();
    let mut sources = SourceMap::default();
    let mut diagnostics = Diagnostics::default();
    for path in &args.models {
        if !args.check && !path.is_file() && path.exists() {
            return Err(CommandError::Found(format!(
                "cannot lay out `{}`: it is not a regular file",
                path.display()
            )));
        }
        let text = text_of(path)?;
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

/// Formats one model into another file.
fn lay_out_into(out: &Path, args: &FmtArgs, console: Console<'_>) -> Result<(), CommandError> {
    let [path] = args.models.as_slice() else {
        return Err(CommandError::Usage("`-o` is for one model".to_owned()));
    };
    if args.check {
        return Err(CommandError::Usage("`--check` writes nothing: leave `-o` out".to_owned()));
    }
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let text = text_of(path)?;
    let Some(formatted) = formatted(path, &text, &mut sources, &mut diagnostics) else {
        return Err(CommandError::diagnosed(&diagnostics, sources));
    };
    write_whole(out, |file| file.write_all(formatted.as_bytes()))?;
    console.remark(&format!("wrote {}", out.display()));
    Ok(())
}

/// The text of a model, library or effect.
fn text_of(path: &Path) -> Result<String, CommandError> {
    read_text(&DiskFiles, path)
        .map_err(|why| CommandError::Found(format!("cannot read `{}`: {why}", path.display())))
}

/// The canonical text of a file that parses.
fn formatted(
    path: &Path,
    text: &str,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Option<String> {
    let id = sources.add(SourceText { name: path.display().to_string(), text: text.to_owned() });
    parse(id, sources, diagnostics).ok()?;
    layout::format(id, sources, diagnostics).ok()
}
