//! 1/Λ(s) and s/Λ(s) of signals that are linear between samples.
//!
//! ```text
//!   Λ(s) = λ₀ + λ₁ s + … + λₙ sⁿ
//!   xᵢ = sⁱ/Λ(s) u,  i = 0 … n − 1:      ẋᵢ = xᵢ₊₁,  λₙ ẋₙ₋₁ = u − Σ λᵢ xᵢ
//!   [x u u̇](t + τ) = exp([A B 0; 0 0 1; 0 0 0] τ) [x u u̇](t)
//! ```
//!
//! An equation remains valid when both sides are filtered, and s/Λ(s) y is the filtered derivative of y without
//! differentiation: Ioannou, Sun, Robust Adaptive Control (1996), §4.2.

use nalgebra::{DMatrix, DVector};

/// A filter and the states of its channels.
#[derive(Debug, Clone)]
pub struct LambdaFilter {
    /// λ₀ … λₙ.
    lambda: Vec<f64>,
    channels: usize,
    /// n × channels.
    states: DMatrix<f64>,
    /// The last values, and their slopes from there on.
    values: Vec<f64>,
    slopes: Vec<f64>,
    /// Transitions over the most recent offsets.
    cached: Vec<(f64, StateTransition)>,
}

/// Transition of the states over a time.
#[derive(Debug, Clone)]
struct StateTransition {
    state: DMatrix<f64>,
    value: DVector<f64>,
    slope: DVector<f64>,
}

/// Number of transitions stored: the nodes of a step, and its end.
const CACHED: usize = 16;

impl LambdaFilter {
    /// A filter with the coefficients λ₀ … λₙ of Λ(s), at rest; `None` unless Λ is of order one or more and all of its
    /// roots are to the left of the imaginary axis.
    pub fn new(lambda: &[f64], channels: usize) -> Option<Self> {
        let n = lambda.len().checked_sub(1).filter(|n| *n > 0)?;
        if !lambda.iter().all(|coefficient| coefficient.is_finite()) || lambda[n] == 0.0 {
            return None;
        }
        let filter = Self {
            lambda: lambda.to_vec(),
            channels,
            states: DMatrix::zeros(n, channels),
            values: vec![0.0; channels],
            slopes: vec![0.0; channels],
            cached: Vec::new(),
        };
        let dynamics = filter.generator().view((0, 0), (n, n)).into_owned();
        let is_stable = dynamics.complex_eigenvalues().iter().all(|root| root.re < 0.0);
        is_stable.then_some(filter)
    }

    /// A filter with Λ(s) = Π (τₖ s + 1).
    pub fn with_time_constants(tau: &[f64], channels: usize) -> Option<Self> {
        let mut lambda = vec![1.0];
        for tau in tau {
            lambda.push(0.0);
            for i in (1..lambda.len()).rev() {
                lambda[i] += tau * lambda[i - 1];
            }
        }
        Self::new(&lambda, channels)
    }

    /// Sets the steady state for these values.
    pub fn settle(&mut self, values: &[f64]) {
        self.states.fill(0.0);
        for (c, value) in values.iter().enumerate() {
            self.states[(0, c)] = value / self.lambda[0];
        }
        self.values.copy_from_slice(values);
        self.slopes.fill(0.0);
    }

    /// Makes the values jump to `from`, and then move linearly to `to` within h seconds.
    pub fn lead(&mut self, from: &[f64], to: &[f64], h: f64) {
        self.values.copy_from_slice(from);
        for (c, slope) in self.slopes.iter_mut().enumerate() {
            *slope = (to[c] - from[c]) / h;
        }
    }

    /// 1/Λ and s/Λ of all channels after τ of these seconds.
    pub fn after(&mut self, tau: f64, smoothed: &mut [f64], rates: &mut [f64]) {
        let states = self.states_after(tau);
        let n = states.nrows();
        for c in 0..self.channels {
            smoothed[c] = states[(0, c)];
            rates[c] = if n > 1 {
                states[(1, c)]
            } else {
                let value = self.values[c] + tau * self.slopes[c];
                (value - self.lambda[0] * states[(0, c)]) / self.lambda[1]
            };
        }
    }

    /// Advances by τ seconds.
    pub fn advance(&mut self, tau: f64) {
        self.states = self.states_after(tau);
        for (value, slope) in self.values.iter_mut().zip(&self.slopes) {
            *value += tau * slope;
        }
    }

