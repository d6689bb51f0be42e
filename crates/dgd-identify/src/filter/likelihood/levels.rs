//! Noise levels as variables of a search.
//!
//! | level of | level | variable z | bounds |
//! |---|---|---|---|
//! | an output | σ = unit · eᶻ | ln(σ/unit) | rounding error .. far above the scatter |
//! | a state | rate = unit · √(eᶻ − 1) | ln(1 + (rate/unit)²) | 0 .. far above the default rate |
//!
//! A rate may be zero. Its logarithm would then be infinite, beyond a plateau without slopes; here z = 0 means zero,
//! the likelihood has a slope there, as it has with respect to the square of the rate, and far above its unit z is a
//! logarithm. The unit is the rate whose estimate has a standard deviation of one unit near zero
//! ([`LikelihoodSearch::told_from_none`](super::LikelihoodSearch)).

use crate::variables::LARGEST_FACTOR;

/// A noise level to be estimated.
#[derive(Debug, Clone, Copy)]
pub(in crate::filter) struct FreeNoiseLevel {
    pub kind: NoiseLevelKind,
    pub unit: f64,
    /// The initial level of a search, and its bounds, SI.
    first: f64,
    least: f64,
    most: f64,
}

/// The kind of a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::filter) enum NoiseLevelKind {
    /// The noise of an output, positive.
    Noise,
    /// The process noise of a state in a second, zero or positive.
    Rate,
}

impl FreeNoiseLevel {
    /// The noise of an output.
    pub(in crate::filter) fn noise(first: f64, least: f64, most: f64) -> Self {
        Self { kind: NoiseLevelKind::Noise, unit: first, first, least, most }
    }

    /// The rate of a state.
    pub(in crate::filter) fn rate(first: f64, most: f64) -> Self {
        Self { kind: NoiseLevelKind::Rate, unit: first, first, least: 0.0, most }
    }

    /// Bounds of z.
    pub(in crate::filter) fn bounds(&self) -> (f64, f64) {
        (self.variable(self.least), self.variable(self.most))
    }

    /// Limit on a step of the search: far above its unit, the z of a rate is the logarithm of its square.
    pub(in crate::filter) fn reach(&self) -> f64 {
        match self.kind {
            NoiseLevelKind::Noise => LARGEST_FACTOR.ln(),
            NoiseLevelKind::Rate => 2.0 * LARGEST_FACTOR.ln(),
        }
    }

    /// Initial z of a search.
    pub(in crate::filter) fn first(&self) -> f64 {
        self.variable(self.first)
    }

    /// The level, SI.
    pub(in crate::filter) fn level(&self, z: f64) -> f64 {
        self.unit
            * match self.kind {
                NoiseLevelKind::Noise => z.exp(),
                NoiseLevelKind::Rate => z.exp_m1().sqrt(),
            }
    }

    /// The z of a level.
    pub(in crate::filter) fn variable(&self, level: f64) -> f64 {
        match self.kind {
            NoiseLevelKind::Noise => (level / self.unit).ln(),
            NoiseLevelKind::Rate => (level / self.unit).powi(2).ln_1p(),
        }
    }

    /// ∂ ln level/∂z.
    pub(in crate::filter) fn log_slope(&self, z: f64) -> f64 {
        match self.kind {
            NoiseLevelKind::Noise => 1.0,
            NoiseLevelKind::Rate => -0.5 / (-z).exp_m1(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_and_levels_belong_to_each_other() {
        for sought in [FreeNoiseLevel::noise(0.3, 1e-6, 1e3), FreeNoiseLevel::rate(0.3, 1e3)] {
            for level in [1e-3, 0.3, 20.0] {
                let z = sought.variable(level);
                assert!((sought.level(z) / level - 1.0).abs() < 1e-12, "{sought:?} {level}");
                let step = 1e-5 * z.abs().max(1e-3);
                let [below, above] = [z - step, z + step].map(|z| sought.level(z).ln());
                let slope = (above - below) / (2.0 * step);
                assert!((sought.log_slope(z) / slope - 1.0).abs() < 1e-4, "{sought:?} {level}");
            }
        }
        let rate = FreeNoiseLevel::rate(0.3, 1e3);
        assert_eq!((rate.level(0.0), rate.variable(0.0)), (0.0, 0.0));
    }
}
