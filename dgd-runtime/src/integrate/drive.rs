//! Inputs during a run, and the past of delayed unknowns.

use crate::algebraic::InputsAt;
use crate::integrate::delay::history::{DelayHistory, Discontinuity, PastSolution};
use crate::integrate::enclosure::{Interval, Tube};
use crate::linalg::norm::Tolerances;
use crate::problem::Problem;
use crate::signal::Segment;
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// Inputs at one time, where those that act late may depend on the unknowns.
pub(crate) struct InstantInputs<'d, 'a, S: SolvableSystem> {
    pub(crate) drive: &'d mut InputCursor<'a, S>,
    pub(crate) t: f64,
}

impl<S: SolvableSystem> InputsAt for InstantInputs<'_, '_, S> {
    #[inline]
    fn evaluate(&mut self, y: &[f64]) -> &[f64] {
        self.drive.evaluate(self.t, y)
    }
}

/// Inputs along the current segment.
pub(crate) struct InputCursor<'a, S: SolvableSystem> {
    problem: &'a Problem<'a, S>,
    /// The segment: its start, u there, and u̇.
    t0: f64,
    start: S::Inputs,
    slope: S::Inputs,
    is_constant: bool,
    /// u at the time of the last call.
    now: S::Inputs,
    /// The past of delayed unknowns, which follows the inputs; `None` if there are none.
    pub(super) history: Option<Box<DelayHistory>>,
}

impl<'a, S: SolvableSystem> InputCursor<'a, S> {
    /// The inputs of a run that starts at `from`, with n_s directions.
    pub(crate) fn new(
        problem: &'a Problem<'a, S>,
        segment: Segment<'_>,
        from: f64,
        n_s: usize,
        tolerances: Tolerances,
    ) -> Self {
        let zeros = || S::Inputs::zeros(segment.u.len());
        let mut drive = Self {
            problem,
            t0: segment.t0,
            start: zeros(),
            slope: zeros(),
            is_constant: true,
            now: zeros(),
            history: if S::FEATURES.past {
                DelayHistory::new(problem, from, n_s, tolerances)
            } else {
                None
            },
        };
        drive.enter(segment);
        drive
    }

    pub(crate) fn enter(&mut self, segment: Segment<'_>) {
        self.t0 = segment.t0;
        self.start.as_mut().copy_from_slice(segment.u);
        self.slope.as_mut().copy_from_slice(segment.udot);
        self.now.as_mut().copy_from_slice(segment.u);
        self.is_constant = segment.is_constant();
    }

    /// u(t); delays may depend on y(t).
    #[inline]
    pub(crate) fn evaluate(&mut self, t: f64, y: &[f64]) -> &[f64] {
        if !self.is_constant {
            let (u, udot) = (self.start.as_ref(), self.slope.as_ref());
            let segment = Segment { t0: self.t0, t1: f64::INFINITY, u, udot };
            segment.value(t, self.now.as_mut());
        }
        if S::FEATURES.past
            && let Some(history) = &mut self.history
        {
            history.write(self.problem, t, y, self.now.as_mut());
        }
        self.now.as_ref()
    }

    /// A delayed value along an interval, if it can be enclosed.
    pub(super) fn past_tube(&self, i: usize, times: [f64; 2]) -> Option<Tube> {
        if !S::FEATURES.past {
            return None;
        }
        self.history.as_ref()?.tube(i, times)
    }

    /// An input along an interval of the segment.
    pub(super) fn tube(&self, i: usize, time: Tube) -> Tube {
        let (start, slope) = (self.start.as_ref()[i], self.slope.as_ref()[i]);
        let start = Tube::still(Interval::point(start));
        if slope == 0.0 {
            return start;
        }
        let passed = time.minus(Tube::still(Interval::point(self.t0)));
        start.plus(passed.times(Tube::still(Interval::point(slope))))
    }

    /// u(t) and u̇; the slopes of delayed unknowns are their own entries of u.
    #[inline]
    pub(crate) fn with_slope(&mut self, t: f64, y: &[f64]) -> (&[f64], &[f64]) {
        self.evaluate(t, y);
        (self.now.as_ref(), self.slope.as_ref())
    }

    /// Continues from a past that is known until `t`.
    pub(super) fn resume_history(&mut self, past: &PastSolution, t: f64) {
        if let Some(history) = &mut self.history {
            history.resume(past, t);
        }
    }

    /// Starts the history with consistent values at `t`.
    pub(crate) fn begin_history(&mut self, t: f64, y: &[f64], s: Option<&[f64]>, sizes: &[f64]) {
        self.evaluate(t, y);
        if let Some(history) = &mut self.history {
            history.begin(self.problem, t, y, s, sizes, self.now.as_ref());
        }
    }

    /// Whether there are variable delays.
    #[inline]
    pub(super) fn has_varying_delays(&self) -> bool {
        S::FEATURES.past && self.history.as_ref().is_some_and(|history| history.varies())
    }

    /// Makes variable delays read where they lead at (t, y), where they may have jumped.
    #[inline]
    pub(super) fn locate_delays(&mut self, t: f64, y: &[f64]) {
        if !self.has_varying_delays() {
            return;
        }
        self.evaluate(t, y);
        if let Some(history) = &mut self.history {
            history.locate(self.problem, t, y, self.now.as_ref());
        }
    }

    /// Whether variable delays read wherever they lead, as while equations are solved for them, from now on.
    #[inline]
    pub(super) fn free_delays(&mut self, is_free: bool) {
        if S::FEATURES.past
            && let Some(history) = &mut self.history
        {
            history.free(is_free);
        }
    }

    /// Makes a delay read values on the other side of a mark, which it reaches at (t, y).
    pub(super) fn pass(&mut self, at: &Discontinuity, t: f64, y: &[f64]) {
        self.evaluate(t, y);
        if let Some(history) = &mut self.history {
            history.pass(at, t);
        }
    }

    /// The first variable delay that has passed a mark at (t, y), and whether backwards.
    pub(super) fn passed_mark(&mut self, t: f64, y: &[f64]) -> Option<(usize, bool)> {
        if !self.has_varying_delays() {
            return None;
        }
        self.evaluate(t, y);
        self.history.as_mut()?.passed(self.problem, t, y, self.now.as_ref())
    }

    /// The smallest variable delay, and its value.
    #[inline]
    pub(super) fn earliest(&mut self, t: f64, y: &[f64]) -> Option<(usize, f64)> {
        if !self.has_varying_delays() {
            return None;
        }
        self.evaluate(t, y);
        self.history.as_mut()?.earliest(self.problem, t, y, self.now.as_ref())
    }
}
