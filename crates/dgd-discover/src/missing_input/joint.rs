//! Estimates unknown inputs in several equations at once, with the states along them.
//!
//! Each interval between samples is a run of its own, from the smoothed states and with the smoothed inputs at its
//! start; so a model that runs away, or one that is far off, is followed as well as any other. Around that trajectory,
//! with d all unknown inputs,
//!
//! ```text
//!   δx(k+1) = Φ δx(k) + Γ d(k) + c(k),     c(k) = φ(x(k), d₀(k)) − x(k+1) − Γ d₀(k)
//!   r(k)    = C δx(k) + D d(k) + v,        r(k) = measured − w(x(k), d₀(k)) + D d₀(k)
//!   d(k+1)  = d(k) + N(0, q h)             for each place a q of its own
//! ```
//!
//! The smoothed states and inputs are the next trajectory (Bell, SIAM J. Optim. 4 (1994) 626). Every q is estimated by
//! maximum likelihood; those of equations that lack nothing go to zero (automatic relevance). With λ and Λ the adjoint
//! variables of the smoother, the derivative of the log-likelihood with respect to q is ½ Σ h (λ² − Λ) (Koopman,
//! Biometrika 80 (1993) 117), so each is multiplied by Σ h λ²/Σ h Λ until that is one.

use dgd_execute::LoadedSystem;
use dgd_runtime::{Inputs, LimitSide, Options, Problem, Solution, System, observe, simulate};
use dgd_screen::noise::{SensorNoise, median};
use nalgebra::{DMatrix, DVector};

use super::deviations::Deviations;
use super::filtered::FilterRecording;
use super::missing_terms::MissingTerms;
use super::reconstruct::inputs_with_all;
use super::unknown_input::SIGNIFICANT_GAIN;

/// Number of linearisations, each around a better trajectory.
const ROUNDS: usize = 6;
/// Number of updates of q around each of them.
const UPDATES: usize = 6;
/// Distances from the last trajectory, in sizes of the states, within which the next one is sought: each in turn until
/// the model runs along it.
const TRUST: [f64; 4] = [f64::INFINITY, 1.0, 0.1, 0.01];
/// Loss of log-likelihood of a reading from one trajectory to the next, at the same q, above which the next is rejected
/// for a linearisation: that of a residual of one standard deviation.
const MOST_LOSS: f64 = 0.5;
/// Largest factor by which one update changes q.
const MOST_CHANGE: f64 = 100.0;

/// A recording to follow.
pub(crate) struct JointRecording<'a> {
    /// The model's own inputs.
    pub(crate) inputs: &'a Inputs,
    /// Times of the samples, s.
    pub(crate) times: &'a [f64],
    /// Readings, n_w per sample; not finite where nothing was read.
    pub(crate) measured: &'a [f64],
    /// Start values, SI.
    pub(crate) start: &'a [(usize, f64)],
}

/// The model, and the places at which something may be missing.
pub(crate) struct JointModel<'a> {
    pub(crate) terms: &'a MissingTerms,
    pub(crate) places: &'a [usize],
    /// Unknowns whose start values are free; the others begin as recordings or the model have them.
    pub(crate) free_starts: &'a [usize],
    /// All parameters, SI.
    pub(crate) p: &'a [f64],
    pub(crate) noise: &'a [Option<SensorNoise>],
    pub(crate) options: &'a Options,
}

/// Number of points between two samples at which inputs are averaged.
const BETWEEN: usize = 8;

/// A smoothed recording.
#[derive(Debug, Clone)]
pub(crate) struct SmoothedRecording {
    /// Unknowns at the samples.
    pub(crate) trajectory: Solution,
    /// The model's own inputs at the samples, n_u each …
    pub(crate) u: Vec<f64>,
    /// … and their means between them.
    pub(crate) u_between: Vec<f64>,
    /// Deviations from it.
    pub(crate) chain: JointChain,
}

