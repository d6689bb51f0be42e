//! Locates the missing term: ranks all places of the base model.
//!
//! ```text
//!   simulate the fitted model in all recordings ─► fit every place
//!     ─► the best few again, around the trajectory with their missing term ─► rank
//! ```
//!
//! Places are ranked by the likelihood of validation readings, each predicted from those before it, or of training
//! readings if there are no validation recordings. Readings are thinned if there are many; inputs never are.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::Model;
use dgd_compiler::units::parse_unit;
use dgd_execute::Engine;
use dgd_identify::Recording;
use dgd_runtime::parallel::{in_parallel, in_parallel_stateless};
use dgd_runtime::{Problem, System, observe, simulate};

use super::deviations::{DeviationError, Deviations};
use super::estimated::{EstimatedPlace, RecordedInput};
use super::found_place::{FoundPlace, MissingInput, PlaceTrace};
use super::kalman::InputWalk;
use super::missing_terms::{MissingPlace, MissingTerms, PlaceKind};
use super::place_fit::{LinearisedRecordings, ParameterColumns, PlaceFit, ReadingLikelihood};
use super::place_search::PlaceSearch;
use super::plausible::objection;
use super::reconstruct::reconstruct;
use super::thinned::ThinnedRecording;
use super::unknown_input::{standing_out, unknown_input};
use crate::fit::{FittedStructure, SearchData};
use crate::noise::SignalWindow;
use dgd_screen::noise::median;

/// The places of a model, and the findings there.
#[derive(Debug, Clone, Default)]
pub(crate) struct MissingInputs {
    /// The model with all places.
    pub(crate) terms: Option<MissingTerms>,
    /// Places that increase the likelihood of the readings, the best first.
    pub(crate) ranked: Vec<FoundPlace>,
    /// Why no place could be examined.
    pub(crate) reason: Option<String>,
}

/// Number of places that are fitted again around the trajectory that includes their missing term.
const AROUND: usize = 6;
/// Number of times that an estimate from one recording is repeated.
const AGAIN: usize = 2;
/// Gains that differ by less than this are tied: the odds are less than twenty to one.
pub(crate) const TIE: f64 = 3.0;

/// All places of the base model, the most likely first.
pub(crate) fn missing_inputs(
    model: &Model,
    engine: Engine,
    fitted: &FittedStructure,
    data: &SearchData<'_>,
    threads: usize,
) -> MissingInputs {
    let Ok(terms) = MissingTerms::scaled(model, data.scales, engine, &mut Diagnostics::default())
    else {
        return MissingInputs::nowhere("the model has no room for a missing term");
    };
    let ranked = PlaceSearch::new(&terms, fitted, data).ranked(model, threads);
    match ranked {
        Ok(ranked) => MissingInputs { ranked, terms: Some(terms), reason: None },
        Err(error) => MissingInputs::nowhere(&error.to_string()),
    }
}

impl MissingInputs {
    fn nowhere(reason: &str) -> Self {
        MissingInputs { reason: Some(reason.to_owned()), ..MissingInputs::default() }
    }
}

