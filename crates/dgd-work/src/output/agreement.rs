//! Agreement between simulation and measurement.
//!
//! ```text
//!   e = measured − simulated      fit = 100 (1 − ‖e‖/‖y − ȳ‖) %
//! ```
//!
//! Source of the fit: Ljung, System Identification Toolbox, `compare`.

use serde::{Deserialize, Serialize};

/// Agreement of an output with measurements, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Agreement {
    /// Number of samples.
    pub samples: usize,
    /// Root-mean-square error.
    pub rms: f64,
    /// Mean error.
    pub bias: f64,
    /// Ljung's fit in percent; null if the measurements are constant.
    pub fit_percent: Option<f64>,
}

impl Agreement {
    /// From pairs of measured and simulated values; pairs that are not finite are skipped. `None` without any.
    pub(crate) fn measure(pairs: impl Iterator<Item = (f64, f64)>) -> Option<Agreement> {
        let pairs: Vec<(f64, f64)> = pairs.filter(|(y, w)| (y - w).is_finite()).collect();
        if pairs.is_empty() {
            return None;
        }
        let n = pairs.len() as f64;
        let squares: f64 = pairs.iter().map(|(y, w)| (y - w).powi(2)).sum();
        let mean = pairs.iter().map(|(y, _)| y).sum::<f64>() / n;
        let scatter: f64 = pairs.iter().map(|(y, _)| (y - mean).powi(2)).sum();
        Some(Agreement {
            samples: pairs.len(),
            rms: (squares / n).sqrt(),
            bias: pairs.iter().map(|(y, w)| y - w).sum::<f64>() / n,
            fit_percent: (scatter > 0.0).then(|| 100.0 * (1.0 - (squares / scatter).sqrt())),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_fits_to_nothing_and_itself_to_a_hundred_percent() {
        let y = [1.0, 2.0, 3.0, 6.0, f64::NAN];
        let agreement = |w: [f64; 5]| Agreement::measure(y.into_iter().zip(w)).expect("samples");
        let by_mean = agreement([3.0; 5]);
        assert_eq!((by_mean.samples, by_mean.bias), (4, 0.0));
        assert_eq!(by_mean.fit_percent, Some(0.0));
        // 4 + 1 + 0 + 9 over 4.
        assert_eq!(by_mean.rms, 3.5_f64.sqrt());
        assert_eq!(agreement(y).fit_percent, Some(100.0));
        assert_eq!(agreement([0.0, 1.0, 2.0, 5.0, 0.0]).bias, 1.0);
        assert_eq!(Agreement::measure([(f64::NAN, 1.0)].into_iter()), None);
        assert_eq!(
            Agreement::measure([(2.0, 1.0), (2.0, 1.0)].into_iter()).and_then(|a| a.fit_percent),
            None
        );
    }
}
