//! Chooses the initial step size.

use crate::integrate::methods::multistep::error_constant;
use crate::integrate::methods::rosenbrock::add_product;
use crate::integrate::simulation::{Simulation, multiply};
use crate::linalg::norm::{larger, largest_block};
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

/// Error constant C, typical of fifth-order methods. The resulting step is tried, not trusted.
const ESTIMATE: f64 = 1e-3;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// A step from (t, y), where the stepper is linearised, over which a transient that starts with the current slope
    /// has an error near the tolerance; infinity if nothing is known about it.
    ///
    /// ```text
    ///   ÿ = ∂f/∂y f + df/dt,   λ = ‖ÿ‖ / ‖ẏ‖,   e ≈ C (h λ)^k ‖ẏ‖ / λ
    /// ```
    ///
    /// After a jump of inputs, a step may be so much longer than the new transient that its error gives no information
    /// about the right size: the error estimate of a stiff method does not grow like h^k there.
    pub(in crate::integrate) fn transient_step(&mut self) -> f64 {
        if !self.algebraic.is_empty() || !self.stepper.traits.wants_all_derivatives() {
            return f64::INFINITY;
        }
        let (f, curvature) = (self.stepper.f.as_ref(), self.stepper.rhs.as_mut());
        curvature.copy_from_slice(self.stepper.dfdt.as_ref());
        let pattern = &self.problem.system.signature().jacobian;
        add_product(curvature, pattern, self.stepper.jacobian.as_ref(), f);
        let (y, sizes) = (self.y.as_ref(), self.sizes.as_ref());
        let norm = |values: &[f64]| self.tolerances.mean_square(values, y, y, sizes).sqrt();
        let (slope, rate) = (norm(f), norm(self.stepper.rhs.as_ref()) / norm(f));
        let k = f64::from(self.method.kind.estimate_order(self.tolerances.rtol) + 1);
        let h = (rate / (ESTIMATE * slope)).powf(1.0 / k) / rate;
        if h > 0.0 { h } else { f64::INFINITY }
    }

    /// A step that is small relative to the time in which the solution and its slope change.
    ///
    /// ```text
    ///   h₀ = 0.01 ‖y‖ / ‖ẏ‖,  ‖ÿ‖ ≈ ‖f(t + h₀, y + h₀ f) − f‖ / h₀
    ///   h  = min(100 h₀, (0.01 / max(‖ẏ‖, ‖ÿ‖))^(1/k))
    /// ```
    ///
    /// # Source
    ///
    /// Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, 2nd ed. (1993), §II.4.
    pub(in crate::integrate) fn initial_step(&mut self, span: f64, solution: &mut Solution) -> f64 {
        let Problem { system, p, .. } = *self.problem;
        let mass = self.algebraic.mass.as_ref();
        let n = mass.len().max(1);
        let (y, sizes) = (self.y.as_ref(), self.sizes.as_ref());
        let tolerances = self.tolerances;
        let size = |values: &[f64]| tolerances.mean_square(values, y, y, sizes);

        let slope = &mut self.stepper.f;
        let slope_new = &mut self.stepper.y_new;
        let u = self.drive.evaluate(self.t, y);
        let z = self.discrete.z();
        let point = EvaluationPoint { t: self.t, y, u, p, z };
        let (mut d0, mut d1) = (size(y), 0.0_f64);
        if let Some(d) = &mut self.directions {
            system.sensitivity_rhs(point, d.s.as_ref(), slope.as_mut(), d.g.as_mut());
            for column in d.g.as_mut().chunks_exact_mut(n) {
                multiply(column, mass);
            }
            let norm = |values: &[f64]| {
                let s = d.s.as_ref();
                largest_block(tolerances, n, values, s, s, d.sizes.as_ref())
            };
            d0 = d0.max(norm(d.s.as_ref()));
            d1 = norm(d.g.as_ref());
        } else {
            system.rhs(point, slope.as_mut());
        }
        multiply(slope.as_mut(), mass);
        d1 = d1.max(size(slope.as_ref())).sqrt();
        d0 = d0.sqrt();

        let h0 = (0.01 * d0 / d1).min(span);
        let h0 = if h0 > 0.0 { h0 } else { 1e-6 * span };
        let euler = self.stepper.rhs.as_mut();
        for ((euler, y), slope) in euler.iter_mut().zip(y).zip(slope.as_ref()) {
            *euler = y + h0 * slope;
        }
        let u = self.drive.evaluate(self.t + h0, euler);
        let point = EvaluationPoint { t: self.t + h0, y: euler, u, p, z };
        let mut change = 0.0_f64;
        if let Some(d) = &mut self.directions {
            for ((euler, s), g) in d.s_new.as_mut().iter_mut().zip(d.s.as_ref()).zip(d.g.as_ref()) {
                *euler = s + h0 * g;
            }
            let row = self.sensitivity_row.get_or_insert_with(|| d.s.clone());
            system.sensitivity_rhs(point, d.s_new.as_ref(), slope_new.as_mut(), row.as_mut());
            for column in row.as_mut().chunks_exact_mut(n) {
                multiply(column, mass);
            }
            for (new, old) in row.as_mut().iter_mut().zip(d.g.as_ref()) {
                *new -= old;
            }
            let s = d.s.as_ref();
            change = largest_block(tolerances, n, row.as_ref(), s, s, d.sizes.as_ref());
        } else {
            system.rhs(point, slope_new.as_mut());
        }
        multiply(slope_new.as_mut(), mass);
        for (new, old) in slope_new.as_mut().iter_mut().zip(slope.as_ref()) {
            *new -= old;
        }
        solution.statistics.evaluations += 2;

        let d2 = change.max(size(slope_new.as_ref())).sqrt() / h0;
        let steepest = d1.max(d2);
        let h = (0.01 / steepest)
            .powf(1.0 / f64::from(self.method.kind.estimate_order(tolerances.rtol) + 1))
            .min(100.0 * h0);
        // The solution is at rest, or the trial point is outside the model's domain.
        let fallback = if steepest == 0.0 { span } else { 0.01 * h0 };
        if h.is_finite() && h > 0.0 { h.min(span) } else { fallback }
    }

    /// The step for which the local error of order 1 is half the tolerance. Slopes are in `f` and `g`,
    /// ∂g/∂y ẏ + dg/dt in the directions' `rhs`.
    pub(in crate::integrate) fn first_step_of_order_one(&mut self) -> f64 {
        let pattern = &self.problem.system.signature().jacobian;
        let jacobian = self.stepper.jacobian.as_ref();
        let n = self.y.as_ref().len().max(1);
        let curvature = self.stepper.rhs.as_mut();
        curvature.copy_from_slice(self.stepper.dfdt.as_ref());
        add_product(curvature, pattern, jacobian, self.stepper.f.as_ref());
        self.algebraic.keep_differential(curvature);
        let y = self.y.as_ref();
        let mut square = self.tolerances.mean_square(curvature, y, y, self.sizes.as_ref());
        if let Some(d) = &mut self.directions {
            let columns = d.rhs.as_mut().chunks_exact_mut(n).zip(d.g.as_ref().chunks_exact(n));
            for (curvature, g) in columns {
                add_product(curvature, pattern, jacobian, g);
            }
            self.algebraic.keep_differential(d.rhs.as_mut());
            let (e, s) = (d.rhs.as_ref(), d.s.as_ref());
            square = larger(square, largest_block(self.tolerances, n, e, s, s, d.sizes.as_ref()));
        }
        let h = (0.5 / (error_constant(1) * square.sqrt())).sqrt();
        if h > 0.0 { h } else { f64::INFINITY }
    }
}
