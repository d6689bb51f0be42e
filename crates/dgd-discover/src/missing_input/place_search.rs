//! The search over places: its data, and recordings linearised around simulations or filters.

use dgd_execute::LoadedSystem;
use dgd_runtime::{Inputs, Problem, System, observe, simulate};

use super::deviations::{DeviationError, Deviations};
use super::filtered::{FilterRecording, FilteredTrajectory};
use super::kalman::{DeviationChain, InputWalk};
use super::missing_terms::{MissingTerms, PlaceKind};
use super::place_fit::LinearisedRecording;
use super::reconstruct::{ReconstructedRecording, inputs_with};
use super::thinned::ThinnedRecording;
use crate::fit::{FittedStructure, SearchData, states_at};
use crate::library::CarriedValues;

/// Total number of samples to which places are fitted.
const SAMPLES: usize = 3000;
/// Minimum number of samples that each recording keeps.
const FEWEST: usize = 200;
/// Maximum number of simulations in fits of start values.
const EVALUATIONS: usize = 40;

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

impl<'a> PlaceSearch<'a> {
    pub(super) fn new(
        terms: &'a MissingTerms,
        fitted: &'a FittedStructure,
        data: &'a SearchData<'a>,
    ) -> Self {
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
        let around = ReconstructedRecording {
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
    pub(super) fn sights(&mut self) -> Result<[Vec<LinearisedRecording>; 2], DeviationError> {
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
