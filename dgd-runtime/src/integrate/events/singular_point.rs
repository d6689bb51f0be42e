//! Points where ∂f_a/∂y_a is singular: how states pass through, and where sensitivities end.
//!
//! A tank that fills through a throttle, 0 = a (5 − h) − b q|q|, is full after a finite time, and then ∂f/∂q = 0. The
//! matrix of the stages is still regular. The peculiarities:
//!
//! - f_a = 0 to tolerance leaves q undetermined to its square root ([`Simulation::after_rejection`]),
//! - so does f_a = 0 to rounding ([`Simulation::error_beyond_rounding`]),
//! - q departs from rest like a square root ([`Simulation::leave_singular_point`]),
//! - S is no longer determined ([`UndefinedSensitivity`]), and nearby not to tolerance
//!   ([`Simulation::unresolved_equation`]).

use crate::algebraic::AlgebraicPoint;
use crate::integrate::drive::InstantInputs;
use crate::integrate::methods::stepper::{StepBase, StepEnd};
use crate::integrate::simulation::{Simulation, multiply};
use crate::linalg::Factorisation;
use crate::linalg::norm::larger;
use crate::problem::Problem;
use crate::solution::{Solution, UndefinedCause, UndefinedSensitivity};
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

/// How weakly an equation determines its unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::integrate) enum Weakness {
    /// Too weakly for sensitivities.
    Singular,
    /// Not at all.
    Vanishing,
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Makes algebraic unknowns consistent again after a rejection. If the solution is at a singular point, takes a
    /// step off it and returns its size.
    ///
    /// Equations are satisfied to the tolerance of the unknowns. Where ∂f_a/∂y_a is nearly singular that is not enough:
    /// the remaining residual acts as a jump in the next step, which no smaller step size reduces.
    pub(in crate::integrate) fn after_rejection(
        &mut self,
        h: f64,
        remaining: f64,
        times: &[f64],
        solution: &mut Solution,
    ) -> Option<f64> {
        if self.algebraic.is_empty() || self.corrected {
            return None;
        }
        self.corrected = true;
        self.linearized = false;
        let Problem { system, p, .. } = *self.problem;
        let u = InstantInputs { drive: &mut self.drive, t: self.t };
        let point = AlgebraicPoint { t: self.t, u, p, z: self.discrete.z() };
        let y = self.row.as_mut();
        y.copy_from_slice(self.y.as_ref());
        let jacobian = self.stepper.jacobian.as_mut();
        let (sizes, tolerances) = (self.sizes.as_ref(), self.tolerances);
        if self.algebraic.make_consistent(system, point, y, jacobian, sizes, tolerances).is_ok() {
            std::mem::swap(&mut self.y, &mut self.row);
        }

        let (mass, z) = (&self.algebraic.mass, self.discrete.z());
        let base = StepBase { system, p, z, mass, t: self.t };
        self.stepper.linearize(base, &mut self.drive, self.y.as_ref(), None);
        let vanishing = self.weak_equation(self.t, Weakness::Vanishing);
        let Some(row) = vanishing else {
            // The sensitivities were consistent with the old unknowns.
            self.make_sensitivities_consistent(solution);
            return None;
        };
        if self.directions.is_some() {
            self.end_sensitivities(self.t, row, solution);
        }
        let next = times.get(solution.times.len()).map_or(remaining, |t| t - self.t);
        let h = self.leave_singular_point(h.min(0.5 * remaining).min(0.5 * next))?;
        solution.statistics.steps += 1;
        Some(h)
    }

    /// Takes a step of at most `h` off a point where ∂f_a/∂y_a vanishes, and returns its size.
    ///
    /// There, algebraic unknowns may move like a square root, which no method that uses J at the start of the step can
    /// follow. Euler's explicit step
    ///
    /// ```text
    ///   y_d⁺ = y_d + h f_d,   0 = f_a(y⁺),   e_d = h/2 (f_d⁺ − f_d),   ∂f_a/∂y_a e_a = −∂f_a/∂y_d e_d
    /// ```
    ///
    /// needs no J at its start.
    fn leave_singular_point(&mut self, mut h: f64) -> Option<f64> {
        let Problem { system, p, .. } = *self.problem;
        let pattern = &system.signature().jacobian;
        let (sizes, tolerances) = (self.sizes.as_ref(), self.tolerances);
        let y = self.y.as_ref();
        self.row.as_mut().copy_from_slice(self.stepper.f.as_ref());
        multiply(self.row.as_mut(), self.algebraic.mass.as_ref());
        let slope = self.row.as_ref();

        while h > 4.0 * f64::EPSILON * self.t.abs().max(f64::MIN_POSITIVE) {
            let t_new = self.t + h;
            let y_new = self.stepper.y_new.as_mut();
            for ((new, y), slope) in y_new.iter_mut().zip(y).zip(slope) {
                *new = y + h * slope;
            }
            let u = InstantInputs { drive: &mut self.drive, t: t_new };
            let point = AlgebraicPoint { t: t_new, u, p, z: self.discrete.z() };
            let jacobian = self.stepper.jacobian.as_mut();
            let consistent =
                self.algebraic.make_consistent(system, point, y_new, jacobian, sizes, tolerances);
            if consistent.is_ok() {
                let (u, udot) = self.drive.with_slope(t_new, y_new);
                let point = EvaluationPoint { t: t_new, y: y_new, u, p, z: self.discrete.z() };
                let (f, dfdt) = (self.stepper.f.as_mut(), self.stepper.dfdt.as_mut());
                system.linearize(point, udot, f, jacobian, dfdt);
                let e = self.stepper.rhs.as_mut();
                e.copy_from_slice(f);
                multiply(e, self.algebraic.mass.as_ref());
                for (e, slope) in e.iter_mut().zip(slope) {
                    *e = 0.5 * h * (*e - slope);
                }
                if self.algebraic.factorise(pattern, jacobian, sizes).is_ok() {
                    self.algebraic.factorisation.solve(e);
                    if tolerances.mean_square(e, y, y_new, sizes) <= 1.0 {
                        std::mem::swap(&mut self.y, &mut self.stepper.y_new);
                        self.t = t_new;
                        self.corrected = false;
                        self.stepper.restart();
                        return Some(h);
                    }
                }
            }
            h *= 0.25;
        }
        None
    }

    /// The error, without that of algebraic unknowns if they satisfy their equations at the end of the step to
    /// rounding.
    ///
    /// Where ∂f_a/∂y_a vanishes, rounding of f_a moves algebraic unknowns by its square root, which can exceed the
    /// tolerance however short the step. A method that solves equations at the end of a step satisfies them everywhere,
    /// so for it this test alone is meaningless.
    pub(in crate::integrate) fn error_beyond_rounding(&mut self, h: f64, error: f64) -> f64 {
        if self.algebraic.is_empty() || !error.is_finite() {
            return error;
        }
        let Problem { system, p, .. } = *self.problem;
        let (y, y_new) = (self.y.as_ref(), self.stepper.y_new.as_ref());
        let t_new = self.t + h;
        let u = self.drive.evaluate(t_new, self.stepper.y_new.as_ref());
        let point = EvaluationPoint { t: t_new, y: y_new, u, p, z: self.discrete.z() };
        system.rhs(point, self.row.as_mut());
        let pattern = &system.signature().jacobian;
        let jacobian = self.stepper.jacobian.as_ref();
        if !self.algebraic.is_rounding(pattern, jacobian, y_new, &self.row) {
            return error;
        }
        let (sizes, atol) = (self.sizes.as_ref(), self.tolerances.atol);
        if self.stepper.traits.solves_equations()
            && !self.algebraic.is_lost_in_rounding(pattern, jacobian, sizes, atol)
        {
            return error;
        }
        let f = self.row.as_mut();
        f.copy_from_slice(self.stepper.local_error());
        multiply(f, self.algebraic.mass.as_ref());
        let rest = self.tolerances.mean_square(f, y, y_new, self.sizes.as_ref());
        larger(rest, self.sensitivity_error())
    }

    /// The equation that, because of rounding, does not determine the sensitivities to tolerance, if only these cause
    /// the rejection of a step of this size.
    ///
    /// Close to where ∂f_a/∂y_a vanishes, rounding of f_a moves algebraic unknowns by less than their tolerance, but
    /// their sensitivities, which grow with the inverse of ∂f_a/∂y_a, by more.
    pub(in crate::integrate) fn unresolved_equation(&mut self, h: f64) -> Option<usize> {
        if self.algebraic.is_empty() {
            return None;
        }
        let directions = self.directions.take()?;
        let error = self.error();
        let of_states = self.error_beyond_rounding(h, error);
        self.directions = Some(directions);
        let pattern = &self.problem.system.signature().jacobian;
        let jacobian = self.stepper.jacobian.as_ref();
        let row = self.algebraic.weakened_equation(pattern, jacobian, self.sizes.as_ref())?;
        (of_states <= 1.0).then_some(row)
    }

    /// Linearises at the end of the step; ends the sensitivities if ∂f_a/∂y_a is singular there.
    pub(in crate::integrate) fn look_for_singular_point(
        &mut self,
        t_new: f64,
        solution: &mut Solution,
    ) {
        let Problem { system, p, .. } = *self.problem;
        let (mass, z) = (&self.algebraic.mass, self.discrete.z());
        let base = StepBase { system, p, z, mass, t: t_new };
        let wants_all = self.stepper.traits.wants_all_derivatives();
        let directions = self.directions.as_mut().filter(|_| wants_all).map(|d| (d, StepEnd::End));
        // The linearisation needs y⁺, which the stepper owns.
        self.row.as_mut().copy_from_slice(self.stepper.y_new.as_ref());
        self.stepper.linearize(base, &mut self.drive, self.row.as_ref(), directions);
        self.linearized = true;
        solution.statistics.linearizations += 1;
        solution.statistics.factorisations += 1;
        std::mem::swap(&mut self.y, &mut self.stepper.y_new);
        let singular = self.weak_equation(t_new, Weakness::Singular);
        std::mem::swap(&mut self.y, &mut self.stepper.y_new);
        if let Some(row) = singular {
            self.end_sensitivities(self.t, row, solution);
        }
    }

    /// The equation that does not determine its unknown at (t, y), where the stepper is linearised.
    pub(in crate::integrate) fn weak_equation(&mut self, t: f64, how: Weakness) -> Option<usize> {
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.evaluate(t, self.y.as_ref());
        let point = EvaluationPoint { t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
        let work = self.projection.as_mut()?.jacobian.as_mut();
        let jacobian = self.stepper.jacobian.as_ref();
        let (sizes, atol) = (self.sizes.as_ref(), self.tolerances.atol);
        match how {
            Weakness::Singular => {
                self.algebraic.singular_equation(system, point, jacobian, work, sizes, atol)
            }
            Weakness::Vanishing => {
                self.algebraic.vanishing_equation(system, point, jacobian, work, sizes, atol)
            }
        }
    }

    pub(in crate::integrate) fn end_sensitivities(
        &mut self,
        from: f64,
        row: usize,
        solution: &mut Solution,
    ) {
        self.directions = None;
        let equation = self.problem.system.signature().equations.get(row).to_string();
        let cause = UndefinedCause::Singular;
        solution.undefined.push(UndefinedSensitivity { from, until: from, equation, cause });
    }
}
