//! Inputs while a run goes on, and what delayed unknowns were.

use super::history::History;
use crate::problem::Problem;
use crate::signal::Segment;
use crate::system::{Storage, System};

/// Inputs along the current segment.
pub(crate) struct Drive<'a, S: System> {
    problem: &'a Problem<'a, S>,
    t0: f64,
    start: S::Inputs,
    slope: S::Inputs,
    now: S::Inputs,
    constant: bool,
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
    ) -> Self {
        let n_u = segment.u.len();
        let mut drive = Self {
            problem,
            t0: 0.0,
            start: S::Inputs::zeros(n_u),
            slope: S::Inputs::zeros(n_u),
            now: S::Inputs::zeros(n_u),
            constant: true,
            history: History::new(problem, from, n_s),
        };
        drive.enter(segment);
        drive
    }

    pub(crate) fn enter(&mut self, segment: Segment<'_>) {
        self.t0 = segment.t0;
        self.start.as_mut().copy_from_slice(segment.u);
        self.slope.as_mut().copy_from_slice(segment.udot);
        self.now.as_mut().copy_from_slice(segment.u);
        self.constant = segment.is_constant();
    }

    /// u(t).
    #[inline]
    pub(crate) fn at(&mut self, t: f64) -> &[f64] {
        if !self.constant {
            let segment = Segment {
                t0: self.t0,
                t1: f64::INFINITY,
                u: self.start.as_ref(),
                udot: self.slope.as_ref(),
            };
            segment.value(t, self.now.as_mut());
        }
        if let Some(history) = &mut self.history {
            history.write(self.problem, t, self.now.as_mut());
        }
        self.now.as_ref()
    }

    /// u(t) and u̇; what was is known with its own slopes.
    #[inline]
    pub(crate) fn with_slope(&mut self, t: f64) -> (&[f64], &[f64]) {
        self.at(t);
        (self.now.as_ref(), self.slope.as_ref())
    }
}