/// Deviations with unknown inputs at all places.
#[derive(Debug, Clone)]
pub(crate) struct JointChain {
    /// Sizes of the states, SI.
    sizes: Vec<f64>,
    /// Whether their start values are free.
    is_free: Vec<bool>,
    /// Length of each interval, s.
    intervals: Vec<f64>,
    phi: Vec<DMatrix<f64>>,
    gamma: Vec<DMatrix<f64>>,
    shifts: Vec<DVector<f64>>,
    /// Readings of each sample.
    readings: Vec<Vec<JointReading>>,
}

/// One reading.
#[derive(Debug, Clone)]
struct JointReading {
    value: f64,
    variance: f64,
    states: DVector<f64>,
    inputs: DVector<f64>,
}

/// A filter run at some q, which whitens other inputs.
#[derive(Debug, Clone)]
pub(crate) struct WhiteningRun {
    /// Places of the unknown inputs.
    places: Vec<usize>,
    /// For each sample and reading, K and S.
    gains: Vec<Vec<(DVector<f64>, f64)>>,
    /// The whitened residuals.
    pub(crate) residuals: Vec<f64>,
    /// Σ ln S.
    pub(crate) log_determinant: f64,
}

/// States at the samples, and each place's input there.
type JointEstimate = (Vec<DVector<f64>>, Vec<Vec<f64>>);

/// z⁺ and P⁺ at each sample, with the innovations.
struct JointFiltered {
    whitening: WhiteningRun,
    states: Vec<(DVector<f64>, DMatrix<f64>)>,
    innovations: Vec<Vec<f64>>,
}

/// Smoothed deviations, and Σ h λ² and Σ h Λ of each place.
struct JointSmoothed {
    z: Vec<DVector<f64>>,
    scores: Vec<(f64, f64)>,
}

impl WhiteningRun {
    /// ln p of the readings, up to terms that do not depend on q.
    fn log_likelihood(&self) -> f64 {
        -0.5 * (self.residuals.iter().map(|x| x * x).sum::<f64>() + self.log_determinant)
    }
}

impl JointChain {
    fn duration(&self) -> f64 {
        self.intervals.iter().sum()
    }

    fn n(&self) -> usize {
        self.sizes.len()
    }

    /// Number of readings.
    pub(crate) fn len(&self) -> usize {
        self.readings.iter().map(Vec::len).sum()
    }

    /// The chain with readings of all deviations as zero, each with a standard deviation of `trust` sizes of the state.
    fn held(&self, trust: f64) -> JointChain {
        let mut chain = self.clone();
        if trust.is_finite() {
            let m = self.gamma.first().map_or(0, DMatrix::ncols);
            for readings in &mut chain.readings {
                readings.extend(self.sizes.iter().enumerate().map(|(i, size)| JointReading {
                    value: 0.0,
                    variance: (trust * size).powi(2),
                    states: DVector::from_fn(self.n(), |k, _| f64::from(u8::from(k == i))),
                    inputs: DVector::zeros(m),
                }));
            }
        }
        chain
    }

    /// F of an interval: [Φ Γ; 0 1].
    fn transition(&self, k: usize, places: &[usize]) -> DMatrix<f64> {
        let (n, m) = (self.n(), places.len());
        let mut f = DMatrix::identity(n + m, n + m);
        f.view_mut((0, 0), (n, n)).copy_from(&self.phi[k]);
        for (j, place) in places.iter().enumerate() {
            f.view_mut((0, n + j), (n, 1)).copy_from(&self.gamma[k].column(*place));
        }
        f
    }

    /// H of a reading.
    fn row(&self, reading: &JointReading, places: &[usize]) -> DVector<f64> {
        let n = self.n();
        DVector::from_fn(n + places.len(), |i, _| {
            if i < n { reading.states[i] } else { reading.inputs[places[i - n]] }
        })
    }

