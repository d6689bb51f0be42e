//! Changes between pieces of algebraic equations during a run.
//!
//! Where the solution reaches the end of a piece, several pieces may change at one time, as in a bridge of diodes of
//! which two open together. Which ones hold from then on follows from the equations just after: states are moved on by
//! a little, and unknowns and pieces found there together ([`crate::algebraic::PieceAutomata`]).
//!
//! The unknowns are continuous unless there is no solution next to the one before: at a fold, where the equations stop
//! determining their unknowns. Then these jump to another solution, which is recorded ([`Fold`]), and sensitivities
//! end.

use crate::algebraic::{AlgebraicPoint, CorrectionWeights};
use crate::error::{InitialError, IntegrateError};
use crate::integrate::events::transitions::OF_ROUNDING;
use crate::integrate::simulation::Simulation;
use crate::linalg::norm::Tolerances;
use crate::problem::Problem;
use crate::solution::{Fold, Solution, UndefinedCause, UndefinedSensitivity};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// How far states are moved on, in units of their tolerance, and at most, as a fraction of the run.
const ON: f64 = 0.1;
const ON_TIME: f64 = 1e-9;
/// A movement must be seen beside rounding, whatever the tolerance.
const SEEN: f64 = 1e-9;
/// Unknowns that change by more than this, in units of their tolerance, may jump.
const FAR: f64 = 10.0;
/// Whether they do is seen from a movement that is this part of the other.
const NEARER: f64 = 1.0 / 16.0;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Finds the pieces that hold at (t, y), together with the algebraic unknowns.
    pub(in crate::integrate) fn find_pieces(&mut self) -> Result<(), InitialError> {
        if self.discrete.pieces.is_empty() || self.algebraic.is_empty() {
            return Ok(());
        }
        self.linearized = false;
        self.stepper.restart();
        let mut y = self.y.take();
        let pieces = self.solve_pieces_at(self.t, y.as_mut());
        self.y = y;
        pieces
    }

    /// Finds the pieces that hold just after t, and the unknowns that they have there; `because` is the automaton that
    /// left its piece.
    pub(in crate::integrate) fn enter_pieces(
        &mut self,
        because: Option<usize>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        if self.discrete.pieces.is_empty() || self.algebraic.is_empty() {
            return Ok(());
        }
        // Only points reached along a solution may be folds; inputs, resets and other modes jump by themselves.
        let is_reached = self.discrete.located.is_some();
        if is_reached {
            // A step leaves algebraic unknowns within the tolerance of their equations.
            self.make_values_consistent()?;
        }
        self.find_pieces_ahead(1.0, because)?;
        let may_be_fold = is_reached && self.discrete.pieces.has_turned();
        let far = self.distance_from_row().filter(|(_, far)| may_be_fold && *far > FAR);
        // Continuous unknowns change the less the nearer the pieces are found.
        if let Some((_, far)) = far {
            self.y.as_mut().copy_from_slice(self.row.as_ref());
            self.find_pieces_ahead(NEARER, because)?;
            let nearer = self.distance_from_row().filter(|(_, nearer)| *nearer > 0.5 * far);
            if let Some((unknown, _)) = nearer {
                self.jump_at_fold(unknown, because, solution);
            }
        }
        if self.directions.is_some() {
            self.linearize_values();
            self.make_sensitivities_consistent(solution);
        }
        self.set_slack_of_pieces();
        Ok(())
    }

    /// Finds the pieces that hold after this part of the movement of [`Self::move_on`], and the unknowns that satisfy
    /// them at t. Those before are in `row` then.
    fn find_pieces_ahead(
        &mut self,
        part: f64,
        because: Option<usize>,
    ) -> Result<(), IntegrateError> {
        let on = self.move_on(part);
        let mut after = self.row.take();
        let mut pieces = self.solve_pieces_at(self.t + on, after.as_mut());
        // States that begin to move with these pieces may tell apart others, which agree where they rest.
        if pieces.is_ok() {
            let has_turned = self.discrete.pieces.has_turned();
            self.move_states(on, after.as_mut());
            pieces = self.solve_pieces_at(self.t + on, after.as_mut());
            self.discrete.pieces.count_turn(has_turned);
        }
        // States stay where they are.
        let mass = self.algebraic.mass.as_ref();
        for ((after, y), mass) in after.as_mut().iter_mut().zip(self.y.as_mut()).zip(mass) {
            if *mass == 0.0 {
                std::mem::swap(after, y);
            } else {
                *after = *y;
            }
        }
        self.row = after;
        match pieces {
            Ok(()) => self.make_values_consistent(),
            Err(error) => Err(self.no_piece(because, error)),
        }
    }

    /// Solves for algebraic unknowns and pieces at a time, with the states in `y`.
    fn solve_pieces_at(&mut self, t: f64, y: &mut [f64]) -> Result<(), InitialError> {
        let Problem { system, p, .. } = *self.problem;
        let point = AlgebraicPoint { t, u: self.drive.evaluate(t, y), p, z: &[] };
        let weights = CorrectionWeights { sizes: self.sizes.as_ref(), tolerances: self.tolerances };
        self.algebraic.solve_pieces(
            system,
            &mut self.discrete.pieces,
            point,
            &mut self.discrete.schedule.z,
            y,
            self.stepper.jacobian.as_mut(),
            weights,
        )
    }

    /// Advances states over a time `on` with their slopes at `y`, which is that much later.
    fn move_states(&mut self, on: f64, y: &mut [f64]) {
        let Problem { system, p, .. } = *self.problem;
        let t = self.t + on;
        let point = EvaluationPoint {
            t,
            y,
            u: self.drive.evaluate(t, y),
            p,
            z: self.discrete.schedule.z.as_slice(),
        };
        let slopes = self.stepper.rhs.as_mut();
        system.rhs(point, slopes);
        let (mass, before) = (self.algebraic.mass.as_ref(), self.y.as_ref());
        for (i, y) in y.iter_mut().enumerate() {
            if mass[i] != 0.0 {
                *y = before[i] + on * slopes[i];
            }
        }
    }

    /// At t itself, event functions of pieces that hold just after may still be on the other side by a little.
    fn set_slack_of_pieces(&mut self) {
        self.evaluate_events();
        let Tolerances { rtol, atol } = self.seen();
        self.take_errors(rtol, atol);
        let discrete = &self.problem.system.signature().discrete;
        for (k, (automaton, transition)) in discrete.transitions().enumerate() {
            if !discrete.automata[automaton].kind.is_piece() {
                continue;
            }
            let (e, little) = (self.discrete.e[k], self.discrete.high[k]);
            let is_behind = self.discrete.is_active(automaton, transition.from)
                && transition.crossing.is_past(e)
                && e.abs() <= little;
            self.discrete.armed[k] = true;
            self.discrete.slack[k] = if is_behind { 2.0 * e.abs() } else { OF_ROUNDING };
        }
    }

    /// The tolerances, but not so small that movements within them are rounding.
    fn seen(&self) -> Tolerances {
        let Tolerances { rtol, atol } = self.tolerances;
        Tolerances { rtol: rtol.max(SEEN), atol: atol.max(SEEN) }
    }

    /// Writes y to `row`, states moved on by a part of a little along their slopes. Returns the time that this takes.
    fn move_on(&mut self, part: f64) -> f64 {
        let Problem { system, p, .. } = *self.problem;
        let inputs = self.seen();
        let y = self.y.as_ref();
        let u = self.drive.evaluate(self.t, y);
        let point = EvaluationPoint { t: self.t, y, u, p, z: self.discrete.z() };
        let slopes = self.stepper.rhs.as_mut();
        system.rhs(point, slopes);
        self.algebraic.keep_differential(slopes);
        let speed = inputs.mean_square(slopes, y, y, self.sizes.as_ref()).sqrt();
        let on = part * (ON / speed).min(ON_TIME * self.span);
        let on = on.max(16.0 * f64::EPSILON * self.t.abs());
        for ((row, y), slope) in self.row.as_mut().iter_mut().zip(y).zip(slopes.iter()) {
            *row = y + on * slope;
        }
        on
    }

    /// The unknown that differs most from `row`, and by how many tolerances.
    fn distance_from_row(&self) -> Option<(usize, f64)> {
        let inputs = self.seen();
        let (y, before, sizes) = (self.y.as_ref(), self.row.as_ref(), self.sizes.as_ref());
        let far = |i: usize| {
            let weight = inputs.weight(y[i].abs().max(before[i].abs()), sizes[i]);
            (i, (y[i] - before[i]).abs() / weight)
        };
        (0..y.len()).map(far).max_by(|(_, a), (_, b)| a.total_cmp(b))
    }

    /// Records that algebraic unknowns have jumped, this one furthest, from their values in `row`.
    fn jump_at_fold(&mut self, unknown: usize, because: Option<usize>, solution: &mut Solution) {
        let signature = self.problem.system.signature();
        let fold = Fold {
            t: self.t,
            unknown: signature.unknowns.name(unknown).to_string(),
            unit: signature.unknowns.unit(unknown).clone(),
            from: self.row.as_ref()[unknown],
            to: self.y.as_ref()[unknown],
            automaton: because.map(|k| signature.discrete.automata[k].name.clone()),
        };
        self.end_sensitivities_at_fold(&fold, solution);
        solution.folds.push(fold);
    }

    fn end_sensitivities_at_fold(&mut self, fold: &Fold, solution: &mut Solution) {
        if self.directions.take().is_none() {
            return;
        }
        let (from, until) = (self.t, self.t);
        let equation = fold.unknown.clone();
        let cause = UndefinedCause::Fold;
        solution.undefined.push(UndefinedSensitivity { from, until, equation, cause });
    }

    fn no_piece(&self, because: Option<usize>, error: InitialError) -> IntegrateError {
        let Some(k) = because else { return IntegrateError::Initial(error) };
        let automaton = self.problem.system.signature().discrete.automata[k].name.to_string();
        IntegrateError::NoSolutionBeyond { t: self.t, automaton, error: Box::new(error) }
    }
}
