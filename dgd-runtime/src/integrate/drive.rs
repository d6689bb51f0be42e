//! Inputs while a run goes on, and what delayed unknowns were.

use super::along::Along;
use super::history::History;
use crate::linalg::norm::Tolerances;
use crate::problem::Problem;
use crate::signal::Segment;
use crate::system::System;

/// Inputs along the current segment.
pub(crate) struct Drive<'a, S: System> {
    problem: &'a Problem<'a, S>,
    inputs: Along<S>,
    /// What is read late of the unknowns, behind the inputs; `None` where nothing is.
    pub(super) history: Option<Box<History>>,
}

impl<'a, S: System> Drive<'a, S> {
    /// The inputs of a run from `from` on, with n_s directions.
    pub(crate) fn new(
        problem: &'a Problem<'a, S>,
        segment: Segment<'_>,
        from: f64,
        n_s: usize,
        tolerances: Tolerances,
    ) -> Self {
        let n_u = segment.u.len();
        let mut drive = Self {
            problem,
            inputs: Along::new(n_u),
            history: if S::FEATURES.past {
                History::new(problem, from, n_s, tolerances)
            } else {
                None
            },
        };
        drive.enter(segment);
        drive
    }

    pub(crate) fn enter(&mut self, segment: Segment<'_>) {
        self.inputs.enter(segment);
    }

    /// u(t); what is read late may depend on y(t).
    #[inline]
    pub(crate) fn at(&mut self, t: f64, y: &[f64]) -> &[f64] {
        self.inputs.at(t);
        if S::FEATURES.past
            && let Some(history) = &mut self.history
        {
            history.write(self.problem, t, y, self.inputs.now.as_mut());
        }
        self.inputs.now.as_ref()
    }

    /// u(t) and u̇; what was is known with its own slopes.
    #[inline]
    pub(crate) fn with_slope(&mut self, t: f64, y: &[f64]) -> (&[f64], &[f64]) {
        self.at(t, y);
        self.inputs.with_slope()
    }

    /// Begins the history with consistent values at `t`.
    pub(crate) fn begin_history(&mut self, t: f64, y: &[f64], s: Option<&[f64]>, sizes: &[f64]) {
        self.at(t, y);
        if let Some(history) = &mut self.history {
            history.begin(self.problem, (y, s), sizes, self.inputs.now.as_ref());
        }
    }

    /// The first delay that varies and has passed a mark at (t, y), and whether backwards.
    pub(super) fn passed_mark(&mut self, t: f64, y: &[f64]) -> Option<(usize, bool)> {
        if !S::FEATURES.past || !self.history.as_ref()?.varies() {
            return None;
        }
        self.at(t, y);
        self.history.as_mut()?.passed(self.problem, (t, y), self.inputs.now.as_ref())
    }

    /// The smallest of the delays that vary, and its value.
    #[inline]
    pub(super) fn earliest(&mut self, t: f64, y: &[f64]) -> Option<(usize, f64)> {
        if !S::FEATURES.past || !self.history.as_ref()?.varies() {
            return None;
        }
        self.at(t, y);
        self.history.as_mut()?.earliest(self.problem, (t, y), self.inputs.now.as_ref())
    }
}
