//! Who looks on while something long is estimated, and may end it.

use std::fmt;

use dgd_runtime::Watched;

/// Looks on while something long is computed, and says when to stop.
///
/// A stopped computation gives the best it has, marked as such: [`Termination::Stopped`](super::Termination).
pub trait Watch: fmt::Debug + Sync {
    /// So much is done. It is called between simulations, by any thread.
    fn advanced(&self, progress: Progress);

    /// Whether to stop. It is asked between simulations, by any thread; once it is said it stays.
    fn is_stopped(&self) -> bool;

    /// What runs look at before each step, where who looks on can stop them there; it is stopped when and only when
    /// [`Watch::is_stopped`].
    fn watched(&self) -> Option<&'static Watched> {
        None
    }
}

/// How far a computation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is counted, in the plural.
    pub what: &'static str,
    /// How many are done.
    pub done: usize,
    /// How many there will be.
    pub of: Of,
}

/// How many there will be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// So many.
    Exactly(usize),
    /// No more than so many, and often far fewer.
    AtMost(usize),
}

/// Nobody looks on, and nothing is stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}
