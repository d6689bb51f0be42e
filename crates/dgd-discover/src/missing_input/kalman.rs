//! Kalman filter and smoother for deviations with one unknown input.
//!
//! The state is z = [δx; n; d], with d a random walk that steps at the samples and n the correlated noise of each
//! sensor that has any, of variance c² and correlation time τ. Other [`InputWalk`]s have other last rows: a white d is
//! independent at each sample, and an integrated walk is followed by its slope, z = [δx; n; d; ḋ], which steps.
//!
//! ```text
//!   z(k+1) = F z(k) + w,   F = [Φ 0 Γ; 0 φ 0; 0 0 1],   w ~ N(0, diag(0, c² (1 − φ²), q h)),   φ = e^(−h/τ)
//!   r = H z + v,           H = [C I D],                 v ~ N(0, σ²), independent for each output
//!   δx(0) ~ N(0, sizes²),  n(0) ~ N(0, c²),  d(0) ~ N(0, q T)
//! ```
//!
//! and, where the trajectory is not a run of the model, with its known [`shifts`](Deviations::shifts) added to δx,
//! so that q = 0 is the model with nothing missing. Measurements are taken one by one; covariances
//! are updated in Joseph's form, (I − KH) P (I − KH)ᵀ + K σ² Kᵀ, and kept symmetric.
//!
//! The smoother is the Rauch–Tung–Striebel smoother in Bryson–Frazier form, which runs adjoint variables λ, Λ backwards
//! and does not invert covariances: with innovation ε of variance S,
//!
//! ```text
//!   across a measurement:  λ ← (I − KH)ᵀ λ − Hᵀ ε/S,   Λ ← (I − KH)ᵀ Λ (I − KH) + Hᵀ H/S
//!   across an interval:    λ ← Fᵀ λ,                    Λ ← Fᵀ Λ F
//!   smoothed:              ẑ = z⁺ − P⁺ λ,               P̂ = P⁺ − P⁺ Λ P⁺
//! ```
//!
//! Source: Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18 (1973)
//! 65–75.

// Sizes become constants only after inlining.
#![allow(clippy::inline_always)]

use super::deviations::Deviations;
use crate::noise::NoiseWhitener;
use dgd_screen::noise::{NoiseColour, SensorNoise};

/// Numbers that the kernels below process at once.
const LANES: usize = 4;

/// The random process of an unknown input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum InputWalk {
    /// White noise: independent at each sample.
    White,
    /// A random walk.
    Random,
    /// An integrated random walk: its slope is a random walk.
    Integrated,
}

impl InputWalk {
    /// All processes, the simplest first.
    pub(crate) const ALL: [InputWalk; 3] =
        [InputWalk::Random, InputWalk::White, InputWalk::Integrated];

    /// Number of states in z that it needs.
    fn len(self) -> usize {
        match self {
            InputWalk::White | InputWalk::Random => 1,
            InputWalk::Integrated => 2,
        }
    }
}

/// Deviations with one unknown input, and their measurements.
///
/// Between n and d, z is padded with zeros to a multiple of [`LANES`].
#[derive(Debug)]
pub(crate) struct DeviationChain {
    /// Length of z.
    n: usize,
    /// The process of d.
    walk: InputWalk,
    /// Position of d in z.
    at: usize,
    /// F of each interval, row by row, without its last row.
    transitions: Vec<f64>,
    /// Shift of δx in each interval, n numbers each; empty if the trajectory is a run of the model.
    shifts: Vec<f64>,
    /// Times of the samples, and length of each interval, s.
    times: Vec<f64>,
    intervals: Vec<f64>,
    /// Variances of δx(0) and n(0).
    start: Vec<f64>,
    /// Number of differential unknowns, after which n begins.
    states: usize,
    /// Noise of each output.
    noise: Vec<Option<SensorNoise>>,
    /// All measurements, in order of time.
    pub(crate) measurements: Vec<ChainMeasurement>,
    /// H of each measurement.
    rows: Vec<f64>,
    /// First measurement of each sample, and the end of the last.
    begin: Vec<usize>,
}

