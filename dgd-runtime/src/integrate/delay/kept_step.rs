//! Steps as history: those that are recorded, and those that read themselves.
//!
//! A variable delay may be shorter than a step. Such a step first reads beyond the last piece of the history; it is
//! repeated with its own polynomial until it no longer changes.

use crate::error::IntegrateError;
use crate::integrate::delay::discontinuities::Discontinuities;
use crate::integrate::delay::history::NODES;
use crate::integrate::methods::stepper::StepFailure;
use crate::integrate::simulation::{Simulation, StepVariables};
use crate::linalg::norm::{larger, largest_block};
use crate::solution::Solution;
use crate::solved::SolvableSystem;

/// Maximum number of times that a step that reads itself is repeated.
const MOST_PASSES: usize = 12;
/// Change, as a fraction of the tolerance, below which a step that reads itself has converged.
const SETTLED: f64 = 1e-2;
/// A delay may be negative by this fraction of a step: the error of the solution on which it depends.
const AHEAD: f64 = 1e-2;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Discards the data of the previous trial, before a step is tried.
    #[inline]
    pub(in crate::integrate) fn forget_trial(&mut self) {
        if S::FEATURES.past
            && let Some(history) = &mut self.drive.history
        {
            history.forget_trial();
        }
    }

    /// Makes a step that reads itself consistent: repeats it with its own polynomial as history until it no longer
    /// changes.
    #[inline]
    pub(in crate::integrate) fn close_step(
        &mut self,
        h: f64,
        variables: StepVariables,
        solution: &mut Solution,
    ) -> Result<(), StepFailure> {
        if !S::FEATURES.past {
            return Ok(());
        }
        let history = self.drive.history.as_ref();
        if !history.is_some_and(|history| history.has_read_beyond()) {
            return Ok(());
        }
        let Some(mut work) = self.discontinuities.take() else { return Ok(()) };
        let mut closed = Err(StepFailure::Unsettled);
        for _ in 0..MOST_PASSES {
            self.remember(self.t + h, true);
            work.before.as_mut().copy_from_slice(self.stepper.y_new.as_ref());
            if let (Some(d), Some(s)) = (&self.directions, &mut work.s) {
                s.as_mut().copy_from_slice(d.s_new.as_ref());
            }
            if let Err(failed) = self.attempt(h, variables, solution) {
                closed = Err(failed);
                break;
            }
            if self.has_settled(&mut work) {
                self.remember(self.t + h, true);
                closed = Ok(());
                break;
            }
        }
        self.discontinuities = Some(work);
        closed
    }

    /// Whether the last tried step equals the one before it, to a fraction of the tolerance.
    fn has_settled(&self, work: &mut Discontinuities<S>) -> bool {
        let (y, y_new) = (self.y.as_ref(), self.stepper.y_new.as_ref());
        for (before, after) in work.before.as_mut().iter_mut().zip(y_new) {
            *before -= after;
        }
        let tolerances = self.tolerances;
        let mut moved = tolerances.mean_square(work.before.as_ref(), y, y_new, self.sizes.as_ref());
        if let (Some(d), Some(s)) = (&self.directions, &mut work.s) {
            for (before, after) in s.as_mut().iter_mut().zip(d.s_new.as_ref()) {
                *before -= after;
            }
            let (s_old, s_new) = (d.s.as_ref(), d.s_new.as_ref());
            let n = y.len().max(1);
            let moved_s = largest_block(tolerances, n, s.as_ref(), s_old, s_new, d.sizes.as_ref());
            moved = larger(moved, moved_s);
        }
        moved <= SETTLED * SETTLED
    }

    /// The error for a variable delay that is negative at the end of the last tried step, if there is one.
    #[inline]
    pub(in crate::integrate) fn reads_ahead(&mut self, h: f64) -> Option<IntegrateError> {
        if !S::FEATURES.past {
            return None;
        }
        let t = self.t + h;
        let (delay, value) = self.drive.earliest(t, self.stepper.y_new.as_ref())?;
        (value < -AHEAD * h).then(|| {
            let delay = self.problem.system.signature().varying_delays[delay].to_string();
            IntegrateError::DelayBelowZero { t, delay, value }
        })
    }

    /// Records the last tried step, to `t_new`, in the history.
    #[inline]
    pub(in crate::integrate) fn remember_step(&mut self, t_new: f64) {
        if S::FEATURES.past {
            self.remember(t_new, false);
        }
    }

    fn remember(&mut self, t_new: f64, for_now: bool) {
        if !for_now && self.remembers_algebraic() {
            return self.remember_projected(t_new);
        }
        let Some(history) = &mut self.drive.history else { return };
        self.stepper.prepare_dense(self.y.as_ref(), self.directions.as_mut());
        history.begin_piece(self.t, t_new, for_now);
        let y = self.y.as_ref();
        for (node, theta) in NODES.iter().enumerate() {
            self.stepper.interpolate(*theta, y, self.row.as_mut());
            let s = match (&self.directions, &mut self.sensitivity_row) {
                (Some(d), Some(row)) => {
                    self.stepper.interpolate_sensitivities(*theta, d, row.as_mut());
                    Some((*row).as_ref())
                }
                _ => None,
            };
            history.set_node(node, self.row.as_ref(), s);
        }
        history.end_piece();
    }

    /// Whether algebraic unknowns are delayed and were not read within the step itself, where they have the step's own
    /// values.
    fn remembers_algebraic(&self) -> bool {
        let mass = self.algebraic.mass.as_ref();
        let of_others = self.drive.history.as_ref().filter(|history| !history.has_trial());
        of_others.is_some_and(|history| history.watches(|unknown| mass[unknown] == 0.0))
    }

    /// [`Self::remember`] with rows between the ends projected onto their algebraic equations. The ends are those of
    /// the step.
    fn remember_projected(&mut self, t_new: f64) {
        self.stepper.prepare_dense(self.y.as_ref(), self.directions.as_mut());
        self.begin_projection();
        let h = t_new - self.t;
        let mut rows = Vec::with_capacity(NODES.len());
        for theta in NODES {
            let (mut row, mut row_s) = (self.row.clone(), self.sensitivity_row.clone());
            self.stepper.interpolate(theta, self.y.as_ref(), row.as_mut());
            if let (Some(d), Some(row_s)) = (&self.directions, &mut row_s) {
                self.stepper.interpolate_sensitivities(theta, d, row_s.as_mut());
            }
            if theta > 0.0 && theta < 1.0 {
                let s = row_s.as_mut().map(AsMut::as_mut);
                self.project(self.t + theta * h, row.as_mut(), s);
            }
            rows.push((row, row_s));
        }
        // A row in between may read the previous step: this one exists only now.
        let Some(history) = &mut self.drive.history else { return };
        history.begin_piece(self.t, t_new, false);
        for (node, (row, row_s)) in rows.iter().enumerate() {
            history.set_node(node, row.as_ref(), row_s.as_ref().map(AsRef::as_ref));
        }
        history.end_piece();
    }
}
