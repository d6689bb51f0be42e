//! Delayed values along a part of a step that are not enclosed: with a delay that varies, and before the start.
//!
//! They are sampled at the ends and the middle of each part, and their slopes are those of a parabola.

use crate::integrate::enclosure::{Interval, Tube};
use crate::integrate::simulation::Simulation;
use crate::solved::SolvableSystem;

/// Delayed values that event functions read, at the ends and the middle of a part of a step.
pub(in crate::integrate) struct PastValues {
    /// Their positions in u, ascending.
    positions: Vec<usize>,
    values: [Vec<f64>; 3],
}

impl PastValues {
    /// Those among the inputs read that are at this position or behind it.
    pub(super) fn new(inputs: &[usize], first: usize) -> Self {
        let positions: Vec<usize> = inputs.iter().copied().filter(|i| *i >= first).collect();
        let zeros = || vec![0.0; positions.len()];
        Self { values: [zeros(), zeros(), zeros()], positions }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The tube of an input; `None` for one that is not delayed.
    pub(super) fn tube(&self, i: usize) -> Option<Tube> {
        let position = self.positions.binary_search(&i).ok()?;
        let [a, middle, b] = [0, 1, 2].map(|k| self.values[k][position]);
        if a == b && a == middle {
            return Some(Tube::still(Interval::point(a)));
        }
        let error = 4.0 * f64::EPSILON * a.abs().max(b.abs());
        let [left, right] = [a, b].map(|x| Interval::around(x, error));
        let slopes = [4.0 * middle - 3.0 * a - b, 3.0 * b + a - 4.0 * middle];
        let change = slopes.map(|slope| Interval::around(slope, 8.0 * error));
        let change = change[0].hull(change[1]);
        Some(Tube::moving(left, right, Interval::ENTIRE, change))
    }
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Takes the delayed values that event functions read in a part of the last tried step, of size h.
    pub(super) fn take_past(&mut self, h: f64, [from, to]: [f64; 2]) {
        if self.discrete.past.is_empty() {
            return;
        }
        for (k, part) in [from, 0.5 * (from + to), to].into_iter().enumerate() {
            self.stepper.interpolate(part, self.y.as_ref(), self.row.as_mut());
            let u = self.drive.evaluate(self.t + part * h, self.row.as_ref());
            let past = &mut self.discrete.past;
            for (value, at) in past.values[k].iter_mut().zip(&past.positions) {
                *value = u[*at];
            }
        }
    }
}
