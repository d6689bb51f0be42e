//! How far a run is, and whether it is to stop: what it shares with whoever waits for it.
//!
//! The run looks at one byte before each step. It writes where it is only where somebody wants to know, so that
//! the threads of a fit share a line of memory that nobody writes to.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use crate::error::IntegrateError;

const STOP: u8 = 1;
const TELL: u8 = 2;

/// What runs and those who wait for them share ([`Options::watched`](crate::Options::watched)).
///
/// It lives as long as the program: runs look at it without a lock, and may be asked to stop when whoever began them is
/// gone.
#[derive(Debug, Default)]
pub struct Watched {
    asked: AtomicU8,
    reached: AtomicU64,
}

impl Watched {
    /// Nothing is asked for.
    pub const fn new() -> Self {
        Self { asked: AtomicU8::new(0), reached: AtomicU64::new(0) }
    }

    /// Asks runs to stop before their next step; whether they were asked before.
    pub fn stop(&self) -> bool {
        self.asked.fetch_or(STOP, Ordering::Relaxed) & STOP != 0
    }

    /// Whether runs are to stop.
    pub fn is_stopped(&self) -> bool {
        self.asked.load(Ordering::Relaxed) & STOP != 0
    }

    /// Forgets what was asked for.
    pub fn reset(&self) {
        self.asked.store(0, Ordering::Relaxed);
    }

    /// Asks a run that is at `t`, s, to tell how far it is.
    pub fn tell(&self, t: f64) {
        self.reached.store(t.to_bits(), Ordering::Relaxed);
        self.asked.fetch_or(TELL, Ordering::Relaxed);
    }

    /// The time that the run has reached, s.
    pub fn reached(&self) -> f64 {
        f64::from_bits(self.reached.load(Ordering::Relaxed))
    }

    /// A run is at `t`, s.
    #[inline]
    pub(crate) fn passes(&self, t: f64) -> Result<(), IntegrateError> {
        match self.asked.load(Ordering::Relaxed) {
            0 => Ok(()),
            asked => self.answers(asked, t),
        }
    }

    #[cold]
    fn answers(&self, asked: u8, t: f64) -> Result<(), IntegrateError> {
        if asked & STOP != 0 {
            return Err(IntegrateError::Stopped { t });
        }
        self.reached.store(t.to_bits(), Ordering::Relaxed);
        Ok(())
    }
}
