//! Recordings with what was simulated of them, in the units of the model.

use std::path::PathBuf;

use dgd_identify::{Evaluation, Recording};
use dgd_runtime::{Side, Signature};

use crate::output::columns::in_unit;
use crate::run::recording;

/// One recording.
pub(crate) struct Trace {
    /// What it is called.
    pub name: String,
    /// Whether it is one of validation.
    pub is_valid: bool,
    /// Sample times, s.
    pub times: Vec<f64>,
    /// By input.
    pub inputs: Vec<Vec<f64>>,
    /// By output; nothing where it was not measured.
    pub measured: Vec<Option<Vec<f64>>>,
    /// By output.
    pub simulated: Vec<Vec<f64>>,
    /// By output: measured less simulated where samples count, NaN elsewhere.
    pub residuals: Vec<Option<Vec<f64>>>,
    /// By output: the residuals with the weights of the fit's loss, which tests are made of: outliers are not to hide
    /// what the other samples show.
    pub tested: Vec<Option<Vec<f64>>>,
}

/// Training and validation recordings, each with its evaluation if there is one; `weight` is that of a residual of an
/// output, SI.
pub(crate) fn traces(
    signature: &Signature,
    paths: [&[PathBuf]; 2],
    of: [Option<(&[Recording], &Evaluation)>; 2],
    weight: impl Fn(usize, f64) -> f64,
) -> Vec<Trace> {
    let names = recording::names(&paths.concat());
    let (train, valid) = names.split_at(paths[0].len());
    let mut traces = Vec::new();
    for (set, (names, is_valid)) in of.into_iter().zip([(train, false), (valid, true)]) {
        let Some((recordings, evaluation)) = set else { continue };
        for ((name, recording), observations) in
            names.iter().zip(recordings).zip(&evaluation.observations)
        {
            let simulated = |i: usize| -> Vec<f64> {
                (0..recording.times.len()).map(|k| observations.w(k)[i]).collect()
            };
            traces.push(trace(signature, name, is_valid, recording, simulated, &weight));
        }
    }
    traces
}

fn trace(
    signature: &Signature,
    name: &str,
    is_valid: bool,
    recording: &Recording,
    simulated: impl Fn(usize) -> Vec<f64>,
    weight: &impl Fn(usize, f64) -> f64,
) -> Trace {
    let units = || signature.outputs.iter().map(|output| &output.unit);
    let simulated: Vec<Vec<f64>> =
        units().enumerate().map(|(i, unit)| in_unit(&simulated(i), unit)).collect();
    let measured: Vec<Option<Vec<f64>>> = units()
        .zip(&recording.measured)
        .map(|(unit, samples)| Some(in_unit(samples.as_ref()?, unit)))
        .collect();
    let residual = |(measured, simulated): (&Option<Vec<f64>>, &Vec<f64>)| {
        let counts = recording.times.iter().map(|t| *t >= recording.counts_from);
        let pairs = measured.as_ref()?.iter().zip(simulated).zip(counts);
        Some(pairs.map(|((y, w), counts)| if counts { y - w } else { f64::NAN }).collect())
    };
    let residuals: Vec<Option<Vec<f64>>> = measured.iter().zip(&simulated).map(residual).collect();
    let tested = units().zip(&residuals).enumerate().map(|(i, (unit, residuals))| {
        let weighted = |e: &f64| if e.is_finite() { weight(i, e * unit.factor) * e } else { *e };
        Some(residuals.as_ref()?.iter().map(weighted).collect())
    });
    Trace {
        tested: tested.collect(),
        name: name.to_owned(),
        is_valid,
        inputs: inputs(signature, recording),
        residuals,
        times: recording.times.clone(),
        measured,
        simulated,
    }
}

/// All inputs at the sample times; of a jump what holds after it.
fn inputs(signature: &Signature, recording: &Recording) -> Vec<Vec<f64>> {
    let mut values = vec![Vec::with_capacity(recording.times.len()); signature.inputs.len()];
    let mut u = vec![0.0; recording.inputs.len()];
    for t in &recording.times {
        recording.inputs.value(*t, Side::Right, &mut u);
        for ((values, value), input) in values.iter_mut().zip(&u).zip(signature.inputs.iter()) {
            values.push(input.unit.from_si(*value));
        }
    }
    values
}
