//! `dgd linearize`: the linear model at a point of a run, or at a steady state.

use dgd_work::{Ended, LinearizeRequest, linearize};

use crate::args::LinearizeArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{Interrupt, NOTHING, ProgressDisplay};
use crate::tail::{Printed, Saved, Shown, Table, finish};

pub(crate) fn run(args: &LinearizeArgs, console: Console<'_>) -> Result<(), CommandError> {
    picture::verify_formats(&args.solve.plot)?;
    let display = ProgressDisplay::new(console, Interrupt::Ends(NOTHING));
    let mut request = LinearizeRequest::new(&args.model, args.at);
    request.choices = args.choices.request();
    request.data.clone_from(&args.data);
    request.solve = args.solve.request();
    let linear = linearize(&request, display.session())?;
    let table = Table {
        write: &|out| linear.write_csv(out),
        details: linear.to_json(),
        rows: None,
        is_partial: false,
    };
    let plots = &args.solve.plot;
    let shown = Shown {
        drawings: picture::drawings(plots, || linear.figure(), |command| Ok(linear.page(command)))?,
        json: Some(linear.to_json()),
        saved: Saved::Table(table),
        printed: Printed::Text(linear.to_text()),
        ..Shown::new(Ended::Done)
    };
    finish(shown, console)
}
