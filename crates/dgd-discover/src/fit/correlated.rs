//! Standard deviations of estimates under correlated measurement noise.
//!
//! A fit weights all samples equally, whatever their correlation. With J the sensitivities of the readings to the
//! estimates, W = diag(1/σ²) the weights, σ² the total noise variance of a reading, and R the covariance of the noise,
//!
//! ```text
//!   θ̂ − θ = N⁻¹ JᵀW e,   N = JᵀWJ,   Cov θ̂ = N⁻¹ (JᵀW R WJ) N⁻¹,   R_kl = σ_w² δ_kl + c² e^(−|t_k − t_l|/T)
//! ```
//!
//! which is N⁻¹ for white noise. Products with R take one pass forwards and one backwards in time.
//!
//! Source: Seber, Wild, Nonlinear Regression (1989), §6.2.

use dgd_identify::{ParameterEstimate, Recording, outputs_with_sensitivities};
use dgd_runtime::Direction;
use dgd_runtime::System;
use nalgebra::{DMatrix, SymmetricEigen};

use super::data::SearchData;
use super::fitted::FittedStructure;
use dgd_screen::noise::SensorNoise;

impl FittedStructure {
    /// Updates the standard deviations of the estimates to the current noise, including its correlation. Those of fits
    /// are correct only for white noise.
    pub(crate) fn know_correlations(&mut self, data: &SearchData<'_>) {
        if data.noise.iter().flatten().all(|noise| noise.colour.is_none()) {
            return;
        }
        let Some(covariance) = self.covariance(data) else { return };
        let places = self.fitted_directions();
        for (place, variance) in places.into_iter().zip(&covariance.diagonal()) {
            let std = &mut self.estimates[place].std;
            *std = std.filter(|_| variance.is_finite()).map(|_| variance.sqrt());
        }
    }

    /// Positions of fitted estimates that are not at a bound.
    pub(crate) fn fitted_directions(&self) -> Vec<usize> {
        let is_moment = |of: &Direction| match of {
            Direction::Parameter(i) => self.moments.contains(i),
            Direction::Start(_) => false,
        };
        let is_fitted = |e: &ParameterEstimate| e.at_bound.is_none() && !is_moment(&e.of);
        (0..self.estimates.len()).filter(|place| is_fitted(&self.estimates[*place])).collect()
    }

    /// Covariance of [`Self::fitted_directions`]; `None` if the sensitivities are not available.
    pub(crate) fn covariance(&self, data: &SearchData<'_>) -> Option<DMatrix<f64>> {
        let fitted = self.fitted_directions();
        let n = fitted.len();
        let system = &self.structure.system;
        let directions = &system.signature().directions;
        let (mut information, mut scores) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        for (r, recording) in data.train.iter().enumerate() {
            let start = self.values.starts(system, r);
            let observations = outputs_with_sensitivities(
                system.as_model(),
                recording,
                &self.p,
                &start,
                &data.options_for(system),
            )
            .ok()?;
            // The estimates of this recording, and their directions.
            let active: Vec<(usize, usize)> = fitted
                .iter()
                .enumerate()
                .filter(|(_, e)| self.estimates[**e].recording.is_none_or(|other| other == r))
                .filter_map(|(i, e)| {
                    let fitted_direction: &Direction = &self.estimates[*e].of;
                    Some((
                        i,
                        directions.iter().position(|direction| direction == fitted_direction)?,
                    ))
                })
                .collect();
            for (output, noise) in data.noise.iter().enumerate() {
                let (Some(noise), Some(measured)) = (noise, &recording.measured[output]) else {
                    continue;
                };
                // A sample without a sensitivity carries no information.
                let derivative =
                    |k: usize, j: usize| observations.dw(k)[j * observations.n_w + output];
                let samples: Vec<usize> = (0..measured.len())
                    .filter(|k| measured[*k].is_finite())
                    .filter(|k| active.iter().all(|(_, j)| derivative(*k, *j).is_finite()))
                    .collect();
                // WJ, and R WJ
                let weight = noise.total().powi(-2);
                let weighted = DMatrix::from_fn(samples.len(), active.len(), |k, i| {
                    weight * derivative(samples[k], active[i].1)
                });
                let correlated = with_covariance(&weighted, recording, &samples, noise);
                let own_information = weighted.tr_mul(&weighted) / weight;
                let own_scores = weighted.tr_mul(&correlated);
                for (a, (i, _)) in active.iter().enumerate() {
                    for (b, (j, _)) in active.iter().enumerate() {
                        information[(*i, *j)] += own_information[(a, b)];
                        scores[(*i, *j)] += own_scores[(a, b)];
                    }
                }
            }
        }
        let inverse = inverse(&information, data.options.rtol);
        Some(&inverse * scores * &inverse)
    }
}

