//! Fits the missing input at one place in all recordings, together with changes of the model's own parameters.
//!
//! Around simulated trajectories, measured minus simulated is
//!
//! ```text
//!   r = X β + h * d + e,     β ~ N(0, size²) changes of the free parameters, d a walk, e the sensors' noise
//! ```
//!
//! For a walk of intensity q, a filter turns r and the columns of X into independent numbers of unit variance, so that
//! β follows from least squares, and the likelihood of q from the residuals (de Jong, The diffuse Kalman filter, Ann.
//! Stat. 19 (1991) 1073). So no place is judged with parameters that are a compromise without it. Start values are
//! states with a wide prior. The likelihood is maximised over q and the three [`InputWalk`]s, with a penalty for their
//! number of states.
//!
//! A place is judged by the likelihood of recordings to which it was not fitted: q and β are those of the training
//! recordings, and each reading is predicted from those before it.

use dgd_runtime::Solution;
use dgd_screen::noise::SensorNoise;
use nalgebra::{DMatrix, DVector};

use super::deviations::Deviations;
use super::kalman::{ChainSmoothed, DeviationChain, InputWalk};
use super::unknown_input::maximum;

/// A linearised recording.
#[derive(Debug, Clone)]
pub(crate) struct LinearisedRecording {
    /// Deviations from the simulated trajectory.
    pub(crate) deviations: Deviations,
    /// Measured minus simulated, n_w per sample.
    pub(crate) residuals: Vec<f64>,
    /// Time from which readings count, s.
    pub(crate) counts_from: f64,
    /// Start values of the differential unknowns, SI.
    pub(crate) start: Vec<(usize, f64)>,
    /// The trajectory, if it is that of a filter.
    pub(crate) followed: Option<Solution>,
}

/// Linearised recordings, and the free parameters shared by all of them.
pub(crate) struct LinearisedRecordings<'a> {
    pub(crate) train: &'a [LinearisedRecording],
    pub(crate) valid: &'a [LinearisedRecording],
    pub(crate) noise: &'a [Option<SensorNoise>],
    /// Places of the free parameters, each with the size of its prior error.
    pub(crate) free: &'a [(usize, f64)],
}

/// The fit of a place.
#[derive(Debug, Clone)]
pub(crate) struct PlaceFit {
    pub(crate) walk: InputWalk,
    /// q.
    pub(crate) intensity: f64,
    /// Changes of the free parameters fitted with it, relative to their sizes.
    pub(crate) changes: Vec<f64>,
    /// The likelihood of the recordings.
    pub(crate) likelihood: ReadingLikelihood,
}

/// Log-likelihoods of readings.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReadingLikelihood {
    /// Of training readings, minus ½ ln N of their number N for each state of the walk.
    pub(crate) train: f64,
    /// Of validation readings, each predicted from those before it; `None` if there are none.
    pub(crate) valid: Option<f64>,
}

impl ReadingLikelihood {
    /// Its gain over another, on validation data if there is any.
    pub(crate) fn gain_over(self, other: ReadingLikelihood) -> f64 {
        match (self.valid, other.valid) {
            (Some(own), Some(other)) => own - other,
            _ => self.train - other.train,
        }
    }
}

/// A place's chain in one recording, and the columns of the free parameters.
struct PlaceChain {
    chain: DeviationChain,
    columns: Vec<Vec<f64>>,
}

/// Normal equations summed over recordings.
struct PlaceEquations {
    matrix: DMatrix<f64>,
    vector: DVector<f64>,
    square: f64,
    log_determinant: f64,
}