/// One measured deviation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChainMeasurement {
    /// Its sample.
    pub(crate) sample: usize,
    /// Its output.
    pub(crate) output: usize,
    /// r.
    pub(crate) value: f64,
    /// σ².
    variance: f64,
}

/// Record of the filter for the smoother, or for filtering other measurements.
#[derive(Debug, Default)]
struct FilterRecord {
    /// Whether z⁺ and P⁺ are stored.
    has_states: bool,
    /// z⁺ and P⁺ of each sample.
    z: Vec<f64>,
    p: Vec<f64>,
    /// K, ε and S of each measurement.
    gains: Vec<f64>,
    innovations: Vec<(f64, f64)>,
}

/// Smoothed values.
#[derive(Debug)]
pub(crate) struct ChainSmoothed {
    /// d at each sample.
    pub(crate) input: Vec<f64>,
    /// Its standard deviation.
    pub(crate) std: Vec<f64>,
    /// r − H ẑ of each measurement.
    pub(crate) residuals: Vec<f64>,
    /// δx at the first sample.
    pub(crate) start: Vec<f64>,
}

/// Measurements whitened by a filter.
#[derive(Debug)]
pub(crate) struct WhitenedMeasurements {
    /// Innovations of the residuals divided by their standard deviations.
    pub(crate) residuals: Vec<f64>,
    /// Those of each column.
    pub(crate) columns: Vec<Vec<f64>>,
    /// ln S of each, and their sum.
    pub(crate) log_variances: Vec<f64>,
    pub(crate) log_determinant: f64,
}

/// Work space of a filter.
struct FilterWorkspace {
    z: Vec<f64>,
    p: Vec<f64>,
    gain: Vec<f64>,
    column: Vec<f64>,
    product: Vec<f64>,
}

impl DeviationChain {
    /// The chain with the unknown input at one place. `residuals` has n_w numbers per sample, not finite where nothing
    /// was measured; outputs without noise, or whose white noise is not a positive number, are left out.
    pub(crate) fn new(
        deviations: &Deviations,
        place: usize,
        walk: InputWalk,
        residuals: &[f64],
        noise: &[Option<SensorNoise>],
    ) -> Self {
        let (times, n_w) = (&deviations.times, deviations.n_outputs);
        let states = deviations.n();
        let intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let coloured: Vec<(usize, NoiseColour)> = noise
            .iter()
            .enumerate()
            .filter_map(|(output, noise)| Some((output, noise.as_ref()?.colour?)))
            .collect();
        let n = (states + coloured.len() + walk.len()).next_multiple_of(LANES);
        let input_position = n - walk.len();
        let mut transitions = vec![0.0; deviations.transitions.len() * n * (n - 1)];
        let systems = deviations.transitions.iter().zip(&deviations.responses).zip(&intervals);
        let matrices = transitions.chunks_exact_mut(n * (n - 1));
        for (f, ((transition, response), h)) in matrices.zip(systems) {
            for (i, row) in f.chunks_exact_mut(n).enumerate().take(states) {
                for (entry, phi) in row.iter_mut().zip(transition.row(i).iter()) {
                    *entry = *phi;
                }
                row[input_position] = response[(i, place)];
            }
            for (i, (_, colour)) in coloured.iter().enumerate() {
                f[(states + i) * (n + 1)] = (-h / colour.memory).exp();
            }
            if walk == InputWalk::Integrated {
                f[input_position * n + input_position] = 1.0;
                f[input_position * n + n - 1] = *h;
            }
        }
        let mut shifts = vec![0.0; deviations.shifts.len() * n];
        for (own, shift) in shifts.chunks_exact_mut(n).zip(&deviations.shifts) {
            own[..states].copy_from_slice(shift.as_slice());
        }
        let (mut measurements, mut rows, mut begin) = (Vec::new(), Vec::new(), vec![0]);
        for (sample, seen) in deviations.seen.iter().enumerate() {
            for output in 0..n_w {
                let value = residuals[sample * n_w + output];
                let (Some(seen), Some(SensorNoise { std, .. })) = (seen, noise[output]) else {
                    continue;
                };
                if value.is_finite() && std > 0.0 && std.is_finite() {
                    measurements.push(ChainMeasurement {
                        sample,
                        output,
                        value,
                        variance: std * std,
                    });
                    let mut row = vec![0.0; n];
                    for (entry, c) in row.iter_mut().zip(seen.states.row(output).iter()) {
                        *entry = *c;
                    }
                    if let Some(own) = coloured.iter().position(|(other, _)| *other == output) {
                        row[states + own] = 1.0;
                    }
                    row[input_position] = seen.inputs[(output, place)];
                    rows.extend(row);
                }
            }
            begin.push(measurements.len());
        }
        let of_colour = coloured.iter().map(|(_, colour)| colour.std);
        DeviationChain {
            n,
            walk,
            at: input_position,
            transitions,
            shifts,
            times: times.clone(),
            intervals,
            start: deviations.sizes.iter().copied().chain(of_colour).map(|std| std * std).collect(),
            states,
            noise: noise.to_vec(),
            measurements,
            rows,
            begin,
        }
    }

