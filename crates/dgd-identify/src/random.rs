//! Uniform and normal deviates from the bits of any generator.

/// Random numbers from random bits.
pub(super) struct Uniform<G>(pub G);

impl<G: FnMut() -> u64> Uniform<G> {
    /// A number in (0, 1].
    pub(super) fn next(&mut self) -> f64 {
        (((self.0)() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    /// A number from 0 to n − 1.
    pub(super) fn below(&mut self, n: usize) -> usize {
        (((self.next() - f64::EPSILON) * n as f64).max(0.0) as usize).min(n - 1)
    }

    /// A normal deviate by the Box–Muller method.
    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.next().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.next()).cos()
    }
}
