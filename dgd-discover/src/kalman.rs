//! A Kalman filter and smoother for deviations with one unknown input.
//!
//! The state is z = [δx; d], with d a random walk that steps at the samples:
//!
//! ```text
//!   z(k+1) = F z(k) + w,   F = [Φ Γ; 0 1],   w ~ N(0, diag(0, q h))
//!   r = H z + v,           H = [C D],        v ~ N(0, σ²), independent for each output
//!   δx(0) ~ N(0, sizes²),  d(0) ~ N(0, q T)
//! ```
//!
//! so that q = 0 is the model with nothing missing. Measurements are taken one by one; covariances
//! are updated in Joseph's form, (I − KH) P (I − KH)ᵀ + K σ² Kᵀ, and kept symmetric.
//!
//! The smoother is that of Rauch, Tung and Striebel in the form of Bryson and Frazier, which runs
//! adjoint variables λ, Λ backwards and inverts no covariance: with innovation ε of variance S,
//!
//! ```text
//!   across a measurement:  λ ← (I − KH)ᵀ λ − Hᵀ ε/S,   Λ ← (I − KH)ᵀ Λ (I − KH) + Hᵀ H/S
//!   across an interval:    λ ← Fᵀ λ,                    Λ ← Fᵀ Λ F
//!   smoothed:              ẑ = z⁺ − P⁺ λ,               P̂ = P⁺ − P⁺ Λ P⁺
//! ```
//!
//! Source: Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18 (1973)
//! 65–75.

use crate::deviations::Deviations;

/// Deviations with one unknown input, and what was measured of them.
#[derive(Debug)]
pub(crate) struct Chain {
    /// Length of z.
    n: usize,
    /// [Φ Γ] of each interval, row by row; the last row of F is not stored.
    transitions: Vec<f64>,
    /// Length of each interval, s.
    intervals: Vec<f64>,
    /// Variances of δx(0).
    start: Vec<f64>,
    /// T, s.
    duration: f64,
    /// All measurements, in order of time.
    pub(crate) measurements: Vec<Measurement>,
    /// H of each measurement.
    rows: Vec<f64>,
    /// Where the measurements of each sample begin; one more than samples.
    begin: Vec<usize>,
}

/// One measured deviation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measurement {
    /// Sample it was taken at.
    pub(crate) sample: usize,
    /// Output it is of.
    pub(crate) output: usize,
    /// r.
    pub(crate) value: f64,
    /// σ².
    variance: f64,
}

/// What the filter leaves for the smoother.
#[derive(Debug, Default)]
struct Record {
    /// z⁺ and P⁺ of each sample.
    z: Vec<f64>,
    p: Vec<f64>,
    /// K, ε and S of each measurement.
    gains: Vec<f64>,
    innovations: Vec<(f64, f64)>,
}

/// Smoothed values.
#[derive(Debug)]
pub(crate) struct Smoothed {
    /// d at each sample.
    pub(crate) input: Vec<f64>,
    /// Its standard deviation.
    pub(crate) std: Vec<f64>,
    /// r − H ẑ of each measurement.
    pub(crate) residuals: Vec<f64>,
}

/// Work space of a filter.
struct Filter {
    z: Vec<f64>,
    p: Vec<f64>,
    gain: Vec<f64>,
    column: Vec<f64>,
    product: Vec<f64>,
}

impl Chain {
    /// The chain with the unknown input at one place. `residuals` has n_w numbers per sample, those
    /// that are not finite were not measured; outputs whose noise is not a positive number are left
    /// out.
    pub(crate) fn new(
        deviations: &Deviations,
        place: usize,
        residuals: &[f64],
        noise: &[f64],
    ) -> Self {
        let (times, n_w) = (&deviations.times, deviations.n_outputs);
        let n = deviations.n() + 1;
        let mut transitions = Vec::with_capacity(deviations.transitions.len() * n * (n - 1));
        for (transition, response) in deviations.transitions.iter().zip(&deviations.responses) {
            for i in 0..n - 1 {
                transitions.extend(transition.row(i).iter());
                transitions.push(response[(i, place)]);
            }
        }
        let (mut measurements, mut rows, mut begin) = (Vec::new(), Vec::new(), vec![0]);
        for (sample, seen) in deviations.seen.iter().enumerate() {
            for output in 0..n_w {
                let (value, std) = (residuals[sample * n_w + output], noise[output]);
                let Some(seen) = seen else { continue };
                if value.is_finite() && std > 0.0 && std.is_finite() {
                    measurements.push(Measurement { sample, output, value, variance: std * std });
                    rows.extend(seen.states.row(output).iter());
                    rows.push(seen.inputs[(output, place)]);
                }
            }
            begin.push(measurements.len());
        }
        Chain {
            n,
            transitions,
            intervals: times.windows(2).map(|pair| pair[1] - pair[0]).collect(),
            start: deviations.sizes.iter().map(|size| size * size).collect(),
            duration: times[times.len() - 1] - times[0],
            measurements,
            rows,
            begin,
        }
    }

