//! Threads that do the work of calls, one call at a time each. A thread of Python keeps those that worked for it: a fresh
//! one would ask the system for each page of its memory again, and one that worked for another thread of Python would
//! wait for the processor on which that one runs.

use std::cell::RefCell;
use std::io;
use std::process;
use std::sync::mpsc::{self, SendError, Sender};
use std::thread;

/// The stack of a thread; what is deep is limited far below.
const STACK: usize = 16 << 20;

type Job = Box<dyn FnOnce() + Send>;

/// A thread that does what it is sent, and ends where this is dropped.
pub(crate) struct Worker {
    /// The process that began it: one that was forked does not have it.
    process: u32,
    jobs: Sender<Job>,
}

thread_local! {
    /// Those that wait for work. More than one where a call is made from within another.
    static IDLE: RefCell<Vec<Worker>> = const { RefCell::new(Vec::new()) };
}

/// Has a worker do this; it must not panic. Whoever knows that it has ended calls [`Worker::rest`].
///
/// # Errors
///
/// The system gives no thread.
pub(crate) fn spawn(job: impl FnOnce() + Send + 'static) -> io::Result<Worker> {
    let mut job: Job = Box::new(job);
    while let Some(worker) = IDLE.with_borrow_mut(Vec::pop) {
        if worker.process != process::id() {
            // Its channel was copied while another thread may have held it.
            std::mem::forget(worker);
            continue;
        }
        match worker.jobs.send(job) {
            Ok(()) => return Ok(worker),
            Err(SendError(refused)) => job = refused,
        }
    }
    let (jobs, receive) = mpsc::channel::<Job>();
    thread::Builder::new().stack_size(STACK).spawn(move || {
        job();
        while let Ok(next) = receive.recv() {
            next();
        }
    })?;
    Ok(Worker { process: process::id(), jobs })
}

impl Worker {
    /// Keeps it for the next call of this thread.
    pub(crate) fn rest(self) {
        IDLE.with_borrow_mut(|idle| idle.push(self));
    }
}
