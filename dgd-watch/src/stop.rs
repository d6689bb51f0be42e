//! How a run that nobody waits for any more is stopped.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Stops what a [`Bench`](crate::Bench) is doing, from any thread.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    is_asked: Arc<AtomicBool>,
}

impl Stop {
    /// Asks for it.
    pub fn stop(&self) {
        self.is_asked.store(true, Ordering::SeqCst);
    }

    /// Whether it is asked for.
    pub fn is_asked(&self) -> bool {
        self.is_asked.load(Ordering::SeqCst)
    }

    /// Before something else is begun.
    pub fn reset(&self) {
        self.is_asked.store(false, Ordering::SeqCst);
    }
}
