//! Changes which unknowns are states during a run.

use crate::discrete::state_selection::select_states;
use crate::error::IntegrateError;
use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Selects the states that suit (t, y). Returns whether the selection changed. The mass matrix and everything
    /// derived from it are not updated yet.
    #[inline]
    pub(in crate::integrate) fn select_states(&mut self) -> bool {
        if !S::FEATURES.events || !self.discrete.selects_states() {
            return false;
        }
        let Problem { system, p, .. } = *self.problem;
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        let point = EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: &[] };
        select_states(system, point, &mut self.discrete.schedule.z, &mut self.discrete.e)
    }

    /// Selects the states for the first consistent values.
    pub(in crate::integrate) fn select_first_states(&mut self) {
        if S::FEATURES.events && self.select_states() {
            let Problem { system, p, .. } = *self.problem;
            let mut mass = self.algebraic.mass.clone();
            let u = self.drive.evaluate(self.t, self.y.as_ref());
            let point = EvaluationPoint { t: self.t, y: &[], u, p, z: self.discrete.z() };
            system.mass(point, mass.as_mut());
            self.algebraic.enter_modes(mass.as_ref());
        }
    }

    /// Continues with other states if the current ones have become a bad choice. The solution does not change, so the
    /// time of the change has no influence.
    #[inline]
    pub(in crate::integrate) fn reselect_states(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if !S::FEATURES.events || !self.select_states() {
            return Ok(());
        }
        self.discrete.saltation.tau.fill(0.0);
        self.begin_instant(solution);
        self.take_over(None, solution)
    }
}