impl LinearisedRecordings<'_> {
    fn seen(
        &self,
        sight: &LinearisedRecording,
        place: usize,
        walk: InputWalk,
        columns: &[Vec<f64>],
    ) -> PlaceChain {
        let chain =
            DeviationChain::new(&sight.deviations, place, walk, &sight.residuals, self.noise);
        PlaceChain { chain, columns: columns.to_vec() }
    }

    /// Columns of the free parameters in each of some recordings, in units of their sizes.
    pub(crate) fn columns(&self, sights: &[LinearisedRecording]) -> Vec<Vec<Vec<f64>>> {
        let of_sight = |sight: &LinearisedRecording| {
            let of_parameter = |&(place, size): &(usize, f64)| {
                let chain = DeviationChain::new(
                    &sight.deviations,
                    place,
                    InputWalk::Random,
                    &sight.residuals,
                    self.noise,
                );
                let response = chain.response(&vec![size; sight.deviations.times.len()]);
                response.into_iter().map(|x| if x.is_finite() { x } else { 0.0 }).collect()
            };
            self.free.iter().map(of_parameter).collect()
        };
        sights.iter().map(of_sight).collect()
    }

    /// Fits a place; `None` if no measured output depends on it.
    pub(crate) fn fit(&self, place: usize, columns: &ParameterColumns) -> Option<PlaceFit> {
        let price = 0.5 * (self.readings().max(2) as f64).ln();
        let mut best: Option<PlaceFit> = None;
        for walk in InputWalk::ALL {
            let chains = self.seen_in_training(place, walk, columns);
            let information: f64 =
                chains.iter().map(|seen| seen.chain.information_on_a_constant()).sum();
            let duration = chains.iter().map(|seen| seen.chain.duration()).fold(0.0, f64::max);
            if !(information > 0.0 && information.is_finite() && duration > 0.0) {
                return None;
            }
            let unit = scale(walk, duration) / information.sqrt();
            let intensity = |decades: f64| (unit * 10f64.powf(decades)).powi(2) / duration;
            let likelihood =
                |q: f64| normal(&chains, q).map_or(f64::NEG_INFINITY, |n| n.likelihood());
            let (decades, largest) = maximum(|decades| likelihood(intensity(decades)));
            let numbers = if walk == InputWalk::Integrated { 2.0 } else { 1.0 };
            let train = largest - numbers * price;
            if train.is_finite() && best.as_ref().is_none_or(|best| train > best.likelihood.train) {
                let intensity = intensity(decades);
                let changes = normal(&chains, intensity)?.solution()?;
                let likelihood = ReadingLikelihood { train, valid: None };
                best = Some(PlaceFit { walk, intensity, changes, likelihood });
            }
        }
        let mut best = best?;
        best.likelihood.valid = self.of_validation(place, &best, columns);
        Some(best)
    }

    /// The fit with nothing missing; `place` is arbitrary.
    pub(crate) fn nothing(&self, place: usize, columns: &ParameterColumns) -> Option<PlaceFit> {
        let walk = InputWalk::Random;
        let chains = self.seen_in_training(place, walk, columns);
        let normal = normal(&chains, 0.0)?;
        let likelihood = ReadingLikelihood { train: normal.likelihood(), valid: None };
        let changes = normal.solution()?;
        let mut nothing = PlaceFit { walk, intensity: 0.0, changes, likelihood };
        nothing.likelihood.valid = self.of_validation(place, &nothing, columns);
        Some(nothing)
    }

    fn seen_in_training(
        &self,
        place: usize,
        walk: InputWalk,
        columns: &ParameterColumns,
    ) -> Vec<PlaceChain> {
        let pairs = self.train.iter().zip(&columns.train);
        pairs.map(|(sight, columns)| self.seen(sight, place, walk, columns)).collect()
    }

    fn readings(&self) -> usize {
        let of_sight =
            |sight: &LinearisedRecording| sight.residuals.iter().filter(|r| r.is_finite()).count();
        self.train.iter().map(of_sight).sum()
    }

    fn of_validation(
        &self,
        place: usize,
        fit: &PlaceFit,
        columns: &ParameterColumns,
    ) -> Option<f64> {
        if self.valid.is_empty() {
            return None;
        }
        let of_sight = |(sight, columns): (&LinearisedRecording, &Vec<Vec<f64>>)| {
            let chain = self.seen(sight, place, fit.walk, columns);
            chain.log_density(fit.intensity, &fit.changes, sight.counts_from)
        };
        let sum: f64 = self.valid.iter().zip(&columns.valid).map(of_sight).sum();
        Some(if sum.is_finite() { sum } else { f64::NEG_INFINITY })
    }

    /// The smoothed missing input at the place in a recording, with the changed parameters.
    pub(crate) fn smoothed(
        &self,
        sight: &LinearisedRecording,
        place: usize,
        fit: &PlaceFit,
        columns: &[Vec<f64>],
    ) -> ChainSmoothed {
        let PlaceChain { chain, columns } = self.seen(sight, place, fit.walk, columns);
        let mut residuals = sight.residuals.clone();
        let n_w = sight.deviations.n_outputs;
        for (m, measurement) in chain.measurements.iter().enumerate() {
            let change: f64 = columns.iter().zip(&fit.changes).map(|(c, b)| c[m] * b).sum();
            residuals[measurement.sample * n_w + measurement.output] -= change;
        }
        DeviationChain::new(&sight.deviations, place, fit.walk, &residuals, self.noise)
            .smooth(fit.intensity)
    }
}

