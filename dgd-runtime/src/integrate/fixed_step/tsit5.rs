//! Steps of a given size with Tsit5.
//!
//! A step takes six evaluations. The seventh stage, at the end of the step, is evaluated only for an error estimate or
//! an interpolation; within a segment it is the first of the next step. Stages are written out one by one, so that
//! their coefficients are constants in the generated code.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use super::carried::CarriedState;
use super::method::{FixedStep, LastStep, SegmentModel};
use crate::integrate::methods::tableaux::MAX_STAGES;
use crate::integrate::methods::tableaux::RungeKuttaTableau;
use crate::integrate::methods::tableaux::TSIT5;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

const TABLEAU: &RungeKuttaTableau = &TSIT5;

/// Weights of the local error, filled up with zeros.
const ERROR: [f64; MAX_STAGES] = {
    let mut weights = [0.0; MAX_STAGES];
    let mut j = 0;
    while j < TABLEAU.error.len() {
        weights[j] = TABLEAU.error[j];
        j += 1;
    }
    weights
};

/// Differences of stages below this fraction of the unknowns are rounding.
const ROUNDING: f64 = 1e-9;

/// Work space of the method.
pub(crate) struct FixedTsit5<S: SolvableSystem, C> {
    /// Inputs of a stage, if they change.
    u: S::Inputs,
    k: [C; 7],
    stage: C,
    /// Whether the last of the `k` is the slope at the end of the last step.
    has_end: bool,
}

impl<S: SolvableSystem, C: CarriedState<S>> FixedTsit5<S, C> {
    /// Work space for a model.
    pub(crate) fn new(system: &S) -> Self {
        Self {
            u: S::Inputs::zeros(system.signature().n_u()),
            k: std::array::from_fn(|_| C::zeros(system)),
            stage: C::zeros(system),
            has_end: false,
        }
    }

    /// kᵢ = F(t + cᵢ h, x + h Σⱼ aᵢⱼ kⱼ).
    #[inline(always)]
    fn stage<const I: usize>(&mut self, equations: SegmentModel<'_, S>, t: f64, h: f64, now: &C) {
        now.advanced::<I>(h, &TABLEAU.a[I], &self.k, &mut self.stage);
        let SegmentModel { system, p, inputs } = equations;
        let t = t + TABLEAU.c[I] * h;
        let point =
            EvaluationPoint { t, y: &[], u: inputs.evaluate(t, self.u.as_mut()), p, z: &[] };
        self.stage.slopes(system, point, &mut self.k[I]);
    }

    /// Sets one of the `k` to the slope at `x`.
    #[inline(always)]
    fn slopes<const I: usize>(&mut self, equations: SegmentModel<'_, S>, t: f64, x: &C) {
        let SegmentModel { system, p, inputs } = equations;
        let point =
            EvaluationPoint { t, y: &[], u: inputs.evaluate(t, self.u.as_mut()), p, z: &[] };
        x.slopes(system, point, &mut self.k[I]);
    }

    /// The seventh stage.
    #[inline(always)]
    fn end(&mut self, equations: SegmentModel<'_, S>, made: LastStep<'_, C>) {
        if !self.has_end {
            self.slopes::<6>(equations, made.t + made.h, made.to);
            self.has_end = true;
        }
    }
}

impl<S: SolvableSystem, C: CarriedState<S>> FixedStep<S, C> for FixedTsit5<S, C> {
    const EVALUATIONS: usize = TABLEAU.stages() - 1;

    fn exponent(&self) -> u32 {
        TABLEAU.estimate_order + 1
    }

    #[inline(always)]
    fn enter(&mut self) {
        self.has_end = false;
    }

    #[inline(always)]
    fn step(&mut self, equations: SegmentModel<'_, S>, t: f64, h: f64, now: &C, next: &mut C) {
        if self.has_end {
            self.k.swap(0, 6);
            self.has_end = false;
        } else {
            self.slopes::<0>(equations, t, now);
        }
        self.stage::<1>(equations, t, h, now);
        self.stage::<2>(equations, t, h, now);
        self.stage::<3>(equations, t, h, now);
        self.stage::<4>(equations, t, h, now);
        self.stage::<5>(equations, t, h, now);
        now.advanced::<6>(h, &TABLEAU.a[6], &self.k, next);
    }

    #[inline(always)]
    fn estimate(
        &mut self,
        equations: SegmentModel<'_, S>,
        made: LastStep<'_, C>,
        error: &mut C,
    ) -> f64 {
        self.end(equations, made);
        C::weighted::<7>(made.h, &ERROR, &self.k, error);
        // The last two stages are at the same time: h |λ| ≈ h ‖k₇ − k₆‖ / ‖Y₇ − Y₆‖.
        let slopes = distance(self.k[6].y(), self.k[5].y());
        let values = distance(made.to.y(), self.stage.y());
        let size: f64 = made.to.y().iter().map(|y| y * y).sum();
        // At rest both are rounding.
        if values <= ROUNDING * ROUNDING * size {
            return 0.0;
        }
        made.h * (slopes / values).sqrt() / TABLEAU.stability
    }

    fn interpolate(
        &mut self,
        equations: SegmentModel<'_, S>,
        made: LastStep<'_, C>,
        theta: f64,
        out: &mut C,
    ) {
        self.end(equations, made);
        let mut weights = [0.0; MAX_STAGES];
        for (weight, [d1, d2, d3, d4]) in weights.iter_mut().zip(TABLEAU.dense) {
            *weight = theta * (d1 + theta * (d2 + theta * (d3 + theta * d4)));
        }
        made.from.advanced::<7>(made.h, &weights, &self.k, out);
    }
}

/// ‖a − b‖².
#[inline(always)]
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}
