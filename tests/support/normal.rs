//! Numbers that are the same in every run and on every machine.

#![allow(dead_code, reason = "no test binary uses all of it")]

/// Standard normal numbers: SplitMix64 (Steele, Lea, Flood 2014) and Box and Muller's transform. The number is where the
/// sequence begins; one step apart, two of them give one sequence shifted by a number, which those of
/// [`new`](Normal::new) do not.
pub(crate) struct Normal(pub(crate) u64);

impl Normal {
    pub(crate) fn new(seed: u64) -> Self {
        Normal(seed.wrapping_mul(0x2545_F491_4F6C_DD1D))
    }

    /// 64 random bits.
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In (0, 1].
    pub(crate) fn uniform(&mut self) -> f64 {
        ((self.bits() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn next(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    pub(crate) fn many(&mut self, n: usize, std: f64) -> Vec<f64> {
        (0..n).map(|_| std * self.next()).collect()
    }
}

/// Numbers in [-1, 1), of the same bits.
pub(crate) struct Noise(Normal);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Noise(Normal(seed))
    }

    pub(crate) fn next(&mut self) -> f64 {
        (self.0.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// One of 0 … n − 1.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((0.5 * (self.next() + 1.0) * n as f64) as usize).min(n - 1)
    }
}
