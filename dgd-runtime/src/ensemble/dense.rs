//! What lies between the ends of a step in each lane, as a polynomial of its fraction.

#![allow(clippy::inline_always)]

use super::lanes::LaneStorage;
use crate::system::{Storage, System};

/// cₗ of each unknown, θ = (t − t₀)/h:
///
/// ```text
///   y(t₀ + θ h) = y + θ (c₁ + θ (c₂ + θ (c₃ + θ c₄)))
/// ```
pub(super) struct Polynomials<S: System> {
    pub(super) c: [<S::Vector as Storage>::Lanes; 4],
}

impl<S: System> Polynomials<S> {
    pub(super) fn new(n: usize) -> Self {
        Self { c: std::array::from_fn(|_| <S::Vector as Storage>::Lanes::zeros(n)) }
    }

    /// Writes unknown i of lane l at the `asked` times, best a multiple of eight, of a step from (t, y)
    /// by 1/`per_h`.
    #[inline(always)]
    pub(super) fn write(
        &self,
        (i, l): (usize, usize),
        (t, y, per_h): (f64, f64, f64),
        asked: &[f64],
        row: &mut [f64],
    ) {
        let lane = |c: &<S::Vector as Storage>::Lanes| c.lanes()[i].0[l];
        let [c1, c2, c3, c4] = &self.c;
        let (c1, c2, c3, c4) = (lane(c1), lane(c2), lane(c3), lane(c4));
        for (value, asked) in row.iter_mut().zip(asked) {
            let theta = (asked - t) * per_h;
            *value = y + theta * (c1 + theta * (c2 + theta * (c3 + theta * c4)));
        }
    }
}
