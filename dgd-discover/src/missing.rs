//! What each equation and each sensor of the base model would have needed.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::Model;
use dgd_execute::Engine;
use dgd_runtime::{Problem, System, simulate};

use crate::deviations::Deviations;
use crate::discovery::MissingInput;
use crate::fitted::{Data, Fitted};
use crate::missing_terms::{MissingTerms, PlaceKind};
use crate::unknown_input::unknown_input;

/// Unknown inputs of all places in the first training recording, the most likely first.
pub(crate) fn missing_inputs(
    model: &Model,
    engine: Engine,
    fitted: &Fitted,
    data: &Data<'_>,
) -> Vec<MissingInput> {
    let Ok(terms) = MissingTerms::new(model, engine, &mut Diagnostics::default()) else {
        return Vec::new();
    };
    let recording = &data.train[0];
    let system = &fitted.structure.system;
    let start = fitted.values.starts(system, 0);
    let problem = Problem { system, p: &fitted.p, inputs: &recording.inputs, start: &start };
    let Ok(solution) = simulate(&problem, &recording.times, &data.options) else {
        return Vec::new();
    };
    let Ok(deviations) = Deviations::along(&terms, &fitted.p, &recording.inputs, &solution) else {
        return Vec::new();
    };
    let outputs = &fitted.residuals(data)[0];
    let n_w = system.signature().outputs.len();
    let samples = recording.times.len();
    let residuals: Vec<f64> = (0..samples * n_w).map(|at| outputs[at % n_w][at / n_w]).collect();
    let places = terms.places().iter().enumerate();
    let mut all: Vec<MissingInput> = places
        .filter_map(|(i, place)| {
            let found = unknown_input(&deviations, i, &residuals, &data.noise)?;
            let equation = match place.kind {
                PlaceKind::Equation => place.name.clone(),
                PlaceKind::Output => format!("sensor {}", place.name),
            };
            Some(MissingInput {
                equation,
                unit: place.unit.clone(),
                times: found.times,
                value: found.estimate,
                std: found.std,
                windows: found.windows,
                gain: found.gain,
            })
        })
        .collect();
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all
}
