//! Dense output of a step in each lane, as a polynomial of its fraction.

#![allow(clippy::inline_always)]

use super::lanes::LaneStorage;
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// cₗ of each unknown, θ = (t − t₀)/h:
///
/// ```text
///   y(t₀ + θ h) = y + θ (c₁ + θ (c₂ + θ (c₃ + θ c₄)))
/// ```
pub(super) struct DensePolynomials<S: SolvableSystem> {
    pub(super) c: [<S::Vector as Storage>::Lanes; 4],
}

/// A step of one lane.
#[derive(Clone, Copy)]
pub(super) struct LaneStep {
    pub(super) lane: usize,
    /// Its start, and 1/h.
    pub(super) t: f64,
    pub(super) per_h: f64,
}

impl<S: SolvableSystem> DensePolynomials<S> {
    pub(super) fn new(n: usize) -> Self {
        Self { c: std::array::from_fn(|_| <S::Vector as Storage>::Lanes::zeros(n)) }
    }

    /// Writes unknown i of a lane, which is y at the start of the lane's step, at the `asked` times, ideally a multiple
    /// of eight of them.
    #[inline(always)]
    pub(super) fn write(&self, i: usize, y: f64, step: LaneStep, asked: &[f64], row: &mut [f64]) {
        let lane = |c: &<S::Vector as Storage>::Lanes| c.lanes()[i].0[step.lane];
        let [c1, c2, c3, c4] = &self.c;
        let (c1, c2, c3, c4) = (lane(c1), lane(c2), lane(c3), lane(c4));
        for (value, asked) in row.iter_mut().zip(asked) {
            let theta = (asked - step.t) * step.per_h;
            *value = y + theta * (c1 + theta * (c2 + theta * (c3 + theta * c4)));
        }
    }
}