    /// T, s.
    pub(crate) fn duration(&self) -> f64 {
        self.duration
    }

    /// Σ (H z)²/σ² for d = 1 throughout and δx(0) = 0: what is known about a constant d.
    pub(crate) fn information_on_a_constant(&self) -> f64 {
        let n = self.n;
        let mut z = vec![0.0; n];
        z[n - 1] = 1.0;
        let mut next = z.clone();
        let mut information = 0.0;
        for k in 0..=self.intervals.len() {
            for m in self.begin[k]..self.begin[k + 1] {
                let seen = dot(&self.rows[m * n..(m + 1) * n], &z);
                information += seen * seen / self.measurements[m].variance;
            }
            if k < self.intervals.len() {
                for (next, row) in next.iter_mut().zip(self.transition(k).chunks_exact(n)) {
                    *next = dot(row, &z);
                }
                std::mem::swap(&mut z, &mut next);
                z[n - 1] = 1.0;
            }
        }
        information
    }

    /// ln p(r | q) up to what does not depend on q; minus infinity where it is no number.
    pub(crate) fn log_likelihood(&self, intensity: f64) -> f64 {
        self.filter(intensity, &mut None)
    }

    /// d and the residuals, given all measurements.
    pub(crate) fn smooth(&self, intensity: f64) -> Smoothed {
        let n = self.n;
        let mut record = Some(Record::default());
        self.filter(intensity, &mut record);
        let record = record.unwrap_or_default();

        let samples = self.intervals.len() + 1;
        let mut smoothed = Smoothed {
            input: vec![0.0; samples],
            std: vec![0.0; samples],
            residuals: vec![0.0; self.measurements.len()],
        };
        let (mut lambda, mut capital) = (vec![0.0; n], vec![0.0; n * n]);
        let (mut z, mut column, mut product) = (vec![0.0; n], vec![0.0; n], vec![0.0; n * n]);
        for k in (0..samples).rev() {
            // ẑ = z⁺ − P⁺ λ,  P̂_dd = P⁺_dd − P⁺_d Λ P⁺_dᵀ
            let p = &record.p[k * n * n..(k + 1) * n * n];
            for ((z, filtered), row) in z.iter_mut().zip(&record.z[k * n..]).zip(p.chunks_exact(n))
            {
                *z = filtered - dot(row, &lambda);
            }
            let p_d = &p[(n - 1) * n..];
            multiply(&capital, p_d, &mut column);
            smoothed.input[k] = z[n - 1];
            smoothed.std[k] = (p_d[n - 1] - dot(p_d, &column)).max(0.0).sqrt();

            for m in (self.begin[k]..self.begin[k + 1]).rev() {
                let h = &self.rows[m * n..(m + 1) * n];
                let gain = &record.gains[m * n..(m + 1) * n];
                let (innovation, variance) = record.innovations[m];
                smoothed.residuals[m] = self.measurements[m].value - dot(h, &z);

                let along = dot(gain, &lambda) + innovation / variance;
                add_scaled(&mut lambda, -along, h);
                // With c = ΛK:  (I − KH)ᵀ Λ (I − KH) = Λ − c H − Hᵀ cᵀ + Hᵀ (KᵀΛK) H
                multiply(&capital, gain, &mut column);
                let both = dot(gain, &column) + 1.0 / variance;
                for (i, row) in capital.chunks_exact_mut(n).enumerate() {
                    for (j, entry) in row.iter_mut().enumerate() {
                        *entry += h[i] * h[j] * both - column[i] * h[j] - h[i] * column[j];
                    }
                }
            }
            if k > 0 {
                self.pull_back(k - 1, &mut lambda, &mut capital, &mut column, &mut product);
            }
        }
        smoothed
    }

    fn transition(&self, k: usize) -> &[f64] {
        let len = self.n * (self.n - 1);
        &self.transitions[k * len..(k + 1) * len]
    }

    /// λ ← Fᵀ λ, Λ ← Fᵀ Λ F.
    fn pull_back(
        &self,
        k: usize,
        lambda: &mut [f64],
        capital: &mut [f64],
        column: &mut [f64],
        product: &mut [f64],
    ) {
        let n = self.n;
        let rows = || self.transition(k).chunks_exact(n);
        column.fill(0.0);
        for (row, lambda) in rows().zip(lambda.iter()) {
            add_scaled(column, *lambda, row);
        }
        column[n - 1] += lambda[n - 1];
        lambda.copy_from_slice(column);

        // Λ F, then Fᵀ (Λ F); F's last row is the unit vector of d.
        for (capital, product) in capital.chunks_exact(n).zip(product.chunks_exact_mut(n)) {
            product.fill(0.0);
            for (row, factor) in rows().zip(capital) {
                add_scaled(product, *factor, row);
            }
            product[n - 1] += capital[n - 1];
        }
        capital.fill(0.0);
        for (row, product) in rows().zip(product.chunks_exact(n)) {
            for (capital, factor) in capital.chunks_exact_mut(n).zip(row) {
                add_scaled(capital, *factor, product);
            }
        }
        add_scaled(&mut capital[(n - 1) * n..], 1.0, &product[(n - 1) * n..]);
        symmetrise(capital, n);
    }

