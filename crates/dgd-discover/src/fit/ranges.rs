//! Ranges of a model's quantities in a recording, and the strongest period of the residuals.

use std::f64::consts::TAU;

use dgd_runtime::{LimitSide, Problem, System, simulate};
use dgd_screen::usual_spacing;

use super::data::SearchData;
use super::fitted::FittedStructure;
use crate::library::QuantityRanges;

/// Minimum and maximum values in the first training recording: of measured outputs there, and of all other quantities
/// in the fitted structure's simulation of it.
pub(crate) fn ranges(fitted: &FittedStructure, data: &SearchData<'_>) -> QuantityRanges {
    let system = &fitted.structure.system;
    let signature = system.signature();
    let (p, start) = (&fitted.p, fitted.values.starts(system, 0));
    let recording = &data.train[0];
    let problem = Problem { system, p, inputs: &recording.inputs, start: &start };
    let within = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
    };
    let mut ranges = QuantityRanges::new();
    // Measurements are better known than the model's outputs, which may be far off.
    for (i, output) in signature.outputs.iter().enumerate() {
        let measured = data.scales.readings(i, recording);
        let measured = measured.iter().flatten().copied().filter(|value| value.is_finite());
        let (a, b) = within(&mut measured.into_iter());
        if a <= b {
            ranges.push((output.name.to_string(), output.unit.symbol.to_string(), a, b));
        }
    }
    if let Ok(solution) = simulate(&problem, &recording.times, &data.options_for(system)) {
        for (i, unknown) in signature.unknowns.iter().enumerate() {
            let (a, b) = within(&mut (0..solution.len()).map(|k| solution.y(k)[i]));
            ranges.push((unknown.name.to_string(), unknown.unit.symbol.to_string(), a, b));
        }
    }
    for (i, input) in signature.inputs.iter().enumerate() {
        let mut u = vec![0.0; signature.inputs.len()];
        let mut value_at = |t: f64| {
            recording.inputs.value(t, LimitSide::Right, &mut u);
            u[i]
        };
        let (a, b) = within(&mut recording.times.iter().map(|t| value_at(*t)));
        ranges.push((input.name.to_string(), input.unit.symbol.to_string(), a, b));
    }
    ranges
}

/// Minimum number of cycles in a recording for a period.
const FEWEST: f64 = 4.0;
/// Number of frequencies tried per resolvable frequency.
const FINER: f64 = 4.0;
/// Maximum number of frequencies tried.
const MOST: usize = 2000;

/// The strongest period, s, in the residuals of the first training recording, in units of the noise; `None` if the
/// recording is too short.
pub(crate) fn period(fitted: &FittedStructure, data: &SearchData<'_>) -> Option<f64> {
    let times = &data.train.first()?.times;
    let (first, last) = (*times.first()?, *times.last()?);
    let duration = last - first;
    let fastest = 0.5 / usual_spacing(times)?;
    let residuals = fitted.residuals(data);
    let outputs: Vec<(&[f64], f64)> = (residuals.first()?.iter().zip(&data.noise))
        .filter_map(|(residuals, noise)| Some((residuals.as_slice(), noise.as_ref()?.std)))
        .collect();
    let frequency = |k: usize| (FEWEST + k as f64 / FINER) / duration;
    // e^(iωt) of each sample, and the factor that advances it to the next frequency, so that sines are computed once
    // for all frequencies and outputs.
    let turned =
        |frequency: f64| times.iter().map(move |t| (TAU * frequency * (t - first)).sin_cos());
    let mut wave: Vec<(f64, f64)> = turned(frequency(0)).collect();
    let turns: Vec<(f64, f64)> = turned(1.0 / (FINER * duration)).collect();
    let mut best: Option<(f64, f64)> = None;
    for frequency in (0..MOST).map(frequency).take_while(|frequency| *frequency <= fastest) {
        let of_output = |(residuals, std): &(&[f64], f64)| {
            let read = wave.iter().zip(*residuals).filter(|(_, r)| r.is_finite());
            let [sine, cosine] = read.fold([0.0, 0.0], |sums, ((sine, cosine), r)| {
                [sums[0] + sine * r, sums[1] + cosine * r]
            });
            (sine * sine + cosine * cosine) / (std * std)
        };
        let power: f64 = outputs.iter().map(of_output).sum();
        if power.is_finite() && best.is_none_or(|(_, most)| power > most) {
            best = Some((frequency, power));
        }
        for ((sine, cosine), (s, c)) in wave.iter_mut().zip(&turns) {
            (*sine, *cosine) = (*sine * c + *cosine * s, *cosine * c - *sine * s);
        }
    }
    best.map(|(frequency, _)| 1.0 / frequency)
}
