//! Chooses a method that can begin a run.
//!
//! Rosenbrock methods need the derivatives of f at the start of each step and, with sensitivities, the second
//! derivatives too. Those of x^1.5 are not finite at x = 0, but are at the end of any step. This is checked before the
//! run, so that no run changes its method on the way.

use crate::integrate::delay::history;
use crate::integrate::methods::catalogue::{METHODS, Method};
use crate::integrate::methods::family::FamilyNeeds;
use crate::integrate::methods::stepper::SensitivityWorkspace;
use crate::integrate::simulation::Simulation;
use crate::problem::{Options, Problem};
use crate::solution::Solution;
use crate::solved::SolvableSystem;

/// A substitute for a method that cannot begin a run.
#[derive(Debug, Clone)]
pub struct OtherMethod {
    /// The method that can begin it.
    pub method: &'static Method,
    /// The equation with a derivative that is not finite where the run begins.
    pub equation: String,
    /// The start of the run, s.
    pub t: f64,
}

/// The method for a run that begins at `t` and that `options.method` cannot begin: `kencarp4`, which needs no second
/// derivatives, or `bdf`, which needs no derivative at the start of a step. `None` if the method can begin the run, if
/// none can, or if the request is invalid, which the run will report.
///
/// A model with directions is checked as if sensitivities to them were requested.
pub fn method_to_begin<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    t: f64,
    options: &Options,
) -> Option<OtherMethod> {
    if !options.method.kind.traits().wants_all_derivatives() {
        return None;
    }
    options.verify().ok()?;
    problem.verify().ok()?;
    problem.inputs.cover(t, t).ok()?;
    let system = problem.system;
    let signature = system.signature();
    let n_s = signature.directions.len();
    history::verify(problem, n_s > 0).ok()?;
    let inputs = problem.inputs_read().ok()?;
    let read = Problem { inputs: &inputs, ..*problem };
    let directions = (n_s > 0).then(|| SensitivityWorkspace::new(system));
    let mut simulation = Simulation::new(&read, options, t, directions);
    let mut solution = Solution::empty(signature, n_s);
    simulation.start(&mut solution).ok()?;
    simulation.linearize_for_step(&mut solution);
    let (method, row) = simulation.other_method()?;
    Some(OtherMethod { method, equation: signature.equations.get(row).to_string(), t })
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// The method to use instead of a Rosenbrock method, from the linearisation at (t, y), and the equation with a
    /// derivative that is not finite.
    fn other_method(&self) -> Option<(&'static Method, usize)> {
        let bad = |values: &[f64]| values.iter().position(|value| !value.is_finite());
        let signature = self.problem.system.signature();
        let n = self.y.as_ref().len();
        let of_directions = self.directions.as_ref();
        if bad(self.stepper.f.as_ref()).or(of_directions.and_then(|d| bad(d.g.as_ref()))).is_some()
        {
            return None;
        }
        let needing =
            |needs| METHODS.iter().find(|m| m.kind.is_implicit() && m.kind.traits().needs == needs);
        if let Some(k) = bad(self.stepper.jacobian.as_ref()) {
            let method = needing(FamilyNeeds::Nothing)?;
            return Some((method, signature.jacobian.position(k).0));
        }
        let of_time = bad(self.stepper.dfdt.as_ref());
        let row = of_time.or_else(|| {
            let d = of_directions?;
            let pattern = &signature.sensitivity_jacobian;
            let second = || bad(d.dgdy.as_ref()).map(|k| pattern.position(k).0 % n);
            bad(d.dgdt.as_ref()).map(|row| row % n).or_else(second)
        })?;
        Some((needing(FamilyNeeds::Jacobian)?, row))
    }
}
