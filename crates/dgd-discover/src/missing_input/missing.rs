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
use dgd_execute::{Engine, LoadedSystem};
use dgd_identify::{Recording, Starts};
use dgd_runtime::parallel::{in_parallel, in_parallel_stateless};
use dgd_runtime::{Inputs, Problem, Solution, System, observe, simulate};

use super::around::ReferencePart;
use super::deviations::{DeviationError, Deviations};
use super::filtered::{FilterRecording, FilteredTrajectory};
use super::kalman::{DeviationChain, InputWalk};
use super::missing_terms::{MissingPlace, MissingTerms, PlaceKind};
use super::place_fit::{
    LinearisedRecording, LinearisedRecordings, ParameterColumns, PlaceFit, ReadingLikelihood,
};
use super::plausible::{PlaceObjection, objection};
use super::reconstruct::{inputs_with, reconstruct};
use super::thinned::ThinnedRecording;
use super::unknown_input::{standing_out, unknown_input};
use crate::fit::{FittedStructure, SearchData, states_at};
use crate::library::CarriedValues;
use crate::noise::SignalWindow;
use dgd_screen::noise::median;

/// The missing input at a place.
#[derive(Debug, Clone)]
pub struct MissingInput {
    /// The place.
    pub place: MissingPlace,
    /// The unit of `value` and `std`.
    pub unit: String,
    /// Times of the first training recording, s.
    pub times: Vec<f64>,
    /// The smoothed estimate: the missing term on an equation's right-hand side, the values of a parameter, or the
    /// error of an input or a sensor.
    pub value: Vec<f64>,
    /// Its standard deviation.
    pub std: Vec<f64>,
    /// Windows in which it stands out.
    pub windows: Vec<SignalWindow>,
    /// Gain in log-likelihood over nothing missing, of validation readings if there are any.
    pub gain: f64,
}

impl MissingInput {
    /// Name of the place in a result: an equation's label, a parameter, an input or `sensor NAME`.
    pub fn target(&self) -> String {
        self.place.called()
    }
}

/// The missing input at a place in one recording, for comparison with formulas.
#[derive(Debug, Clone)]
pub(crate) struct PlaceTrace {
    /// Times, s.
    pub(crate) times: Vec<f64>,
    /// d, SI.
    pub(crate) d: Vec<f64>,
    /// Its standard deviation.
    pub(crate) std: Vec<f64>,
    /// Start values of the recording.
    pub(crate) start: Starts,
    /// Correlation time of the errors of d, s.
    pub(crate) resolved: f64,
    /// The trajectory that includes d, if it is that of a filter.
    pub(crate) followed: Option<Solution>,
}

/// A place with its traces.
#[derive(Debug, Clone)]
pub(crate) struct FoundPlace {
    pub(crate) missing: MissingInput,
    /// All parameters, SI, that belong to the traces.
    pub(crate) p: Vec<f64>,
    /// Traces of the training recordings; the validation recordings follow.
    pub(crate) train: Vec<PlaceTrace>,
    pub(crate) valid: Vec<PlaceTrace>,
    /// Windows in which it stands out in each training recording.
    windows: Vec<Vec<SignalWindow>>,
    /// Mean square of the residuals relative to the noise in simulations of the training recordings with its traces, at
    /// most that of the readings about their mean.
    pub(crate) left: f64,
    /// The unknowns along the first training recording.
    pub(crate) course: Option<Solution>,
    /// The reason why it is implausible.
    pub(crate) objection: Option<PlaceObjection>,
}

impl FoundPlace {
    /// Whether its traces were estimated along the trajectory of a filter.
    pub(crate) fn is_followed(&self) -> bool {
        self.train.iter().any(|trace| trace.followed.is_some())
    }
}

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

/// Total number of samples to which places are fitted.
const SAMPLES: usize = 3000;
/// Minimum number of samples that each recording keeps.
const FEWEST: usize = 200;
/// Number of places that are fitted again around the trajectory that includes their missing term.
const AROUND: usize = 6;
/// Maximum number of simulations in fits of start values.
const EVALUATIONS: usize = 40;
/// Number of times that an estimate from one recording is repeated.
const AGAIN: usize = 2;
/// Gains that differ by less than this are tied: the odds are less than twenty to one.
pub(crate) const TIE: f64 = 3.0;

/// The data of the search over places.
pub(super) struct PlaceSearch<'a> {
    pub(super) terms: &'a MissingTerms,
    pub(super) data: &'a SearchData<'a>,
    /// All parameters, SI: those of the fit, or the model's own if the fit diverges.
    pub(super) p: Vec<f64>,
    pub(super) own: Vec<f64>,
    /// Whether the fit diverges, so that trajectories are those of filters.
    pub(super) runs_away: bool,
    pub(super) follows: bool,
    pub(super) train: Vec<ThinnedRecording<'a>>,
    pub(super) valid: Vec<ThinnedRecording<'a>>,
    /// Places of the free parameters, with their sizes and positions among the parameters.
    pub(super) free: Vec<(usize, f64, usize)>,
}

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

