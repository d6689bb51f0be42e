//! The loop over the segments of the inputs, with equal steps in each.
//!
//! ```text
//!   for each segment [a, b] of the inputs:
//!     h = (b − a) / n                            n from the grid
//!     for k = 0 … n − 1:  x(a + k h) → x(a + (k + 1) h)
//! ```
//!
//! No step is rejected, nothing depends on an error, and x is a smooth function of what the run
//! depends on: sensitivities are its derivatives, to rounding.

// Lengths are constants where storage has a fixed size, and only once inlined there.
#![allow(clippy::inline_always)]

use super::carried::Carried;
use super::choice::Measured;
use super::grid::Grid;
use super::method::{Equations, FixedStep, Made};
use super::segment_inputs::SegmentInputs;
use crate::error::IntegrateError;
use crate::integrate::watched::Watched;
use crate::linalg::norm::Tolerances;
use crate::linalg::norm::larger;
use crate::signal::{Inputs, Segment, Side};
use crate::solved::Solved;

/// What is run.
pub(crate) struct Course<'a, S> {
    pub(crate) system: &'a S,
    pub(crate) p: &'a [f64],
    pub(crate) inputs: &'a Inputs,
    /// Asked times, ascending, one at least.
    pub(crate) times: &'a [f64],
    pub(crate) grid: Grid,
    pub(crate) max_steps: usize,
    pub(crate) watched: Option<&'static Watched>,
}

impl<S> Course<'_, S> {
    /// Segments of the inputs that the run goes through, with the one that begins where it ends.
    pub(crate) fn segments(&self) -> usize {
        let last = self.inputs.segment_at(self.times[self.times.len() - 1], Side::Right);
        last + 1 - self.inputs.segment_at(self.times[0], Side::Right)
    }
}

/// Receives values at the asked times.
pub(crate) trait Sink {
    /// y and S at the next of the asked times, with the inputs that go on from there or, on the left
    /// side of a jump, come up to it.
    fn take(&mut self, t: f64, segment: Segment<'_>, y: &[f64], s: &[f64]);
}

/// What errors are measured by.
pub(crate) struct Gauge<C> {
    tolerances: Tolerances,
    sizes: C,
    error: C,
    measured: Measured,
}

impl<C: Clone> Gauge<C> {
    pub(crate) fn new(tolerances: Tolerances, sizes: C) -> Self {
        let error = sizes.clone();
        Self { tolerances, sizes, error, measured: Measured { largest: 0.0, stiffness: 0.0 } }
    }

    /// Forgets what was measured.
    pub(crate) fn reset(&mut self) {
        self.measured = Measured { largest: 0.0, stiffness: 0.0 };
    }

    /// What was measured.
    pub(crate) fn measured(&self) -> Measured {
        self.measured
    }

    #[inline(always)]
    fn measure<S: Solved, M: FixedStep<S, C>>(
        &mut self,
        method: &mut M,
        equations: Equations<'_, S>,
        made: Made<'_, C>,
    ) where
        C: Carried<S>,
    {
        let stiffness = method.estimate(equations, made, &mut self.error);
        let error = self.error.error_norm(self.tolerances, made.from, made.to, &self.sizes);
        self.measured.largest = larger(error, self.measured.largest);
        self.measured.stiffness = larger(stiffness, self.measured.stiffness);
    }
}

/// Why a run stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stopped {
    /// More steps than allowed.
    TooMany { t: f64 },
    /// Whoever waited for it asked it to.
    Asked { t: f64 },
    /// The step from this time leads to what is not finite.
    NotFinite { t: f64 },
}

impl Stopped {
    /// The error of more than `max_steps` steps, that of one who was stopped, or what is made of a step that is not finite.
    pub(crate) fn into_error<T>(
        self,
        max_steps: usize,
        not_finite: impl FnOnce(f64) -> Result<T, IntegrateError>,
    ) -> Result<T, IntegrateError> {
        match self {
            Self::TooMany { t } => Err(IntegrateError::TooManySteps { t, steps: max_steps }),
            Self::Asked { t } => Err(IntegrateError::Stopped { t }),
            Self::NotFinite { t } => not_finite(t),
        }
    }
}

/// Runs from x at the first of the asked times, in `now`, to the last; gives the number of steps.
///
/// Where the run stops, `now` is what was reached.
#[inline(always)]
pub(crate) fn sweep<S: Solved, C: Carried<S>, M: FixedStep<S, C>>(
    course: &Course<'_, S>,
    method: &mut M,
    now: &mut C,
    mut gauge: Option<&mut Gauge<C>>,
    sink: &mut impl Sink,
) -> Result<usize, Stopped> {
    let Course { system, p, inputs, times, grid, max_steps, watched } = *course;
    let (mut t, until) = (times[0], times[times.len() - 1]);
    let mut next = now.clone();
    let mut row = now.clone();
    let (mut asked, mut steps) = (0, 0);
    let mut index = inputs.segment_at(t, Side::Right);
    loop {
        let segment = inputs.segment(index);
        let equations = Equations { system, p, inputs: SegmentInputs::new(segment) };
        method.enter();
        while asked < times.len() && times[asked] == t {
            sink.take(t, segment, now.y(), now.s());
            asked += 1;
        }
        if asked == times.len() {
            return Ok(steps);
        }

        let (begin, end) = (t, segment.t1.min(until));
        let count = grid.steps(end - begin);
        steps += count;
        if steps > max_steps {
            return Err(Stopped::TooMany { t });
        }
        let h = (end - begin) / count as f64;
        for k in 1..=count {
            if watched.is_some_and(|watched| watched.passes(t).is_err()) {
                return Err(Stopped::Asked { t });
            }
            method.step(equations, t, h, now, &mut next);
            let made = Made { t, h, from: &*now, to: &next };
            if let Some(gauge) = &mut gauge {
                gauge.measure(method, equations, made);
            }
            if !next.is_finite() {
                return Err(Stopped::NotFinite { t });
            }
            let t_new = if k == count { end } else { begin + k as f64 * h };
            while asked < times.len() && times[asked] < t_new {
                method.interpolate(equations, made, (times[asked] - t) / h, &mut row);
                sink.take(times[asked], segment, row.y(), row.s());
                asked += 1;
            }
            std::mem::swap(now, &mut next);
            t = t_new;
            // Within the segment, and at the end of a run that no change of the inputs ends; before a
            // change all but the last of equal times are just before it.
            while asked < times.len()
                && times[asked] == t
                && (t < segment.t1 || times.get(asked + 1) == Some(&t))
            {
                sink.take(t, segment, now.y(), now.s());
                asked += 1;
            }
        }
        if asked == times.len() {
            return Ok(steps);
        }
        index += 1;
    }
}
