//! `dgd linearize`: the linear model at a point of a run, or at a steady state.

use dgd_work::{LinearizeRequest, TaskEnd, linearize};

use crate::args::DrawnArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{InterruptPolicy, NOTHING, ProgressDisplay};
use crate::tail::{CommandOutput, PrintedText, SavedContent, WritableTable, finish};

pub(crate) fn run(
    args: &DrawnArgs<LinearizeRequest>,
    console: Console<'_>,
) -> Result<(), CommandError> {
    picture::verify_formats(&args.plot)?;
    let display = ProgressDisplay::new(console, InterruptPolicy::Ends(NOTHING));
    let linear = linearize(&args.request, display.session())?;
    let table = WritableTable {
        write: &|out| linear.write_csv(out),
        details: linear.to_json(),
        rows: None,
        is_partial: false,
    };
    let plots = &args.plot;
    let shown = CommandOutput {
        drawings: picture::drawings(plots, || linear.figure(), |command| Ok(linear.page(command)))?,
        json: Some(linear.to_json()),
        saved: SavedContent::Table(table),
        printed: PrintedText::Text(linear.to_text()),
        ..CommandOutput::new(TaskEnd::Done)
    };
    finish(shown, console)
}
