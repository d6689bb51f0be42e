//! Inputs along a segment.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use crate::signal::Segment;

/// Inputs along a segment, with a flag whether any changes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SegmentInputs<'a> {
    segment: Segment<'a>,
    is_constant: bool,
}

impl<'a> SegmentInputs<'a> {
    #[inline(always)]
    pub(crate) fn new(segment: Segment<'a>) -> Self {
        Self { segment, is_constant: segment.is_constant() }
    }

    /// u(t), which is written to `now` if inputs change.
    #[inline(always)]
    pub(crate) fn evaluate<'b>(&self, t: f64, now: &'b mut [f64]) -> &'b [f64]
    where
        'a: 'b,
    {
        if self.is_constant {
            return self.segment.u;
        }
        self.segment.value(t, now);
        now
    }

    /// u̇.
    #[inline(always)]
    pub(crate) fn slope(&self) -> &'a [f64] {
        self.segment.udot
    }
}