    /// Runs the filter and returns ln p(r | q).
    fn filter(&self, intensity: f64, record: &mut Option<Record>) -> f64 {
        let n = self.n;
        let mut filter = Filter::new(n);
        for (i, variance) in self.start.iter().enumerate() {
            filter.p[i * n + i] = *variance;
        }
        filter.p[n * n - 1] = intensity * self.duration;

        let mut log_likelihood = 0.0;
        for k in 0..=self.intervals.len() {
            for m in self.begin[k]..self.begin[k + 1] {
                let Measurement { value, variance, .. } = self.measurements[m];
                let h = &self.rows[m * n..(m + 1) * n];
                let (innovation, s) = filter.update(h, value, variance);
                log_likelihood -= 0.5 * (s.ln() + innovation * innovation / s);
                if let Some(record) = record {
                    record.gains.extend_from_slice(&filter.gain);
                    record.innovations.push((innovation, s));
                }
            }
            if let Some(record) = record {
                record.z.extend_from_slice(&filter.z);
                record.p.extend_from_slice(&filter.p);
            }
            if let Some(h) = self.intervals.get(k) {
                filter.predict(self.transition(k), intensity * h);
            }
        }
        if log_likelihood.is_finite() { log_likelihood } else { f64::NEG_INFINITY }
    }
}

impl Filter {
    fn new(n: usize) -> Self {
        Filter {
            z: vec![0.0; n],
            p: vec![0.0; n * n],
            gain: vec![0.0; n],
            column: vec![0.0; n],
            product: vec![0.0; n * n],
        }
    }

    /// Takes in a measurement; returns its innovation and the innovation's variance.
    fn update(&mut self, h: &[f64], value: f64, variance: f64) -> (f64, f64) {
        let n = self.z.len();
        // S = H P Hᵀ + σ²,  K = P Hᵀ/S
        multiply(&self.p, h, &mut self.column);
        let s = dot(h, &self.column) + variance;
        for (gain, column) in self.gain.iter_mut().zip(&self.column) {
            *gain = column / s;
        }
        let innovation = value - dot(h, &self.z);
        add_scaled(&mut self.z, innovation, &self.gain);

        // T = (I − KH) P,  P ← T (I − KH)ᵀ + K σ² Kᵀ = T − (T Hᵀ − σ² K) Kᵀ
        for (row, gain) in self.p.chunks_exact_mut(n).zip(&self.gain) {
            add_scaled(row, -gain, &self.column);
            let rest = dot(row, h) - variance * gain;
            add_scaled(row, -rest, &self.gain);
        }
        symmetrise(&mut self.p, n);
        (innovation, s)
    }

    /// z ← F z, P ← F P Fᵀ with `step` added to the variance of d.
    fn predict(&mut self, transition: &[f64], step: f64) {
        let n = self.z.len();
        let rows = || transition.chunks_exact(n);
        for (next, row) in self.column.iter_mut().zip(rows()) {
            *next = dot(row, &self.z);
        }
        self.z[..n - 1].copy_from_slice(&self.column[..n - 1]);

        // F P without its last row, which is that of P.
        for (product, row) in self.product.chunks_exact_mut(n).zip(rows()) {
            product.fill(0.0);
            for (factor, p) in row.iter().zip(self.p.chunks_exact(n)) {
                add_scaled(product, *factor, p);
            }
        }
        for i in 0..n - 1 {
            let product = &self.product[i * n..(i + 1) * n];
            for (j, row) in rows().enumerate().take(i + 1) {
                let entry = dot(product, row);
                self.p[i * n + j] = entry;
                self.p[j * n + i] = entry;
            }
            self.p[i * n + n - 1] = product[n - 1];
            self.p[(n - 1) * n + i] = product[n - 1];
        }
        self.p[n * n - 1] += step;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// y ← y + a x.
fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// y ← A x for a square A, row by row.
fn multiply(a: &[f64], x: &[f64], y: &mut [f64]) {
    for (y, row) in y.iter_mut().zip(a.chunks_exact(x.len())) {
        *y = dot(row, x);
    }
}

fn symmetrise(a: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            let mean = f64::midpoint(a[i * n + j], a[j * n + i]);
            a[i * n + j] = mean;
            a[j * n + i] = mean;
        }
    }
}
