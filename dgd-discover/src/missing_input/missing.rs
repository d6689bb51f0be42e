//! What each equation and each sensor of the base model would have needed.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::Model;
use dgd_execute::Engine;
use dgd_identify::Recording;
use dgd_runtime::{Problem, observe, simulate};

use super::deviations::Deviations;
use super::missing_terms::{MissingTerms, Place, PlaceKind};
use super::unknown_input::unknown_input;
use crate::fit::{Data, Fitted};
use crate::noise::Window;

/// What an equation would have needed on its right-hand side, in its own unit.
#[derive(Debug, Clone)]
pub struct MissingInput {
    /// The equation.
    pub equation: String,
    /// The unit of `value` and `std`.
    pub unit: String,
    /// Times, s.
    pub times: Vec<f64>,
    /// The smoothed estimate.
    pub value: Vec<f64>,
    /// Its standard deviation.
    pub std: Vec<f64>,
    /// Where it differs from nothing.
    pub windows: Vec<Window>,
    /// By how much the log-likelihood gains.
    pub gain: f64,
}

/// How a model with room for what is missing deviates from its simulation in one recording.
pub(crate) struct Simulated {
    pub(crate) deviations: Deviations,
    /// Measured − simulated, n_w per sample.
    pub(crate) residuals: Vec<f64>,
}

/// The fitted model in a recording; `None` where it cannot be simulated or linearised.
pub(crate) fn simulated(
    terms: &MissingTerms,
    fitted: &Fitted,
    data: &Data<'_>,
    recording: &Recording,
    start: &[(usize, f64)],
) -> Option<Simulated> {
    let Recording { inputs, times, measured, .. } = recording;
    let problem = Problem { system: &fitted.structure.system, p: &fitted.p, inputs, start };
    let solution = simulate(&problem, times, &data.options).ok()?;
    let deviations = Deviations::along(terms, &fitted.p, inputs, &solution).ok()?;
    let w = observe(&problem, &solution).w;
    let n_w = measured.len();
    let residual = |(at, w): (usize, &f64)| {
        measured[at % n_w].as_ref().map_or(f64::NAN, |measured| measured[at / n_w] - w)
    };
    let residuals = w.iter().enumerate().map(residual).collect();
    Some(Simulated { deviations, residuals })
}

/// The same in a training recording.
fn in_training(
    terms: &MissingTerms,
    fitted: &Fitted,
    data: &Data<'_>,
    recording: usize,
) -> Option<Simulated> {
    let start = fitted.values.starts(&fitted.structure.system, recording);
    simulated(terms, fitted, data, &data.train[recording], &start)
}

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
    let Some(Simulated { deviations, residuals }) = in_training(&terms, fitted, data, 0) else {
        return Vec::new();
    };
    let places = terms.places().iter().enumerate();
    let mut all: Vec<MissingInput> = places
        .filter_map(|(i, place)| {
            let found = unknown_input(&deviations, i, &residuals, &data.noise)?;
            Some(MissingInput {
                equation: called(place),
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

/// What a place is called in a result.
fn called(place: &Place) -> String {
    match place.kind {
        PlaceKind::Equation => place.name.clone(),
        PlaceKind::Output => format!("sensor {}", place.name),
    }
}

/// Position of the place that a missing input is of.
pub(crate) fn place_of(terms: &MissingTerms, missing: &MissingInput) -> Option<usize> {
    terms.places().iter().position(|place| called(place) == missing.equation)
}

/// Windows of what was missing at one place in each training recording.
pub(crate) fn windows(
    model: &Model,
    engine: Engine,
    fitted: &Fitted,
    data: &Data<'_>,
    missing: &MissingInput,
) -> Vec<Vec<[f64; 2]>> {
    let ends = |windows: &[Window]| windows.iter().map(|w| [w.from, w.until]).collect();
    let mut all = vec![ends(&missing.windows)];
    if data.train.len() == 1 {
        return all;
    }
    let terms = MissingTerms::new(model, engine, &mut Diagnostics::default()).ok();
    let of_recording = |recording: usize| {
        let terms = terms.as_ref()?;
        let place = place_of(terms, missing)?;
        let Simulated { deviations, residuals } = in_training(terms, fitted, data, recording)?;
        Some(ends(&unknown_input(&deviations, place, &residuals, &data.noise)?.windows))
    };
    all.extend((1..data.train.len()).map(|recording| of_recording(recording).unwrap_or_default()));
    all
}
