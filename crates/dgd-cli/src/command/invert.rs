//! `dgd invert`: computes the missing term of an equation from measurements.

use dgd_work::{InvertRequest, TaskEnd, invert};

use crate::args::DrawnArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{InterruptPolicy, NOTHING, ProgressDisplay};
use crate::tail::{CommandOutput, PrintedText, SavedContent, WritableTable, finish};

pub(crate) fn run(
    args: &DrawnArgs<InvertRequest>,
    console: Console<'_>,
) -> Result<(), CommandError> {
    picture::verify_formats(&args.plot)?;
    let display = ProgressDisplay::new(console, InterruptPolicy::Ends(NOTHING));
    let missing = invert(&args.request, display.session())?;
    let table = WritableTable {
        write: &|out| missing.write_csv(out),
        details: missing.details(),
        rows: Some(missing.found.times.len()),
        is_partial: false,
    };
    let plots = &args.plot;
    let shown = CommandOutput {
        json: console.needs_json().then(|| missing.to_json()),
        saved: SavedContent::Table(table),
        drawings: picture::drawings(
            plots,
            || missing.figure(),
            |command| Ok(missing.page(command)),
        )?,
        printed: PrintedText::Text(missing.to_text()),
        ..CommandOutput::new(TaskEnd::Done)
    };
    finish(shown, console)
}
