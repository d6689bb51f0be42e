//! Predicts how large validation errors are if nothing is missing.
//!
//! ```text
//!   e_later = v_later − Jₓ δx − Jₚ δp,     δx = F⁻¹ Jₓ'ᵀW (v' − Jₚ' δp)     ' : readings before `counts_from`
//!   Cov e_later ≈ R + G C Gᵀ + Jₓ S Jₓᵀ,   G = Jₚ − Jₓ H,   H = F⁻¹ Jₓ'ᵀW Jₚ',   F = Jₓ'ᵀW Jₓ'
//!   S = F⁻¹ (Jₓ'ᵀW R' W Jₓ') F⁻¹:          covariance of start values, with the noise's own correlation R'
//!   C:                                     that of the parameters, from the training recordings (`correlated`)
//! ```
//!
//! The mean square of n such errors has the mean tr Σ/n and the variance 2 tr Σ²/n², with Σ their covariance, and is
//! approximated by its mean times χ²_ν/ν, with ν = (tr Σ)²/tr Σ². The variance of the noise, with which it is compared,
//! is known only from the training errors, with ν' = (tr R)²/tr R² there. So their ratio divided by m = tr Σ/(n σ²)
//! follows an F distribution, and ln F is approximately normal with variance 2/ν + 2/ν'.
//!
//! In long recordings m is one, and ν and ν' are n reduced by the correlation of the noise. In short ones, parameters,
//! start values and the noise itself are not known well enough to predict down to the noise even if nothing is missing.
//!
//! Sources: Satterthwaite, Biometrics Bulletin 2 (1946) 110, for degrees of freedom; Fisher, Proc. Int. Congr. Math.
//! Toronto 2 (1924) 805, for the logarithm.

use dgd_identify::{Recording, outputs_with_sensitivities};
use dgd_runtime::{Direction, Observations, System};
use dgd_screen::distribution::normal_two_sided;
use dgd_screen::noise::SensorNoise;
use nalgebra::DMatrix;

use super::correlated::{inverse, with_covariance};
use super::data::SearchData;
use super::fitted::FittedStructure;
use super::residuals::chi_square;

/// Expected mean square of one output relative to the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExpectedError {
    mean: f64,
    /// Variance of the logarithm of the ratio.
    scatter: f64,
}

impl ExpectedError {
    /// Probability that a mean square is at least this large.
    fn tail(&self, mean_square: f64) -> f64 {
        let z = (mean_square / self.mean).ln() / self.scatter.sqrt();
        let beyond = 0.5 * normal_two_sided(z);
        if z > 0.0 { beyond } else { 1.0 - beyond }
    }
}

/// Sums over the readings of an output in all recordings.
#[derive(Debug, Clone)]
struct ReadingSums {
    readings: usize,
    /// tr Jₓ S Jₓᵀ, and the terms of tr Σ² other than tr (G C Gᵀ)² and 2 tr (G C Gᵀ R).
    of_starts: f64,
    squares: f64,
    /// GᵀG and GᵀRG.
    of_parameters: DMatrix<f64>,
    correlated: DMatrix<f64>,
}

impl FittedStructure {
    /// Probability of validation errors this large of each output if nothing is missing; `None` if not available.
    pub(crate) fn held_out_chances(
        &self,
        data: &SearchData<'_>,
        evaluations: usize,
    ) -> Option<Vec<f64>> {
        let foreseen = self.foreseen(data, evaluations)?;
        let squares = chi_square(&self.held_out_residuals(data)?, &data.noise);
        let chance = |((sum, n), foreseen): (&(f64, usize), &Option<ExpectedError>)| {
            foreseen.map_or(1.0, |foreseen| foreseen.tail(sum / *n as f64))
        };
        Some(squares.iter().zip(&foreseen).map(chance).collect())
    }

