//! Breaks: a delay of an unknown reaches a point at which the unknown was not smooth.
//!
//! A jump of x at s, with ds/dθ, is one of x(t − τ) at s + τ, which moves by ds/dθ + ∂τ/∂θ. It is gone
//! through as jumps of inputs that move ([`super::moving_jump`]), and whatever triggers a mark of the
//! history ([`super::history`]) marks it again, one level smoother.

use super::Simulation;
use super::history::{Break, NODES};
use super::moving_jump::NO_JUMP;
use crate::error::IntegrateError;
use crate::signal::Segment;
use crate::solution::Solution;
use crate::system::{Storage, System};

/// Marks from this level on leave the slope of what is read late as it was.
const SMOOTH: u32 = 2;

/// Work space at breaks.
pub(super) struct Breaks<S: System> {
    before: S::Vector,
    after: S::Vector,
}

impl<S: System> Breaks<S> {
    pub(super) fn new(n: usize) -> Self {
        Self { before: S::Vector::zeros(n), after: S::Vector::zeros(n) }
    }
}

impl<S: System> Simulation<'_, S> {
    /// What is read late is known from now on.
    pub(super) fn begin_history(&mut self) {
        let s = self.directions.as_ref().map(|d| d.s.as_ref());
        if let Some(history) = &mut self.drive.history {
            history.begin(self.problem, self.y.as_ref(), s);
            self.linearized = false;
        }
    }

    /// The longest step after which all that is read late is known.
    #[inline]
    pub(super) fn reach(&self) -> f64 {
        self.drive.history.as_ref().map_or(f64::INFINITY, |history| history.reach())
    }

    /// When the next break is.
    #[inline]
    pub(super) fn next_break(&self) -> f64 {
        self.drive.history.as_ref().map_or(f64::INFINITY, |history| history.next_break())
    }

    /// Passes the breaks that are now, one after another.
    pub(super) fn pass_breaks(&mut self, solution: &mut Solution) -> Result<(), IntegrateError> {
        while let Some(at) = self.drive.history.as_ref().and_then(|h| h.break_at(self.t)) {
            let Some(mut work) = self.breaks.take() else { return Ok(()) };
            let passed = self.pass(&at, &mut work, solution);
            self.breaks = Some(work);
            passed?;
            self.mark(at.level + 1, &at.dt);
        }
        Ok(())
    }

    fn pass(
        &mut self,
        at: &Break,
        work: &mut Breaks<S>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.linearized = false;
        if at.level >= SMOOTH {
            if let Some(history) = &mut self.drive.history {
                history.pass(at);
            }
            return Ok(());
        }
        self.begin_moving_jump(&at.dt, solution);
        self.rates(&mut work.before);
        self.change_inputs(solution, |drive| {
            if let Some(history) = &mut drive.history {
                history.pass(at);
            }
        })?;
        self.rates(&mut work.after);
        self.move_sensitivities(&work.before, &work.after, &at.dt, solution)?;
        self.settle(solution)
    }

    /// Marks the present as a point at which a derivative of the solution jumps.
    pub(super) fn mark(&mut self, level: u32, dt: &[f64]) {
        let s = self.directions.as_ref().map(|d| d.s.as_ref());
        if let Some(history) = &mut self.drive.history {
            history.mark(self.t, level, dt, self.y.as_ref(), s);
        }
    }

    /// What the solution makes of the begin of a segment: a kink where an input jumps, less where one
    /// only kinks.
    pub(super) fn level_of(&mut self, segment: Segment<'_>) -> u32 {
        if self.drive.history.is_none() {
            return 0;
        }
        let n = self.problem.system.signature().past().first;
        let before = &self.drive.at(self.t)[..n];
        let jumps = before
            .iter()
            .zip(segment.u)
            .any(|(left, right)| (right - left).abs() > NO_JUMP * left.abs().max(right.abs()));
        if jumps { 1 } else { 2 }
    }

    /// Marks the instant of a change of modes, or of a condition on time.
    pub(super) fn mark_instant(&mut self) {
        let s = self.directions.as_ref().map(|d| d.s.as_ref());
        if let Some(history) = &mut self.drive.history {
            history.mark(self.t, 1, &self.discrete.instant.tau, self.y.as_ref(), s);
        }
    }

    /// Keeps the step to `t_new` that was tried last in the history.
    pub(super) fn remember_step(&mut self, t_new: f64) {
        let Some(history) = &mut self.drive.history else { return };
        self.stepper.prepare_dense(self.directions.as_mut());
        history.begin_piece(self.t, t_new);
        let (y, h) = (self.y.as_ref(), t_new - self.t);
        for (node, theta) in NODES.iter().enumerate() {
            self.stepper.interpolate(*theta, h, y, self.row.as_mut());
            let s = match (&self.directions, &mut self.sensitivity_row) {
                (Some(d), Some(row)) => {
                    self.stepper.interpolate_sensitivities(*theta, h, d, row.as_mut());
                    Some((*row).as_ref())
                }
                _ => None,
            };
            history.set_node(node, self.row.as_ref(), s);
        }
        history.end_piece();
    }
}
