//! What the tests share: noise that is the same in every run, and readings as files have them.

#![allow(dead_code, reason = "no test binary uses all of it")]

/// Standard normal numbers: SplitMix64 (Steele, Lea, Flood 2014) and Box and Muller's transform.
pub(crate) struct Normal(u64);

impl Normal {
    pub(crate) fn new(seed: u64) -> Self {
        // One step apart, neighbouring seeds would give one sequence shifted by a number.
        Normal(seed.wrapping_mul(0x2545_F491_4F6C_DD1D))
    }

    /// In (0, 1].
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        ((z >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn next(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (2.0 * std::f64::consts::PI * self.uniform()).cos()
    }

    pub(crate) fn many(&mut self, n: usize, std: f64) -> Vec<f64> {
        (0..n).map(|_| std * self.next()).collect()
    }
}

/// 0, 1, …, n − 1 seconds.
pub(crate) fn seconds(n: usize) -> Vec<f64> {
    (0..n).map(|k| k as f64).collect()
}