/// Columns of the free parameters in training and in validation recordings.
pub(crate) struct ParameterColumns {
    pub(crate) train: Vec<Vec<Vec<f64>>>,
    pub(crate) valid: Vec<Vec<Vec<f64>>>,
}

/// The scale of a walk's last state relative to a constant that is just detectable: for an integrated walk this state
/// is the slope.
fn scale(walk: InputWalk, duration: f64) -> f64 {
    match walk {
        InputWalk::White | InputWalk::Random => 1.0,
        InputWalk::Integrated => 1.0 / duration,
    }
}

/// The normal equations of all recordings at one intensity.
fn normal(all: &[PlaceChain], intensity: f64) -> Option<PlaceEquations> {
    let n = all.first()?.columns.len();
    let mut sum = PlaceEquations {
        matrix: DMatrix::identity(n, n),
        vector: DVector::zeros(n),
        square: 0.0,
        log_determinant: 0.0,
    };
    for PlaceChain { chain, columns } in all {
        let whitened = chain.whitened(intensity, columns);
        sum.log_determinant += whitened.log_determinant;
        sum.square += whitened.residuals.iter().map(|x| x * x).sum::<f64>();
        for (i, a) in whitened.columns.iter().enumerate() {
            sum.vector[i] += product(a, &whitened.residuals);
            for (j, b) in whitened.columns[..=i].iter().enumerate() {
                let entry = product(a, b);
                sum.matrix[(i, j)] += entry;
                if i != j {
                    sum.matrix[(j, i)] += entry;
                }
            }
        }
    }
    let is_finite = sum.square.is_finite() && sum.matrix.iter().all(|x| x.is_finite());
    is_finite.then_some(sum)
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl PlaceEquations {
    /// Changes of the parameters, in units of their sizes.
    fn solution(&self) -> Option<Vec<f64>> {
        let factor = self.matrix.clone().cholesky()?;
        Some(factor.solve(&self.vector).iter().copied().collect())
    }

    /// ln p(r | q), with the changes of the parameters integrated out.
    fn likelihood(&self) -> f64 {
        let Some(factor) = self.matrix.clone().cholesky() else { return f64::NEG_INFINITY };
        let explained = self.vector.dot(&factor.solve(&self.vector));
        let of_matrix: f64 = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
        -0.5 * (self.square - explained + self.log_determinant) - of_matrix
    }
}

impl PlaceChain {
    /// ln p of readings from a given time on, each predicted from those before it.
    fn log_density(&self, intensity: f64, changes: &[f64], from: f64) -> f64 {
        let whitened = self.chain.whitened(intensity, &self.columns);
        let counts = |m: &usize| self.chain.time_of(*m) >= from;
        let left = |m: usize| {
            let change: f64 = whitened.columns.iter().zip(changes).map(|(c, b)| c[m] * b).sum();
            whitened.residuals[m] - change
        };
        let those = (0..whitened.residuals.len()).filter(counts);
        those.map(|m| -0.5 * (left(m).powi(2) + whitened.log_variances[m])).sum()
    }
}
