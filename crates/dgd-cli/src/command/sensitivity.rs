//! `dgd sensitivity`: derivatives of states and outputs with respect to parameters over time.

use dgd_work::sensitivity::verify::VerificationReport;
use dgd_work::{SensitivityRequest, sensitivity};

use crate::args::DrawnArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{InterruptPolicy, ProgressDisplay, ROWS_SO_FAR};
use crate::tail::{CommandOutput, PrintedText, SavedContent, WritableTable, finish};

pub(crate) fn run(
    args: &DrawnArgs<SensitivityRequest>,
    console: Console<'_>,
) -> Result<(), CommandError> {
    let plots = &args.plot;
    picture::verify_formats(plots)?;
    let display = ProgressDisplay::new(console, InterruptPolicy::Stops(ROWS_SO_FAR));
    let sensitivities = sensitivity(&args.request, display.session())?;
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
    let table = WritableTable {
        write: &|out| sensitivities.table.write_csv(out),
        details: sensitivities.details(),
        rows: Some(sensitivities.table.times.len()),
        is_partial,
    };
    let is_said = !drawings.is_empty() || sensitivities.verification.is_some();
    let shown = CommandOutput {
        json: console.needs_json().then(|| sensitivities.to_json()),
        saved: SavedContent::Table(table),
        drawings,
        printed: if is_said { PrintedText::Nothing } else { PrintedText::Table },
        closing: sensitivities.verification.as_ref().map(VerificationReport::to_text),
        ..CommandOutput::new(sensitivities.ended())
    };
    finish(shown, console)
}
