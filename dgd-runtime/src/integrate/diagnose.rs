//! What to say when no step is small enough.

use super::Simulation;
use super::rosenbrock::{Base, Spoilt};
use crate::error::{Evaluation, IntegrateError};
use crate::problem::Problem;
use crate::readings::readings;
use crate::system::{Point, System};

impl<S: System> Simulation<'_, S> {
    pub(super) fn singular_iteration(&self, h: f64, row: usize) -> IntegrateError {
        let equation = self.problem.system.signature().equations[row].to_string();
        IntegrateError::SingularIteration { t: self.t, h, equation }
    }

    pub(super) fn step_size_too_small(&self, h: f64) -> IntegrateError {
        let signature = self.problem.system.signature();
        let (y, y_new) = (self.y.as_ref(), self.stepper.y_new.as_ref());
        let n = y.len();
        let mut worst = (0, 0.0);
        let mut consider = |index: usize, e: f64, y: f64, y_new: f64, size: f64| {
            let error = e.abs() / self.tolerances.weight(y.abs().max(y_new.abs()), size);
            if error > worst.1 {
                worst = (index, error);
            }
        };
        for (i, e) in self.stepper.local_error().iter().enumerate() {
            consider(i, *e, y[i], y_new[i], self.sizes.as_ref()[i]);
        }
        if let Some(d) = &self.directions {
            for (i, e) in self.stepper.sensitivity_error(d).iter().enumerate() {
                let (s, s_new) = (d.s.as_ref()[i], d.s_new.as_ref()[i]);
                consider(n + i, *e, s, s_new, d.sizes.as_ref()[i]);
            }
        }
        let (index, error) = worst;
        let parameter = (index / n)
            .checked_sub(1)
            .map(|direction| signature.direction_name(direction).to_string());
        IntegrateError::StepSizeTooSmall {
            t: self.t,
            h,
            unknown: signature.unknowns[index % n].name.to_string(),
            parameter,
            error,
        }
    }

    pub(super) fn not_finite(&mut self, h: f64) -> IntegrateError {
        let Problem { system, p, .. } = *self.problem;
        let (mass, z) = (&self.algebraic.mass, self.discrete.z());
        let base = Base { system, p, z, mass, t: self.t };
        let directions = self.directions.as_mut();
        let spoilt = self.stepper.spoilt(base, &mut self.drive, self.y.as_ref(), h, directions);
        let Some((t, spoilt)) = spoilt else {
            // Finite evaluations, but a solution beyond the largest number.
            return self.step_size_too_small(h);
        };
        let (row, what) = match spoilt {
            Spoilt::Equation(row) => (row, Evaluation::Equation),
            Spoilt::Derivative(row) => (row, Evaluation::Derivative),
        };
        let equation = system.signature().equations[row].to_string();
        let u = self.drive.at(self.t);
        let at = Point { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
        IntegrateError::NotFinite { t, equation, what, before: readings(system, at, row) }
    }
}
