//! Reproducible random numbers.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// A stream of numbers determined by a seed.
pub(crate) struct Random(Pcg64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self::in_stream(seed, 20)
    }

    /// Another stream of numbers for the same seed.
    pub(crate) fn in_stream(seed: u64, stream: u128) -> Self {
        Self(Pcg64::new(u128::from(seed), stream))
    }

    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// One of 0 … n − 1.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n.saturating_sub(1))
    }

    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    pub(crate) fn pick<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }
}

impl Default for Random {
    fn default() -> Self {
        Self::new(0)
    }
}
