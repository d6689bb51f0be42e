//! `dgd check`: checks syntax, names, units and structure, in every variant.

use std::path::Path;

use dgd_compiler::diagnostics::Fix;
use dgd_compiler::diagnostics::fix::written;
use dgd_compiler::source::SourceId;
use dgd_data::files::write_whole;
use dgd_work::{CheckedModel, TaskEnd, check};

use crate::args::CheckArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::tail::{CommandOutput, PrintedText, SavedContent, finish};

/// Most repetitions of the check: fixes may uncover further mistakes, but not without end.
const ROUNDS: usize = 100;

pub(crate) fn run(args: &CheckArgs, console: Console<'_>) -> Result<(), CommandError> {
    let request = &args.request;
    let mut checked = check(request, console.session()).map_err(CommandError::from);
    for _ in 0..ROUNDS {
        match &checked {
            Err(error) if args.fix && write_fixes(error, console)? > 0 => {
                checked = check(request, console.session()).map_err(CommandError::from);
            }
            Ok(_) | Err(_) => break,
        }
    }
    let checked = checked?;
    let summary = checked.summary();
    let json = checked.to_json();
    let shown = CommandOutput::new(TaskEnd::Done);
    // Without a result, the summary goes to standard error.
    let is_remark = matches!(checked, CheckedModel::Effect { .. })
        || console.out().is_none() && !console.writes_json();
    let shown = if is_remark {
        CommandOutput { saved: SavedContent::Nothing, closing: Some(summary), ..shown }
    } else {
        CommandOutput { json, printed: PrintedText::Text(summary), ..shown }
    };
    finish(shown, console)
}

/// Applies the safe fixes, each file atomically; returns their number.
fn write_fixes(error: &CommandError, console: Console<'_>) -> Result<usize, CommandError> {
    let CommandError::Diagnosed { diagnostics, sources } = error else { return Ok(0) };
    let fixes = diagnostics.iter().filter_map(|diagnostic| diagnostic.fix.as_deref());
    let fixes: Vec<&Fix> = fixes.filter(|fix| fix.is_safe()).collect();
    let mut fixed = 0;
    for (k, source) in sources.iter().enumerate() {
        let path = Path::new(&source.name);
        let (text, n) = written(&source.text, SourceId(k as u32), &fixes);
        let is_file = sources.argument(SourceId(k as u32)).is_none() && path.is_file();
        if n == 0 || !is_file {
            continue;
        }
        write_whole(path, |out| out.write_all(text.as_bytes()))?;
        let lines = if n == 1 { "1 mistake".to_owned() } else { format!("{n} mistakes") };
        console.remark(&format!("{}: mended {lines}", path.display()));
        fixed += n;
    }
    Ok(fixed)
}