    /// Runs the filter with these intensities of the walks.
    fn filtered(&self, places: &[usize], q: &[f64], keeps: bool) -> JointFiltered {
        let (n, m) = (self.n(), places.len());
        let duration = self.duration();
        let mut z = DVector::zeros(n + m);
        let mut p = DMatrix::zeros(n + m, n + m);
        for i in 0..n + m {
            p[(i, i)] = match self.is_free.get(i) {
                Some(true) => self.sizes[i].powi(2),
                Some(false) => 0.0,
                None => q[i - n] * duration,
            };
        }
        let mut whitening = WhiteningRun {
            places: places.to_vec(),
            gains: Vec::new(),
            residuals: Vec::new(),
            log_determinant: 0.0,
        };
        let (mut states, mut innovations) = (Vec::new(), Vec::new());
        for (k, readings) in self.readings.iter().enumerate() {
            let (mut gains, mut own) = (Vec::new(), Vec::new());
            for reading in readings {
                let h = self.row(reading, places);
                let column = &p * &h;
                let variance = h.dot(&column) + reading.variance;
                let innovation = reading.value - h.dot(&z);
                let gain = &column / variance;
                z += &gain * innovation;
                // (I − KH) P (I − KH)ᵀ + K σ² Kᵀ
                p -= &gain * column.transpose();
                p -= (&p * &h) * gain.transpose();
                p += &gain * (gain.transpose() * reading.variance);
                p = (&p + p.transpose()) * 0.5;
                whitening.residuals.push(innovation / variance.sqrt());
                whitening.log_determinant += variance.ln();
                gains.push((gain, variance));
                own.push(innovation);
            }
            whitening.gains.push(gains);
            innovations.push(own);
            if keeps {
                states.push((z.clone(), p.clone()));
            }
            if let Some(h) = self.intervals.get(k) {
                let f = self.transition(k, places);
                z = &f * &z;
                let mut x = z.rows_mut(0, n);
                x += &self.shifts[k];
                p = &f * &p * f.transpose();
                for (j, q) in q.iter().enumerate() {
                    p[(n + j, n + j)] += q * h;
                }
            }
        }
        JointFiltered { whitening, states, innovations }
    }

    /// The smoother in Bryson and Frazier's form (Bierman, Int. J. Control 18 (1973) 65).
    fn smoothed(&self, places: &[usize], q: &[f64]) -> JointSmoothed {
        let (n, m) = (self.n(), places.len());
        let JointFiltered { whitening, states, innovations } = self.filtered(places, q, true);
        let mut lambda = DVector::zeros(n + m);
        let mut capital = DMatrix::zeros(n + m, n + m);
        let mut z = vec![DVector::zeros(0); states.len()];
        let mut scores = vec![(0.0, 0.0); m];
        let mut add = |h: f64, lambda: &DVector<f64>, capital: &DMatrix<f64>| {
            for (j, (square, expected)) in scores.iter_mut().enumerate() {
                *square += h * lambda[n + j].powi(2);
                *expected += h * capital[(n + j, n + j)];
            }
        };
        for k in (0..states.len()).rev() {
            if k + 1 < states.len() {
                add(self.intervals[k], &lambda, &capital);
                let f = self.transition(k, places);
                lambda = f.tr_mul(&lambda);
                capital = f.tr_mul(&capital) * &f;
            }
            let (own, p) = &states[k];
            z[k] = own - p * &lambda;
            for (i, reading) in self.readings[k].iter().enumerate().rev() {
                let h = self.row(reading, places);
                let (gain, variance) = &whitening.gains[k][i];
                let along = gain.dot(&lambda) + innovations[k][i] / variance;
                lambda -= &h * along;
                let column = &capital * gain;
                let both = gain.dot(&column) + 1.0 / variance;
                capital +=
                    &h * (h.transpose() * both) - &column * h.transpose() - &h * column.transpose();
            }
        }
        add(self.duration(), &lambda, &capital);
        JointSmoothed { z, scores }
    }

