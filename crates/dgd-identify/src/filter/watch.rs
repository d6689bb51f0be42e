//! Consistency test of the innovations.
//!
//! If the filter is right, the normalised squares of innovations, εᵀS⁻¹ε, sum to χ² with as many degrees of freedom as
//! there are samples (Bar-Shalom, Li, Kirubarajan 2001, §5.4). A far larger sum over the last rows indicates that the
//! filter has diverged.

use std::collections::VecDeque;

/// Number of rows in the sum.
const ROWS: usize = 50;
/// Cap on a sample, five standard deviations squared: single outliers do not indicate divergence.
const MOST_SQUARE: f64 = 25.0;
/// Number of standard deviations beyond the expectation, with a probability of one in a million.
const BEYOND: f64 = 4.75;

/// A change in the consistency of the innovations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InnovationAlarm {
    /// They are persistently larger than the filter predicts.
    Diverged {
        /// Root of the mean normalised square: the factor by which they are larger.
        ratio: f64,
        /// Number of rows.
        rows: usize,
    },
    /// They are consistent again.
    Recovered,
}

/// The last rows.
#[derive(Debug, Clone, Default)]
pub(super) struct InnovationMonitor {
    last: VecDeque<(f64, usize)>,
    diverged: bool,
}

impl InnovationMonitor {
    /// Adds the normalised square of a row with `samples` samples.
    pub(super) fn take(&mut self, square: f64, samples: usize) -> Option<InnovationAlarm> {
        if samples == 0 {
            return None;
        }
        if self.last.len() == ROWS {
            self.last.pop_front();
        }
        // NaN must not count as small.
        let cap = MOST_SQUARE * samples as f64;
        self.last.push_back((if square <= cap { square } else { cap }, samples));
        if self.last.len() < ROWS {
            return None;
        }
        let sum: f64 = self.last.iter().map(|(square, _)| square).sum();
        let samples: usize = self.last.iter().map(|(_, samples)| samples).sum();
        let diverged = sum > most(samples as f64);
        if diverged == self.diverged {
            return None;
        }
        self.diverged = diverged;
        let ratio = (sum / samples as f64).sqrt();
        Some(if diverged {
            InnovationAlarm::Diverged { ratio, rows: ROWS }
        } else {
            InnovationAlarm::Recovered
        })
    }
}

/// A quantile of χ² (Wilson and Hilferty 1931): ν (1 − 2/(9ν) + z √(2/(9ν)))³.
fn most(freedom: f64) -> f64 {
    let part = 2.0 / (9.0 * freedom);
    freedom * (1.0 - part + BEYOND * part.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twice_the_expected_size_is_told_once_and_so_is_the_end() {
        let mut watch = InnovationMonitor::default();
        let told = |watch: &mut InnovationMonitor, square: f64| {
            (0..120).filter_map(|_| watch.take(square, 2)).collect::<Vec<_>>()
        };
        assert_eq!(told(&mut watch, 2.0), []);
        assert!(matches!(told(&mut watch, 8.0)[..], [InnovationAlarm::Diverged { .. }]));
        assert_eq!(told(&mut watch, 2.0), [InnovationAlarm::Recovered]);
        assert_eq!(told(&mut watch, f64::NAN).len(), 1);
        assert_eq!(told(&mut watch, 2.0), [InnovationAlarm::Recovered]);
        assert_eq!(watch.take(1e9, 2), None);
    }

    /// The quantile of χ² with 100 degrees of freedom that is exceeded with a probability of one in a million is
    /// 182.13; the approximation is accurate to a thousandth that far out.
    #[test]
    fn the_bound_is_a_quantile() {
        assert!((most(100.0) / 182.13 - 1.0).abs() < 3e-3, "{}", most(100.0));
    }
}
