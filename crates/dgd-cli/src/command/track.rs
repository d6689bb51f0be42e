//! `dgd track`: states and parameters row by row, one line out for each line in.

use std::io::{self, Read, Write};
use std::path::Path;

use dgd_data::write::TableFormat;
use dgd_work::{LineFormat, TaskEnd, TrackRequest, TrackingResult, track};
use serde_json::json;

use crate::args::DrawnArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{InterruptPolicy, NOTHING, ProgressDisplay};
use crate::tail::{CommandOutput, SavedContent, finish};

pub(crate) fn run(
    args: &DrawnArgs<TrackRequest>,
    console: Console<'_>,
) -> Result<(), CommandError> {
    picture::verify_formats(&args.plot)?;
    let (tracked, ended) = match console.out() {
        None => print(args, console)?,
        Some(path) => save(args, path, console)?,
    };
    for words in &tracked.remarks {
        console.remark(words);
    }
    let plots = &args.plot;
    let drawings =
        picture::drawings(plots, || tracked.figure(), |command| Ok(tracked.page(command)))?;
    finish(
        CommandOutput {
            saved: SavedContent::Nothing,
            drawings,
            ..CommandOutput::new(TaskEnd::Done)
        },
        console,
    )?;
    ended
}

/// The tracking result, and the outcome of the command.
type TrackEnd = (TrackingResult, Result<(), CommandError>);

/// Standard input, if that is the recording.
fn input(args: &DrawnArgs<TrackRequest>) -> Option<Box<dyn Read>> {
    (args.request.data == Path::new("-")).then(|| Box::new(io::stdin()) as Box<dyn Read>)
}

/// Tracks to standard output; programs read an error there as the last line.
fn print(args: &DrawnArgs<TrackRequest>, console: Console<'_>) -> Result<TrackEnd, CommandError> {
    let mut out = io::stdout().lock();
    let format = if console.is_json() { LineFormat::Lines } else { LineFormat::Csv };
    let session = console.session();
    let mut tracked = track(&args.request(), input(args), session, &mut out, format)?;
    let Some(error) = tracked.stopped.take().map(CommandError::from) else {
        return Ok((tracked, Ok(())));
    };
    if !console.is_json() {
        return Ok((tracked, Err(error)));
    }
    let line = writeln!(out, "{}", json!({ "error": error.to_string() }));
    match line.and_then(|()| out.flush()) {
        Err(failed) if failed.kind() != io::ErrorKind::BrokenPipe => {
            Err(CommandError::Found(format!("cannot write a row: {failed}")))
        }
        _ => Ok((tracked, Err(error.written()))),
    }
}

/// Tracks into a file that is written atomically.
fn save(
    args: &DrawnArgs<TrackRequest>,
    path: &Path,
    console: Console<'_>,
) -> Result<TrackEnd, CommandError> {
    let format = console.table_format(path)?;
    let lines = match format {
        TableFormat::Csv | TableFormat::Parquet => LineFormat::Csv,
        TableFormat::Json => LineFormat::Document,
        TableFormat::JsonLines => LineFormat::Lines,
    };
    let display = ProgressDisplay::new(console, InterruptPolicy::Ends(NOTHING));
    let mut outcome = None;
    let written = format.save(path, |out| {
        let tracked = track(&args.request(), input(args), display.session(), out, lines);
        let is_whole = tracked.as_ref().is_ok_and(|tracked| tracked.stopped.is_none());
        outcome = Some(tracked);
        if is_whole { Ok(()) } else { Err(io::Error::other("tracking ended")) }
    });
    let Some(tracked) = outcome else {
        // Tracking has not begun because the output cannot be opened.
        let error = written.err().map_or_else(String::new, |error| error.to_string());
        return Err(CommandError::Found(error));
    };
    let mut tracked = tracked?;
    if let Some(error) = tracked.stopped.take() {
        return Ok((tracked, Err(error.into())));
    }
    let ended = written.map_err(CommandError::from);
    if ended.is_ok() {
        console.remark(&format!("wrote {} ({} rows)", path.display(), tracked.count));
    }
    Ok((tracked, ended))
}