/// The place of a free parameter.
pub(crate) struct FreePlace {
    pub(crate) place: usize,
    /// The size of its prior error, SI.
    pub(crate) size: f64,
    /// Its position among the parameters.
    pub(crate) parameter: usize,
}

/// The places of a structure's free parameters.
pub(crate) fn free_places(terms: &MissingTerms, fitted: &FittedStructure) -> Vec<FreePlace> {
    let parameters = &fitted.structure.system.signature().parameters;
    let is_free =
        |name: &str| fitted.estimates.iter().any(|e| e.recording.is_none() && e.name == name);
    let free = terms.places().iter().enumerate().filter_map(|(place, own)| {
        let parameter = parameters.iter().position(|p| p.name == own.name)?;
        let size = fitted.p[parameter].abs();
        let size = if size > 0.0 { size } else { parameters[parameter].unit.factor };
        let is_free = own.kind == PlaceKind::Parameter && is_free(&own.name);
        is_free.then_some(FreePlace { place, size, parameter })
    });
    free.collect()
}

impl<'a> PlaceSearch<'a> {
    fn new(terms: &'a MissingTerms, fitted: &'a FittedStructure, data: &'a SearchData<'a>) -> Self {
        let system = &fitted.structure.system;
        let starts = fitted.held_out_starts(data, EVALUATIONS);
        let held_out = data.valid.iter().zip(starts.into_iter().flatten()).enumerate();
        let n_recordings = data.train.len() + data.valid.len();
        let most = (SAMPLES / n_recordings.max(1)).max(FEWEST);
        let train = data.train.iter().enumerate();
        let train = train
            .map(|(r, recording)| {
                let start = fitted.values.starts(system, r);
                ThinnedRecording::new(recording, most, start, f64::NEG_INFINITY)
            })
            .collect();
        let valid = held_out
            .map(|(r, (recording, start))| {
                let from = data.counts_from.get(r).copied().unwrap_or(f64::NEG_INFINITY);
                ThinnedRecording::new(recording, most, start, from)
            })
            .collect();
        let free = free_places(terms, fitted).into_iter();
        let free = free.map(|FreePlace { place, size, parameter }| (place, size, parameter));
        let free = free.collect();
        let declared = CarriedValues::default().parameters(system);
        let (p, runs_away, follows) = (fitted.p.clone(), fitted.runs_away(data), false);
        PlaceSearch { terms, data, p, own: declared, runs_away, follows, train, valid, free }
    }

    pub(super) fn system(&self) -> &LoadedSystem {
        self.terms.system()
    }

    /// Inputs of the model and of all places, with d at one of these.
    pub(super) fn inputs(
        &self,
        thinned: &ThinnedRecording<'_>,
        place: usize,
        d: &[f64],
    ) -> Option<Inputs> {
        let ThinnedRecording { recording, times, start, .. } = thinned;
        let (p, noise) = (&*self.p, &*self.data.noise);
        let around = super::ReconstructedRecording {
            p,
            inputs: &recording.inputs,
            start,
            times,
            measured: &[],
            noise,
        };
        inputs_with(self.terms, &around, place, d).ok()
    }

    /// A linearised recording, around its simulation with nothing missing.
    fn sight(&self, thinned: &ThinnedRecording<'_>) -> Result<LinearisedRecording, DeviationError> {
        let nothing = vec![0.0; thinned.times.len()];
        self.sight_around(thinned, &thinned.start, 0, &nothing, &self.p)
            .ok_or(DeviationError::Undetermined)
    }

    /// A recording linearised around the trajectory of a filter, with d at a place.
    pub(super) fn sight_filtered(
        &self,
        thinned: &ThinnedRecording<'_>,
        place: usize,
        d: &[f64],
        p: &[f64],
    ) -> Option<LinearisedRecording> {
        let ThinnedRecording { times, start, counts_from, .. } = thinned;
        let (inputs, measured) = (self.inputs(thinned, place, d)?, thinned.readings());
        let SearchData { noise, options, .. } = self.data;
        let (terms, inputs, measured) = (self.terms, &inputs, &*measured);
        let followed =
            FilterRecording { terms, p, inputs, place, d, start, times, measured, noise, options };
        let FilteredTrajectory { deviations, residuals, trajectory } = followed.filtered()?;
        let (counts_from, start) = (*counts_from, states_at(self.system(), &trajectory, 0));
        Some(LinearisedRecording {
            deviations,
            residuals,
            counts_from,
            start,
            followed: Some(trajectory),
        })
    }

