//! Over what levels the quantities of a model went in a recording.

use dgd_runtime::{Problem, System, simulate};

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
    for (output, measured) in signature.outputs.iter().zip(&recording.measured) {
        let measured = measured.iter().flatten().copied().filter(|value| value.is_finite());
        let (a, b) = within(&mut measured.into_iter());
        all.push((output.name.to_string(), output.unit.symbol.to_string(), a, b));
    }
    all
}
