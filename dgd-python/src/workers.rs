//! Threads that do the work of calls, one call at a time each. They are kept, and with them their memory: a fresh thread
//! would ask the system for each page of it again.

use std::io;
use std::sync::Mutex;
use std::sync::mpsc::{self, Sender};
use std::thread;

/// The stack of a thread; what is deep is limited far below.
const STACK: usize = 16 << 20;
/// Most threads that wait for work.
const MOST_IDLE: usize = 8;

type Job = Box<dyn FnOnce() + Send>;

/// Threads that wait, of the process that began them: one that was forked has none.
struct Idle {
    process: u32,
    threads: Vec<Sender<Job>>,
}

static IDLE: Mutex<Idle> = Mutex::new(Idle { process: 0, threads: Vec::new() });

/// Has a thread do this; it must not panic.
///
/// # Errors
///
/// The system gives no thread.
pub(crate) fn spawn(job: impl FnOnce() + Send + 'static) -> io::Result<()> {
    let mut job: Job = Box::new(job);
    while let Some(thread) = waiting() {
        match thread.send(job) {
            Ok(()) => return Ok(()),
            Err(mpsc::SendError(refused)) => job = refused,
        }
    }
    let (send, jobs) = mpsc::channel::<Job>();
    thread::Builder::new().stack_size(STACK).spawn(move || {
        job();
        while wait(&send) {
            let Ok(next) = jobs.recv() else { return };
            next();
        }
    })?;
    Ok(())
}

/// A thread that waits. Where the list is in use, nobody waits for it: it may be for ever after a fork.
fn waiting() -> Option<Sender<Job>> {
    let mut idle = IDLE.try_lock().ok()?;
    if idle.process != std::process::id() {
        idle.process = std::process::id();
        // Their threads are those of another process.
        std::mem::forget(std::mem::take(&mut idle.threads));
    }
    idle.threads.pop()
}

/// Has a thread wait for work; whether there is room.
fn wait(thread: &Sender<Job>) -> bool {
    let Ok(mut idle) = IDLE.lock() else { return false };
    let has_room = idle.threads.len() < MOST_IDLE && idle.process == std::process::id();
    if has_room {
        idle.threads.push(thread.clone());
    }
    has_room
}
