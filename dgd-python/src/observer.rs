//! Who hears of a piece of work for Python: remarks are collected, progress is handed on by the thread that waits.

use std::sync::{Mutex, PoisonError};

use dgd_identify::{Of, Progress, Watch};
use dgd_runtime::Watched;
use dgd_work::{Listener, Remark};
use pyo3::prelude::*;

/// What no call looks at any more, and was never stopped: each lives as long as the program.
static UNUSED: Mutex<Vec<&'static Watched>> = Mutex::new(Vec::new());

/// Hears of a piece of work, and may stop it.
#[derive(Debug)]
pub(crate) struct Observer {
    watched: &'static Watched,
    remarks: Mutex<Vec<String>>,
    progress: Mutex<Option<Progress>>,
    /// What is called with `what`, `done`, `all` and whether `all` is only the most.
    shows: Option<Py<PyAny>>,
}

impl Observer {
    /// One that shows progress, if this is something.
    pub(crate) fn new(shows: Option<Py<PyAny>>) -> Self {
        let unused = UNUSED.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let watched = unused.unwrap_or_else(|| Box::leak(Box::default()));
        Observer { watched, remarks: Mutex::default(), progress: Mutex::default(), shows }
    }

    /// Asks the work to stop; whether it was asked before.
    pub(crate) fn stop(&self) -> bool {
        self.watched.stop()
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
        self.watched.is_stopped()
    }

    fn watched(&self) -> Option<&'static Watched> {
        Some(self.watched)
    }
}

impl Listener for Observer {
    fn remark(&self, remark: Remark<'_>) {
        self.remarks.lock().unwrap_or_else(PoisonError::into_inner).push(remark.to_text());
    }

    fn hears_progress(&self) -> bool {
        self.shows.is_some()
    }
}

impl Drop for Observer {
    fn drop(&mut self) {
        if !self.watched.is_stopped() {
            self.watched.reset();
            UNUSED.lock().unwrap_or_else(PoisonError::into_inner).push(self.watched);
        }
    }
}