    fn states_after(&mut self, tau: f64) -> DMatrix<f64> {
        let (values, slopes) =
            (DVector::from_column_slice(&self.values), DVector::from_column_slice(&self.slopes));
        if !self.cached.iter().any(|(cached, _)| *cached == tau) {
            if self.cached.len() >= CACHED {
                self.cached.clear();
            }
            let transition = self.transition(tau);
            self.cached.push((tau, transition));
        }
        let transition = self.cached.iter().find(|(cached, _)| *cached == tau);
        let Some((_, StateTransition { state, value, slope })) = transition else {
            unreachable!("it has just been put there")
        };
        state * &self.states + value * values.transpose() + slope * slopes.transpose()
    }

    /// [A B 0; 0 0 1; 0 0 0].
    fn generator(&self) -> DMatrix<f64> {
        let n = self.lambda.len() - 1;
        let mut generator = DMatrix::zeros(n + 2, n + 2);
        for i in 0..n - 1 {
            generator[(i, i + 1)] = 1.0;
        }
        for i in 0..n {
            generator[(n - 1, i)] = -self.lambda[i] / self.lambda[n];
        }
        generator[(n - 1, n)] = 1.0 / self.lambda[n];
        generator[(n, n + 1)] = 1.0;
        generator
    }

    fn transition(&self, tau: f64) -> StateTransition {
        let n = self.lambda.len() - 1;
        let exponential = (self.generator() * tau).exp();
        StateTransition {
            state: exponential.view((0, 0), (n, n)).into_owned(),
            value: exponential.view((0, n), (n, 1)).column(0).into_owned(),
            slope: exponential.view((0, n + 1), (n, 1)).column(0).into_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_filtered_as_its_closed_form_says() {
        // u = t from rest, Λ = 5s + 1: x = t − 5 + 5 e^(−t/5), s x = 1 − e^(−t/5); irregular steps.
        let mut filter = LambdaFilter::with_time_constants(&[5.0], 1).expect("stable");
        let (mut x, mut rate, mut t) = ([0.0], [0.0], 0.0);
        for h in [0.3, 1.0, 2.5, 0.01, 7.0] {
            filter.lead(&[t], &[t + h], h);
            filter.after(0.4 * h, &mut x, &mut rate);
            let decay = (-(t + 0.4 * h) / 5.0f64).exp();
            assert!((x[0] - (t + 0.4 * h - 5.0 + 5.0 * decay)).abs() < 1e-13);
            assert!((rate[0] - (1.0 - decay)).abs() < 1e-13);
            filter.advance(h);
            t += h;
        }
    }

    #[test]
    fn a_second_order_filter_is_two_of_the_first() {
        // Step response of 1/((2s + 1)(3s + 1)): 1 + 2 e^(−t/2) − 3 e^(−t/3).
        let mut filter = LambdaFilter::with_time_constants(&[2.0, 3.0], 1).expect("stable");
        let (mut x, mut rate) = ([0.0], [0.0]);
        for k in 0..10 {
            filter.lead(&[1.0], &[1.0], 1.0);
            filter.after(1.0, &mut x, &mut rate);
            filter.advance(1.0);
            let t = f64::from(k + 1);
            let (two, three) = ((-t / 2.0).exp(), (-t / 3.0).exp());
            assert!((x[0] - (1.0 + 2.0 * two - 3.0 * three)).abs() < 1e-13, "{x:?}");
            assert!((rate[0] - (three - two)).abs() < 1e-13, "{rate:?}");
        }
        filter.settle(&[4.0]);
        filter.lead(&[4.0], &[4.0], 1.0);
        filter.after(0.7, &mut x, &mut rate);
        assert!((x[0] - 4.0).abs() < 1e-14 && rate[0].abs() < 1e-14);
    }

    #[test]
    fn a_filter_that_would_run_away_is_none() {
        assert!(LambdaFilter::new(&[1.0], 1).is_none());
        assert!(LambdaFilter::new(&[-1.0, 5.0], 1).is_none());
        assert!(LambdaFilter::new(&[1.0, 0.0], 1).is_none());
        assert!(LambdaFilter::with_time_constants(&[5.0, -5.0], 1).is_none());
    }
}
