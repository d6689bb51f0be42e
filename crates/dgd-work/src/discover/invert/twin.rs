//! The smoothed estimate of a missing term, as discoveries draw it.

use dgd_discover::{
    Deviations, MissingTerms, ReconstructedRecording as Readings, UnknownInput, reconstruct,
    unknown_input,
};
use dgd_identify::Recording;
use dgd_runtime::{Problem, observe, simulate};
use dgd_screen::noise::SensorNoise;

use crate::run::ModelRun;
use crate::session::TaskContext;

/// Relinearizations around the estimated trajectory, as in discoveries.
const ROUNDS: usize = 2;

/// The unknown input of the equation with which a simulation follows the readings, SI.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct TwinInput {
    /// Sample times, s.
    pub times: Vec<f64>,
    /// Value of the input.
    pub value: Vec<f64>,
    /// Its standard deviation.
    pub std: Vec<f64>,
    /// Gain in log-likelihood over no missing term, nats.
    pub gain: f64,
}

/// The estimate; without one, a remark gives the reason.
pub(super) fn estimate(
    terms: &MissingTerms,
    run: &ModelRun,
    recording: &Recording,
    noise: &[Option<f64>],
    session: TaskContext<'_>,
) -> Option<TwinInput> {
    match smoothed(terms, run, recording, noise) {
        Ok(found) => Some(found),
        Err(reason) => {
            session.remark(format!("the smoother gave no estimate to compare with: {reason}"));
            None
        }
    }
}

fn smoothed(
    terms: &MissingTerms,
    run: &ModelRun,
    recording: &Recording,
    noise: &[Option<f64>],
) -> Result<TwinInput, String> {
    // The smoother uses the second of two samples at one time.
    let times: Vec<f64> = recording
        .times
        .iter()
        .enumerate()
        .filter(|(k, t)| recording.times.get(k + 1) != Some(*t))
        .map(|(_, t)| *t)
        .collect();
    let rows: Vec<usize> =
        times.iter().map(|t| recording.times.partition_point(|own| own <= t) - 1).collect();
    let noise: Vec<Option<SensorNoise>> =
        noise.iter().map(|std| std.map(SensorNoise::known)).collect();
    let samples = |k: &usize| {
        recording
            .measured
            .iter()
            .map(|w| w.as_ref().map_or(f64::NAN, |w| w[*k]))
            .collect::<Vec<_>>()
    };
    let measured: Vec<f64> = rows.iter().flat_map(samples).collect();
    let problem =
        Problem { system: terms.system(), p: &run.p, inputs: &recording.inputs, start: &run.start };
    let trajectory =
        simulate(&problem, &times, &run.options).map_err(|failure| failure.error.to_string())?;
    let simulated = observe(&problem, &trajectory).w;
    let deviations = Deviations::linearize(terms, &run.p, &recording.inputs, &trajectory)
        .map_err(|error| error.to_string())?;
    let residuals: Vec<f64> = measured.iter().zip(&simulated).map(|(m, s)| m - s).collect();
    let unseen = || "no output that was measured sees what is missing".to_owned();
    let mut estimate = unknown_input(&deviations, 0, &residuals, &noise).ok_or_else(unseen)?;
    let readings = Readings {
        p: &run.p,
        inputs: &run.inputs,
        start: &run.start,
        times: &times,
        measured: &measured,
        noise: &noise,
    };
    for _ in 0..ROUNDS {
        // If the model cannot follow the new estimate, the previous one stays.
        let Ok(Some(again)) = reconstruct(terms, &readings, 0, &estimate, &run.options) else {
            break;
        };
        estimate = again;
    }
    let UnknownInput { times, estimate, std, gain, .. } = estimate;
    Ok(TwinInput { times, value: estimate, std, gain })
}
