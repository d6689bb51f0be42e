//! Threads that run calls, one call at a time each. Each Python thread keeps its own: a new one would have to request
//! its memory pages from the system again, and one that worked for another Python thread would compete with it for the
//! processor.

use std::cell::RefCell;
use std::io;
use std::process;
use std::sync::mpsc::{self, SendError, Sender};
use std::thread;

/// Stack size of a thread; recursion is limited to far less.
const STACK: usize = 16 << 20;

type WorkerJob = Box<dyn FnOnce() + Send>;

/// A thread that runs the jobs sent to it, and ends when this is dropped.
pub(crate) struct WorkerThread {
    /// The process that started it: a forked process does not have it.
    process: u32,
    jobs: Sender<WorkerJob>,
}

thread_local! {
    /// Idle workers. More than one for nested calls.
    static IDLE: RefCell<Vec<WorkerThread>> = const { RefCell::new(Vec::new()) };
}

/// Runs a job, which must not panic, in a worker. After the job has ended, the caller calls [`WorkerThread::rest`].
///
/// # Errors
///
/// If the system cannot start a thread.
pub(crate) fn spawn(job: impl FnOnce() + Send + 'static) -> io::Result<WorkerThread> {
    let mut job: WorkerJob = Box::new(job);
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
    let (jobs, receive) = mpsc::channel::<WorkerJob>();
    thread::Builder::new().stack_size(STACK).spawn(move || {
        job();
        while let Ok(next) = receive.recv() {
            next();
        }
    })?;
    Ok(WorkerThread { process: process::id(), jobs })
}

impl WorkerThread {
    /// Keeps it for the next call of this thread.
    pub(crate) fn rest(self) {
        IDLE.with_borrow_mut(|idle| idle.push(self));
    }
}
