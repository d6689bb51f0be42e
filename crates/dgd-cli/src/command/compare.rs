//! `dgd compare`: models, variants, effects and results side by side on the same recordings.

use dgd_work::{Ended, compare};

use crate::args::compare::CompareArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{BEST_SO_FAR, Interrupt, ProgressDisplay};
use crate::tail::{Printed, Saved, Shown, finish};

pub(crate) fn run(args: &CompareArgs, console: Console<'_>) -> Result<(), CommandError> {
    picture::verify_formats(&args.solve.plot)?;
    let display = ProgressDisplay::new(console, Interrupt::Stops(BEST_SO_FAR));
    let compared = compare(&args.request(console.out()), display.session())?;
    let plots = &args.solve.plot;
    let shown = Shown {
        json: Some(compared.to_json()),
        saved: match console.out() {
            Some(_) => Saved::Folder { files: compared.files(), is_told: true },
            None => Saved::Nothing,
        },
        drawings: picture::drawings(plots, || compared.figure(), |_| Ok(compared.page()))?,
        printed: Printed::Text(compared.to_text()),
        ..Shown::new(Ended::Done)
    };
    if let Err(error) = finish(shown, console) {
        compared.leave();
        return Err(error);
    }
    CommandError::of(compared.ended())
}
