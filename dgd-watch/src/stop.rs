//! How a run that nobody waits for any more is stopped.

use dgd_runtime::Watched;

/// Stops what a [`Bench`](crate::Bench) is doing, from any thread, before its next step.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    watched: &'static Watched,
}

impl Default for Stop {
    /// For one bench: runs look at it for as long as the program lives.
    fn default() -> Self {
        Stop { watched: Box::leak(Box::default()) }
    }
}

impl Stop {
    /// Asks for it.
    pub fn stop(&self) {
        self.watched.stop();
    }

    /// Whether it is asked for.
    pub fn is_asked(&self) -> bool {
        self.watched.is_stopped()
    }

    /// Before something else is begun.
    pub fn reset(&self) {
        self.watched.reset();
    }

    /// What runs look at.
    pub(crate) fn watched(self) -> &'static Watched {
        self.watched
    }
}
