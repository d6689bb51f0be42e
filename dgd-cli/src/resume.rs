//! Runs that go on where another one was ended.

use dgd_runtime::journal::Digest;

use crate::console::Console;
use crate::data::journal::{Before, JournalError, Opening, RunJournal};
use crate::failure::CommandError;

/// Checks that there can be something to go on from.
pub(crate) fn verify(is_resumed: bool, console: Console<'_>) -> Result<(), CommandError> {
    if is_resumed && console.out().is_none() {
        return Err(CommandError::Usage(
            "`--resume` goes on from what a run with `-o DIR` has kept beside it: give that `-o`"
                .to_owned(),
        ));
    }
    Ok(())
}

/// Where what is finished is kept until the run ends, if it can be: beside `--out`. `input` is a digest of all that
/// it depends on.
pub(crate) fn journal(
    is_resumed: bool,
    input: impl FnOnce() -> Digest,
    console: Console<'_>,
) -> Result<Option<RunJournal>, CommandError> {
    let Some(out) = console.out() else { return Ok(None) };
    let path = RunJournal::path(out);
    let shown = path.display().to_string();
    let opening = if is_resumed { Opening::Resume } else { Opening::Anew };
    match RunJournal::open(path, owner(input()), opening) {
        Ok((journal, before)) => {
            match before {
                Before::Results(n) => {
                    console.remark(&format!("going on with {n} results from {shown}"));
                }
                Before::Nothing if is_resumed => {
                    console.remark(&format!("nothing to go on from: {shown} is not there"));
                }
                Before::Other => console.remark(&format!(
                    "{shown} is not used: it belongs to another model, other data, other options or \
                     another build of dgd"
                )),
                Before::Nothing => {}
            }
            Ok(Some(journal))
        }
        Err(JournalError::InUse) if is_resumed => {
            Err(CommandError::Found(format!("{shown} is in use: another run is still writing it")))
        }
        Err(JournalError::InUse) => {
            console.remark(&format!(
                "{shown} is in use by another run: this one cannot be resumed if it is ended"
            ));
            Ok(None)
        }
        Err(JournalError::Failed(error)) => {
            console.remark(&format!(
                "this run cannot be resumed if it is ended: {shown} cannot be written: {error}"
            ));
            Ok(None)
        }
    }
}

/// Whose journal it is: that of the input and of this program, since another build may compute other digits.
fn owner(input: Digest) -> Digest {
    let program = std::env::current_exe().and_then(std::fs::metadata);
    let program = program.map(|file| (file.len(), file.modified().ok())).ok();
    input.of(&env!("CARGO_PKG_VERSION")).of(&program)
}
