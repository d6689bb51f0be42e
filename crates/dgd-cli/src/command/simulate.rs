//! `dgd simulate`: trajectories of states and outputs.

use dgd_work::{SimulateRequest, TaskEnd, simulate};

use crate::args::DrawnArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{InterruptPolicy, ProgressDisplay, ROWS_SO_FAR};
use crate::tail::{CommandOutput, PrintedText, SavedContent, WritableTable, finish};

pub(crate) fn run(
    args: &DrawnArgs<SimulateRequest>,
    console: Console<'_>,
) -> Result<(), CommandError> {
    if args.request.ensemble.is_some() {
        return super::ensemble::run(args, console);
    }
    let plots = &args.plot;
    picture::verify_formats(plots)?;
    let display = ProgressDisplay::new(console, InterruptPolicy::Stops(ROWS_SO_FAR));
    let simulated = simulate(&args.request(), display.session())?;
    let ended = simulated.ended();
    let is_partial = ended != TaskEnd::Done;
    let drawings = if is_partial {
        Vec::new()
    } else {
        picture::drawings(plots, || simulated.figure(), |command| Ok(simulated.page(command)))?
    };
    let table = WritableTable {
        write: &|out| simulated.table.write_csv(out),
        details: simulated.details(),
        rows: Some(simulated.table.times.len()),
        is_partial,
    };
    let agreement = simulated.agreement();
    let closing =
        (!agreement.is_empty() && ended == TaskEnd::Done).then(|| agreement.trim_end().to_owned());
    let printed = if drawings.is_empty() { PrintedText::Table } else { PrintedText::Nothing };
    let json = console.needs_json().then(|| simulated.to_json());
    let saved = SavedContent::Table(table);
    finish(
        CommandOutput { json, saved, drawings, printed, closing, ..CommandOutput::new(ended) },
        console,
    )
}
