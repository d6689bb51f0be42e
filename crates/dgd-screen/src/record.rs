//! The record to screen: channels over common times.

/// A recording as in its file: columns over common times.
#[derive(Debug, Clone)]
pub struct ScreenedRecord<'a> {
    /// Times, s, ascending; two equal ones are the sides of a jump.
    pub times: &'a [f64],
    /// The columns, each with a value for each time.
    pub channels: Vec<Channel<'a>>,
}

/// One column.
#[derive(Debug, Clone, Copy)]
pub struct Channel<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its unit, as text: only columns with equal units are compared.
    pub unit: &'a str,
    /// Values in that unit; NaN where there is none.
    pub values: &'a [f64],
}

/// A time interval that includes both ends, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeStretch {
    /// Its first sample.
    pub from: f64,
    /// Its last sample.
    pub until: f64,
}

impl TimeStretch {
    /// The interval of the samples `first..=last`.
    pub(crate) fn from_samples(times: &[f64], first: usize, last: usize) -> TimeStretch {
        TimeStretch { from: times[first], until: times[last] }
    }
}

/// Maximal runs of neighbours for which `marked` holds: first and last index.
pub(crate) fn runs(n: usize, marked: impl Fn(usize) -> bool) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for k in (0..n).filter(|k| marked(*k)) {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == k => *last = k,
            _ => runs.push((k, k)),
        }
    }
    runs
}

/// The median interval between neighbouring times, s; `None` with fewer than two.
pub fn usual_spacing(times: &[f64]) -> Option<f64> {
    let mut spacings: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|h| *h > 0.0).collect();
    if spacings.is_empty() {
        return None;
    }
    let middle = spacings.len() / 2;
    Some(*spacings.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Smallest and largest of the values that are not NaN.
pub(crate) fn extremes(values: &[f64]) -> Option<(f64, f64)> {
    let valid = values.iter().copied().filter(|value| value.is_finite());
    valid.fold(None, |range, value| match range {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}
