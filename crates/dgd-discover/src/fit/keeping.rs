//! Stored results of a discovery, and its progress.
//!
//! Fits and screens take longest. Each is a function of the request and of its key, so that an interrupted run finds
//! them in its journal and ends with the same result.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_identify::journal::{Digest, Journal, NoJournal};
use dgd_identify::{Monitor, NoMonitor, Progress, Total};

/// Where results are stored and progress is reported.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WorkJournal<'a> {
    pub journal: &'a dyn Journal,
    pub watch: &'a dyn Monitor,
    /// Digest of the request, with which all keys begin.
    pub request: Digest,
}

impl WorkJournal<'_> {
    /// Stores nothing and reports nothing: for fits that keys would not distinguish.
    pub(crate) const NONE: WorkJournal<'static> =
        WorkJournal { journal: &NoJournal, watch: &NoMonitor, request: Digest::EMPTY };

    /// The key of the result `what`, computed from further arguments.
    pub(crate) fn key(
        &self,
        what: &dyn fmt::Debug,
        arguments: impl FnOnce(Digest) -> Digest,
    ) -> u128 {
        arguments(self.request.debug(what)).value()
    }

    /// Whether the run was cancelled.
    pub(crate) fn is_stopped(&self) -> bool {
        self.watch.is_stopped()
    }

    /// A counter from zero to `all` that reports progress.
    pub(crate) fn count(&self, what: &'static str, all: usize) -> ProgressCounter<'_> {
        let count = ProgressCounter { watch: self.watch, what, all, done: AtomicUsize::new(0) };
        count.more(0);
        count
    }
}

/// A counter of finished items.
pub(crate) struct ProgressCounter<'a> {
    watch: &'a dyn Monitor,
    what: &'static str,
    all: usize,
    done: AtomicUsize,
}

impl ProgressCounter<'_> {
    /// Adds `n` finished items.
    pub(crate) fn more(&self, n: usize) {
        let done = self.done.fetch_add(n, Ordering::Relaxed) + n;
        self.watch.advanced(Progress { what: self.what, done, of: Total::Exactly(self.all) });
    }
}
