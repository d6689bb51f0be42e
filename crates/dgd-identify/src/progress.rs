//! Progress and cancellation of long estimations.

use std::fmt;

use dgd_runtime::RunMonitor;

/// Receives progress of a long computation, and can cancel it.
///
/// A cancelled computation returns its best result, marked with [`Termination::Stopped`](super::Termination).
pub trait Monitor: fmt::Debug + Sync {
    /// Reports progress. Called between simulations, by any thread.
    fn advanced(&self, progress: Progress);

    /// Whether to stop. Called between simulations, by any thread; once true it stays true.
    fn is_stopped(&self) -> bool;

    /// A flag that runs check before each step, if cancellation is possible there; it is set if and only if
    /// [`Monitor::is_stopped`].
    fn watched(&self) -> Option<&'static RunMonitor> {
        None
    }
}

/// Progress of a computation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// The counted items, in the plural.
    pub what: &'static str,
    /// Number of items done.
    pub done: usize,
    /// Total number of items.
    pub of: Total,
}

/// The total number of items.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Total {
    /// An exact number.
    Exactly(usize),
    /// An upper limit, often far too high.
    AtMost(usize),
}

/// Ignores progress and never cancels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoMonitor;

impl Monitor for NoMonitor {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}
