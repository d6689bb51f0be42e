//! The error of algebraic unknowns within a step.
//!
//! A Rosenbrock method satisfies algebraic equations at the end of a step, exactly if they are linear, and its estimate
//! is of the error there. Between the ends, unknowns follow the polynomials of the dense output, whatever the equations
//! do: a voltage behind a sine passes its thresholds unseen in a step of a whole period. Where event functions are
//! watched that read such unknowns, steps are so short that the dense output satisfies the equations to tolerance.

use crate::integrate::events::hybrid::HybridState;
use crate::integrate::methods::family::EndEquations;
use crate::integrate::simulation::Simulation;
use crate::linalg::Factorisation;
use crate::linalg::norm::larger;
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

/// Where equations are looked at, as fractions of the step: in the golden section, so that no oscillation has its nodes
/// at both.
const AT: [f64; 2] = [0.381_966_011_250_105, 0.618_033_988_749_895];

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Square of the error of the dense output of the last tried step in algebraic unknowns that watched event functions
    /// read, in units of the tolerance: of Newton's correction by the matrix of the step.
    pub(in crate::integrate) fn error_within(&mut self, h: f64) -> f64 {
        let is_exact_at_end = self.stepper.traits.solves == EndEquations::Linear;
        if !is_exact_at_end || !self.discrete.watches_algebraic {
            return 0.0;
        }
        self.stepper.prepare_dense(self.y.as_ref(), None);
        AT.into_iter().map(|part| self.error_at(h, part)).fold(0.0, larger)
    }

    /// Marks algebraic unknowns that watched event functions read.
    pub(super) fn mark_watched(&mut self) {
        let HybridState { watching, watched, watches_algebraic: any, .. } = &mut self.discrete;
        *any = false;
        if self.algebraic.is_empty() {
            return;
        }
        let mass = self.algebraic.mass.as_ref();
        watched.fill(false);
        for (k, i) in self.problem.system.signature().discrete.event_jacobian.positions() {
            if mass[i] == 0.0 && watching[k].is_within() {
                watched[i] = true;
                *any = true;
            }
        }
    }

    fn error_at(&mut self, h: f64, part: f64) -> f64 {
        let Problem { system, p, .. } = *self.problem;
        let t = self.t + part * h;
        self.stepper.interpolate(part, self.y.as_ref(), self.row.as_mut());
        let u = self.drive.evaluate(t, self.row.as_ref());
        let point = EvaluationPoint { t, y: self.row.as_ref(), u, p, z: self.discrete.z() };
        let correction = &mut self.stepper.rhs;
        system.rhs(point, correction.as_mut());
        self.algebraic.keep_algebraic(correction.as_mut());
        self.stepper.factorisation.solve(correction.as_mut());
        let correction = self.stepper.rhs.as_mut();
        for (correction, is_watched) in correction.iter_mut().zip(&self.discrete.watched) {
            if !is_watched {
                *correction = 0.0;
            }
        }
        let (y, sizes) = (self.y.as_ref(), self.sizes.as_ref());
        self.tolerances.mean_square(correction, y, self.row.as_ref(), sizes)
    }
}
