//! Slopes of all unknowns along a solution.

use super::AlgebraicSystem;
use crate::problem::unknown_sizes;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Derivatives of all unknowns along a solution.
pub(crate) struct UnknownRates<S: SolvableSystem> {
    algebraic: AlgebraicSystem<S>,
    jacobian: S::Jacobian,
    f: S::Vector,
    dfdt: S::Vector,
    mass: S::Vector,
    sizes: S::Vector,
}

impl<S: SolvableSystem> UnknownRates<S> {
    /// For a solution that starts at these values, none if it has no rows.
    pub(crate) fn new(system: &S, start: &[f64]) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let mut sizes = S::Vector::zeros(n);
        if start.len() == n {
            unknown_sizes(system, start, sizes.as_mut());
        }
        Self {
            algebraic: AlgebraicSystem::new(system),
            jacobian: S::Jacobian::zeros(signature.jacobian.len()),
            f: S::Vector::zeros(n),
            dfdt: S::Vector::zeros(n),
            mass: S::Vector::zeros(n),
            sizes,
        }
    }

    /// ẏ at consistent values; `None` if the algebraic unknowns are not determined.
    pub(crate) fn evaluate(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        udot: &[f64],
    ) -> Option<&[f64]> {
        if !system.signature().discrete.automata.is_empty() {
            system.mass(at, self.mass.as_mut());
            self.algebraic.enter_modes(self.mass.as_ref());
        }
        let (f, jacobian) = (self.f.as_mut(), self.jacobian.as_mut());
        system.linearize(at, udot, f, jacobian, self.dfdt.as_mut());
        let pattern = &system.signature().jacobian;
        let (dfdt, sizes) = (self.dfdt.as_ref(), self.sizes.as_ref());
        self.algebraic.rates(pattern, jacobian, f, dfdt, sizes).ok()?;
        Some(self.f.as_ref())
    }
}
