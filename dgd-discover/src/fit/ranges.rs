//! Over what levels the quantities of a model went in a recording, and how often they come back.

use std::f64::consts::TAU;

use dgd_runtime::{Problem, Side, System, simulate};
use dgd_screen::usual_spacing;

use super::data::Data;
use super::fitted::Fitted;
use crate::library::Ranges;

/// The least and the largest values along the fitted structure's run of the first training recording.
pub(crate) fn ranges(fitted: &Fitted, data: &Data<'_>) -> Ranges {
    let system = &fitted.structure.system;
    let signature = system.signature();
    let (p, start) = (&fitted.p, fitted.values.starts(system, 0));
    let recording = &data.train[0];
    let problem = Problem { system, p, inputs: &recording.inputs, start: &start };
    let within = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
    };
    let mut all = Ranges::new();
    if let Ok(solution) = simulate(&problem, &recording.times, &data.options) {
        for (i, unknown) in signature.unknowns.iter().enumerate() {
            let (a, b) = within(&mut (0..solution.len()).map(|k| solution.y(k)[i]));
            all.push((unknown.name.to_string(), unknown.unit.symbol.to_string(), a, b));
        }
    }
    for (i, input) in signature.inputs.iter().enumerate() {
        let mut u = vec![0.0; signature.inputs.len()];
        let mut at = |t: f64| {
            recording.inputs.value(t, Side::Right, &mut u);
            u[i]
        };
        let (a, b) = within(&mut recording.times.iter().map(|t| at(*t)));
        all.push((input.name.to_string(), input.unit.symbol.to_string(), a, b));
    }
    for (output, measured) in signature.outputs.iter().zip(&recording.measured) {
        let measured = measured.iter().flatten().copied().filter(|value| value.is_finite());
        let (a, b) = within(&mut measured.into_iter());
        all.push((output.name.to_string(), output.unit.symbol.to_string(), a, b));
    }
    all
}

/// Fewest periods of a recording that make one.
const FEWEST: f64 = 4.0;
/// Frequencies that are tried for each that a recording resolves.
const FINER: f64 = 4.0;
/// Most frequencies that are tried.
const MOST: usize = 2000;

/// The period, s, that is strongest in what a fit leaves of the first training recording, in units of the noise; nothing
/// where that is too short.
pub(crate) fn period(fitted: &Fitted, data: &Data<'_>) -> Option<f64> {
    let times = &data.train.first()?.times;
    let (first, last) = (*times.first()?, *times.last()?);
    let duration = last - first;
    let fastest = 0.5 / usual_spacing(times)?;
    let residuals = fitted.residuals(data);
    let outputs: Vec<(&[f64], f64)> = (residuals.first()?.iter().zip(&data.noise))
        .filter_map(|(residuals, noise)| Some((residuals.as_slice(), noise.as_ref()?.std)))
        .collect();
    let step = 1.0 / (FINER * duration);
    let power = |frequency: f64| -> f64 {
        let of_output = |(residuals, std): &(&[f64], f64)| {
            let mut sums = [0.0; 2];
            for (t, r) in times.iter().zip(*residuals).filter(|(_, r)| r.is_finite()) {
                let (sine, cosine) = (TAU * frequency * (t - first)).sin_cos();
                sums[0] += sine * r;
                sums[1] += cosine * r;
            }
            (sums[0] * sums[0] + sums[1] * sums[1]) / (std * std)
        };
        outputs.iter().map(of_output).sum()
    };
    let mut best: Option<(f64, f64)> = None;
    for k in 0..MOST {
        let frequency = FEWEST / duration + k as f64 * step;
        if frequency > fastest {
            break;
        }
        let power = power(frequency);
        if power.is_finite() && best.is_none_or(|(_, most)| power > most) {
            best = Some((frequency, power));
        }
    }
    best.map(|(frequency, _)| 1.0 / frequency)
}