    /// All linearised recordings, training first. If the fitted model diverges from one, they are linearised around the
    /// trajectory of a filter, with the model's own parameters: those of the fit are a compromise.
    fn sights(&mut self) -> Result<[Vec<LinearisedRecording>; 2], DeviationError> {
        let sights =
            |all: &[ThinnedRecording<'_>]| -> Result<Vec<LinearisedRecording>, DeviationError> {
                all.iter().map(|thinned| self.sight(thinned)).collect()
            };
        if self.runs_away {
            let followed = |thinned: &ThinnedRecording<'_>| {
                let nothing = vec![0.0; thinned.times.len()];
                self.sight_filtered(thinned, 0, &nothing, &self.own)
            };
            let recordings = self.train.iter().chain(&self.valid);
            if let Some(mut train) =
                recordings.map(followed).collect::<Option<Vec<LinearisedRecording>>>()
            {
                let recordings = self.train.iter_mut().chain(&mut self.valid);
                for (thinned, sight) in recordings.zip(&train) {
                    thinned.start.clone_from(&sight.start);
                }
                self.p.clone_from(&self.own);
                self.follows = true;
                let valid = train.split_off(self.train.len());
                return Ok([train, valid]);
            }
        }
        Ok([sights(&self.train)?, sights(&self.valid).unwrap_or_default()])
    }

    /// A recording linearised around its simulation with d at a place and these parameters: residuals are those that
    /// the linearised model would have without d.
    pub(super) fn sight_around(
        &self,
        thinned: &ThinnedRecording<'_>,
        start: &[(usize, f64)],
        place: usize,
        d: &[f64],
        p: &[f64],
    ) -> Option<LinearisedRecording> {
        let ThinnedRecording { times, counts_from, .. } = thinned;
        let inputs = self.inputs(thinned, place, d)?;
        let problem = Problem { system: self.system(), p, inputs: &inputs, start };
        let solution = simulate(&problem, times, &self.data.options).ok()?;
        let deviations = Deviations::linearize(self.terms, p, &inputs, &solution).ok()?;
        let mut residuals = thinned.residuals(&observe(&problem, &solution));
        if d.iter().any(|d| *d != 0.0) {
            let chain = DeviationChain::new(
                &deviations,
                place,
                InputWalk::Random,
                &residuals,
                &self.data.noise,
            );
            chain.add_response(d, &mut residuals, deviations.n_outputs);
        }
        let (counts_from, start) = (*counts_from, states_at(self.system(), &solution, 0));
        Some(LinearisedRecording { deviations, residuals, counts_from, start, followed: None })
    }

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

/// A place with its estimates.
pub(super) struct EstimatedPlace {
    pub(super) place: usize,
    pub(super) fit: PlaceFit,
    /// Parameters of the trajectory around which it was fitted, if they differ from those of the base model.
    pub(super) p: Option<Vec<f64>>,
    /// Estimates in each training recording; the validation recordings follow.
    pub(super) train: Vec<RecordedInput>,
    pub(super) valid: Vec<RecordedInput>,
}

/// The missing input at a place in one recording.
pub(super) struct RecordedInput {
    pub(super) piece: ReferencePart,
    /// Standard deviation of d.
    pub(super) std: Vec<f64>,
    /// The trajectory, if it is that of a filter.
    pub(super) followed: Option<Solution>,
}

impl EstimatedPlace {
    pub(super) fn new(
        place: usize,
        fit: PlaceFit,
        sights: &LinearisedRecordings<'_>,
        columns: &ParameterColumns,
    ) -> Self {
        let smoothed =
            |all: &[LinearisedRecording], columns: &[Vec<Vec<f64>>]| -> Vec<RecordedInput> {
                let both = all.iter().zip(columns);
                both.map(|(sight, columns)| {
                    let smoothed = sights.smoothed(sight, place, &fit, columns);
                    let moved = sight.start.iter().zip(&smoothed.start);
                    let start = moved.map(|((state, value), change)| (*state, value + change));
                    let piece = ReferencePart { start: start.collect(), d: smoothed.input };
                    RecordedInput { piece, std: smoothed.std, followed: sight.followed.clone() }
                })
                .collect()
            };
        let train = smoothed(sights.train, &columns.train);
        let valid = smoothed(sights.valid, &columns.valid);
        EstimatedPlace { place, fit, p: None, train, valid }
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

/// Windows in which the missing term at one place stands out in each training recording.
pub(crate) fn windows(found: &FoundPlace) -> Vec<Vec<[f64; 2]>> {
    let ends = |windows: &Vec<SignalWindow>| windows.iter().map(|w| [w.from, w.until]).collect();
    found.windows.iter().map(ends).collect()
}
