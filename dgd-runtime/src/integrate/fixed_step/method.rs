//! The contract between the loop over samples and a method that makes steps of given size.

use super::carried::Carried;
use super::segment_inputs::SegmentInputs;
use crate::solved::Solved;

/// A model with its parameters, and its inputs along a segment.
pub(crate) struct Equations<'a, S> {
    pub(crate) system: &'a S,
    pub(crate) p: &'a [f64],
    pub(crate) inputs: SegmentInputs<'a>,
}

impl<S> Clone for Equations<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S> Copy for Equations<'_, S> {}

/// A method that makes steps of given size, for models all of whose unknowns are differential.
///
/// A step that follows another begins where that ended, with the same inputs, unless
/// [`FixedStep::enter`] is called in between.
pub(crate) trait FixedStep<S: Solved, C: Carried<S>> {
    /// Evaluations of F in a step.
    const EVALUATIONS: usize;

    /// Local errors, as they are estimated, fall with this power of h.
    fn exponent(&self) -> u32;

    /// Goes on with other inputs: nothing that was evaluated before holds any more.
    fn enter(&mut self);

    /// Makes a step of size h from `now` at `t` to `next`.
    fn step(&mut self, equations: Equations<'_, S>, t: f64, h: f64, now: &C, next: &mut C);

    /// Writes the local error of the step made last, and gives h |λ| of the fastest rate λ that it
    /// met over what is stable; beyond 1 errors grow.
    fn estimate(&mut self, equations: Equations<'_, S>, made: Made<'_, C>, error: &mut C) -> f64;

    /// What lies at the fraction θ of the step made last.
    fn interpolate(
        &mut self,
        equations: Equations<'_, S>,
        made: Made<'_, C>,
        theta: f64,
        out: &mut C,
    );
}

/// The step made last.
pub(crate) struct Made<'a, C> {
    /// Where it began.
    pub(crate) t: f64,
    /// Its size.
    pub(crate) h: f64,
    pub(crate) from: &'a C,
    pub(crate) to: &'a C,
}

impl<C> Clone for Made<'_, C> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<C> Copy for Made<'_, C> {}
