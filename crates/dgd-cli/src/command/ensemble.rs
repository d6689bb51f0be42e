//! `dgd simulate --ensemble`: trajectories for many sets of parameters and initial values.

use dgd_data::write::TableFormat;
use dgd_work::simulate::EnsembleStorage;
use dgd_work::{SimulateRequest, simulate_each};

use crate::args::DrawnArgs;
use crate::console::{Console, print};
use crate::failure::CommandError;
use crate::picture;
use crate::progress::{InterruptPolicy, ProgressDisplay};
use crate::table_file::save_json;
use crate::tail::{CommandOutput, SavedContent, finish};

pub(crate) fn run(
    args: &DrawnArgs<SimulateRequest>,
    console: Console<'_>,
) -> Result<(), CommandError> {
    let plots = &args.plot;
    picture::verify_formats(plots)?;
    let display =
        ProgressDisplay::new(console, InterruptPolicy::Stops("stopping at the sets that are done"));
    let session = display.session();
    let mut ensemble = simulate_each(&args.request(), session)?;
    let out = console.out().map(|path| Ok((path, console.table_format(path)?)));
    let out = out.transpose().map_err(|error: CommandError| error)?;
    let is_document = out.map_or(console.is_json(), |(_, format)| format.is_document());
    let hold = EnsembleStorage::new(is_document, !plots.is_empty());
    match out.filter(|_| !is_document) {
        // Rows are written as they are computed.
        Some((path, format)) => {
            ensemble.verify_memory(if hold.figure { ensemble.sets() } else { 0 })?;
            format.save(path, |out| ensemble.write_csv(out, hold, session))?;
            console.remark(&format!("wrote {} ({} sets)", path.display(), ensemble.done()));
        }
        None if !is_document && !hold.figure => {
            ensemble.verify_memory(ensemble.sets())?;
            let mut text = Vec::new();
            let written = ensemble.write_csv(&mut text, hold, session);
            written.map_err(|error| CommandError::Found(error.to_string()))?;
            print(&String::from_utf8_lossy(&text))?;
        }
        None => ensemble.run(hold, session)?,
    }
    if let Some((path, format)) = out.filter(|_| is_document) {
        save_json(path, &ensemble.to_json(), format != TableFormat::JsonLines)?;
        console.remark(&format!("wrote {} ({} sets)", path.display(), ensemble.done()));
    }
    let drawings =
        picture::drawings(plots, || ensemble.figure(), |command| Ok(ensemble.page(command)))?;
    let is_printed = console.is_json() && !(is_document && out.is_some());
    let json = is_printed.then(|| ensemble.to_json());
    finish(
        CommandOutput {
            json,
            saved: SavedContent::Nothing,
            drawings,
            ..CommandOutput::new(ensemble.ended())
        },
        console,
    )
}