impl PlaceSearch<'_> {
    fn ranked(&mut self, model: &Model, threads: usize) -> Result<Vec<FoundPlace>, DeviationError> {
        let [train, valid] = self.sights()?;
        let free: Vec<(usize, f64)> = self.free.iter().map(|(i, size, _)| (*i, *size)).collect();
        let plain = LinearisedRecordings {
            train: &train,
            valid: &valid,
            noise: &self.data.noise,
            free: &free,
        };
        let columns =
            ParameterColumns { train: plain.columns(&train), valid: plain.columns(&valid) };
        let Some(nothing) = plain.nothing(0, &columns) else {
            return Err(DeviationError::Undetermined);
        };
        let count = self.terms.places().len();
        let progress = self.data.keeping.count("places examined", count);
        let fits = in_parallel_stateless(count, threads, |place| {
            let fit = plain.fit(place, &columns);
            progress.more(1);
            Some(EstimatedPlace::new(place, fit?, &plain, &columns))
        });
        let mut candidates: Vec<EstimatedPlace> = fits.into_iter().flatten().collect();
        sort(&mut candidates, nothing.likelihood);
        let nearest = candidates.len().min(AROUND);
        let again = in_parallel(self.terms, nearest, threads, |terms, k| {
            // Each thread has a system of its own.
            let places = PlaceSearch {
                terms,
                data: self.data,
                p: self.p.clone(),
                own: self.own.clone(),
                runs_away: self.runs_away,
                follows: self.follows,
                train: self.train.clone(),
                valid: self.valid.clone(),
                free: self.free.clone(),
            };
            if places.data.is_over() { None } else { places.again(&candidates[k], &free) }
        });
        for (place, again) in candidates.iter_mut().zip(again) {
            if let Some(again) = again {
                *place = again;
            }
        }
        sort(&mut candidates, nothing.likelihood);
        let reported = candidates.into_iter().filter_map(|place| {
            let gain = place.fit.likelihood.gain_over(nothing.likelihood);
            (gain > 0.0).then(|| self.told(model, &place, gain))
        });
        Ok(reported.collect())
    }

    fn told(&self, model: &Model, found: &EstimatedPlace, gain: f64) -> FoundPlace {
        let place = self.terms.places()[found.place].clone();
        let p = self.changed(found.p.as_ref().unwrap_or(&self.p), &found.fit);
        let (mut base, mut unit) = (0.0, (place.unit.clone(), 1.0));
        let declared = match place.kind {
            PlaceKind::Parameter => {
                let mut parameters = self.system().signature().parameters.iter();
                base = parameters.position(|p| p.name == place.name).map_or(0.0, |i| p[i]);
                model.parameters.iter().map(|p| &p.declared).find(|d| d.name == place.name)
            }
            PlaceKind::Input => {
                model.inputs.iter().map(|i| &i.declared).find(|d| d.name == place.name)
            }
            PlaceKind::Output => {
                model.outputs.iter().map(|o| &o.declared).find(|d| d.name == place.name)
            }
            PlaceKind::Equation => None,
        };
        // A term of an equation is given in the unit of a quantity of the same dimension.
        let display_unit = match declared {
            Some(declared) => Some(declared.unit.of_differences()),
            None => parse_unit(&place.unit).ok().map(|unit| model.familiar(unit.dimension)),
        };
        if let Some(display_unit) = display_unit {
            unit = (display_unit.symbol, display_unit.factor);
        }
        let windows: Vec<Vec<SignalWindow>> = (self.train.iter().zip(&found.train))
            .map(|(thinned, RecordedInput { piece, std, .. })| {
                standing_out(&thinned.times, &piece.d, std, found.fit.intensity)
            })
            .collect();
        let traces =
            |all: &[ThinnedRecording<'_>], estimates: &[RecordedInput]| -> Vec<PlaceTrace> {
                let each = all.iter().zip(estimates);
                each.map(|(thinned, RecordedInput { piece, std, followed })| PlaceTrace {
                    times: thinned.times.clone(),
                    d: piece.d.clone(),
                    std: std.clone(),
                    start: piece.start.clone(),
                    resolved: resolved(&found.fit, std),
                    followed: followed.clone(),
                })
                .collect()
            };
        let missing = MissingInput {
            place,
            unit: unit.0,
            times: self.train[0].times.clone(),
            value: found.train[0].piece.d.iter().map(|d| (base + d) / unit.1).collect(),
            std: found.train[0].std.iter().map(|std| std / unit.1).collect(),
            windows: windows[0].clone(),
            gain,
        };
        let train = traces(&self.train, &found.train);
        let valid = traces(&self.valid, &found.valid);
        let (left, course) = self.left_with(found, &p);
        let objection = objection(&missing.place, model, &self.train, base, &train);
        FoundPlace { missing, p, train, valid, windows, left, course, objection }
    }
}

/// Correlation time of the errors of a smoothed walk, s.
fn resolved(fit: &PlaceFit, std: &[f64]) -> f64 {
    let Some(typical) = median(&mut std.to_vec()) else { return 0.0 };
    let share = typical * typical / fit.intensity;
    match fit.walk {
        InputWalk::White => 0.0,
        InputWalk::Random => 2.0 * share,
        InputWalk::Integrated => 2.0 * share.cbrt(),
    }
}

/// Sorts the most likely first.
fn sort(found: &mut [EstimatedPlace], nothing: ReadingLikelihood) {
    let gain = |found: &EstimatedPlace| found.fit.likelihood.gain_over(nothing);
    found.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
}

/// The missing input at a place in one recording with the base model's own parameters, estimated from that recording
/// alone and again around the trajectory that includes it.
pub(crate) fn alone(
    terms: &MissingTerms,
    fitted: &FittedStructure,
    data: &SearchData<'_>,
    place: usize,
    recording: &Recording,
    start: &[(usize, f64)],
) -> Option<PlaceTrace> {
    let Recording { inputs, times, measured, .. } = recording;
    let problem = Problem { system: &fitted.structure.system, p: &fitted.p, inputs, start };
    let solution = simulate(&problem, times, &data.options).ok()?;
    let deviations = Deviations::linearize(terms, &fitted.p, inputs, &solution).ok()?;
    let w = observe(&problem, &solution).w;
    let n_w = measured.len();
    let readings: Vec<f64> = (0..times.len() * n_w)
        .map(|at| measured[at % n_w].as_ref().map_or(f64::NAN, |all| all[at / n_w]))
        .collect();
    let residuals: Vec<f64> = readings.iter().zip(&w).map(|(m, w)| m - w).collect();
    let mut unknown = unknown_input(&deviations, place, &residuals, &data.noise)?;
    let around = super::ReconstructedRecording {
        p: &fitted.p,
        inputs,
        start,
        times,
        measured: &readings,
        noise: &data.noise,
    };
    for _ in 0..AGAIN {
        match reconstruct(terms, &around, place, &unknown, &data.options) {
            Ok(Some(again)) if again.intensity > 0.0 => unknown = again,
            // The estimate is used as far as it could be refined.
            Ok(_) | Err(_) => break,
        }
    }
    let typical = median(&mut unknown.std.clone())?;
    (unknown.intensity > 0.0).then(|| PlaceTrace {
        followed: None,
        times: unknown.times,
        d: unknown.estimate,
        std: unknown.std,
        start: start.to_vec(),
        resolved: 2.0 * typical * typical / unknown.intensity,
    })
}

/// Position of a place among those of a model.
pub(crate) fn place_of(terms: &MissingTerms, place: &MissingPlace) -> Option<usize> {
    terms.places().iter().position(|other| other == place)
}