    /// Typical (H Γ)²/σ² of a reading for d = 1 at a place since the sample before, as the median: where the model runs
    /// away, it is arbitrarily large.
    fn information(&self, place: usize) -> Option<f64> {
        let after = self.gamma.iter().zip(&self.readings[1..]).flat_map(|(gamma, readings)| {
            let signal_to_noise = |reading: &JointReading| {
                let response = reading.states.dot(&gamma.column(place)) + reading.inputs[place];
                response * response / reading.variance
            };
            readings.iter().map(signal_to_noise)
        });
        let mut positive: Vec<f64> = after.filter(|x| *x > 0.0).collect();
        median(&mut positive)
    }

    /// The filter's gains and whitened residuals.
    pub(crate) fn whitening(&self, places: &[usize], q: &[f64]) -> WhiteningRun {
        self.filtered(places, q, false).whitening
    }

    /// The whitened response of the readings to an input at a place: `held` is its mean over each interval, `at` its
    /// value at each sample.
    pub(crate) fn whitened(
        &self,
        with: &WhiteningRun,
        place: usize,
        held: &[f64],
        at: &[f64],
    ) -> Vec<f64> {
        let (n, m) = (self.n(), with.places.len());
        let mut z: DVector<f64> = DVector::zeros(n + m);
        let mut next: DVector<f64> = DVector::zeros(n);
        let mut whitened = Vec::with_capacity(with.residuals.len());
        for (k, readings) in self.readings.iter().enumerate() {
            for (reading, (gain, variance)) in readings.iter().zip(&with.gains[k]) {
                let mut predicted = reading.inputs[place] * at[k];
                for i in 0..n {
                    predicted += reading.states[i] * z[i];
                }
                for (j, own) in with.places.iter().enumerate() {
                    predicted += reading.inputs[*own] * z[n + j];
                }
                z.axpy(-predicted, gain, 1.0);
                whitened.push(predicted / variance.sqrt());
            }
            if k < self.intervals.len() {
                next.gemv(1.0, &self.phi[k], &z.rows(0, n), 0.0);
                for (j, own) in with.places.iter().enumerate() {
                    next.axpy(z[n + j], &self.gamma[k].column(*own), 1.0);
                }
                next.axpy(held[k], &self.gamma[k].column(place), 1.0);
                z.rows_mut(0, n).copy_from(&next);
            }
        }
        whitened
    }
}

