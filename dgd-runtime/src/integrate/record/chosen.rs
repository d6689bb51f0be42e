//! Records a few chosen unknowns of a large model at the requested times.

use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Records `chosen` unknowns at times within the step to `t_new`, and `at_end` times at its end.
    pub(in crate::integrate) fn record_chosen(
        &mut self,
        chosen: &[usize],
        inside: &[f64],
        at_end: usize,
        t_new: f64,
        solution: &mut Solution,
    ) {
        let per_h = 1.0 / (t_new - self.t);
        if self.is_whole(chosen) {
            self.stepper.prepare_dense(self.y.as_ref(), None);
            self.begin_projection();
            for asked in inside {
                let theta = (asked - self.t) * per_h;
                self.stepper.interpolate(theta, self.y.as_ref(), self.row.as_mut());
                self.record_whole(chosen, *asked, solution);
            }
            for _ in 0..at_end {
                self.row.as_mut().copy_from_slice(self.stepper.y_new.as_ref());
                self.record_whole(chosen, t_new, solution);
            }
            return;
        }
        for asked in inside {
            let theta = (asked - self.t) * per_h;
            let (y, row) = (self.y.as_ref(), self.row.as_mut());
            self.stepper.interpolate_chosen(theta, y, chosen, row, &mut solution.y);
            solution.times.push(*asked);
            solution.z.extend_from_slice(self.discrete.z());
        }
        for _ in 0..at_end {
            let y_new = self.stepper.y_new.as_ref();
            solution.y.extend(chosen.iter().map(|i| y_new[*i]));
            solution.times.push(t_new);
            solution.z.extend_from_slice(self.discrete.z());
        }
    }

    /// Whether whole rows are needed: for outputs, or for a chosen algebraic unknown.
    fn is_whole(&self, chosen: &[usize]) -> bool {
        let mass = self.algebraic.mass.as_ref();
        let is_algebraic = || chosen.iter().any(|i| mass[*i] == 0.0);
        self.observed.is_some() || (!self.algebraic.is_empty() && is_algebraic())
    }

    /// Records `chosen` unknowns of the current row at `t`, moved onto the algebraic equations, and outputs if
    /// requested.
    fn record_whole(&mut self, chosen: &[usize], t: f64, solution: &mut Solution) {
        let mut row = self.row.take();
        if !self.algebraic.is_empty() {
            self.project(t, row.as_mut(), None);
        }
        let y = row.as_ref();
        solution.y.extend(chosen.iter().map(|i| y[*i]));
        if let Some(w) = &mut self.observed {
            let Problem { system, p, .. } = *self.problem;
            system.outputs(
                EvaluationPoint { t, y, u: self.drive.evaluate(t, y), p, z: self.discrete.z() },
                w,
            );
            solution.w.extend_from_slice(w);
        }
        self.row = row;
        solution.times.push(t);
        solution.z.extend_from_slice(self.discrete.z());
    }

    /// Records `chosen` unknowns as they are now.
    pub(in crate::integrate) fn record_chosen_now(
        &mut self,
        chosen: &[usize],
        solution: &mut Solution,
    ) {
        if self.is_whole(chosen) {
            self.row.as_mut().copy_from_slice(self.y.as_ref());
            self.begin_projection_anew();
            self.record_whole(chosen, self.t, solution);
            return;
        }
        let y = self.y.as_ref();
        solution.y.extend(chosen.iter().map(|i| y[*i]));
        solution.times.push(self.t);
        solution.z.extend_from_slice(self.discrete.z());
    }
}
