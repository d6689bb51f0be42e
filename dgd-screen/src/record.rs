//! What is screened: channels over common times.

/// A recording as it stands in its file: columns over common times.
#[derive(Debug, Clone)]
pub struct Record<'a> {
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
    /// Its unit, as a text: columns are compared where it is the same.
    pub unit: &'a str,
    /// Values in that unit; NaN where there is none.
    pub values: &'a [f64],
}

/// A stretch of time, both ends in it, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Its first sample.
    pub from: f64,
    /// Its last sample.
    pub until: f64,
}

impl Stretch {
    /// Samples `first..=last` of these times.
    pub(crate) fn of(times: &[f64], first: usize, last: usize) -> Stretch {
        Stretch { from: times[first], until: times[last] }
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

/// The usual distance of neighbouring times, s; `None` where there are fewer than two.
pub fn usual_spacing(times: &[f64]) -> Option<f64> {
    let mut spacings: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|h| *h > 0.0).collect();
    if spacings.is_empty() {
        return None;
    }
    let middle = spacings.len() / 2;
    Some(*spacings.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Smallest and largest of the values that are numbers.
pub(crate) fn extremes(values: &[f64]) -> Option<(f64, f64)> {
    let valid = values.iter().copied().filter(|value| value.is_finite());
    valid.fold(None, |range, value| match range {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}
