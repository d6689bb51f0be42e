//! Stops a run whose result is no longer needed.

use dgd_runtime::RunMonitor;

/// Stops the work of a [`ModelBench`](crate::ModelBench), from any thread, before its next step.
#[derive(Debug, Clone, Copy)]
pub struct StopHandle {
    watched: &'static RunMonitor,
}

impl Default for StopHandle {
    /// Allocates for the lifetime of the program, since runs read it without a lock.
    fn default() -> Self {
        StopHandle { watched: Box::leak(Box::default()) }
    }
}

impl StopHandle {
    /// Requests a stop.
    pub fn stop(&self) {
        self.watched.stop();
    }

    /// Whether a stop is requested.
    pub fn is_asked(&self) -> bool {
        self.watched.is_stopped()
    }

    /// Clears the request before new work begins.
    pub fn reset(&self) {
        self.watched.reset();
    }

    /// The state that runs check.
    pub(crate) fn watched(self) -> &'static RunMonitor {
        self.watched
    }
}
