//! Truncated power series with their derivatives along one direction: Taylor coefficients computed a whole series at a
//! time, as in textbooks.

use std::ops::{Add, Div, Mul, Neg, Sub};

use dgd_runtime::taylor::{MOST_ORDER, SeriesTerms};

use super::Number;

/// value + derivative ε with ε² = 0, both power series.
#[derive(Debug, Clone, Copy)]
pub struct Jet {
    pub value: SeriesTerms,
    pub derivative: SeriesTerms,
}

const ZERO: SeriesTerms = [0.0; MOST_ORDER + 1];

fn terms(term: impl Fn(usize) -> f64) -> SeriesTerms {
    std::array::from_fn(term)
}

fn product(a: &SeriesTerms, b: &SeriesTerms) -> SeriesTerms {
    terms(|k| (0..=k).map(|j| a[j] * b[k - j]).sum())
}

fn quotient(a: &SeriesTerms, b: &SeriesTerms) -> SeriesTerms {
    let mut v = ZERO;
    for k in 0..v.len() {
        let known: f64 = (1..=k).map(|j| b[j] * v[k - j]).sum();
        v[k] = (a[k] - known) / b[0];
    }
    v
}

/// The series of v that begins with v₀ and has v̇ = d ẋ, where d follows from the known coefficients of v.
fn integral(v0: f64, x: &SeriesTerms, d: impl Fn(&SeriesTerms, usize) -> f64) -> SeriesTerms {
    let mut v = ZERO;
    v[0] = v0;
    for k in 1..v.len() {
        let sum: f64 = (1..=k).map(|j| j as f64 * x[j] * d(&v, k - j)).sum();
        v[k] = sum / k as f64;
    }
    v
}

impl Jet {
    /// The function with this value and slope.
    fn of(self, value: SeriesTerms, slope: &SeriesTerms) -> Self {
        Self { value, derivative: product(slope, &self.derivative) }
    }
}

impl From<f64> for Jet {
    fn from(value: f64) -> Self {
        Self { value: terms(|k| if k == 0 { value } else { 0.0 }), derivative: ZERO }
    }
}

impl Number for Jet {
    fn value(self) -> f64 {
        self.value[0]
    }

    fn chain(self, _: f64, _: f64, _: f64) -> Self {
        unreachable!("functions of series are written out")
    }

    fn abs(self) -> Self {
        if self.value[0] < 0.0 { -self } else { self }
    }

    fn sqrt(self) -> Self {
        let mut root = ZERO;
        root[0] = self.value[0].sqrt();
        for k in 1..root.len() {
            let known: f64 = (1..k).map(|j| root[j] * root[k - j]).sum();
            root[k] = (self.value[k] - known) / (2.0 * root[0]);
        }
        let slope = quotient(&Jet::from(0.5).value, &root);
        self.of(root, &slope)
    }

    fn exp(self) -> Self {
        let e = integral(self.value[0].exp(), &self.value, |e, k| e[k]);
        self.of(e, &e)
    }

    fn sin(self) -> Self {
        let x = &self.value;
        // Both at once, since the slope of each is the other.
        let (mut sin, mut cos) = (ZERO, ZERO);
        (sin[0], cos[0]) = x[0].sin_cos();
        for k in 1..sin.len() {
            let sum = |of: &SeriesTerms| (1..=k).map(|j| j as f64 * x[j] * of[k - j]).sum::<f64>();
            (sin[k], cos[k]) = (sum(&cos) / k as f64, -sum(&sin) / k as f64);
        }
        self.of(sin, &cos)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            value: terms(|k| self.value[k] + o.value[k]),
            derivative: terms(|k| self.derivative[k] + o.derivative[k]),
        }
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, c: f64) -> Self {
        Self { value: self.value.map(|v| v * c), derivative: self.derivative.map(|d| d * c) }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let (a, b) = (product(&self.value, &o.derivative), product(&self.derivative, &o.value));
        Self { value: product(&self.value, &o.value), derivative: terms(|k| a[k] + b[k]) }
    }
}

impl Div for Jet {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let value = quotient(&self.value, &o.value);
        let change = product(&value, &o.derivative);
        let change = terms(|k| self.derivative[k] - change[k]);
        Self { value, derivative: quotient(&change, &o.value) }
    }
}
