//! Re-estimates a large missing input, linearised around the trajectory that includes it.
//!
//! A leak that empties a tank takes the plant far from the simulation without a leak, where a linearisation does not
//! describe the real trajectory. So the model is simulated with the estimate, and the estimate is repeated around that
//! trajectory, as in an iterated extended Kalman smoother:
//!
//! ```text
//!   y̅ = simulation with d̅;   r = measured − w(y̅) + (response of the linearised model to d̅)
//! ```
//!
//! d is again a random walk from zero, so that its prior is not used twice.
//!
//! Source: Bell, The iterated Kalman smoother as a Gauss–Newton method, SIAM J. Optim. 4 (1994)
//! 626–636.

use std::fmt;

use dgd_runtime::{
    InputError, Inputs, IntegrateError, LimitSide, Options, Problem, observe, simulate,
};

use super::deviations::{DeviationError, Deviations};
use super::kalman::{DeviationChain, InputWalk};
use super::missing_terms::MissingTerms;
use super::unknown_input::{UnknownInput, unknown_input};
use crate::library::with_further_inputs;
use dgd_screen::noise::SensorNoise;

/// A recording, with the model's parameters and start values.
///
/// | name | shape |
/// |---|---|
/// | `p` | all parameters |
/// | `start` | start values that replace the model's, by position of the unknown |
/// | `times` | samples, as for a simulation |
/// | `measured` | n_w per sample; not finite where not measured |
/// | `noise` | n_w; `None` for an output that is left out |
#[derive(Debug, Clone, Copy)]
pub struct ReconstructedRecording<'a> {
    /// Parameters, SI.
    pub p: &'a [f64],
    /// The model's own inputs.
    pub inputs: &'a Inputs,
    /// Start values, SI.
    pub start: &'a [(usize, f64)],
    /// Times of the samples, s.
    pub times: &'a [f64],
    /// Measured outputs, SI.
    pub measured: &'a [f64],
    /// Noise of each sensor, SI.
    pub noise: &'a [Option<SensorNoise>],
}

/// Why the model cannot follow an estimate.
#[derive(Debug, Clone, PartialEq)]
pub enum ReconstructError {
    /// The estimate is not a valid input.
    Inputs(InputError),
    /// The model has no solution with the estimate: keep the previous estimate.
    Integrate(Box<IntegrateError>),
    /// The solution has no derivatives.
    Linearize(DeviationError),
}

impl fmt::Display for ReconstructError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Inputs(error) => error.fmt(f),
            Self::Integrate(error) => error.fmt(f),
            Self::Linearize(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ReconstructError {}

/// Re-estimates the unknown input at a place, around the trajectory with `earlier` included. Once is usually enough;
/// call again with the result if it still changes.
///
/// [`UnknownInput::gain`] compares with no input in the new linearisation, so only gains of one linearisation are
/// comparable. `None` if no measured output depends on the place.
///
/// # Errors
///
/// [`ReconstructError`].
///
/// # Panics
///
/// If the recording or the estimate belong to another model.
pub fn reconstruct(
    model: &MissingTerms,
    recording: &ReconstructedRecording<'_>,
    place: usize,
    earlier: &UnknownInput,
    options: &Options,
) -> Result<Option<UnknownInput>, ReconstructError> {
    let ReconstructedRecording { p, start, times, measured, noise, .. } = *recording;
    assert!(place < model.places().len(), "a place of the model");
    assert_eq!(earlier.estimate.len(), times.len(), "an estimate for each sample");
    let inputs = inputs_with(model, recording, place, &earlier.estimate)
        .map_err(ReconstructError::Inputs)?;
    let problem = Problem { system: model.system(), p, inputs: &inputs, start };
    let trajectory = simulate(&problem, times, options)
        .map_err(|failure| ReconstructError::Integrate(Box::new(failure.error)))?;
    let simulated = observe(&problem, &trajectory).w;
    assert_eq!(measured.len(), simulated.len(), "measurements of all samples");
    let deviations = Deviations::linearize(model, p, &inputs, &trajectory)
        .map_err(ReconstructError::Linearize)?;

    let mut residuals: Vec<f64> = measured.iter().zip(&simulated).map(|(m, s)| m - s).collect();
    let chain = DeviationChain::new(&deviations, place, InputWalk::Random, &residuals, noise);
    chain.add_response(&earlier.estimate, &mut residuals, deviations.n_outputs);
    Ok(unknown_input(&deviations, place, &residuals, noise))
}

/// The model's inputs, with d at one place and zero at all others.
pub fn inputs_with(
    model: &MissingTerms,
    recording: &ReconstructedRecording<'_>,
    place: usize,
    d: &[f64],
) -> Result<Inputs, InputError> {
    inputs_with_all(model, recording.inputs, recording.times, &[(place, d)])
}

/// The model's inputs, with d at some places and zero at all others.
pub(crate) fn inputs_with_all(
    model: &MissingTerms,
    inputs: &Inputs,
    times: &[f64],
    given: &[(usize, &[f64])],
) -> Result<Inputs, InputError> {
    with_further_inputs(inputs, times, model.places().len(), |t, side, behind| {
        let begun = match side {
            LimitSide::Left => times.partition_point(|sample| *sample < t),
            LimitSide::Right => times.partition_point(|sample| *sample <= t),
        };
        for (place, d) in given {
            behind[*place] = d[begun.saturating_sub(1)];
        }
    })
}