/// The product of R and some columns over some samples of a recording.
pub(crate) fn with_covariance(
    columns: &DMatrix<f64>,
    recording: &Recording,
    samples: &[usize],
    noise: &SensorNoise,
) -> DMatrix<f64> {
    let mut product = columns * noise.std.powi(2);
    let Some(colour) = noise.colour else { return product };
    let phi: Vec<f64> = samples
        .windows(2)
        .map(|pair| {
            let [before, after] = [pair[0], pair[1]].map(|k| recording.times[k]);
            ((before - after) / colour.memory).exp()
        })
        .collect();
    let variance = colour.std.powi(2);
    for (column, mut product) in columns.column_iter().zip(product.column_iter_mut()) {
        let mut forth = 0.0;
        for k in 0..samples.len() {
            forth = column[k] + if k > 0 { phi[k - 1] * forth } else { 0.0 };
            product[k] += variance * forth;
        }
        let mut back = 0.0;
        for k in (1..samples.len()).rev() {
            back = phi[k - 1] * (column[k] + back);
            product[k - 1] += variance * back;
        }
    }
    product
}

/// N⁻¹ restricted to the combinations of estimates that readings determine to this relative tolerance. Poorly
/// determined ones fade out, so that rounding does not decide whether they count.
pub(crate) fn inverse(information: &DMatrix<f64>, rtol: f64) -> DMatrix<f64> {
    let n = information.nrows();
    // If all start values are fixed, the matrix is empty and has no eigenvalues.
    if n == 0 {
        return information.clone();
    }
    let size = information.diagonal().map(f64::sqrt);
    let scaled = DMatrix::from_fn(n, n, |i, j| {
        let scale = size[i] * size[j];
        if scale > 0.0 { information[(i, j)] / scale } else { 0.0 }
    });
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(scaled);
    let least = (10.0 * rtol).powi(2).max(1e-13) * eigenvalues.max();
    let inverted = eigenvalues.map(|value| value / (value * value + least * least));
    let inverse = &eigenvectors * DMatrix::from_diagonal(&inverted) * eigenvectors.transpose();
    DMatrix::from_fn(n, n, |i, j| {
        let scale = size[i] * size[j];
        if scale > 0.0 { inverse[(i, j)] / scale } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use dgd_runtime::Inputs;
    use dgd_screen::noise::NoiseColour;

    #[test]
    fn products_with_the_covariance_are_those_of_its_matrix() {
        let times: Vec<f64> = (0..40).map(|k| f64::from(k) + 0.3 * f64::from(k % 3)).collect();
        let samples: Vec<usize> = (0..40).filter(|k| k % 7 != 3).collect();
        let colour = Some(NoiseColour { std: 1.5, memory: 6.0 });
        let noise = SensorNoise { colour, ..SensorNoise::known(0.5) };
        let columns =
            DMatrix::from_fn(samples.len(), 2, |k, i| ((k + 1) as f64 * 0.3).sin() + i as f64);
        let r = DMatrix::from_fn(samples.len(), samples.len(), |k, l| {
            let apart = (times[samples[k]] - times[samples[l]]).abs();
            2.25 * (-apart / 6.0).exp() + if k == l { 0.25 } else { 0.0 }
        });
        let recording = Recording::new(times, Inputs::none(), Vec::new());
        let product = with_covariance(&columns, &recording, &samples, &noise);
        assert!((product - r * columns).amax() < 1e-12);
    }

    #[test]
    fn nothing_is_the_inverse_of_nothing() {
        assert_eq!(inverse(&DMatrix::zeros(0, 0), 1e-4), DMatrix::zeros(0, 0));
        let of_one = inverse(&DMatrix::from_element(1, 1, 4.0), 1e-4)[(0, 0)];
        assert!((of_one - 0.25).abs() < 1e-10, "{of_one}");
    }
}
