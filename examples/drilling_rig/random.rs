//! Random numbers that are the same on every machine.

/// A permuted congruential generator, PCG-XSH-RR 64/32.
///
/// # Source
///
/// O'Neill, *PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for Random
/// Number Generation*, HMC-CS-2014-0905.
#[derive(Debug, Clone)]
pub(crate) struct Random {
    state: u64,
    increment: u64,
}

impl Random {
    /// The stream of that number; streams of one seed are independent of each other.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut random = Self { state: 0, increment: (stream << 1) | 1 };
        random.next();
        random.state = random.state.wrapping_add(seed);
        random.next();
        random
    }

    fn next(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(self.increment);
        let mixed = (((old >> 18) ^ old) >> 27) as u32;
        mixed.rotate_right((old >> 59) as u32)
    }

    /// Uniform in [low, high).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        let unit = f64::from(self.next()) / (f64::from(u32::MAX) + 1.0);
        low + (high - low) * unit
    }

    /// True with that probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }

    /// A magnitude between the two, with either sign.
    pub(crate) fn either_sign(&mut self, low: f64, high: f64) -> f64 {
        let magnitude = self.between(low, high);
        if self.chance(0.5) { magnitude } else { -magnitude }
    }

    /// Standard normal, by Box and Muller's transformation.
    pub(crate) fn normal(&mut self) -> f64 {
        // 1 − u is in (0, 1], where the logarithm is finite.
        let radius = (-2.0 * (1.0 - self.between(0.0, 1.0)).ln()).sqrt();
        radius * self.between(0.0, std::f64::consts::TAU).cos()
    }
}
