//! Stretches of time.

/// A stretch of time in which something stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Its start, s.
    pub from: f64,
    /// Its end, s.
    pub until: f64,
    /// Mean of what stands out.
    pub mean: f64,
    /// By how many standard deviations it stands out at most.
    pub peak_sigma: f64,
}