impl JointModel<'_> {
    fn states(&self) -> Vec<usize> {
        self.terms.system().signature().unknowns.differential().collect()
    }

    /// The smoothed recordings and the intensity of the walk at each place; `None` if one cannot be followed.
    ///
    /// If states are not read, rounds that begin with a diverged filter end elsewhere than rounds that begin with the
    /// readings; the result with the higher likelihood counts.
    pub(crate) fn paths(
        &self,
        recordings: &[JointRecording<'_>],
    ) -> Option<(Vec<SmoothedRecording>, Vec<f64>)> {
        let resting = |recorded: &JointRecording<'_>| {
            let estimated = self.resting(recorded)?;
            self.path(recorded, &estimated).map(|path| (estimated, path))
        };
        let resting: Vec<Option<(JointEstimate, SmoothedRecording)>> =
            recordings.iter().map(resting).collect();
        let both = || recordings.iter().zip(&resting);
        let followed = both().map(|(recorded, resting)| {
            let (x, _) = &resting.as_ref()?.0;
            let mut estimated = self.first(recorded)?;
            for (i, state) in self.states().iter().enumerate() {
                if !self.free_starts.contains(state) {
                    estimated.0[0][i] = x[0][i];
                }
            }
            self.path(recorded, &estimated).map(|path| (estimated, path))
        });
        let followed: Vec<_> =
            followed.zip(&resting).map(|(own, rest)| own.or(rest.clone())).collect();
        let of_filter = self.rounds(recordings, followed, f64::INFINITY);
        let n_read = self.noise.iter().flatten().count();
        if n_read >= self.states().len() {
            return of_filter;
        }
        let leaning = both().map(|(recorded, resting)| {
            let (own, path) = resting.as_ref()?;
            let next = leaning(own, path);
            self.path(recorded, &next).map(|path| (next, path))
        });
        let of_readings = self.rounds(recordings, leaning.collect(), MOST_LOSS);
        let likelihood =
            |(paths, q): &(Vec<SmoothedRecording>, Vec<f64>)| self.likelihood(paths, q);
        [of_filter, of_readings]
            .into_iter()
            .flatten()
            .filter(|one| likelihood(one).is_finite())
            .reduce(|best, other| if likelihood(&other) > likelihood(&best) { other } else { best })
    }

    /// The smoothed recordings after all rounds from a first path of each, with at most this loss of log-likelihood of
    /// a reading from one trajectory to the next.
    fn rounds(
        &self,
        recordings: &[JointRecording<'_>],
        begun: Vec<Option<(JointEstimate, SmoothedRecording)>>,
        most_loss: f64,
    ) -> Option<(Vec<SmoothedRecording>, Vec<f64>)> {
        let begun = begun.into_iter().collect::<Option<Vec<_>>>()?;
        let (mut all, mut paths): (Vec<JointEstimate>, Vec<SmoothedRecording>) =
            begun.into_iter().unzip();
        let mut q = self.begin(&paths);
        for _ in 0..ROUNDS {
            for _ in 0..UPDATES {
                self.update(&paths, &mut q);
            }
            let triples = recordings.iter().zip(&all).zip(&paths);
            let next = triples
                .map(|((recorded, from), path)| self.smoothed(recorded, from, path, &q, most_loss));
            // If the model cannot follow, the last trajectory stays.
            let Some(next) = next.collect::<Option<Vec<_>>>() else { break };
            (all, paths) = next.into_iter().unzip();
        }
        Some((paths, q))
    }

    /// ln p of the readings of all recordings.
    fn likelihood(&self, paths: &[SmoothedRecording], q: &[f64]) -> f64 {
        let of_path =
            |path: &SmoothedRecording| path.chain.whitening(self.places, q).log_likelihood();
        paths.iter().map(of_path).sum()
    }

    /// The smoothed states and inputs of a recording, with the path along them, as near to the last path as necessary
    /// (an iterated smoother by Levenberg and Marquardt: Särkkä & Svensson, ICASSP 2020, 5875).
    fn smoothed(
        &self,
        recorded: &JointRecording<'_>,
        (x, d): &JointEstimate,
        path: &SmoothedRecording,
        q: &[f64],
        most_loss: f64,
    ) -> Option<(JointEstimate, SmoothedRecording)> {
        let n = path.chain.n();
        let least =
            self.likelihood(std::slice::from_ref(path), q) - most_loss * path.chain.len() as f64;
        TRUST.iter().find_map(|trust| {
            let JointSmoothed { z, .. } = path.chain.held(*trust).smoothed(self.places, q);
            let x = x.iter().zip(&z).map(|(x, z)| x + z.rows(0, n));
            let of_place = |j: usize| z.iter().map(move |z| z[n + j]).collect();
            let next: JointEstimate = (x.collect(), (0..d.len()).map(of_place).collect());
            let path = self.path(recorded, &next)?;
            let reached = self.likelihood(std::slice::from_ref(&path), q);
            // Without a likelihood to compare with, every path is accepted.
            let is_better = reached >= least || least.is_nan() || most_loss.is_infinite();
            is_better.then_some((next, path))
        })
    }

    /// Places without whose walk the readings would be less likely than chance allows.
    pub(crate) fn standing_out(&self, paths: &[SmoothedRecording], q: &[f64]) -> Vec<usize> {
        let whole = self.likelihood(paths, q);
        let stands_out = |i: &usize| {
            let mut without = q.to_vec();
            without[*i] = 0.0;
            let gain = whole - self.likelihood(paths, &without);
            // Without the walk there may be no likelihood.
            gain.is_nan() || gain > SIGNIFICANT_GAIN
        };
        (0..q.len()).filter(stands_out).map(|i| self.places[i]).collect()
    }

    /// Initial intensities: a step of the walk between samples is just visible in a reading, so that it can follow any
    /// readings.
    fn begin(&self, paths: &[SmoothedRecording]) -> Vec<f64> {
        let intervals = paths.iter().flat_map(|path| path.chain.intervals.iter().copied());
        let usual = median(&mut intervals.collect::<Vec<f64>>()).unwrap_or(0.0);
        let of_place = |place: &usize| {
            let of_paths = paths.iter().filter_map(|path| path.chain.information(*place));
            let information = of_paths.fold(0.0, f64::max);
            let q = 1.0 / (information * usual);
            if q.is_finite() { q } else { 0.0 }
        };
        self.places.iter().map(of_place).collect()
    }

    fn update(&self, paths: &[SmoothedRecording], q: &mut [f64]) {
        let mut sums = vec![(0.0, 0.0); q.len()];
        for path in paths {
            for (sum, own) in sums.iter_mut().zip(path.chain.smoothed(self.places, q).scores) {
                sum.0 += own.0;
                sum.1 += own.1;
            }
        }
        for (q, (square, expected)) in q.iter_mut().zip(sums) {
            let factor = square / expected;
            if factor.is_finite() {
                *q *= factor.clamp(1.0 / MOST_CHANGE, MOST_CHANGE);
            }
        }
    }

    /// The states of a filter, and no inputs.
    fn first(&self, recorded: &JointRecording<'_>) -> Option<JointEstimate> {
        let JointRecording { inputs, times, measured, start } = *recorded;
        let inputs = inputs_with_all(self.terms, inputs, times, &[]).ok()?;
        let nothing = vec![0.0; times.len()];
        let followed = FilterRecording {
            terms: self.terms,
            p: self.p,
            inputs: &inputs,
            place: 0,
            d: &nothing,
            start,
            times,
            measured,
            noise: self.noise,
            options: self.options,
        };
        let trajectory = followed.filtered()?.trajectory;
        let states = self.states();
        let x = (0..times.len()).map(|k| {
            let y = trajectory.y(k);
            DVector::from_iterator(states.len(), states.iter().map(|i| y[*i]))
        });
        Some((x.collect(), vec![nothing.clone(); self.places.len()]))
    }

    /// Constant states at their start values, and no inputs: a first path where a filter diverges.
    fn resting(&self, recorded: &JointRecording<'_>) -> Option<JointEstimate> {
        let JointRecording { inputs, times, start, .. } = *recorded;
        let inputs = inputs_with_all(self.terms, inputs, times, &[]).ok()?;
        let problem = Problem { system: self.terms.system(), p: self.p, inputs: &inputs, start };
        let begun = simulate(&problem, times.get(..1)?, self.options).ok()?;
        let states = self.states();
        let x = DVector::from_iterator(states.len(), states.iter().map(|i| begun.y(0)[*i]));
        Some((vec![x; times.len()], vec![vec![0.0; times.len()]; self.places.len()]))
    }

    /// The linearisation around states and inputs.
    fn path(
        &self,
        recorded: &JointRecording<'_>,
        (x, d): &JointEstimate,
    ) -> Option<SmoothedRecording> {
        let JointRecording { inputs: own, times, measured, .. } = *recorded;
        let place_inputs: Vec<(usize, &[f64])> =
            self.places.iter().copied().zip(d.iter().map(Vec::as_slice)).collect();
        let inputs = inputs_with_all(self.terms, own, times, &place_inputs).ok()?;
        let states = self.states();
        let last = times.len() - 1;
        let mut chain = JointChain {
            sizes: Vec::new(),
            is_free: states.iter().map(|i| self.free_starts.contains(i)).collect(),
            intervals: times.windows(2).map(|t| t[1] - t[0]).collect(),
            phi: Vec::with_capacity(last),
            gamma: Vec::with_capacity(last),
            shifts: Vec::with_capacity(last),
            readings: Vec::with_capacity(times.len()),
        };
        let (mut y, mut z) = (Vec::new(), Vec::new());
        let mut whole: Option<Solution> = None;
        for k in 0..last {
            let start: Vec<(usize, f64)> =
                states.iter().copied().zip(x[k].iter().copied()).collect();
            let problem: Problem<'_, LoadedSystem> =
                Problem { system: self.terms.system(), p: self.p, inputs: &inputs, start: &start };
            let piece = simulate(&problem, &times[k..k + 2], self.options).ok()?;
            let deviations = Deviations::linearize(self.terms, self.p, &inputs, &piece).ok()?;
            let simulated = observe(&problem, &piece);
            let gamma = &deviations.responses[0];
            let reached = piece.y(1);
            let mut shift =
                DVector::from_iterator(states.len(), states.iter().map(|i| reached[*i]));
            shift -= &x[k + 1];
            for (place, d) in &place_inputs {
                shift.axpy(-d[k], &gamma.column(*place), 1.0);
            }
            let n_w = deviations.n_outputs;
            let phi = &deviations.transitions[0];
            let mut entries = phi.iter().chain(gamma.iter()).chain(shift.iter());
            if !entries.all(|x| x.is_finite()) {
                return None;
            }
            // The end of the last interval has readings of its own.
            let ends = if k + 1 == last { 0..2 } else { 0..1 };
            for end in ends {
                let sample = k + end;
                let mut readings = Vec::new();
                if let Some(seen) = &deviations.seen[end] {
                    for (output, noise) in self.noise.iter().enumerate() {
                        let read = measured[sample * n_w + output];
                        let Some(noise) = noise.filter(|noise| noise.std > 0.0) else { continue };
                        if !read.is_finite() {
                            continue;
                        }
                        let states = seen.states.row(output).transpose();
                        let inputs = seen.inputs.row(output).transpose();
                        let mut value = read - simulated.w(end)[output];
                        // The end of a run is not the state around which it is linear.
                        if end == 1 {
                            value += states.dot(&(&shift + deviation(gamma, &place_inputs, k)));
                        }
                        for (place, d) in &place_inputs {
                            value += inputs[*place] * d[sample];
                        }
                        let variance = noise.total().powi(2);
                        readings.push(JointReading { value, variance, states, inputs });
                    }
                }
                chain.readings.push(readings);
                y.extend_from_slice(piece.y(end));
                z.extend_from_slice(piece.z(end));
            }
            if k == 0 {
                chain.sizes.clone_from(&deviations.sizes);
            }
            for (size, own) in chain.sizes.iter_mut().zip(&deviations.sizes) {
                *size = size.max(*own);
            }
            chain.phi.push(phi.clone());
            chain.gamma.push(gamma.clone());
            chain.shifts.push(shift);
            whole.get_or_insert(piece);
        }
        let trajectory = Solution { times: times.to_vec(), y, z, ..whole? };
        let n = own.len();
        let value = |t: f64| {
            let mut u = vec![0.0; n];
            own.value(t, LimitSide::Right, &mut u);
            u
        };
        let mean = |[a, b]: [f64; 2]| {
            let part = |k: usize| a + (b - a) * (k as f64 + 0.5) / BETWEEN as f64;
            let values: Vec<Vec<f64>> = (0..BETWEEN).map(|k| value(part(k))).collect();
            (0..n).map(move |i| values.iter().map(|u| u[i]).sum::<f64>() / BETWEEN as f64)
        };
        let u = times.iter().flat_map(|t| value(*t)).collect();
        let u_between = times.windows(2).flat_map(|ends| mean([ends[0], ends[1]])).collect();
        Some(SmoothedRecording { trajectory, u, u_between, chain })
    }
}