    /// T, s.
    pub(crate) fn duration(&self) -> f64 {
        self.times[self.times.len() - 1] - self.times[0]
    }

    /// Information about a constant d: Σ (H z)²/σ² for d = 1 throughout and δx(0) = 0, ignoring the correlation of the
    /// noise.
    pub(crate) fn information_on_a_constant(&self) -> f64 {
        let response = self.response(&vec![1.0; self.times.len()]);
        let of_output = |(output, noise): (usize, &Option<SensorNoise>)| {
            let Some(noise) = noise else { return 0.0 };
            let mut responses = vec![f64::NAN; self.times.len()];
            let pairs = self.measurements.iter().zip(&response);
            for (measurement, response) in pairs.filter(|(m, _)| m.output == output) {
                responses[measurement.sample] = *response;
            }
            let whitener = NoiseWhitener::new(&self.times, |k| responses[k].is_finite(), noise);
            let whitened = whitener.apply(responses.iter().copied());
            whitened.iter().filter(|value| value.is_finite()).map(|value| value * value).sum()
        };
        self.noise.iter().enumerate().map(of_output).sum()
    }

    /// H z of each measurement for a given d at each sample, and δx(0) = 0.
    pub(crate) fn response(&self, d: &[f64]) -> Vec<f64> {
        let n = self.n;
        let (mut z, mut next) = (vec![0.0; n], vec![0.0; n]);
        let mut response = Vec::with_capacity(self.measurements.len());
        for (k, d) in d.iter().enumerate() {
            z[self.at] = *d;
            let rows = &self.rows[self.begin[k] * n..self.begin[k + 1] * n];
            response.extend(rows.chunks_exact(n).map(|row| dot(row, &z)));
            if k < self.intervals.len() {
                for (next, row) in next.iter_mut().zip(self.transition(k).chunks_exact(n)) {
                    *next = flushed(dot(row, &z));
                }
                std::mem::swap(&mut z, &mut next);
                z[n - 1] = 0.0;
            }
        }
        response
    }

    /// Adds the response of measurements to d to residuals, n_w per sample.
    pub(crate) fn add_response(&self, d: &[f64], residuals: &mut [f64], n_w: usize) {
        for (measurement, response) in self.measurements.iter().zip(self.response(d)) {
            residuals[measurement.sample * n_w + measurement.output] += response;
        }
    }

