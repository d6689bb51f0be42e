//! The loop over the segments of the inputs, with equal steps in each.
//!
//! ```text
//!   for each segment [a, b] of the inputs:
//!     h = (b − a) / n                            n from the grid
//!     for k = 0 … n − 1:  x(a + k h) → x(a + (k + 1) h)
//! ```
//!
//! No step is rejected, nothing depends on an error, and x is a smooth function of the data of the run: sensitivities
//! are its derivatives, to rounding.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use super::carried::CarriedState;
use super::choice::RunErrors;
use super::grid::StepGrid;
use super::method::{FixedStep, LastStep, SegmentModel};
use super::segment_inputs::SegmentInputs;
use crate::error::IntegrateError;
use crate::integrate::watched::RunMonitor;
use crate::linalg::norm::Tolerances;
use crate::linalg::norm::larger;
use crate::signal::{Inputs, LimitSide, Segment};
use crate::solved::SolvableSystem;

/// The problem and the times of a run.
pub(crate) struct RunSchedule<'a, S> {
    pub(crate) system: &'a S,
    pub(crate) p: &'a [f64],
    pub(crate) inputs: &'a Inputs,
    /// Requested times, ascending, at least one.
    pub(crate) times: &'a [f64],
    pub(crate) grid: StepGrid,
    pub(crate) max_steps: usize,
    pub(crate) watched: Option<&'static RunMonitor>,
}

impl<S> RunSchedule<'_, S> {
    /// Number of input segments in the run, including one that begins at its end.
    pub(crate) fn segments(&self) -> usize {
        let last = self.inputs.segment_at(self.times[self.times.len() - 1], LimitSide::Right);
        last + 1 - self.inputs.segment_at(self.times[0], LimitSide::Right)
    }
}

/// Receives values at the requested times.
pub(crate) trait SampleSink {
    /// y and S at the next requested time, with the inputs of the segment that follows it or, on the left side of a
    /// jump, that ends there.
    fn take(&mut self, t: f64, segment: Segment<'_>, y: &[f64], s: &[f64]);
}

/// Measures errors.
pub(crate) struct ErrorGauge<C> {
    tolerances: Tolerances,
    sizes: C,
    error: C,
    measured: RunErrors,
}

impl<C: Clone> ErrorGauge<C> {
    pub(crate) fn new(tolerances: Tolerances, sizes: C) -> Self {
        let error = sizes.clone();
        Self { tolerances, sizes, error, measured: RunErrors { largest: 0.0, stiffness: 0.0 } }
    }

    /// Resets the measurement.
    pub(crate) fn reset(&mut self) {
        self.measured = RunErrors { largest: 0.0, stiffness: 0.0 };
    }

    /// The result of the measurement.
    pub(crate) fn measured(&self) -> RunErrors {
        self.measured
    }

    #[inline(always)]
    fn measure<S: SolvableSystem, M: FixedStep<S, C>>(
        &mut self,
        method: &mut M,
        equations: SegmentModel<'_, S>,
        made: LastStep<'_, C>,
    ) where
        C: CarriedState<S>,
    {
        let stiffness = method.estimate(equations, made, &mut self.error);
        let error = self.error.error_norm(self.tolerances, made.from, made.to, &self.sizes);
        self.measured.largest = larger(error, self.measured.largest);
        self.measured.stiffness = larger(stiffness, self.measured.stiffness);
    }
}

/// Why a run stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum RunStop {
    /// The limit on the number of steps was reached.
    TooMany { t: f64 },
    /// The caller asked it to stop.
    Asked { t: f64 },
    /// The step from this time gives non-finite values.
    NotFinite { t: f64 },
}

impl RunStop {
    /// The error for reaching `max_steps` or being stopped; a non-finite step is converted by the caller.
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

/// Runs from x at the first requested time, in `now`, to the last, and returns the number of steps.
///
/// If the run stops early, `now` holds the last values reached.
#[inline(always)]
pub(crate) fn sweep<S: SolvableSystem, C: CarriedState<S>, M: FixedStep<S, C>>(
    course: &RunSchedule<'_, S>,
    method: &mut M,
    now: &mut C,
    mut gauge: Option<&mut ErrorGauge<C>>,
    sink: &mut impl SampleSink,
) -> Result<usize, RunStop> {
    let RunSchedule { system, p, inputs, times, grid, max_steps, watched } = *course;
    let (mut t, until) = (times[0], times[times.len() - 1]);
    let mut next = now.clone();
    let mut row = now.clone();
    let (mut asked, mut steps) = (0, 0);
    let mut index = inputs.segment_at(t, LimitSide::Right);
    loop {
        let segment = inputs.segment(index);
        let equations = SegmentModel { system, p, inputs: SegmentInputs::new(segment) };
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
            return Err(RunStop::TooMany { t });
        }
        let h = (end - begin) / count as f64;
        for k in 1..=count {
            if watched.is_some_and(|watched| watched.passes(t).is_err()) {
                return Err(RunStop::Asked { t });
            }
            method.step(equations, t, h, now, &mut next);
            let made = LastStep { t, h, from: &*now, to: &next };
            if let Some(gauge) = &mut gauge {
                gauge.measure(method, equations, made);
            }
            if !next.is_finite() {
                return Err(RunStop::NotFinite { t });
            }
            let t_new = if k == count { end } else { begin + k as f64 * h };
            while asked < times.len() && times[asked] < t_new {
                method.interpolate(equations, made, (times[asked] - t) / h, &mut row);
                sink.take(times[asked], segment, row.y(), row.s());
                asked += 1;
            }
            std::mem::swap(now, &mut next);
            t = t_new;
            // Times within the segment, and at the end of the run if no change of the inputs is there. At a change, all
            // but the last of equal times are just before it.
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
