//! Steps of a given size along Taylor series.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use super::carried::CarriedState;
use super::method::{FixedStep, LastStep, SegmentModel};
use crate::integrate::methods::taylor::{TaylorExpansion, YAndS};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// Work space of the method.
pub(crate) struct FixedTaylor<S: SolvableSystem> {
    /// Inputs at the start or end of the step, if they change.
    u: S::Inputs,
    /// Slopes at the end of the last step.
    f: S::Vector,
    g: Vec<f64>,
    expansion: TaylorExpansion,
}

impl<S: SolvableSystem> FixedTaylor<S> {
    /// Work space for a model and `n_s` directions.
    pub(crate) fn new(system: &S, order: usize, n_s: usize) -> Self {
        Self {
            u: S::Inputs::zeros(system.signature().n_u()),
            f: S::Vector::zeros(system.signature().unknowns.len()),
            g: vec![0.0; system.signature().unknowns.len() * n_s],
            expansion: TaylorExpansion::new(system, order, n_s),
        }
    }
}

impl<S: SolvableSystem, C: CarriedState<S>> FixedStep<S, C> for FixedTaylor<S> {
    const EVALUATIONS: usize = 1;

    fn exponent(&self) -> u32 {
        self.expansion.order() as u32
    }

    #[inline(always)]
    fn enter(&mut self) {}

    #[inline(always)]
    fn step(&mut self, equations: SegmentModel<'_, S>, t: f64, h: f64, now: &C, next: &mut C) {
        let SegmentModel { system, p, inputs } = equations;
        let point =
            EvaluationPoint { t, y: now.y(), u: inputs.evaluate(t, self.u.as_mut()), p, z: &[] };
        self.expansion.compute(system, point, inputs.slope(), h, now.s());
        let (y, s) = next.parts_mut();
        self.expansion.sum(1.0, now.y(), y);
        if C::HAS_SENSITIVITIES {
            self.expansion.sum_sensitivities(1.0, now.s(), y.len(), s);
        }
    }

    /// No rate of the model is known; if steps are too long for one, the terms of the series are large.
    #[inline(always)]
    fn estimate(
        &mut self,
        equations: SegmentModel<'_, S>,
        made: LastStep<'_, C>,
        error: &mut C,
    ) -> f64 {
        let (y, s) = error.parts_mut();
        self.expansion.error(1.0, y);
        if C::HAS_SENSITIVITIES {
            self.expansion.sensitivity_error(1.0, y.len(), s);
        }
        let t = made.t + made.h;
        let SegmentModel { system, p, inputs } = equations;
        let point = EvaluationPoint {
            t,
            y: made.to.y(),
            u: inputs.evaluate(t, self.u.as_mut()),
            p,
            z: &[],
        };
        let slopes = YAndS { y: self.f.as_mut(), s: &mut self.g };
        self.expansion.add_defects(system, point, 1.0, made.to.s(), slopes, YAndS { y, s });
        0.0
    }

    fn interpolate(
        &mut self,
        _: SegmentModel<'_, S>,
        made: LastStep<'_, C>,
        theta: f64,
        out: &mut C,
    ) {
        let (y, s) = out.parts_mut();
        self.expansion.sum(theta, made.from.y(), y);
        if C::HAS_SENSITIVITIES {
            self.expansion.sum_sensitivities(theta, made.from.s(), y.len(), s);
        }
    }
}