/// The course with states corrected by the readings of their own sample; between readings, the last correction holds.
fn leaning((x, d): &JointEstimate, path: &SmoothedRecording) -> JointEstimate {
    let chain = &path.chain;
    let mut moved = DVector::zeros(chain.n());
    let mut moved_states = Vec::with_capacity(x.len());
    for (k, (x, readings)) in x.iter().zip(&chain.readings).enumerate() {
        if !readings.is_empty() {
            let squares: Vec<f64> = chain.sizes.iter().map(|size| size * size).collect();
            let mut p = DMatrix::from_diagonal(&DVector::from_vec(squares));
            moved.fill(0.0);
            for reading in readings {
                let column = &p * &reading.states;
                let variance = reading.states.dot(&column) + reading.variance;
                let innovation = reading.value - reading.states.dot(&moved);
                moved.axpy(innovation / variance, &column, 1.0);
                p -= &column * column.transpose() / variance;
            }
        }
        let state = DVector::from_fn(chain.n(), |i, _| {
            let is_kept = k == 0 && !chain.is_free[i];
            if is_kept { x[i] } else { x[i] + moved[i] }
        });
        moved_states.push(state);
    }
    (moved_states, d.clone())
}

/// Γ d₀ of an interval.
fn deviation(gamma: &DMatrix<f64>, given: &[(usize, &[f64])], k: usize) -> DVector<f64> {
    let mut sum = DVector::zeros(gamma.nrows());
    for (place, d) in given {
        sum.axpy(d[k], &gamma.column(*place), 1.0);
    }
    sum
}

