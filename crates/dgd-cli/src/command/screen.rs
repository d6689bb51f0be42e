//! `dgd screen`: checks recordings for faults before anything is fitted to them.

use std::path::PathBuf;

use dgd_work::screen;

use crate::args::ScreenArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{InterruptPolicy, NOTHING, ProgressDisplay};
use crate::tail::{CommandOutput, PrintedText, SavedContent, finish};

pub(crate) fn run(args: &ScreenArgs, console: Console<'_>) -> Result<(), CommandError> {
    picture::verify_formats(&args.plot)?;
    let display = ProgressDisplay::new(console, InterruptPolicy::Ends(NOTHING));
    if args.plot.len() > 1
        && args.request.data.len() > 1
        && args.plot.len() != args.request.data.len()
    {
        return Err(CommandError::Usage("give one `--plot`, or one for each `--data`".to_owned()));
    }
    let screened = screen(&args.request(), display.session())?;
    let drawing = |(at, path): (usize, &PathBuf)| {
        picture::drawings([path], || screened.figure(at), |_| screened.page())
    };
    let drawings: Result<Vec<_>, CommandError> =
        args.plot.iter().enumerate().map(drawing).collect();
    let is_silent = console.is_quiet() && console.out().is_some();
    let shown = CommandOutput {
        json: Some(screened.to_json()),
        saved: match console.out() {
            Some(_) => SavedContent::Folder { files: screened.files()?, is_told: true },
            None => SavedContent::Nothing,
        },
        drawings: drawings?.into_iter().flatten().collect(),
        printed: if is_silent {
            PrintedText::Nothing
        } else {
            PrintedText::Text(screened.to_text(console.out()))
        },
        ..CommandOutput::new(screened.ended())
    };
    finish(shown, console)
}
