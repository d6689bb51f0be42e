//! The contract between the loop over samples and a method that makes steps of a given size.

use super::carried::CarriedState;
use super::segment_inputs::SegmentInputs;
use crate::solved::SolvableSystem;

/// A model with its parameters, and its inputs along a segment.
pub(crate) struct SegmentModel<'a, S> {
    pub(crate) system: &'a S,
    pub(crate) p: &'a [f64],
    pub(crate) inputs: SegmentInputs<'a>,
}

impl<S> Clone for SegmentModel<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S> Copy for SegmentModel<'_, S> {}

/// A method that makes steps of a given size, for models whose unknowns are all differential.
///
/// A step begins where the previous one ended, with the same inputs, unless [`FixedStep::enter`] is called in between.
pub(crate) trait FixedStep<S: SolvableSystem, C: CarriedState<S>> {
    /// Evaluations of F in a step.
    const EVALUATIONS: usize;

    /// The power of h with which estimated local errors fall.
    fn exponent(&self) -> u32;

    /// Continues with other inputs: earlier evaluations are no longer valid.
    fn enter(&mut self);

    /// Makes a step of size h from `now` at `t` to `next`.
    fn step(&mut self, equations: SegmentModel<'_, S>, t: f64, h: f64, now: &C, next: &mut C);

    /// Writes the local error of the last step, and returns h |λ| of the fastest rate λ in it, relative to the
    /// stability limit; beyond 1 errors grow.
    fn estimate(
        &mut self,
        equations: SegmentModel<'_, S>,
        made: LastStep<'_, C>,
        error: &mut C,
    ) -> f64;

    /// The values at the fraction θ of the last step.
    fn interpolate(
        &mut self,
        equations: SegmentModel<'_, S>,
        made: LastStep<'_, C>,
        theta: f64,
        out: &mut C,
    );
}

/// The last step.
pub(crate) struct LastStep<'a, C> {
    /// Its start, s.
    pub(crate) t: f64,
    /// Its size, s.
    pub(crate) h: f64,
    pub(crate) from: &'a C,
    pub(crate) to: &'a C,
}

impl<C> Clone for LastStep<'_, C> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C> Copy for LastStep<'_, C> {}