#[cfg(test)]
mod tests {
    use dgd_compiler::diagnostics::Diagnostics;
    use dgd_compiler::model::{ModelOptions, resolve};
    use dgd_compiler::pipeline::load;
    use dgd_compiler::source::{SourceMap, SourceText};
    use dgd_execute::Engine;

    use super::*;
    use crate::missing_input::PlaceKind;

    /// A level that runs away by itself, and a second one behind it.
    const MODEL: &str = "model two
state x [1] = 1
state y [1] = 0
equation first: 1 [s]*der(x) = 3*x
equation second: 1 [s]*der(y) = x - y
output x noise 0.001
output y noise 0.001
";

    #[test]
    fn what_is_missing_is_found_in_its_equation_and_in_no_other() {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let source = SourceText { name: "two.dgd".to_owned(), text: MODEL.to_owned() };
        let mut nothing = |path: &str| Err(format!("{path} is not read here"));
        let asts = load(source, &mut nothing, &mut sources, &mut diagnostics).expect("a model");
        let model = resolve(&asts, &ModelOptions::default(), &mut diagnostics).expect("a model");
        let terms = MissingTerms::new(&model, Engine::Auto, &mut diagnostics).expect("places");
        let is_equation = |i: &usize| terms.places()[*i].kind == PlaceKind::Equation;
        let places: Vec<usize> = (0..terms.places().len()).filter(is_equation).collect();

        // The plant has der(x) = 3 x − 4 x² − x, and settles at ½: missing is −4 x² − x.
        let times: Vec<f64> = (0..=100).map(|k| 0.05 * f64::from(k)).collect();
        let (mut x, mut y, mut measured) = (0.1_f64, 0.0_f64, Vec::new());
        for k in 0..=100 {
            let error = |of: i32| 0.001 * f64::from((k * of) % 17 - 8) / 5.0;
            measured.extend([x + error(7), y + error(11)]);
            for _ in 0..500 {
                let h = 1e-4;
                (x, y) = (x + h * (2.0 * x - 4.0 * x * x), y + h * (x - y));
            }
        }
        let inputs = Inputs::none();
        let start = [(0, 0.1), (1, 0.0)];
        let recorded =
            JointRecording { inputs: &inputs, times: &times, measured: &measured, start: &start };
        let noise = vec![Some(SensorNoise::known(0.001)); 2];
        let (p, options) = (Vec::new(), Options::default());
        let (terms, places, noise, options) = (&terms, &places, &noise, &options);
        let joint = JointModel { terms, places, free_starts: &[0, 1], p: &p, noise, options };
        let (paths, q) = joint.paths(&[recorded]).expect("a path");
        assert_eq!(joint.standing_out(&paths, &q), [places[0]]);
        assert!(q[1] < 1e-6 * q[0], "{q:?}");
        for (k, read) in measured.chunks_exact(2).enumerate() {
            for (y, read) in paths[0].trajectory.y(k).iter().zip(read) {
                assert!((y - read).abs() < 0.004, "{k}: {y} for {read}");
            }
        }
    }
}
