//! Moves a run from one segment of smooth inputs to the next.

use crate::error::IntegrateError;
use crate::integrate::drive::InputCursor;
use crate::integrate::methods::stepper::{SensitivityWorkspace, StepEnd};
use crate::integrate::simulation::Simulation;
use crate::problem::Problem;
use crate::signal::Segment;
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Moves ticks of clocks, and times of conditions, onto requested times and samples that equal them to rounding.
    pub(super) fn align_clocks(&mut self, times: &[f64]) {
        if !S::FEATURES.events || self.discrete.schedule.is_empty() {
            return;
        }
        let inputs = self.problem.inputs;
        let samples = (0..inputs.segments()).map(|k| inputs.segment(k).t0);
        let mut marks: Vec<f64> = samples.chain(times.iter().copied()).collect();
        marks.sort_by(f64::total_cmp);
        marks.dedup();
        self.discrete.schedule.align(marks);
    }

    /// Makes the next segment of the inputs the current one.
    pub(super) fn enter_next_segment(
        &mut self,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        solution.statistics.segments += 1;
        self.segment += 1;
        let segment = self.problem.inputs.segment(self.segment);
        self.segment_end = segment.t1;
        if S::FEATURES.past
            && let Some(mut moving) = self.moving.take()
            && (self.directions.is_some() || self.discrete.has_transitions())
        {
            let entered = self.enter_with_moving_jumps(segment, &mut moving, solution);
            self.moving = Some(moving);
            return entered;
        }
        let level = self.level_of(segment);
        self.jump(segment, solution)?;
        self.mark(level, &[]);
        Ok(())
    }

    /// Continues with the inputs of a segment that begins at a time of its own, and makes the transitions that their
    /// jump triggers.
    pub(super) fn jump(
        &mut self,
        segment: Segment<'_>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.begin_sample();
        self.enter(segment, solution)?;
        self.settle(solution)
    }

    /// Continues with the inputs of a segment.
    pub(super) fn enter(
        &mut self,
        segment: Segment<'_>,
        solution: &mut Solution,
    ) -> Result<(), IntegrateError> {
        self.change_inputs(solution, |drive, t, y| {
            drive.enter(segment);
            drive.locate_delays(t, y);
        })
    }

    /// Continues with inputs changed by `enter`.
    pub(super) fn change_inputs(
        &mut self,
        solution: &mut Solution,
        enter: impl FnOnce(&mut InputCursor<S>, f64, &[f64]),
    ) -> Result<(), IntegrateError> {
        let Problem { system, p, .. } = *self.problem;
        self.linearized = false;
        self.stepper.restart();
        if self.algebraic.is_empty() {
            enter(&mut self.drive, self.t, self.y.as_ref());
            return Ok(());
        }

        // Most jumps do not affect algebraic equations.
        let (t, y, z) = (self.t, self.y.as_ref(), self.discrete.z());
        let (before, after) = (&mut self.stepper.f, &mut self.stepper.y_new);
        let mut evaluate = |drive: &mut InputCursor<S>, f: &mut S::Vector, place: StepEnd| {
            let point = EvaluationPoint { t, y, u: drive.evaluate(t, y), p, z };
            match (&mut self.directions, place) {
                (None, _) => system.rhs(point, f.as_mut()),
                (Some(SensitivityWorkspace { s, g, .. }), StepEnd::Start) => {
                    system.sensitivity_rhs(point, s.as_ref(), f.as_mut(), g.as_mut());
                }
                (Some(SensitivityWorkspace { s, s_new, .. }), StepEnd::End) => {
                    system.sensitivity_rhs(point, s.as_ref(), f.as_mut(), s_new.as_mut());
                }
            }
        };
        evaluate(&mut self.drive, before, StepEnd::Start);
        enter(&mut self.drive, t, y);
        evaluate(&mut self.drive, after, StepEnd::End);
        let inputs = self
            .directions
            .as_ref()
            .is_some_and(|d| self.algebraic.differs(d.g.as_ref(), d.s_new.as_ref()));
        solution.statistics.evaluations += 2;
        if inputs || self.algebraic.differs(before.as_ref(), after.as_ref()) {
            self.make_consistent(solution)?;
        }
        Ok(())
    }
}