    /// The whitened residuals and further columns: innovations divided by their standard deviations, and Σ ln S of the
    /// innovations' variances. `columns` have a number for each measurement.
    pub(crate) fn whitened(&self, intensity: f64, columns: &[Vec<f64>]) -> WhitenedMeasurements {
        let mut record = Some(FilterRecord::default());
        self.filter(intensity, &mut record);
        let record = record.unwrap_or_default();
        let values: Vec<f64> = self.measurements.iter().map(|m| m.value).collect();
        let residuals = self.along(&record, &values, &self.shifts);
        let columns = columns.iter().map(|column| self.along(&record, column, &[])).collect();
        let log_variances: Vec<f64> = record.innovations.iter().map(|(_, s)| s.ln()).collect();
        let log_determinant = log_variances.iter().sum();
        WhitenedMeasurements { residuals, columns, log_variances, log_determinant }
    }

    /// Time of a measurement, s.
    pub(crate) fn time_of(&self, measurement: usize) -> f64 {
        self.times[self.measurements[measurement].sample]
    }

    /// Innovations of other measured values divided by their standard deviations, with the gains of an earlier filter
    /// run; `shifts` are like those of the chain.
    fn along(&self, record: &FilterRecord, values: &[f64], shifts: &[f64]) -> Vec<f64> {
        // See `filter`.
        match self.n {
            4 => self.along_of_size(4, record, values, shifts),
            8 => self.along_of_size(8, record, values, shifts),
            12 => self.along_of_size(12, record, values, shifts),
            n => self.along_of_size(n, record, values, shifts),
        }
    }

    #[inline(always)]
    fn along_of_size(
        &self,
        n: usize,
        record: &FilterRecord,
        values: &[f64],
        shifts: &[f64],
    ) -> Vec<f64> {
        let (mut z, mut next) = (vec![0.0; n], vec![0.0; n]);
        let mut innovations = Vec::with_capacity(values.len());
        for k in 0..=self.intervals.len() {
            let of_sample = self.begin[k]..self.begin[k + 1];
            for (m, value) in of_sample.clone().zip(&values[of_sample]) {
                let h = &self.rows[m * n..(m + 1) * n];
                let innovation = value - dot(h, &z);
                add_scaled(&mut z, innovation, &record.gains[m * n..(m + 1) * n]);
                innovations.push(innovation / record.innovations[m].1.sqrt());
            }
            if k < self.intervals.len() {
                for (next, row) in next.iter_mut().zip(self.transition(k).chunks_exact(n)) {
                    *next = flushed(dot(row, &z));
                }
                next[n - 1] = if self.walk == InputWalk::White { 0.0 } else { z[n - 1] };
                shift(&mut next, shifts, k);
                std::mem::swap(&mut z, &mut next);
            }
        }
        innovations
    }

    /// ln p(r | q) up to terms that do not depend on q; minus infinity if it is NaN.
    pub(crate) fn log_likelihood(&self, intensity: f64) -> f64 {
        self.filter(intensity, &mut None)
    }

