//! Who hears of a piece of work for Python: remarks are collected, progress is handed on by the thread that waits.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use dgd_identify::{Of, Progress, Watch};
use dgd_work::{Listener, Remark};
use pyo3::prelude::*;

/// Hears of a piece of work, and may stop it.
#[derive(Debug, Default)]
pub(crate) struct Observer {
    is_stopped: AtomicBool,
    remarks: Mutex<Vec<String>>,
    progress: Mutex<Option<Progress>>,
    /// What is called with `what`, `done`, `all` and whether `all` is only the most.
    shows: Option<Py<PyAny>>,
}

impl Observer {
    /// One that shows progress, if this is something.
    pub(crate) fn new(shows: Option<Py<PyAny>>) -> Self {
        Observer { shows, ..Observer::default() }
    }

    /// Asks the work to stop; whether it was asked before.
    pub(crate) fn stop(&self) -> bool {
        self.is_stopped.swap(true, Ordering::Relaxed)
    }

    /// What was remarked.
    pub(crate) fn remarks(&self) -> Vec<String> {
        self.remarks.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Shows how far the work is, where something was done since this was called.
    pub(crate) fn show(&self, py: Python<'_>) -> PyResult<()> {
        let Some(shows) = &self.shows else { return Ok(()) };
        let progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(Progress { what, done, of }) = progress else { return Ok(()) };
        let (all, is_most) = match of {
            Of::Exactly(all) => (all, false),
            Of::AtMost(all) => (all, true),
        };
        shows.call1(py, (what, done, all, is_most)).map(drop)
    }
}

impl Watch for Observer {
    fn advanced(&self, progress: Progress) {
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
    }

    fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::Relaxed)
    }
}

impl Listener for Observer {
    fn remark(&self, remark: Remark<'_>) {
        self.remarks.lock().unwrap_or_else(PoisonError::into_inner).push(remark.to_text());
    }
}
