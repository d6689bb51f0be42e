//! Spacing of a recording's samples.

use crate::record::{TimeStretch, usual_spacing};

/// The spacing of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleSpacing {
    /// The median spacing, s; `None` with fewer than two times.
    pub usual: Option<f64>,
    /// Gaps of more than three times the median spacing, between the samples at their ends.
    pub gaps: Vec<TimeStretch>,
    /// Fraction of the other spacings that differ from the median by more than a tenth.
    pub uneven: f64,
}

/// Spacings above this many times the median are gaps.
const GAP: f64 = 3.0;
/// Relative deviation from the median above which spacings are uneven.
const UNEVEN: f64 = 0.1;

/// Gaps and uneven spacings of these times, s, ascending.
pub fn sampling(times: &[f64]) -> SampleSpacing {
    let Some(usual) = usual_spacing(times) else {
        return SampleSpacing { usual: None, gaps: Vec::new(), uneven: 0.0 };
    };
    let mut gaps = Vec::new();
    let (mut uneven, mut counted) = (0usize, 0usize);
    for pair in times.windows(2) {
        let spacing = pair[1] - pair[0];
        if spacing > GAP * usual * (1.0 + 1e-9) {
            gaps.push(TimeStretch { from: pair[0], until: pair[1] });
        } else if spacing > 0.0 {
            counted += 1;
            uneven += usize::from((spacing / usual - 1.0).abs() > UNEVEN);
        }
    }
    SampleSpacing { usual: Some(usual), gaps, uneven: uneven as f64 / counted.max(1) as f64 }
}
