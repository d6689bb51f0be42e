//! Observes work for Python: collects remarks, and forwards progress in the waiting thread.

use std::sync::{Mutex, PoisonError};

use dgd_identify::{Monitor, Progress, Total};
use dgd_runtime::RunMonitor;
use dgd_work::{Remark, Reporter, Spelling};
use pyo3::prelude::*;

use crate::errors::keyword;

/// Flags that no call uses any more and that were never set: each lives as long as the program.
static UNUSED: Mutex<Vec<&'static RunMonitor>> = Mutex::new(Vec::new());

/// Observes work, and can cancel it.
#[derive(Debug)]
pub(crate) struct PyObserver {
    watched: &'static RunMonitor,
    remarks: Mutex<Vec<String>>,
    progress: Mutex<Option<Progress>>,
    /// Callback with `what`, `done`, `all` and whether `all` is an upper limit.
    shows: Option<Py<PyAny>>,
}

impl PyObserver {
    /// An observer that shows progress if there is a callback.
    pub(crate) fn new(shows: Option<Py<PyAny>>) -> Self {
        let unused = UNUSED.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let watched = unused.unwrap_or_else(|| Box::leak(Box::default()));
        PyObserver { watched, remarks: Mutex::default(), progress: Mutex::default(), shows }
    }

    /// Cancels the work; returns whether it was cancelled before.
    pub(crate) fn stop(&self) -> bool {
        self.watched.stop()
    }

    /// The remarks.
    pub(crate) fn remarks(&self) -> Vec<String> {
        self.remarks.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Shows progress, if any was made since the last call.
    pub(crate) fn show(&self, py: Python<'_>) -> PyResult<()> {
        let Some(shows) = &self.shows else { return Ok(()) };
        let progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(Progress { what, done, of }) = progress else { return Ok(()) };
        let (all, is_most) = match of {
            Total::Exactly(all) => (all, false),
            Total::AtMost(all) => (all, true),
        };
        shows.call1(py, (what, done, all, is_most)).map(drop)
    }
}

impl Monitor for PyObserver {
    fn advanced(&self, progress: Progress) {
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
    }

    fn is_stopped(&self) -> bool {
        self.watched.is_stopped()
    }

    fn watched(&self) -> Option<&'static RunMonitor> {
        Some(self.watched)
    }
}

impl Reporter for PyObserver {
    fn spelling(&self) -> Spelling {
        keyword
    }

    fn remark(&self, remark: Remark<'_>) {
        self.remarks.lock().unwrap_or_else(PoisonError::into_inner).push(remark.to_text(keyword));
    }

    fn hears_progress(&self) -> bool {
        self.shows.is_some()
    }
}

impl Drop for PyObserver {
    fn drop(&mut self) {
        if !self.watched.is_stopped() {
            self.watched.reset();
            UNUSED.lock().unwrap_or_else(PoisonError::into_inner).push(self.watched);
        }
    }
}
