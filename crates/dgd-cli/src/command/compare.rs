//! `dgd compare`: models, variants, effects and results side by side on the same recordings.

use dgd_work::{CompareRequest, TaskEnd, compare};

use crate::args::DrawnArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{BEST_SO_FAR, InterruptPolicy, ProgressDisplay};
use crate::tail::{CommandOutput, PrintedText, SavedContent, finish};

pub(crate) fn run(
    args: &DrawnArgs<CompareRequest>,
    console: Console<'_>,
) -> Result<(), CommandError> {
    picture::verify_formats(&args.plot)?;
    let display = ProgressDisplay::new(console, InterruptPolicy::Stops(BEST_SO_FAR));
    let compared = compare(&args.request(console.out()), display.session())?;
    let plots = &args.plot;
    let shown = CommandOutput {
        json: Some(compared.to_json()),
        saved: match console.out() {
            Some(_) => SavedContent::Folder { files: compared.files(), is_told: true },
            None => SavedContent::Nothing,
        },
        drawings: picture::drawings(plots, || compared.figure(), |_| Ok(compared.page()))?,
        printed: PrintedText::Text(compared.to_text()),
        ..CommandOutput::new(TaskEnd::Done)
    };
    if let Err(error) = finish(shown, console) {
        compared.leave();
        return Err(error);
    }
    CommandError::check(compared.ended())
}
