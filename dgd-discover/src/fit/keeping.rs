//! What a discovery keeps of its work, and who looks on.
//!
//! Fits and screens are what takes long. Each is a function of the request and of what its key tells apart,
//! so that a run that was ended finds them in its journal and ends as it would have.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_identify::journal::{Digest, Forgetful, Journal};
use dgd_identify::{Of, Progress, Unwatched, Watch};

/// Where results are kept, and what watches them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WorkJournal<'a> {
    pub journal: &'a dyn Journal,
    pub watch: &'a dyn Watch,
    /// Of the request, which all keys begin with.
    pub request: Digest,
}

impl WorkJournal<'_> {
    /// Keeps nothing, and nobody looks on: for fits whose keys would not tell them apart.
    pub(crate) const NONE: WorkJournal<'static> =
        WorkJournal { journal: &Forgetful, watch: &Unwatched, request: Digest::EMPTY };

    /// The key of what is computed, `what`, from further arguments.
    pub(crate) fn key(
        &self,
        what: &dyn fmt::Debug,
        arguments: impl FnOnce(Digest) -> Digest,
    ) -> u128 {
        arguments(self.request.of(what)).value()
    }

    /// Whether who looks on has said to stop.
    pub(crate) fn is_stopped(&self) -> bool {
        self.watch.is_stopped()
    }

    /// Counts from nothing to a number, and tells of it.
    pub(crate) fn count(&self, what: &'static str, all: usize) -> Count<'_> {
        let count = Count { watch: self.watch, what, all, done: AtomicUsize::new(0) };
        count.more(0);
        count
    }
}

/// How many are done.
pub(crate) struct Count<'a> {
    watch: &'a dyn Watch,
    what: &'static str,
    all: usize,
    done: AtomicUsize,
}

impl Count<'_> {
    /// So many more.
    pub(crate) fn more(&self, n: usize) {
        let done = self.done.fetch_add(n, Ordering::Relaxed) + n;
        self.watch.advanced(Progress { what: self.what, done, of: Of::Exactly(self.all) });
    }
}
