//! `dgd sensitivity`: derivatives of states and outputs to parameters over time.

use dgd_work::sensitivity;
use dgd_work::sensitivity::verify::Report;

use crate::args::SensitivityArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{Interrupt, ProgressDisplay, ROWS_SO_FAR};
use crate::tail::{Printed, Saved, Shown, Table, finish};

pub(crate) fn run(args: &SensitivityArgs, console: Console<'_>) -> Result<(), CommandError> {
    let plots = &args.run.solve.plot;
    picture::verify_formats(plots)?;
    let display = ProgressDisplay::new(console, Interrupt::Stops(ROWS_SO_FAR));
    let found = sensitivity(&args.request(), display.session())?;
    let is_partial = found.stopped.is_some();
    let drawings = if is_partial {
        Vec::new()
    } else {
        picture::drawings(plots, || found.figure(), |command| Ok(found.page(command)))?
    };
    let table = Table {
        write: &|out| found.table.write_csv(out),
        details: found.details(),
        rows: Some(found.table.times.len()),
        is_partial,
    };
    let is_said = !drawings.is_empty() || found.verification.is_some();
    let shown = Shown {
        json: console.needs_json().then(|| found.to_json()),
        saved: Saved::Table(table),
        drawings,
        printed: if is_said { Printed::Nothing } else { Printed::Table },
        closing: found.verification.as_ref().map(Report::to_text),
        ..Shown::new(found.ended())
    };
    finish(shown, console)
}
