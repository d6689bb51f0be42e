//! `dgd invert`: computes the missing term of an equation from measurements.

use dgd_work::{Ended, invert};

use crate::args::invert::InvertArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{Interrupt, NOTHING, ProgressDisplay};
use crate::tail::{Printed, Saved, Shown, Table, finish};

pub(crate) fn run(args: &InvertArgs, console: Console<'_>) -> Result<(), CommandError> {
    picture::verify_formats(&args.solve.plot)?;
    let display = ProgressDisplay::new(console, Interrupt::Ends(NOTHING));
    let missing = invert(&args.request(), display.session())?;
    let table = Table {
        write: &|out| missing.write_csv(out),
        details: missing.details(),
        rows: Some(missing.found.times.len()),
        is_partial: false,
    };
    let plots = &args.solve.plot;
    let shown = Shown {
        json: console.needs_json().then(|| missing.to_json()),
        saved: Saved::Table(table),
        drawings: picture::drawings(
            plots,
            || missing.figure(),
            |command| Ok(missing.page(command)),
        )?,
        printed: Printed::Text(missing.to_text()),
        ..Shown::new(Ended::Done)
    };
    finish(shown, console)
}
