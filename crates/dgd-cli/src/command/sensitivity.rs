//! `dgd sensitivity`: derivatives of states and outputs with respect to parameters over time.

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
    let sensitivities = sensitivity(&args.request(), display.session())?;
    let is_partial = sensitivities.stopped.is_some();
    let drawings = if is_partial {
        Vec::new()
    } else {
        picture::drawings(
            plots,
            || sensitivities.figure(),
            |command| Ok(sensitivities.page(command)),
        )?
    };
    let table = Table {
        write: &|out| sensitivities.table.write_csv(out),
        details: sensitivities.details(),
        rows: Some(sensitivities.table.times.len()),
        is_partial,
    };
    let is_said = !drawings.is_empty() || sensitivities.verification.is_some();
    let shown = Shown {
        json: console.needs_json().then(|| sensitivities.to_json()),
        saved: Saved::Table(table),
        drawings,
        printed: if is_said { Printed::Nothing } else { Printed::Table },
        closing: sensitivities.verification.as_ref().map(Report::to_text),
        ..Shown::new(sensitivities.ended())
    };
    finish(shown, console)
}
