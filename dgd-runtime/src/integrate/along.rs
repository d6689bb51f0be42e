//! Inputs along a segment.

// Lengths are constants where storage has a fixed size, and only once inlined there.
#![allow(clippy::inline_always)]

use crate::signal::Segment;
use crate::system::{Storage, System};

/// Inputs along a segment: u at t₀, its slope, and u where it was asked for last.
pub(crate) struct Along<S: System> {
    t0: f64,
    start: S::Inputs,
    slope: S::Inputs,
    pub(super) now: S::Inputs,
    is_constant: bool,
}

impl<S: System> Along<S> {
    /// So many inputs, at zero.
    pub(crate) fn new(n_u: usize) -> Self {
        let zeros = || S::Inputs::zeros(n_u);
        Self { t0: 0.0, start: zeros(), slope: zeros(), now: zeros(), is_constant: true }
    }

    /// Goes on with a segment, from where it begins.
    #[inline(always)]
    pub(crate) fn enter(&mut self, segment: Segment<'_>) {
        self.t0 = segment.t0;
        self.start.as_mut().copy_from_slice(segment.u);
        self.slope.as_mut().copy_from_slice(segment.udot);
        self.now.as_mut().copy_from_slice(segment.u);
        self.is_constant = segment.is_constant();
    }

    /// u(t).
    #[inline(always)]
    pub(crate) fn at(&mut self, t: f64) -> &[f64] {
        if !self.is_constant {
            let (u, udot) = (self.start.as_ref(), self.slope.as_ref());
            let segment = Segment { t0: self.t0, t1: f64::INFINITY, u, udot };
            segment.value(t, self.now.as_mut());
        }
        self.now.as_ref()
    }

    /// u where it was asked for last, and u̇.
    #[inline(always)]
    pub(crate) fn with_slope(&self) -> (&[f64], &[f64]) {
        (self.now.as_ref(), self.slope.as_ref())
    }
}
