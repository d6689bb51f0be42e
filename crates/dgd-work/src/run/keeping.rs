//! Resumable runs: a journal of finished work is kept beside the results until they are written.

use dgd_data::files::journal::{JournalError, JournalOpening, PriorJournal, RunJournal};
use dgd_identify::journal::Digest;

use crate::error::{UnusableFile, UsageError, WorkError};
use crate::request::JournalChoice;
use crate::session::TaskContext;

/// Checks that there is a journal to resume from.
pub(crate) fn verify(keep: &JournalChoice) -> Result<(), WorkError> {
    if keep.resume && keep.out.is_none() {
        return Err(UsageError::ResumeWithoutOut.into());
    }
    Ok(())
}

/// The journal of finished work, if the request allows one, kept beside the results until the run ends. `input` is a
/// digest of everything that the work depends on.
pub(crate) fn journal(
    keep: &JournalChoice,
    input: impl FnOnce() -> Digest,
    session: TaskContext<'_>,
) -> Result<Option<RunJournal>, WorkError> {
    let (Some(out), is_resumed) = (&keep.out, keep.resume) else { return Ok(None) };
    let path = RunJournal::path(out);
    let shown = path.display().to_string();
    let opening = if is_resumed { JournalOpening::Resume } else { JournalOpening::Anew };
    match RunJournal::open(path.clone(), owner(input()), opening) {
        Ok((journal, before)) => {
            match before {
                PriorJournal::Results(n) => {
                    session.remark(format!("going on with {n} results from {shown}"));
                }
                PriorJournal::Nothing if is_resumed => {
                    session.remark(format!("nothing to go on from: {shown} is not there"));
                }
                PriorJournal::Other => session.remark(format!(
                    "{shown} is not used: it belongs to another model, other data, other options or \
                     another build of dgd"
                )),
                PriorJournal::Nothing => {}
            }
            Ok(Some(journal))
        }
        Err(JournalError::InUse) if is_resumed => Err(UnusableFile::JournalInUse(path).into()),
        Err(JournalError::InUse) => {
            session.remark(format!(
                "{shown} is in use by another run: this one cannot be resumed if it is ended"
            ));
            Ok(None)
        }
        Err(JournalError::Failed(error)) => {
            session.remark(format!(
                "this run cannot be resumed if it is ended: {shown} cannot be written: {error}"
            ));
            Ok(None)
        }
    }
}

/// The owner of a journal: the input and this program, because another build may compute different digits. Copies of a
/// program are equal.
fn owner(input: Digest) -> Digest {
    let program = std::env::current_exe().and_then(std::fs::read);
    let program = program.map(|bytes| Digest::EMPTY.bytes(&bytes).value()).ok();
    input.debug(&env!("CARGO_PKG_VERSION")).debug(&program)
}