    /// d and the residuals, given all measurements.
    pub(crate) fn smooth(&self, intensity: f64) -> ChainSmoothed {
        let n = self.n;
        let mut record = Some(FilterRecord { has_states: true, ..FilterRecord::default() });
        self.filter(intensity, &mut record);
        let record = record.unwrap_or_default();

        let samples = self.intervals.len() + 1;
        let mut smoothed = ChainSmoothed {
            input: vec![0.0; samples],
            std: vec![0.0; samples],
            residuals: vec![0.0; self.measurements.len()],
            start: Vec::new(),
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
            let p_d = &p[self.at * n..(self.at + 1) * n];
            multiply(&capital, p_d, &mut column);
            smoothed.input[k] = z[self.at];
            if k == 0 {
                smoothed.start.extend_from_slice(&z[..self.states]);
            }
            smoothed.std[k] = (p_d[self.at] - dot(p_d, &column)).max(0.0).sqrt();

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
        let goes_on = if self.walk == InputWalk::White { 0.0 } else { 1.0 };
        column[n - 1] += goes_on * lambda[n - 1];
        for (lambda, column) in lambda.iter_mut().zip(column.iter()) {
            *lambda = flushed(*column);
        }

        // Λ F, then Fᵀ (Λ F); F's last row is the unit vector of d or its slope, or zero.
        for (capital, product) in capital.chunks_exact(n).zip(product.chunks_exact_mut(n)) {
            product.fill(0.0);
            for (row, factor) in rows().zip(capital) {
                add_scaled(product, *factor, row);
            }
            product[n - 1] += goes_on * capital[n - 1];
        }
        capital.fill(0.0);
        for (row, product) in rows().zip(product.chunks_exact(n)) {
            for (capital, factor) in capital.chunks_exact_mut(n).zip(row) {
                add_scaled(capital, *factor, product);
            }
        }
        add_scaled(&mut capital[(n - 1) * n..], goes_on, &product[(n - 1) * n..]);
        symmetrise(capital, n);
    }

    /// Runs the filter and returns ln p(r | q).
    fn filter(&self, intensity: f64, record: &mut Option<FilterRecord>) -> f64 {
        // One routine, inlined so that its size is a constant for small models.
        match self.n {
            4 => self.filter_of_size(4, intensity, record),
            8 => self.filter_of_size(8, intensity, record),
            12 => self.filter_of_size(12, intensity, record),
            n => self.filter_of_size(n, intensity, record),
        }
    }

    #[inline(always)]
    fn filter_of_size(&self, n: usize, intensity: f64, record: &mut Option<FilterRecord>) -> f64 {
        let mut filter = FilterWorkspace::new(n);
        for (i, variance) in self.start.iter().enumerate() {
            filter.p[i * n + i] = *variance;
        }
        let duration = self.duration();
        let start = intensity * duration;
        filter.p[n * n - 1] = start;
        if self.walk == InputWalk::Integrated {
            // The variance that the walk reaches over the whole recording.
            filter.p[self.at * (n + 1)] = start * duration * duration / 3.0;
        }

        let mut log_likelihood = 0.0;
        for k in 0..=self.intervals.len() {
            for m in self.begin[k]..self.begin[k + 1] {
                let ChainMeasurement { value, variance, .. } = self.measurements[m];
                let h = &self.rows[m * n..(m + 1) * n];
                let (innovation, s) = filter.update(n, h, value, variance);
                log_likelihood -= 0.5 * (s.ln() + innovation * innovation / s);
                if let Some(record) = record {
                    record.gains.extend_from_slice(&filter.gain);
                    record.innovations.push((innovation, s));
                }
            }
            if let Some(record) = record.as_mut().filter(|record| record.has_states) {
                record.z.extend_from_slice(&filter.z);
                record.p.extend_from_slice(&filter.p);
            }
            if let Some(h) = self.intervals.get(k) {
                let transition = self.transition(k);
                if self.walk == InputWalk::White {
                    filter.predict(n, transition, 0.0);
                    filter.begin_anew(n, start);
                } else {
                    filter.predict(n, transition, intensity * h);
                }
                shift(&mut filter.z, &self.shifts, k);
                for (i, variance) in self.start.iter().enumerate().skip(self.states) {
                    let phi = transition[i * (n + 1)];
                    filter.p[i * (n + 1)] += variance * (1.0 - phi * phi);
                }
            }
        }
        if log_likelihood.is_finite() { log_likelihood } else { f64::NEG_INFINITY }
    }
}

impl FilterWorkspace {
    fn new(n: usize) -> Self {
        FilterWorkspace {
            z: vec![0.0; n],
            p: vec![0.0; n * n],
            gain: vec![0.0; n],
            column: vec![0.0; n],
            product: vec![0.0; n * n],
        }
    }

