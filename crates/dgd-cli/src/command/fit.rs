//! `dgd fit`: estimates parameters and initial values from recordings, and validates them on others.

use std::path::{Path, PathBuf};

use dgd_work::{FitFigure, FitRequest, TaskEnd, fit};

use crate::args::DrawnArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture::{self, ImageContent};
use crate::progress::{BEST_SO_FAR, InterruptPolicy, ProgressDisplay};
use crate::tail::{CommandOutput, PrintedText, SavedContent, finish};

pub(crate) fn run(args: &DrawnArgs<FitRequest>, console: Console<'_>) -> Result<(), CommandError> {
    picture::verify_formats(&args.plot)?;
    let display = ProgressDisplay::new(console, InterruptPolicy::Stops(BEST_SO_FAR));
    let fitted = fit(&args.request(console.out()), display.session())?;
    let (pages, pictures): (Vec<&PathBuf>, Vec<&PathBuf>) =
        args.plot.iter().partition(|path| picture::is_page(path));
    let mut drawings: Vec<(PathBuf, ImageContent)> = pictures
        .into_iter()
        .flat_map(|path| fitted.figures.iter().map(|figure| (file(path, figure), figure)))
        .map(|(path, figure)| (path, ImageContent::Figure(figure.figure.clone())))
        .collect();
    drawings
        .extend(pages.into_iter().map(|path| (path.clone(), ImageContent::Page(fitted.page()))));
    let shown = CommandOutput {
        json: Some(fitted.to_json().clone()),
        saved: match console.out() {
            Some(folder) => SavedContent::Folder { files: fitted.files(folder), is_told: true },
            None => SavedContent::Nothing,
        },
        drawings,
        printed: PrintedText::Text(fitted.to_text().to_owned()),
        ..CommandOutput::new(TaskEnd::Done)
    };
    if let Err(error) = finish(shown, console) {
        fitted.leave();
        return Err(error);
    }
    CommandError::check(fitted.ended(console.out()))
}

/// The file of a figure; profiles are saved beside the first: `fit.svg` → `fit.profile-c0.svg`.
fn file(path: &Path, figure: &FitFigure) -> PathBuf {
    let Some(name) = &figure.of else { return path.to_owned() };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}.profile-{}.{ending}", name.replace(['/', ' '], "_")))
}
