//! The process that computes pieces.

use std::io::{self, BufRead, Write};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use dgd_work::{Argument, sentence};

use super::{PieceTask, WorkerAnswer, WorkerQuestion, memory};
use crate::identity::{BuildIdentity, ProgramFile};
use crate::outcome::{FailureClass, PieceOutcome, document};
use crate::store::FleetStore;
use crate::syntax::OptionSyntax;

/// Interval between memory checks, in which a piece allocates a few GB at most.
const LOOKS: Duration = Duration::from_millis(20);

/// The piece in progress; the thread that takes it writes its result.
type CurrentPiece = Arc<Mutex<Option<PieceTask>>>;

/// Answers questions from standard input until it ends, then ends the process, because the parent is gone.
///
/// `perform` computes a piece, in the folder to which its paths are relative.
///
/// # Errors
///
/// Standard output cannot be written.
pub fn serve(
    program: &ProgramFile,
    syntax: OptionSyntax,
    perform: impl Fn(&PieceTask) -> PieceOutcome,
) -> io::Result<()> {
    let current = CurrentPiece::default();
    watch_memory(&current, syntax);
    for line in lines() {
        let answer = match serde_json::from_str(&line) {
            Err(error) => WorkerAnswer::Refused(format!("this is not a question: {error}")),
            Ok(WorkerQuestion::Identity) => match BuildIdentity::read(&program.file) {
                Ok(identity) => WorkerAnswer::Identity(identity),
                Err(error) => WorkerAnswer::Refused(format!("{}: {error}", program.file.display())),
            },
            Ok(WorkerQuestion::Perform(task)) => done(&task, &current, &perform, syntax),
        };
        say(&answer)?;
    }
    Ok(())
}

fn done(
    task: &PieceTask,
    current: &CurrentPiece,
    perform: impl Fn(&PieceTask) -> PieceOutcome,
    syntax: OptionSyntax,
) -> WorkerAnswer {
    if let Some(reason) = &task.given_up {
        return put(task, &PieceOutcome::failed(FailureClass::Ended, reason.clone()), syntax);
    }
    if let Err(error) = std::env::set_current_dir(&task.folder) {
        return WorkerAnswer::Refused(format!("{}: {error}", task.folder.display()));
    }
    *lock(current) = Some(task.clone());
    let outcome = perform(task);
    let mut current = lock(current);
    if current.take().is_none() {
        // The thread that took it is about to end the process.
        drop(current);
        loop {
            std::thread::park();
        }
    }
    put(task, &outcome, syntax)
}

/// Writes a result.
fn put(task: &PieceTask, outcome: &PieceOutcome, syntax: OptionSyntax) -> WorkerAnswer {
    let text = document(&task.name, &task.piece, outcome, syntax);
    let state = outcome.state();
    match FleetStore::open_in(&task.into).and_then(|store| store.put(&task.name, state, &text)) {
        Ok(()) if matches!(outcome, PieceOutcome::Done { .. }) => {
            WorkerAnswer::Done(task.name.clone())
        }
        Ok(()) => WorkerAnswer::Failed(task.name.clone()),
        Err(error) => WorkerAnswer::Refused(error.sentence().spelled(syntax.spelling)),
    }
}

/// Ends the process if a piece exceeds its memory limit, and records the failure.
fn watch_memory(current: &CurrentPiece, syntax: OptionSyntax) {
    let current = Arc::clone(current);
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(LOOKS);
            let mut current = lock(&current);
            let most = current.as_ref().and_then(|task| task.memory);
            let Some((most, held)) =
                most.zip(memory::resident()).filter(|(most, held)| held > most)
            else {
                continue;
            };
            if let Some(task) = current.take() {
                let message = sentence![
                    format!(
                        "it needed more memory than the {} that a piece may have, {} when it was ended: give ",
                        shown(most),
                        shown(held)
                    ),
                    Argument::Memory,
                    " more, and ",
                    Argument::Retry
                ];
                let message = message.spelled(syntax.spelling);
                // The lock is held to the end, so that no other answer is sent.
                let _ =
                    say(&put(&task, &PieceOutcome::failed(FailureClass::Memory, message), syntax));
                std::process::exit(0);
            }
        }
    });
}

/// `1.5 GB`.
fn shown(bytes: u64) -> String {
    let bytes = bytes as f64;
    if bytes >= 1e9 { format!("{:.1} GB", bytes / 1e9) } else { format!("{:.0} MB", bytes / 1e6) }
}

/// Lines of standard input as they arrive. The process ends with them.
fn lines() -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in io::stdin().lock().lines() {
            if line.ok().and_then(|line| sender.send(line).ok()).is_none() {
                break;
            }
        }
        std::process::exit(0);
    });
    receiver
}

fn say(answer: &WorkerAnswer) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let text = serde_json::to_string(answer).map_err(io::Error::other)?;
    writeln!(out, "{text}")?;
    out.flush()
}

fn lock(current: &CurrentPiece) -> std::sync::MutexGuard<'_, Option<PieceTask>> {
    current.lock().unwrap_or_else(PoisonError::into_inner)
}
