//! Over what levels the quantities of a model go, for the grids of constants that are such levels.

use dgd_runtime::{Problem, System, simulate};

use crate::candidates::Candidate;
use crate::fitted::{Data, Fitted};

/// The least and the largest value of each unknown and of each output, with its unit.
pub(crate) type Ranges = Vec<(String, String, f64, f64)>;

/// Those along the fitted structure's run of the first training recording.
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

/// The range of what a template is applied to, where a constant of it without bounds is in its unit:
/// there it is a level of that.
pub(crate) fn range_of(
    candidate: &Candidate<'_>,
    unit: &str,
    ranges: &Ranges,
) -> Option<(f64, f64)> {
    let arguments = &candidate.application.arguments;
    let found = ranges.iter().find(|(name, symbol, a, b)| {
        symbol == unit && a < b && arguments.iter().any(|argument| argument.text == *name)
    });
    found.map(|(_, _, a, b)| (*a, *b))
}
