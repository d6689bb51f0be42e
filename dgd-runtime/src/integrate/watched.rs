//! Progress and cancellation of runs, shared with their callers.
//!
//! A run reads one byte before each step. It writes its time only on request, so that the threads of a fit share a
//! cache line that is not written to.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

use crate::error::IntegrateError;

const STOP: u8 = 1;
const TELL: u8 = 2;

/// State shared by runs and their callers ([`Options::watched`](crate::Options::watched)).
///
/// It lives as long as the program: runs read it without a lock, and can be stopped after their callers are gone.
#[derive(Debug, Default)]
pub struct RunMonitor {
    asked: AtomicU8,
    reached: AtomicU64,
}

impl RunMonitor {
    /// No requests.
    pub const fn new() -> Self {
        Self { asked: AtomicU8::new(0), reached: AtomicU64::new(0) }
    }

    /// Asks runs to stop before their next step. Returns whether they were already asked.
    pub fn stop(&self) -> bool {
        self.asked.fetch_or(STOP, Ordering::Relaxed) & STOP != 0
    }

    /// Whether runs are to stop.
    pub fn is_stopped(&self) -> bool {
        self.asked.load(Ordering::Relaxed) & STOP != 0
    }

    /// Clears all requests.
    pub fn reset(&self) {
        self.asked.store(0, Ordering::Relaxed);
    }

    /// Asks a run that is at `t`, s, to report its time.
    pub fn tell(&self, t: f64) {
        self.reached.store(t.to_bits(), Ordering::Relaxed);
        self.asked.fetch_or(TELL, Ordering::Relaxed);
    }

    /// The time that the run has reached, s.
    pub fn reached(&self) -> f64 {
        f64::from_bits(self.reached.load(Ordering::Relaxed))
    }

    /// Reports that a run is at `t`, s; fails if it is to stop.
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
