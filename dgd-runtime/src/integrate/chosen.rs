//! Values of chosen unknowns at the asked times: of a large model, a few.

use super::Simulation;
use crate::solution::Solution;
use crate::system::System;

impl<S: System> Simulation<'_, S> {
    /// Records `chosen` unknowns at times within the step to `t_new`, and `at_end` times at its end.
    pub(super) fn record_chosen(
        &mut self,
        chosen: &[usize],
        inside: &[f64],
        at_end: usize,
        t_new: f64,
        solution: &mut Solution,
    ) {
        let per_h = 1.0 / (t_new - self.t);
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

    /// Records `chosen` unknowns as they are now.
    pub(super) fn record_chosen_now(&self, chosen: &[usize], solution: &mut Solution) {
        let y = self.y.as_ref();
        solution.y.extend(chosen.iter().map(|i| y[*i]));
        solution.times.push(self.t);
        solution.z.extend_from_slice(self.discrete.z());
    }
}