    /// Updates with a measurement; returns its innovation and the innovation's variance.
    #[inline(always)]
    fn update(&mut self, n: usize, h: &[f64], value: f64, variance: f64) -> (f64, f64) {
        let FilterWorkspace { z, p, gain, column, .. } = self;
        let (p, h) = (&mut p[..n * n], &h[..n]);
        let (z, gain, column) = (&mut z[..n], &mut gain[..n], &mut column[..n]);
        // S = H P Hᵀ + σ², K = P Hᵀ/S; most outputs depend on few states.
        column.fill(0.0);
        for (row, h) in p.chunks_exact(n).zip(h) {
            if *h != 0.0 {
                add_scaled(column, *h, row);
            }
        }
        let s = dot(h, column) + variance;
        for (gain, column) in gain.iter_mut().zip(column.iter()) {
            *gain = column / s;
        }
        let innovation = value - dot(h, z);
        add_scaled(z, innovation, gain);

        // T = (I − KH) P,  P ← T (I − KH)ᵀ + K σ² Kᵀ = T − (T Hᵀ − σ² K) Kᵀ
        for (row, k) in p.chunks_exact_mut(n).zip(gain.iter()) {
            add_scaled(row, -k, column);
            let rest = dot(row, h) - variance * k;
            add_scaled(row, -rest, gain);
        }
        symmetrise(p, n);
        (innovation, s)
    }

    /// z ← F z, P ← F P Fᵀ with `step` added to the variance of d.
    #[inline(always)]
    fn predict(&mut self, n: usize, transition: &[f64], step: f64) {
        let FilterWorkspace { z, p, column, product, .. } = self;
        let (p, product) = (&mut p[..n * n], &mut product[..n * n]);
        let rows = || transition[..n * (n - 1)].chunks_exact(n);
        for (next, row) in column.iter_mut().zip(rows()) {
            *next = flushed(dot(row, z));
        }
        z[..n - 1].copy_from_slice(&column[..n - 1]);

        // F P without its last row, which is that of P.
        for (product, row) in product.chunks_exact_mut(n).zip(rows()) {
            product.fill(0.0);
            for (factor, p) in row.iter().zip(p.chunks_exact(n)) {
                add_scaled(product, *factor, p);
            }
        }
        for (i, product) in product.chunks_exact(n).enumerate().take(n - 1) {
            for (entry, row) in p[i * n..(i + 1) * n].iter_mut().zip(rows()) {
                *entry = dot(product, row);
            }
            p[i * n + n - 1] = product[n - 1];
            p[(n - 1) * n + i] = product[n - 1];
        }
        p[n * n - 1] += step;
        symmetrise(p, n);
    }

    /// Resets the last of z, which from now on is independent of the rest and has this variance.
    fn begin_anew(&mut self, n: usize, variance: f64) {
        self.z[n - 1] = 0.0;
        for i in 0..n {
            self.p[i * n + n - 1] = 0.0;
            self.p[(n - 1) * n + i] = 0.0;
        }
        self.p[n * n - 1] = variance;
    }
}

/// Adds the shift of the k-th interval to a state.
#[inline(always)]
fn shift(z: &mut [f64], shifts: &[f64], k: usize) {
    let n = z.len();
    for (z, shift) in z.iter_mut().zip(shifts.get(k * n..(k + 1) * n).unwrap_or_default()) {
        *z += shift;
    }
}

/// Σ aᵢ bᵢ for a multiple of [`LANES`] numbers.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b.as_chunks::<LANES>().0) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum()
}

/// y ← y + a x for a multiple of [`LANES`] numbers.
#[inline(always)]
fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.as_chunks_mut::<LANES>().0.iter_mut().zip(x.as_chunks::<LANES>().0) {
        for lane in 0..LANES {
            y[lane] += a * x[lane];
        }
    }
}

/// y ← A x for a square A, row by row.
fn multiply(a: &[f64], x: &[f64], y: &mut [f64]) {
    for (y, row) in y.iter_mut().zip(a.chunks_exact(x.len())) {
        *y = dot(row, x);
    }
}

/// The symmetric part, with negligible numbers set to zero.
#[inline(always)]
fn symmetrise(a: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..=i {
            let mean = flushed(0.5 * (a[i * n + j] + a[j * n + i]));
            a[i * n + j] = mean;
            a[j * n + i] = mean;
        }
    }
}

/// Flushes tiny numbers to zero: a variance that decays at each step for hours becomes subnormal, which is a hundred
/// times slower on most processors.
#[inline(always)]
fn flushed(x: f64) -> f64 {
    if x.abs() < 1e-200 { 0.0 } else { x }
}