    /// Expected mean square of validation errors of each output relative to the noise, if nothing is missing: more than
    /// one where parameters and start values are not known well enough; `None` if not available. Computed once.
    pub(crate) fn foreseen_squares(
        &self,
        data: &SearchData<'_>,
        evaluations: usize,
    ) -> Option<&[f64]> {
        let computed = || {
            let foreseen = self.foreseen(data, evaluations)?;
            Some(foreseen.iter().map(|one| one.map_or(1.0, |one| one.mean.max(1.0))).collect())
        };
        self.foreseen.get_or_init(computed).as_deref()
    }

    /// The expectation for each output; `None` for outputs without a reading that counts.
    fn foreseen(
        &self,
        data: &SearchData<'_>,
        evaluations: usize,
    ) -> Option<Vec<Option<ExpectedError>>> {
        let system = &self.structure.system;
        let directions = &system.signature().directions;
        let place = |of: &Direction| directions.iter().position(|direction| direction == of);
        // Estimated parameters: their positions among the estimates and among the directions.
        let fitted = self.fitted_directions();
        let shared = fitted.iter().enumerate().filter_map(|(i, e)| {
            let estimate = &self.estimates[*e];
            let is_shared = estimate.recording.is_none();
            Some((i, place(&estimate.of).filter(|_| is_shared)?))
        });
        let (rows, parameters): (Vec<usize>, Vec<usize>) = shared.unzip();
        let covariance = self.covariance(data)?.select_rows(&rows).select_columns(&rows);
        let is_start = |j: &usize| matches!(directions[*j], Direction::Start(_));
        let starts: Vec<usize> = (0..directions.len()).filter(is_start).collect();
        let n_p = parameters.len();
        let nothing = ReadingSums {
            readings: 0,
            of_starts: 0.0,
            squares: 0.0,
            of_parameters: DMatrix::zeros(n_p, n_p),
            correlated: DMatrix::zeros(n_p, n_p),
        };
        let mut sums = vec![nothing; data.noise.len()];
        let held_out_starts = self.held_out_starts(data, evaluations)?;
        for ((recording, from), start) in
            data.valid.iter().zip(&data.counts_from).zip(&held_out_starts)
        {
            let observations = outputs_with_sensitivities(
                system.as_model(),
                recording,
                &self.p,
                start,
                &data.options_for(system),
            )
            .ok()?;
            let validation =
                ValidationRun { recording, observations: &observations, counts_from: *from };
            validation.add(data, &covariance, [&starts, &parameters], &mut sums);
        }
        let foreseen = |((output, sums), noise): ((usize, &ReadingSums), &Option<SensorNoise>)| {
            let noise = noise.as_ref().filter(|_| sums.readings > 0)?;
            let (n, variance) = (sums.readings as f64, noise.total().powi(2));
            let known = &covariance * &sums.of_parameters;
            let trace = n * variance + known.trace() + sums.of_starts;
            let crossed = (&covariance * &sums.correlated).trace();
            let squares = sums.squares + (&known * &known).trace() + 2.0 * crossed;
            let trained = data.train.iter().map(|recording| of_training(recording, output, noise));
            let (readings, of_noise) =
                trained.fold((0, 0.0), |(n, sum), (m, one)| (n + m, sum + one));
            let of_training = of_noise / (readings as f64 * variance).powi(2);
            let scatter = 2.0 * squares / (trace * trace) + 2.0 * of_training;
            Some(ExpectedError { mean: trace / (n * variance), scatter })
        };
        Some(sums.iter().enumerate().zip(&data.noise).map(foreseen).collect())
    }
}

/// A validation recording with the derivatives of its outputs.
struct ValidationRun<'a> {
    recording: &'a Recording,
    observations: &'a Observations,
    counts_from: f64,
}

