//! Recordings with their simulations, in the units of the model.

use std::path::PathBuf;

use dgd_identify::{OutputErrorEvaluation, Recording};
use dgd_runtime::{LimitSide, Observations, Signature, Unit};

use crate::fit::report::standard::StandardisedResidual;
use crate::output::columns::in_unit;
use crate::run::recording;

/// One recording.
pub(crate) struct PageTrace {
    /// Its name.
    pub name: String,
    /// Whether it is a validation recording.
    pub is_valid: bool,
    /// Sample times, s.
    pub times: Vec<f64>,
    /// By input.
    pub inputs: Vec<Vec<f64>>,
    /// By output; `None` if it was not measured.
    pub measured: Vec<Option<Vec<f64>>>,
    /// By output.
    pub simulated: Vec<Vec<f64>>,
    /// By output: measured − simulated for samples that count, NaN elsewhere.
    pub residuals: Vec<Option<Vec<f64>>>,
    /// By output: the residuals over their standard deviations; over their root mean square in training if those are
    /// unknown.
    pub standard: Vec<Option<Vec<f64>>>,
    /// By output: the same with the weights of the fit's loss, for tests.
    pub tested: Vec<Option<Vec<f64>>>,
    /// By output: −2 ln of the density of each reading, SI, if readings have standard deviations of their own.
    pub deviances: Vec<Option<Vec<f64>>>,
    /// By output: whether its noise is known.
    pub is_scaled: Vec<bool>,
}

/// Training and validation recordings, each with its evaluation if there is one. `standardised` gives the residual of a
/// sample of an output for given model outputs, if the noise of that output is known.
pub(crate) fn traces(
    signature: &Signature,
    paths: [&[PathBuf]; 2],
    of: [Option<(&[Recording], &OutputErrorEvaluation)>; 2],
    standardised: impl Fn(&Recording, usize, usize, &[f64]) -> Option<StandardisedResidual>,
) -> Vec<PageTrace> {
    let names = recording::names(&paths.concat());
    let (train, valid) = names.split_at(paths[0].len());
    let mut traces = Vec::new();
    for (set, (names, is_valid)) in of.into_iter().zip([(train, false), (valid, true)]) {
        let Some((recordings, evaluation)) = set else { continue };
        for ((name, recording), observations) in
            names.iter().zip(recordings).zip(&evaluation.observations)
        {
            traces.push(trace(signature, name, is_valid, recording, observations, &standardised));
        }
    }
    scale_by_their_size(&mut traces, signature.outputs.len());
    traces
}

fn trace(
    signature: &Signature,
    name: &str,
    is_valid: bool,
    recording: &Recording,
    observations: &Observations,
    standardised: &impl Fn(&Recording, usize, usize, &[f64]) -> Option<StandardisedResidual>,
) -> PageTrace {
    let samples = || 0..recording.times.len();
    let units = || signature.outputs.iter().map(|output| &output.unit);
    let simulated = |(i, unit): (usize, &Unit)| {
        let values: Vec<f64> = samples().map(|k| observations.w(k)[i]).collect();
        in_unit(&values, unit)
    };
    let simulated: Vec<Vec<f64>> = units().enumerate().map(simulated).collect();
    let measured: Vec<Option<Vec<f64>>> = units()
        .zip(&recording.measured)
        .map(|(unit, samples)| Some(in_unit(samples.as_ref()?, unit)))
        .collect();
    let counts = |k: usize| recording.times[k] >= recording.counts_from;
    let residual = |(measured, simulated): (&Option<Vec<f64>>, &Vec<f64>)| {
        let pairs = measured.as_ref()?.iter().zip(simulated).enumerate();
        Some(pairs.map(|(k, (y, w))| if counts(k) { y - w } else { f64::NAN }).collect())
    };
    let residuals: Vec<Option<Vec<f64>>> = measured.iter().zip(&simulated).map(residual).collect();
    // By output, for each sample.
    let judged = |i: usize| -> Option<Vec<StandardisedResidual>> {
        let judge = |k: usize| {
            let judged_sample = standardised(recording, i, k, observations.w(k))?;
            let is_counted = counts(k) && judged_sample.residual.is_finite();
            Some(if is_counted {
                judged_sample
            } else {
                StandardisedResidual::missing(judged_sample.deviance.is_some())
            })
        };
        recording.measured[i].as_ref()?;
        samples().map(judge).collect()
    };
    let judged: Vec<Option<Vec<StandardisedResidual>>> = (0..measured.len()).map(judged).collect();
    let part = |of: fn(&StandardisedResidual) -> f64| -> Vec<Option<Vec<f64>>> {
        let of_output = |(judged, raw): (&Option<Vec<StandardisedResidual>>, &Option<Vec<f64>>)| {
            let raw = raw.as_ref()?;
            Some(judged.as_ref().map_or_else(|| raw.clone(), |all| all.iter().map(of).collect()))
        };
        judged.iter().zip(&residuals).map(of_output).collect()
    };
    let deviances = |all: &Option<Vec<StandardisedResidual>>| -> Option<Vec<f64>> {
        all.as_ref()?.iter().map(|one| one.deviance).collect()
    };
    PageTrace {
        standard: part(|one| one.residual),
        tested: part(|one| one.tested),
        deviances: judged.iter().map(deviances).collect(),
        is_scaled: judged.iter().map(Option::is_some).collect(),
        name: name.to_owned(),
        is_valid,
        inputs: inputs(signature, recording),
        residuals,
        times: recording.times.clone(),
        measured,
        simulated,
    }
}

/// Divides residuals of unknown noise by their root mean square, that of training if there is one.
fn scale_by_their_size(traces: &mut [PageTrace], outputs: usize) {
    for i in 0..outputs {
        let size = |is_valid: bool| {
            let of_set = traces.iter().filter(|trace| trace.is_valid == is_valid);
            let residuals = of_set.filter_map(|trace| trace.residuals[i].as_ref()).flatten();
            let residuals: Vec<f64> = residuals.copied().filter(|e| e.is_finite()).collect();
            let mean = residuals.iter().map(|e| e * e).sum::<f64>() / residuals.len() as f64;
            Some(mean.sqrt()).filter(|size| *size > 0.0)
        };
        let Some(size) = size(false).or_else(|| size(true)) else { continue };
        for trace in traces.iter_mut().filter(|trace| !trace.is_scaled[i]) {
            let both = [&mut trace.standard[i], &mut trace.tested[i]];
            for e in both.into_iter().flatten().flatten() {
                *e /= size;
            }
        }
    }
}

/// All inputs at the sample times; at a jump, the values after it.
fn inputs(signature: &Signature, recording: &Recording) -> Vec<Vec<f64>> {
    let mut values = vec![Vec::with_capacity(recording.times.len()); signature.inputs.len()];
    let mut u = vec![0.0; recording.inputs.len()];
    for t in &recording.times {
        recording.inputs.value(*t, LimitSide::Right, &mut u);
        for ((values, value), input) in values.iter_mut().zip(&u).zip(signature.inputs.iter()) {
            values.push(input.unit.from_si(*value));
        }
    }
    values
}
