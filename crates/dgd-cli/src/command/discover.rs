//! `dgd discover`: where a model and recordings disagree, and which known effect is missing.

use dgd_work::{DiscoverRequest, TaskEnd, discover};

use crate::args::DrawnArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{InterruptPolicy, ProgressDisplay};
use crate::tail::{CommandOutput, PrintedText, SavedContent, finish};

pub(crate) fn run(
    args: &DrawnArgs<DiscoverRequest>,
    console: Console<'_>,
) -> Result<(), CommandError> {
    picture::verify_formats(&args.plot)?;
    let display = ProgressDisplay::new(console, InterruptPolicy::Ends(how_to_go_on));
    let discovered = discover(&args.request(console.out()), display.session())?;
    let shown = || {
        let plots = &args.plot;
        let is_silent = console.is_quiet() && console.out().is_some();
        let shown = CommandOutput {
            json: Some(discovered.to_json()),
            saved: match console.out() {
                Some(_) => SavedContent::Folder { files: discovered.files()?, is_told: false },
                None => SavedContent::Nothing,
            },
            drawings: picture::drawings(plots, || discovered.figure(), |_| discovered.page())?,
            printed: if is_silent {
                PrintedText::Nothing
            } else {
                PrintedText::Text(discovered.to_text(console.out()))
            },
            ..CommandOutput::new(TaskEnd::Done)
        };
        finish(shown, console)
    };
    let shown = shown();
    if shown.is_err() && discovered.leave() {
        console.remark(
            "the search is kept: the same command with `--resume` writes its result without searching again",
        );
    }
    shown
}

fn how_to_go_on(is_kept: bool) -> &'static str {
    if is_kept {
        "stopped by Ctrl-C; the same command with `--resume` continues from here"
    } else {
        "stopped by Ctrl-C; nothing was kept: with `-o DIR`, `--resume` could have continued from here"
    }
}
