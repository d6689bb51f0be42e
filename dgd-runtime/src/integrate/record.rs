//! Values at the asked times.

use super::drive::Drive;
use super::{Simulation, Stop};
use crate::solution::Solution;
use crate::system::System;

impl<S: System> Simulation<'_, S> {
    /// Records asked times in (t, t_new].
    #[inline]
    pub(super) fn record_step(
        &mut self,
        t_new: f64,
        stop: Stop,
        times: &[f64],
        solution: &mut Solution,
    ) {
        let asked = &times[solution.times.len()..];
        let (inside, at_end) = due(asked, t_new, stop);
        if inside + at_end == 0 {
            return;
        }
        if let Some(chosen) = self.chosen {
            self.record_chosen(chosen, &asked[..inside], at_end, t_new, solution);
            return;
        }

        if inside > 0 {
            self.record_inside(t_new, &asked[..inside], solution);
        }
        for _ in 0..at_end {
            record_past(&mut self.drive, t_new, self.stepper.y_new.as_ref(), solution);
            solution.y.extend_from_slice(self.stepper.y_new.as_ref());
            if let Some(d) = &self.directions {
                solution.s.extend_from_slice(d.s_new.as_ref());
            }
        }
        if S::FEATURES.events {
            for _ in 0..inside + at_end {
                solution.z.extend_from_slice(self.discrete.z());
            }
        }
        solution.times.extend_from_slice(&asked[..inside + at_end]);
        fill_undefined(solution);
    }

    /// Records times between the ends of the step to `t_new`.
    fn record_inside(&mut self, t_new: f64, asked: &[f64], solution: &mut Solution) {
        self.stepper.prepare_dense(self.y.as_ref(), self.directions.as_mut());
        let step = (self.t, t_new);
        let recorded = solution.y.len();
        self.stepper.interpolate_all(step, asked, &self.y, &mut self.row, &mut solution.y);
        if let (Some(d), Some(row)) = (&self.directions, &mut self.sensitivity_row) {
            self.stepper.interpolate_all_sensitivities(step, asked, d, row, &mut solution.s);
        }
        if S::FEATURES.past && solution.n_past > 0 {
            for (k, t) in asked.iter().enumerate() {
                let row = recorded + k * solution.n..recorded + (k + 1) * solution.n;
                self.row.as_mut().copy_from_slice(&solution.y[row]);
                record_past(&mut self.drive, *t, self.row.as_ref(), solution);
            }
        }
    }

    /// Records the asked times that are now.
    #[inline]
    pub(super) fn record_now(&mut self, times: &[f64], solution: &mut Solution) {
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
            solution.y.extend_from_slice(self.y.as_ref());
            if let Some(d) = &self.directions {
                solution.s.extend_from_slice(d.s.as_ref());
            }
        }
        fill_undefined(solution);
    }
}

/// How many of the asked times are within the step to `t_new`, and how many at its end.
#[inline]
fn due(asked: &[f64], t_new: f64, stop: Stop) -> (usize, usize) {
    // By eights, each counted at once.
    let eights = asked.as_chunks::<8>().0.iter().take_while(|eight| eight[7] < t_new).count();
    let rest = asked[8 * eights..].iter().take_while(|&&t| t < t_new).count();
    let inside = 8 * eights + rest;
    let at_end = asked[inside..].iter().take_while(|&&t| t == t_new).count();
    // The last of equal times at a jump is a right value, which is had after it.
    match stop {
        Stop::Change => (inside, at_end.saturating_sub(1)),
        Stop::None => (inside, at_end),
    }
}

/// Records what is known of delayed unknowns at `t`, where outputs read it.
fn record_past<S: System>(drive: &mut Drive<'_, S>, t: f64, y: &[f64], solution: &mut Solution) {
    if S::FEATURES.past && solution.n_past > 0 {
        let u = drive.at(t, y);
        solution.past.extend_from_slice(&u[u.len() - solution.n_past..]);
    }
}

/// Sensitivities that were not recorded are undefined.
#[inline]
fn fill_undefined(solution: &mut Solution) {
    let len = solution.times.len() * solution.n * solution.n_s;
    if solution.s.len() < len {
        solution.s.resize(len, f64::NAN);
    }
}
