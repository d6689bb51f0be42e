//! Records values at the requested times.

mod chosen;
pub(crate) mod projection;

use crate::integrate::drive::InputCursor;
use crate::integrate::methods::family::RequestedTimes;
use crate::integrate::record::projection::{SensitivityRow, StepRows};
use crate::integrate::simulation::{Simulation, StepOutcome};
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::SolvableSystem;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Records requested times in (t, t_new].
    #[inline]
    pub(in crate::integrate) fn record_step(
        &mut self,
        t_new: f64,
        stop: StepOutcome,
        times: &[f64],
        solution: &mut Solution,
    ) {
        let requested = &times[solution.times.len()..];
        let (inside, at_end) = due(requested, t_new, stop);
        if inside + at_end == 0 {
            return;
        }
        if let Some(chosen) = self.chosen {
            self.record_chosen(chosen, &requested[..inside], at_end, t_new, solution);
            return;
        }

        if !self.algebraic.is_empty() {
            self.begin_projection();
        }
        if inside > 0 {
            self.record_inside(t_new, &requested[..inside], solution);
        }
        for _ in 0..at_end {
            let (first, first_s) = (solution.y.len(), solution.s.len());
            solution.y.extend_from_slice(self.stepper.y_new.as_ref());
            if let Some(d) = &self.directions {
                solution.s.extend_from_slice(d.s_new.as_ref());
            }
            self.project_recorded(&[t_new], first, first_s, solution);
            record_past(&mut self.drive, t_new, self.stepper.y_new.as_ref(), solution);
        }
        if S::FEATURES.events {
            for _ in 0..inside + at_end {
                solution.z.extend_from_slice(self.discrete.z());
            }
        }
        solution.times.extend_from_slice(&requested[..inside + at_end]);
        fill_undefined(solution);
    }

    /// Records times between the ends of the step to `t_new`.
    fn record_inside(&mut self, t_new: f64, asked: &[f64], solution: &mut Solution) {
        self.stepper.prepare_dense(self.y.as_ref(), self.directions.as_mut());
        let (recorded, recorded_s) = (solution.y.len(), solution.s.len());
        let within = RequestedTimes::new(self.t, t_new, asked);
        self.stepper.interpolate_all(within, &self.y, &mut self.row, &mut solution.y);
        if let (Some(d), Some(row)) = (&self.directions, &mut self.sensitivity_row) {
            self.stepper.interpolate_all_sensitivities(within, d, row, &mut solution.s);
        }
        self.project_recorded(asked, recorded, recorded_s, solution);
        if S::FEATURES.past && solution.n_past > 0 {
            for (k, t) in asked.iter().enumerate() {
                let row = recorded + k * solution.n..recorded + (k + 1) * solution.n;
                self.row.as_mut().copy_from_slice(&solution.y[row]);
                record_past(&mut self.drive, *t, self.row.as_ref(), solution);
            }
        }
    }

    /// Records the requested times equal to the current one.
    #[inline]
    pub(in crate::integrate) fn record_now(&mut self, times: &[f64], solution: &mut Solution) {
        while times.get(solution.times.len()) == Some(&self.t) {
            if let Some(chosen) = self.chosen {
                self.record_chosen_now(chosen, solution);
                continue;
            }
            solution.times.push(self.t);
            if S::FEATURES.events {
                solution.z.extend_from_slice(self.discrete.z());
            }
            record_past(&mut self.drive, self.t, self.y.as_ref(), solution);
            let (first, first_s) = (solution.y.len(), solution.s.len());
            solution.y.extend_from_slice(self.y.as_ref());
            if let Some(d) = &self.directions {
                solution.s.extend_from_slice(d.s.as_ref());
            }
            self.begin_projection_anew();
            self.project_recorded(&[self.t], first, first_s, solution);
        }
        fill_undefined(solution);
    }

    /// Prepares to move rows of the last tried step onto the algebraic equations.
    pub(in crate::integrate) fn begin_projection(&mut self) {
        if let Some(projection) = &mut self.projection {
            let pattern = &self.problem.system.signature().jacobian;
            let (jacobian, sizes) = (self.stepper.jacobian.as_ref(), self.sizes.as_ref());
            projection.begin(&mut self.algebraic, pattern, jacobian, sizes);
        }
    }

    /// Prepares to move a row that does not belong to a step.
    pub(in crate::integrate) fn begin_projection_anew(&mut self) {
        if let Some(projection) = &mut self.projection {
            projection.begin_anew();
        }
    }

    /// Moves the rows at `times`, recorded from these positions on, onto the algebraic equations.
    #[inline]
    fn project_recorded(
        &mut self,
        times: &[f64],
        first: usize,
        first_s: usize,
        solution: &mut Solution,
    ) {
        if self.algebraic.is_empty() {
            return;
        }
        let Solution { y, s, n, n_s, .. } = solution;
        let has_s = s.len() > first_s;
        let mut rows_s = s[first_s..].chunks_exact_mut((*n * *n_s).max(1));
        for (t, row) in times.iter().zip(y[first..].chunks_exact_mut(*n)) {
            let row_s = if has_s { rows_s.next() } else { None };
            self.project(*t, row, row_s);
        }
    }

    /// Moves the algebraic unknowns of a row, and their sensitivities, onto their equations.
    pub(in crate::integrate) fn project(&mut self, t: f64, y: &mut [f64], s: Option<&mut [f64]>) {
        let Some(projection) = &mut self.projection else { return };
        let Problem { system, p, .. } = *self.problem;
        let (sizes, z) = (self.sizes.as_ref(), self.discrete.z());
        let rows = StepRows { system, p, z, sizes, tolerances: self.tolerances };
        projection.project(&mut self.algebraic, &rows, &mut self.drive, t, y);
        if let (Some(s), Some(d)) = (s, &mut self.directions) {
            let s = SensitivityRow { s, sizes: d.sizes.as_ref(), work: d.rhs.as_mut() };
            let algebraic = &mut self.algebraic;
            projection.project_sensitivities(algebraic, &rows, &mut self.drive, t, y, s);
        }
    }
}

/// The number of requested times within the step to `t_new`, and at its end.
#[inline]
fn due(asked: &[f64], t_new: f64, stop: StepOutcome) -> (usize, usize) {
    // In groups of eight.
    let eights = asked.as_chunks::<8>().0.iter().take_while(|eight| eight[7] < t_new).count();
    let rest = asked[8 * eights..].iter().take_while(|&&t| t < t_new).count();
    let inside = 8 * eights + rest;
    let at_end = asked[inside..].iter().take_while(|&&t| t == t_new).count();
    match stop {
        StepOutcome::Change => (inside, before_change(at_end)),
        StepOutcome::None => (inside, at_end),
    }
}

/// The number of equal times at a jump that are recorded before it: the first of two, as
/// [`side`](crate::solution::side) says.
#[inline]
pub(crate) fn before_change(equal: usize) -> usize {
    usize::from(equal == 2)
}

/// Records the past of delayed unknowns at `t`, if outputs read it.
fn record_past<S: SolvableSystem>(
    drive: &mut InputCursor<'_, S>,
    t: f64,
    y: &[f64],
    solution: &mut Solution,
) {
    if S::FEATURES.past && solution.n_past > 0 {
        let u = drive.evaluate(t, y);
        solution.past.extend_from_slice(&u[u.len() - solution.n_past..]);
    }
}

/// Marks sensitivities that were not recorded as undefined.
#[inline]
fn fill_undefined(solution: &mut Solution) {
    let len = solution.times.len() * solution.n * solution.n_s;
    if solution.s.len() < len {
        solution.s.resize(len, f64::NAN);
    }
}
