// Lengths are constants where storage has a fixed size, and only once inlined there.
#![allow(clippy::inline_always)]

/// Tolerances of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tolerances {
    pub(crate) rtol: f64,
    pub(crate) atol: f64,
}

impl Tolerances {
    /// Error weight: rtol |y| + atol · size.
    #[inline(always)]
    pub(crate) fn weight(self, y: f64, size: f64) -> f64 {
        self.rtol * y.abs() + self.atol * size
    }

    /// Mean of (eᵢ / wᵢ)², the square of the weighted root-mean-square norm, with the larger of two
    /// values of each unknown in its weight. Zero for no numbers.
    #[inline(always)]
    pub(crate) fn mean_square(self, e: &[f64], y: &[f64], y_new: &[f64], sizes: &[f64]) -> f64 {
        if e.is_empty() {
            return 0.0;
        }
        let mut sum = 0.0;
        for (((e, y), y_new), size) in e.iter().zip(y).zip(y_new).zip(sizes) {
            let larger = if y.abs() > y_new.abs() { *y } else { *y_new };
            let ratio = e / self.weight(larger, *size);
            sum += ratio * ratio;
        }
        sum / e.len() as f64
    }
}
