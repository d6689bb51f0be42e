//! Random numbers by O'Neill's PCG-XSH-RR, so that a seed is a case on every machine and with every version.

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub(crate) struct Random {
    state: u64,
    increment: u64,
}

impl Random {
    /// The stream of that number for a seed.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut random = Random { state: 0, increment: (stream << 1) | 1 };
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

    /// A whole number from low to high, both included.
    pub(crate) fn whole(&mut self, low: usize, high: usize) -> usize {
        let drawn = self.between(low as f64, high as f64 + 1.0).floor() as usize;
        drawn.clamp(low, high)
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

    /// A value that is 10 to 30 % away from this one: the truth, where the model's file says this.
    pub(crate) fn off(&mut self, value: f64) -> f64 {
        value * (1.0 + self.either_sign(0.1, 0.3))
    }

    /// Standard normal, by Box and Muller's transformation.
    pub(crate) fn normal(&mut self) -> f64 {
        // 1 − u is in (0, 1], where the logarithm is finite.
        let radius = (-2.0 * (1.0 - self.between(0.0, 1.0)).ln()).sqrt();
        radius * self.between(0.0, std::f64::consts::TAU).cos()
    }

    /// Student's t with four degrees of freedom, scaled to a variance of one.
    pub(crate) fn heavy_tailed(&mut self) -> f64 {
        let squares: f64 = (0..4).map(|_| self.normal().powi(2)).sum();
        // The variance of t with ν degrees of freedom is ν/(ν − 2).
        self.normal() / (squares / 4.0).sqrt() / std::f64::consts::SQRT_2
    }
}
