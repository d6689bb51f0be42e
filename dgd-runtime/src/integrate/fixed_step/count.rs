//! The search for the number of steps per sample.

use super::PerSample;
use super::choice::RunErrors;
use super::error::PerSampleError;
use crate::error::IntegrateError;

/// Maximum number of steps per sample tried.
pub(super) const MOST: u32 = 64;

/// The number of steps per sample.
pub(super) struct StepCount {
    pub(super) n: u32,
    wanted: PerSample,
    method: &'static str,
}

impl StepCount {
    pub(super) fn new(wanted: PerSample, method: &'static str) -> Self {
        let n = match wanted {
            PerSample::Automatic => 1,
            PerSample::Exactly(n) => n.get(),
        };
        Self { n, wanted, method }
    }

    /// Whether errors determine it.
    pub(super) fn is_open(&self) -> bool {
        self.wanted == PerSample::Automatic
    }

    /// Records that a run becomes non-finite from `t` on.
    pub(super) fn refuse(&mut self, t: f64) -> Result<(), IntegrateError> {
        if self.is_open() && self.n < MOST {
            self.n = (2 * self.n).min(MOST);
            return Ok(());
        }
        let (per_sample, method) = (self.n, self.method);
        Err(IntegrateError::PerSample(PerSampleError::NotFinite { t, per_sample, method }))
    }

    /// Records the errors of a whole run, which fall with the power `exponent` of the step size. Returns whether they
    /// are small enough.
    pub(super) fn settle(
        &mut self,
        measured: RunErrors,
        exponent: u32,
    ) -> Result<bool, IntegrateError> {
        if !self.is_open() {
            return Ok(true);
        }
        let Some(n) = measured.wants_more_than(self.n, exponent) else {
            return Ok(true);
        };
        if self.n == MOST {
            return Err(IntegrateError::PerSample(PerSampleError::Inaccurate {
                per_sample: self.n,
                method: self.method,
                error: measured.largest.sqrt(),
            }));
        }
        self.n = n;
        Ok(false)
    }
}
