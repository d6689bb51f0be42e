//! Time windows in which something stands out.

/// A time window in which a signal stands out from its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignalWindow {
    /// Its start, s.
    pub from: f64,
    /// Its end, s.
    pub until: f64,
    /// Mean of the signal in it, in the signal's unit.
    pub mean: f64,
    /// Largest ratio of value to standard deviation, with the sign of the value.
    pub peak_sigma: f64,
}

/// Windows around the samples that are `marked` with their ratio of value to standard deviation.
///
/// Marks that are neighbours or at most `gap` seconds apart form one window. `signal` gives the means; NaN samples do
/// not count.
pub(crate) fn gather(
    times: &[f64],
    signal: &[f64],
    marked: &[Option<f64>],
    gap: f64,
) -> Vec<SignalWindow> {
    let mut ranges: Vec<(usize, usize, f64)> = Vec::new();
    for (k, mark) in marked.iter().enumerate() {
        let Some(sigma) = *mark else { continue };
        match ranges.last_mut() {
            Some((_, last, peak)) if times[k] - times[*last] <= gap || k == *last + 1 => {
                *last = k;
                if sigma.abs() > peak.abs() {
                    *peak = sigma;
                }
            }
            _ => ranges.push((k, k, sigma)),
        }
    }
    ranges
        .into_iter()
        .map(|(first, last, peak_sigma)| {
            let valid = signal[first..=last].iter().filter(|value| value.is_finite());
            let (sum, count) = valid.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
            let mean = sum / f64::from(count.max(1));
            SignalWindow { from: times[first], until: times[last], mean, peak_sigma }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{SignalWindow, gather};

    #[test]
    fn close_marks_make_one_window_with_its_own_peak() {
        let times: Vec<f64> = (0..10).map(f64::from).collect();
        let signal = [0.0, 1.0, f64::NAN, 3.0, 0.0, 0.0, 0.0, 0.0, -2.0, 0.0];
        let mut marked = [None; 10];
        marked[1] = Some(4.0);
        marked[3] = Some(6.0);
        marked[8] = Some(-5.0);
        let first = SignalWindow { from: 1.0, until: 3.0, mean: 2.0, peak_sigma: 6.0 };
        let second = SignalWindow { from: 8.0, until: 8.0, mean: -2.0, peak_sigma: -5.0 };
        assert_eq!(gather(&times, &signal, &marked, 2.0), [first, second]);
        assert_eq!(gather(&times, &signal, &marked, 1.0).len(), 3);
    }
}
