//! Consistent values at the start of a run, and after inputs or modes have changed.

pub(crate) mod consistent;
pub(crate) mod dependent;
pub(crate) mod equations;
pub(crate) mod measured;
mod one_sided;

use crate::algebraic::AlgebraicPoint;
use crate::error::IntegrateError;
use crate::integrate::drive::InstantInputs;
use crate::integrate::events::singular_point::Weakness;
use crate::integrate::methods::stepper::StepBase;
use crate::integrate::simulation::Simulation;
use crate::integrate::start::consistent::start_values;
use crate::linalg::Singular;
use crate::problem::{Options, Problem, parameter_size, unknown_sizes};
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::{Direction, EvaluationPoint};

/// Maximum number of corrections of sensitivities at the start of a history, and the fraction of the tolerance at which
/// they end.
const MOST_CORRECTIONS: usize = 8;
const CORRECTED: f64 = 1e-6;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Consistent start values and sensitivities.
    pub(super) fn start(&mut self, solution: &mut Solution) -> Result<(), IntegrateError> {
        let Problem { system, p, .. } = *self.problem;
        let n = self.y.as_ref().len();
        let u = self.drive.evaluate(self.t, self.y.as_ref());
        let point = EvaluationPoint { t: self.t, y: &[], u, p, z: self.discrete.z() };
        start_values(self.problem, point, self.y.as_mut()).map_err(IntegrateError::Initial)?;
        let is_found = self.resumed.is_none() && system.signature().start_is_found();
        if is_found {
            let options = Options {
                rtol: self.tolerances.rtol,
                atol: self.tolerances.atol,
                watched: self.watched,
                ..Options::default()
            };
            S::find_start(self.problem, self.t, &options, self.y.as_mut(), None)
                .map_err(IntegrateError::Initial)?;
        }
        unknown_sizes(system, self.y.as_ref(), self.sizes.as_mut());
        if let Some(d) = &mut self.directions {
            self.problem.start_sensitivities(point, d.s.as_mut());
            let directions = &system.signature().directions;
            if is_found {
                let mut y = self.y.as_ref().to_vec();
                let options = Options {
                    rtol: self.tolerances.rtol,
                    atol: self.tolerances.atol,
                    watched: self.watched,
                    ..Options::default()
                };
                S::find_start(self.problem, self.t, &options, &mut y, Some(d.s.as_mut()))
                    .map_err(IntegrateError::Initial)?;
            }
            let columns = d.sizes.as_mut().chunks_exact_mut(n.max(1));
            for (column, direction) in columns.zip(directions.iter()) {
                let of_direction = match *direction {
                    Direction::Parameter(position) => parameter_size(system, position),
                    Direction::Start(i) => self.sizes.as_ref()[i],
                };
                for (size, unknown) in column.iter_mut().zip(self.sizes.as_ref()) {
                    *size = unknown / of_direction;
                }
            }
        }
        solution.statistics.segments = 1;
        match self.resumed {
            None => self.begin_modes(),
            Some(memory) => self.recall_modes(memory),
        }
        self.select_first_states();
        self.evaluate_jumps();
        self.begin_switches();
        if let Some(memory) = self.resumed {
            self.recall_bounds(memory);
        }
        self.find_pieces().map_err(IntegrateError::Initial)?;
        self.make_consistent(solution)?;
        self.reselect_states(solution)?;
        // Bounds that unknowns exceed at the start act at once; other conditions that are true at the start act only
        // after they have been false.
        self.begin_sample();
        self.enter_pieces(None, solution)?;
        self.settle(solution)?;
        if self.resumed.is_none() {
            self.make_first_ticks(solution)?;
        }
        self.begin_history();
        self.pass_discontinuities(solution)?;
        self.judge_derivatives(solution);
        Ok(())
    }

    /// Makes algebraic unknowns and their sensitivities consistent with the current inputs.
    pub(super) fn make_consistent(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.make_values_consistent()?;
        if !self.algebraic.is_empty() && self.directions.is_some() {
            self.linearize_values();
            self.make_sensitivities_consistent(solution);
        }
        Ok(())
    }

    /// Makes algebraic unknowns consistent with the current inputs and modes.
    pub(super) fn make_values_consistent(&mut self) -> Result<(), IntegrateError> {
        self.linearized = false;
        self.stepper.restart();
        self.drive.locate_delays(self.t, self.y.as_ref());
        if self.algebraic.is_empty() {
            return Ok(());
        }
        let Problem { system, p, .. } = *self.problem;
        self.drive.free_delays(true);
        let point = AlgebraicPoint {
            t: self.t,
            u: InstantInputs { drive: &mut self.drive, t: self.t },
            p,
            z: self.discrete.z(),
        };
        let made = self.algebraic.make_consistent(
            system,
            point,
            self.y.as_mut(),
            self.stepper.jacobian.as_mut(),
            self.sizes.as_ref(),
            self.tolerances,
        );
        self.drive.free_delays(false);
        self.drive.locate_delays(self.t, self.y.as_ref());
        if S::FEATURES.events && made.is_err() && !self.discrete.pieces.is_empty() {
            return self.find_pieces().map_err(IntegrateError::Initial);
        }
        made.map_err(IntegrateError::Initial)
    }

    /// Linearises at (t, y) without sensitivities; a step cannot start from that.
    pub(super) fn linearize_values(&mut self) {
        let Problem { system, p, .. } = *self.problem;
        let (mass, z) = (&self.algebraic.mass, self.discrete.z());
        let base = StepBase { system, p, z, mass, t: self.t };
        self.stepper.linearize(base, &mut self.drive, self.y.as_ref(), None);
        self.linearized = false;
    }

    /// Computes the sensitivities of algebraic unknowns from those of the others, or ends them if they are not
    /// determined. The stepper is linearised at (t, y).
    pub(super) fn make_sensitivities_consistent(&mut self, solution: &mut Solution) {
        let Problem { system, p, .. } = *self.problem;
        if self.directions.is_none() {
            return;
        }
        let singular = self.weak_equation(self.t, Weakness::Singular);
        let Some(d) = &mut self.directions else { return };
        let pattern = &system.signature().jacobian;
        let (jacobian, sizes) = (self.stepper.jacobian.as_ref(), self.sizes.as_ref());
        let singular = singular.or_else(|| {
            self.algebraic.factorise(pattern, jacobian, sizes).err().map(|Singular { row }| row)
        });
        solution.statistics.factorisations += 2;
        if let Some(row) = singular {
            self.end_sensitivities(self.t, row, solution);
        } else {
            let u = self.drive.evaluate(self.t, self.y.as_ref());
            let point =
                EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
            let (s, g) = (d.s.as_mut(), d.g.as_mut());
            self.algebraic.make_sensitivities_consistent(system, point, s, g);
        }
    }

    /// Makes sensitivities of algebraic unknowns consistent with a history that has begun with them. Until then,
    /// delayed unknowns were read without delay, with the derivative −ẋ with respect to a delay, although nothing moved
    /// before the start. The problem is linear except for variable delays, so the first correction is the main one.
    pub(super) fn make_sensitivities_consistent_with_history(&mut self) {
        let Problem { system, p, .. } = *self.problem;
        let history = self.drive.history.as_ref();
        if self.algebraic.is_empty() || history.is_none_or(|history| history.is_resumed()) {
            return;
        }
        for _ in 0..MOST_CORRECTIONS {
            let Some(d) = &mut self.directions else { return };
            let u = self.drive.evaluate(self.t, self.y.as_ref());
            let point =
                EvaluationPoint { t: self.t, y: self.y.as_ref(), u, p, z: self.discrete.z() };
            let (s, g) = (d.s.as_mut(), d.g.as_mut());
            self.algebraic.correct_sensitivities(system, point, s, g);
            let Some(history) = &mut self.drive.history else { return };
            history.begin_sensitivities(self.y.as_ref(), s);
            let (sizes, atol) = (d.sizes.as_ref(), self.tolerances.atol);
            let is_small = |(g, size): (&f64, &f64)| g.abs() <= CORRECTED * atol * size;
            if g.iter().zip(sizes).all(is_small) {
                return;
            }
        }
    }
}
