//! Delayed inputs, as inputs of their own.

use super::Inputs;

/// The delay of an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delayed {
    /// Position of the input.
    pub input: usize,
    /// τ, s: finite and non-negative.
    pub tau: f64,
}

/// Times closer than this, relative to themselves or to the delay, count as equal: the rounding of t + τ.
const ONE_TIME: f64 = 4.0 * f64::EPSILON;

impl Inputs {
    /// These inputs, then v(t) = u(t − τ) for each of the `delayed` ones, then the slopes of all v.
    ///
    /// Before its first sample an input has that sample's value. With τ = 0, v equals u bit for bit.
    ///
    /// # Panics
    ///
    /// If there is no such input.
    #[must_use]
    pub fn with_delayed(&self, delayed: &[Delayed]) -> Inputs {
        let starts = self.starts_with(delayed);
        let n_u = self.n_u + 2 * delayed.len();
        let mut values = Vec::with_capacity(n_u * starts.len());
        let mut slopes = Vec::with_capacity(n_u * starts.len());
        for &t0 in &starts {
            let lines = (0..self.n_u).map(|input| self.line(Delayed { input, tau: 0.0 }, t0));
            let delayed_lines = delayed.iter().map(|delayed| self.line(*delayed, t0));
            let begun = values.len();
            for (value, slope) in lines.chain(delayed_lines) {
                values.push(value);
                slopes.push(slope);
            }
            values.extend_from_slice(&slopes[begun + self.n_u..]);
            slopes.resize(values.len(), 0.0);
        }
        Inputs { n_u, starts, values, slopes, ..self.clone() }
    }

    /// These inputs, then `more` zero inputs.
    pub(crate) fn widened(&self, more: usize) -> Inputs {
        let n_u = self.n_u + more;
        let widen = |numbers: &[f64]| {
            let mut wide = Vec::with_capacity(n_u * self.starts.len());
            for segment in 0..self.starts.len() {
                wide.extend_from_slice(&numbers[segment * self.n_u..(segment + 1) * self.n_u]);
                wide.resize((segment + 1) * n_u, 0.0);
            }
            wide
        };
        let (values, slopes) = (widen(&self.values), widen(&self.slopes));
        Inputs { n_u, values, slopes, ..self.clone() }
    }

    /// All starts of segments, including those where delayed inputs change.
    fn starts_with(&self, delayed: &[Delayed]) -> Vec<f64> {
        let mut delayed_starts: Vec<(f64, f64)> = Vec::new();
        for &Delayed { input, tau } in delayed {
            for k in 0..self.segments() {
                if self.changes(input, k) {
                    let t = self.starts[k] + tau;
                    delayed_starts.push((t, ONE_TIME * t.abs().max(tau)));
                }
            }
        }
        delayed_starts.sort_by(|(a, _), (b, _)| a.total_cmp(b));

        let mut times: Vec<f64> = Vec::with_capacity(self.starts.len() + delayed_starts.len());
        let mut starts = self.starts.iter().copied().peekable();
        for (t, rounding) in delayed_starts {
            while let Some(start) = starts.next_if(|start| *start <= t + rounding) {
                times.push(start);
            }
            if times.last().is_none_or(|last| t > last + rounding) {
                times.push(t);
            }
        }
        times.extend(starts);
        times
    }

    /// Whether an input jumps or kinks where the k-th segment starts; before the first it is
    /// constant.
    fn changes(&self, input: usize, k: usize) -> bool {
        let now = k * self.n_u + input;
        if k == 0 {
            return self.slopes[now] != 0.0;
        }
        let before = now - self.n_u;
        self.slopes[now] != 0.0
            || self.slopes[before] != 0.0
            || self.values[now] != self.values[before]
    }

    /// Value and slope of u(t − τ) just after `t0`.
    fn line(&self, Delayed { input, tau }: Delayed, t0: f64) -> (f64, f64) {
        let rounding = if tau == 0.0 { 0.0 } else { ONE_TIME * t0.abs().max(tau) };
        let begun = self.starts.partition_point(|start| start + tau <= t0 + rounding);
        let Some(k) = begun.checked_sub(1) else {
            return (self.values[input], 0.0);
        };
        let position = k * self.n_u + input;
        let (value, slope) = (self.values[position], self.slopes[position]);
        let since = t0 - (self.starts[k] + tau);
        if slope == 0.0 || since <= 0.0 {
            return (value, slope);
        }
        (value + slope * since, slope)
    }
}