impl ValidationRun<'_> {
    /// Readings of an output that have derivatives, before the recording counts or from then on.
    fn readings(&self, output: usize, columns: &[&[usize]], later: bool) -> Vec<usize> {
        let Some(measured) = &self.recording.measured[output] else { return Vec::new() };
        let is_known = |k: &usize| {
            let mut indices = columns.iter().flat_map(|columns| columns.iter());
            measured[*k].is_finite() && indices.all(|j| self.derivative(*k, *j, output).is_finite())
        };
        (0..measured.len())
            .filter(|k| (self.recording.times[*k] >= self.counts_from) == later)
            .filter(is_known)
            .collect()
    }

    fn derivative(&self, k: usize, direction: usize, output: usize) -> f64 {
        self.observations.dw(k)[direction * self.observations.n_w + output]
    }

    fn jacobian(&self, samples: &[usize], columns: &[usize], output: usize) -> DMatrix<f64> {
        DMatrix::from_fn(samples.len(), columns.len(), |k, i| {
            self.derivative(samples[k], columns[i], output)
        })
    }

    /// Adds the contributions of the recording's later readings to each output.
    fn add(
        &self,
        data: &SearchData<'_>,
        covariance: &DMatrix<f64>,
        columns: [&[usize]; 2],
        sums: &mut [ReadingSums],
    ) {
        let [starts, parameters] = columns;
        let (n_x, n_p) = (starts.len(), parameters.len());
        let mut information = DMatrix::zeros(n_x, n_x);
        let mut scores = DMatrix::zeros(n_x, n_x);
        let mut shared = DMatrix::zeros(n_x, n_p);
        for (output, noise) in data.noise.iter().enumerate() {
            let Some(noise) = noise else { continue };
            let samples = self.readings(output, &columns, false);
            let weight = noise.total().powi(-2);
            let of_starts = self.jacobian(&samples, starts, output) * weight;
            let of_parameters = self.jacobian(&samples, parameters, output);
            information += of_starts.tr_mul(&of_starts) / weight;
            scores +=
                of_starts.tr_mul(&with_covariance(&of_starts, self.recording, &samples, noise));
            shared += of_starts.tr_mul(&of_parameters);
        }
        let inverse = inverse(&information, data.options.rtol);
        let of_start = &inverse * scores * &inverse;
        let moved = inverse * shared;
        for ((output, noise), sums) in data.noise.iter().enumerate().zip(sums) {
            let Some(noise) = noise else { continue };
            let samples = self.readings(output, &columns, true);
            let of_starts = self.jacobian(&samples, starts, output);
            let of_parameters = self.jacobian(&samples, parameters, output) - &of_starts * &moved;
            let correlated = |columns| with_covariance(columns, self.recording, &samples, noise);
            let known = &of_start * of_starts.tr_mul(&of_starts);
            let both = of_parameters.tr_mul(&of_starts);
            sums.readings += samples.len();
            sums.of_starts += known.trace();
            sums.squares += of_noise(self.recording, &samples, noise)
                + (&known * &known).trace()
                + 2.0 * (&of_start * of_starts.tr_mul(&correlated(&of_starts))).trace()
                + 2.0 * (covariance * &both * &of_start * both.transpose()).trace();
            sums.of_parameters += of_parameters.tr_mul(&of_parameters);
            sums.correlated += of_parameters.tr_mul(&correlated(&of_parameters));
        }
    }
}

/// Number of readings of an output in a training recording, and tr R² over them.
fn of_training(recording: &Recording, output: usize, noise: &SensorNoise) -> (usize, f64) {
    let measured = recording.measured[output].iter().flatten().enumerate();
    let samples: Vec<usize> = measured.filter(|(_, y)| y.is_finite()).map(|(k, _)| k).collect();
    (samples.len(), of_noise(recording, &samples, noise))
}

/// tr R² over some samples.
fn of_noise(recording: &Recording, samples: &[usize], noise: &SensorNoise) -> f64 {
    let diagonal = noise.total().powi(4) * samples.len() as f64;
    let Some(colour) = noise.colour else { return diagonal };
    let (mut earlier, mut pairs, mut before) = (0.0, 0.0, None);
    for &k in samples {
        let t = recording.times[k];
        let fade = before.map_or(0.0, |before: f64| (2.0 * (before - t) / colour.memory).exp());
        earlier *= fade;
        pairs += earlier;
        earlier += 1.0;
        before = Some(t);
    }
    diagonal + 2.0 * colour.std.powi(4) * pairs
}
