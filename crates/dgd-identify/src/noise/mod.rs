//! The standard deviation of each output's noise: the weight of its samples.
//!
//! | file | contents |
//! |---|---|
//! | `loss` | loss functions, some of them robust |
//! | `density` | the likelihood of readings with a computed distribution |
//! | `shape` | growth of σ with the output, and the scale in which it is uniform |

pub(crate) mod density;
pub(crate) mod loss;
pub(crate) mod shape;

use dgd_runtime::signature::{Density, Distribution};

use crate::noise::density::PredictedReading;
use crate::noise::shape::NoiseShape;
use crate::recording::{OutputSums, Recording};

/// The source of an output's weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoiseSource {
    /// A known standard deviation, SI.
    Known(f64),
    /// Estimated from the residuals of the fit, which is repeated with new weights until they are stable.
    Estimated,
    /// Computed by an extra output of the model; its parameters take part in the fit.
    Density(Density),
    /// Each sample has its own, from [`Recording::deviations`].
    Recorded,
    /// Computed by the model, with readings and outputs in a scale in which it is uniform: the first stage of a search.
    Stabilised(Density, NoiseShape),
}

/// A reading, compared with its own standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JudgedReading {
    /// Measured less simulated over σ; logarithms for log-normal noise.
    pub residual: f64,
    /// Its distribution if the model is right.
    pub distribution: Distribution,
    /// −2 ln of its density, SI.
    pub deviance: f64,
}

impl NoiseSource {
    /// Whether samples have individual standard deviations, and contribute by their likelihood.
    pub fn is_likelihood(self) -> bool {
        match self {
            Self::Known(_) | Self::Estimated => false,
            Self::Density(_) | Self::Recorded | Self::Stabilised(..) => true,
        }
    }

    /// Sample k of an output, given the outputs `w` of the model; `None` if all samples of the output have one σ.
    pub fn judge(
        self,
        recording: &Recording,
        output: usize,
        k: usize,
        w: &[f64],
    ) -> Option<JudgedReading> {
        let (sigma, distribution) = match self {
            Self::Known(_) | Self::Estimated | Self::Stabilised(..) => return None,
            Self::Density(density) => (w[density.deviation], density.distribution),
            Self::Recorded => (recording.deviations_of(output)?[k], Distribution::Normal),
        };
        let measured = recording.measured[output].as_ref()?[k];
        let reading = PredictedReading { measured, simulated: w[output], sigma };
        let term = reading.term(distribution);
        let deviance = term.cost + term.logarithm;
        Some(JudgedReading { residual: -reading.residual(distribution), distribution, deviance })
    }
}

/// Minimum number of samples of an output to estimate its noise.
const LEAST_SAMPLES: usize = 10;
/// Minimum number of samples of all outputs for each estimate.
const FOR_EACH_ESTIMATE: usize = 2;

/// Whether `samples` of an output, out of `all`, are too few to estimate its noise in addition to `estimates` other
/// quantities: the residuals are then far smaller than the noise.
pub fn too_few_for_noise(samples: usize, all: usize, estimates: usize) -> bool {
    samples < LEAST_SAMPLES || all < FOR_EACH_ESTIMATE * estimates
}

/// A first guess of an output's noise from its scatter, σ² = Σ (wₖ₊₁ − wₖ)² / 2 (n − 1), which is insensitive to slow
/// changes.
///
/// Rice, Bandwidth choice for nonparametric regression, Ann. Stat. 12 (1984) 1215, (2.5).
pub(crate) fn scatter(recordings: &[Recording], output: usize) -> Option<f64> {
    let (mut squares, mut differences) = (0.0, 0_u32);
    for recording in recordings {
        let samples: Vec<(usize, f64)> = recording.counted(output).collect();
        for pair in samples.windows(2) {
            squares += (pair[1].1 - pair[0].1).powi(2);
            differences += 1;
        }
    }
    (differences > 0).then(|| (squares / (2.0 * f64::from(differences))).sqrt())
}

/// The smallest significant noise: the error of a simulation with tolerance `rtol`.
pub(crate) fn least(recordings: &[Recording], output: usize, rtol: f64, unit: f64) -> f64 {
    let samples = || recordings.iter().flat_map(|recording| recording.counted(output));
    let largest = samples().map(|(_, value)| value.abs()).fold(0.0, f64::max);
    rtol * if largest > 0.0 { largest } else { unit.abs() }
}

/// σ = √(Σ e² / n) · √(n_all / (n_all − n_free)): outputs lose degrees of freedom in proportion to their samples.
pub(crate) fn of_residuals(sums: &[Vec<OutputSums>], output: usize, spread: f64) -> Option<f64> {
    let (mut squares, mut samples) = (0.0, 0);
    for of_recording in sums {
        squares += of_recording[output].squares;
        samples += of_recording[output].samples;
    }
    (samples > 0).then(|| (squares / samples as f64).sqrt() * spread)
}
