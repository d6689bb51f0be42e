//! Delayed unknowns, from the readings at the earlier time.
//!
//! ```text
//!   x(t − τ):  cubic between neighbouring samples, through the values there, with slopes from
//!              [`super::slopes`]; ẋ(t − τ) is its derivative
//! ```
//!
//! So the value at a sample is the reading, and both change smoothly with a delay that is estimated. Values before the
//! record are unknown: samples whose history begins there have no rows. These samples are determined before the search
//! for a delay, or it would become longer to get rid of rows.

use dgd_runtime::EvaluationPoint;
use dgd_runtime::model::Model;

use crate::regression::known::RecordingSamples;

/// Treatment of values before the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BeforeRecord {
    /// Unknown.
    Unknown,
    /// Those of the first sample: for samples whose whole history was known with the first guess of a delay.
    AsAtFirst,
}

/// Delayed unknowns of a system, and their delays at the last point.
#[derive(Debug, Clone)]
pub(crate) struct DelayedColumns {
    constant: Vec<f64>,
    varying: Vec<f64>,
    /// The earliest time read for the last point, s.
    pub earliest: f64,
}

impl DelayedColumns {
    /// `None` without delayed unknowns.
    pub(crate) fn new(system: &dyn Model) -> Option<Self> {
        let signature = system.signature();
        (!signature.delayed_unknowns.is_empty()).then(|| Self {
            constant: vec![0.0; signature.delays.len()],
            varying: vec![0.0; signature.varying_delays.len()],
            earliest: f64::INFINITY,
        })
    }

    /// Writes delayed unknowns at `at` after the inputs in `u`, which is that of the point; NaN where readings do not
    /// determine them.
    pub(crate) fn write(
        &mut self,
        system: &dyn Model,
        known: &RecordingSamples,
        before: BeforeRecord,
        at: EvaluationPoint<'_>,
        u: &mut [f64],
    ) {
        let signature = system.signature();
        system.delays(at, &mut self.constant);
        system.varying_delays(at, &mut self.varying);
        let layout = signature.past();
        u[layout.first..].fill(0.0);
        u[layout.held()].fill(1.0);
        self.earliest = f64::INFINITY;
        for (k, delayed) in signature.delayed_unknowns.iter().enumerate() {
            let taus = if delayed.varies { &self.varying } else { &self.constant };
            let alpha = at.t - taus[delayed.delay];
            self.earliest = self.earliest.min(alpha);
            let first = known.times.first().copied().unwrap_or(alpha);
            let [value, rate] = match before {
                BeforeRecord::AsAtFirst if alpha < first => {
                    [known.read_at(delayed.unknown, first)[0], 0.0]
                }
                BeforeRecord::Unknown | BeforeRecord::AsAtFirst => {
                    known.read_at(delayed.unknown, alpha)
                }
            };
            u[layout.values().start + k] = value;
            u[layout.rates().start + k] = rate;
        }
    }
}

/// Value and slope at s of the interpolation between two samples at a distance h.
pub(crate) fn cubic(s: f64, h: f64, [y0, y1]: [f64; 2], [m0, m1]: [f64; 2]) -> [f64; 2] {
    // Hermite: y = y₀ + s d + s (1 − s) ((1 − s) a − s b),  a = h m₀ − d,  b = h m₁ − d
    let d = y1 - y0;
    let (a, b) = (h * m0 - d, h * m1 - d);
    let r = 1.0 - s;
    let value = y0 + s * d + s * r * (r * a - s * b);
    let slope = d + (r - s) * (r * a - s * b) - s * r * (a + b);
    [value, slope / h]
}

#[cfg(test)]
mod tests {
    use super::cubic;

    #[test]
    fn a_cubic_is_itself() {
        let y = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.1 * t * t * t;
        let slope = |t: f64| -2.0 + t - 0.3 * t * t;
        let (t0, h) = (1.3, 0.7);
        for s in [0.0, 0.2, 0.5, 1.0] {
            let ends = [t0, t0 + h];
            let [value, rate] = cubic(s, h, ends.map(y), ends.map(slope));
            assert!((value - y(t0 + s * h)).abs() < 1e-14);
            assert!((rate - slope(t0 + s * h)).abs() < 1e-13);
        }
    }
}
