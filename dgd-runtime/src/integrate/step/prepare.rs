//! Computes the data that a step needs at its start: slopes, a linearisation, or a series.

use crate::error::IntegrateError;
use crate::integrate::controller::Controller;
use crate::integrate::methods::rosenbrock::add_product;
use crate::integrate::methods::stepper::StepEnd;
use crate::integrate::simulation::{Simulation, base};
use crate::linalg::Factorisation;
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::SolvableSystem;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Prepares a step towards `end`, and proposes its size.
    #[inline]
    pub(super) fn prepare(
        &mut self,
        controller: &mut Controller,
        end: f64,
        solution: &mut Solution,
    ) -> Result<f64, IntegrateError> {
        let tried = solution.statistics.steps + solution.statistics.rejected;
        if tried >= self.max_steps {
            return Err(self.too_many_steps(tried));
        }
        let traits = self.stepper.traits;
        if !traits.is_implicit() && !self.algebraic.is_empty() {
            return Err(self.unsuited_method());
        }
        if self.stepper.wants_slopes() {
            self.begin_stepper(controller, solution);
        } else if !self.linearized && traits.wants_jacobian() {
            self.linearize_for_step(solution);
        }
        let remaining = end - self.t;
        if !self.linearized && traits.wants_series() {
            self.expand(controller.h.min(remaining), solution);
        }
        Ok(controller.propose(remaining).min(self.reach()))
    }

    /// Linearises at (t, y) for a step.
    #[inline]
    pub(in crate::integrate) fn linearize_for_step(&mut self, solution: &mut Solution) {
        let with_sensitivities = self.stepper.traits.wants_all_derivatives();
        let base = base(self.problem, &self.algebraic, &self.discrete, self.t);
        let directions = self.directions.as_mut().filter(|_| with_sensitivities);
        let directions = directions.map(|d| (d, StepEnd::Start));
        self.stepper.linearize(base, &mut self.drive, self.y.as_ref(), directions);
        solution.statistics.linearizations += 1;
        self.linearized = true;
    }

    /// Gives the stepper the slopes of y and S at the start of the solution, and a first step.
    fn begin_stepper(&mut self, controller: &mut Controller, solution: &mut Solution) {
        let Problem { system, .. } = *self.problem;
        let signature = system.signature();
        let base = base(self.problem, &self.algebraic, &self.discrete, self.t);
        let directions = self.directions.as_mut().map(|d| (d, StepEnd::Start));
        self.stepper.linearize(base, &mut self.drive, self.y.as_ref(), directions);
        solution.statistics.linearizations += 1;
        self.linearized = true;

        // 0 = ∂f_a/∂y ẏ + df_a/dt
        let pattern = &signature.jacobian;
        let (f, dfdt) = (self.stepper.f.as_mut(), self.stepper.dfdt.as_ref());
        let (jacobian, sizes) = (self.stepper.jacobian.as_ref(), self.sizes.as_ref());
        let is_regular = self.algebraic.rates(pattern, jacobian, f, dfdt, sizes).is_ok();
        solution.statistics.factorisations += usize::from(!self.algebraic.is_empty());
        if !is_regular {
            // If there is no slope, a guess is good enough.
            self.algebraic.keep_differential(f);
        }
        self.begin_sensitivities(is_regular);
        if self.stepper.traits.is_multistep() {
            controller.h = controller.h.min(self.first_step_of_order_one());
            controller.set_order(1);
        }
        self.stepper.begin(controller.h, self.directions.as_mut());
    }

    /// Computes the slopes of S at the start of the solution into `g`, from those of y in `f`.
    fn begin_sensitivities(&mut self, is_regular: bool) {
        let Some(d) = &mut self.directions else { return };
        let n = self.y.as_ref().len().max(1);
        let f = self.stepper.f.as_ref();
        // 0 = ∂f_a/∂y Ṡ + ∂g_a/∂y ẏ + dg_a/dt
        let curvature = d.rhs.as_mut();
        curvature.copy_from_slice(d.dgdt.as_ref());
        let pattern = &self.problem.system.signature().sensitivity_jacobian;
        add_product(curvature, pattern, d.dgdy.as_ref(), f);
        if self.algebraic.is_empty() {
            return;
        }
        let mass = self.algebraic.mass.as_ref();
        let columns = d.g.as_mut().chunks_exact_mut(n).zip(curvature.chunks_exact(n));
        for (g, curvature) in columns {
            for ((g, curvature), mass) in g.iter_mut().zip(curvature).zip(mass) {
                if *mass == 0.0 {
                    *g = *curvature;
                }
            }
        }
        if is_regular {
            self.algebraic.factorisation.solve(d.g.as_mut());
        } else {
            self.algebraic.keep_differential(d.g.as_mut());
        }
    }

    /// Computes the series at (t, y), for steps of about this size.
    #[inline]
    fn expand(&mut self, h: f64, solution: &mut Solution) {
        let base = base(self.problem, &self.algebraic, &self.discrete, self.t);
        let (y, directions) = (self.y.as_ref(), self.directions.as_ref());
        self.stepper.expand(base, &mut self.drive, y, h, directions);
        solution.statistics.evaluations += 1;
        self.linearized = true;
    }
}
