//! The noise with which a search weights errors: from the readings, then from the residuals of the best structure so
//! far, white or correlated.

use super::effort::{BEAM, EVALUATIONS};
use super::refits::ValidationUse;
use super::screen::CandidateScore;
use super::thresholds::Thresholds;
use super::tried::{EffectSearch, OpenCandidates};
use crate::fit::{FittedStructure, NoFit, SearchData, StartPoint, chi_square, whitened};
use crate::library::{CarriedValues, StructureId};
use crate::noise::{coloured_noise, noise_of, steadiness};
use dgd_screen::noise::SensorNoise;

/// Maximum number of simulations of fits that are repeated with other weights.
const AGAIN: usize = 10;

impl EffectSearch<'_> {
    /// Fits the base model, twice if necessary: its residuals give a better noise estimate.
    pub(crate) fn fit_base(&mut self, start: &CarriedValues) -> Result<(), NoFit> {
        let structure = self.base.structure(self.candidates, StructureId::BASE);
        let structure = structure.map_err(NoFit::Invalid)?;
        let keeping = self.data.keeping;
        let count = keeping.count("fits of the model as it is", 2);
        let fitted = FittedStructure::new(
            structure.clone(),
            start,
            &[StartPoint::default()],
            &self.data,
            4 * EVALUATIONS,
        );
        count.more(1);
        let Ok(fitted) = fitted else {
            // Places and laws are found along the readings, whatever the simulation does.
            let mut fitted = FittedStructure::diverging(structure, &self.data)?;
            self.data.counts_from = fitted.counts_from(&self.data, EVALUATIONS);
            fitted.hold_out(&self.data, EVALUATIONS);
            self.tried.insert(StructureId::BASE, Ok(fitted));
            return Ok(());
        };
        let changed = self.tighten_noise(&fitted);
        let mut fitted = if changed {
            let from = fitted.values.clone();
            FittedStructure::new(
                structure,
                &from,
                &[StartPoint::default()],
                &self.data,
                EVALUATIONS,
            )?
        } else {
            fitted
        };
        fitted.weigh(&self.data);
        self.data.counts_from = fitted.counts_from(&self.data, EVALUATIONS);
        fitted.hold_out(&self.data, EVALUATIONS);
        count.more(1);
        self.tried.insert(StructureId::BASE, Ok(fitted));
        Ok(())
    }

    /// Adopts the noise of a structure's residuals where it is smaller. Returns whether it changed enough to matter for
    /// weights.
    pub(crate) fn tighten_noise(&mut self, fitted: &FittedStructure) -> bool {
        let shown = noise_of(self.data.train, &fitted.residuals(&self.data));
        let mut changed = false;
        for (noise, shown) in self.data.noise.iter_mut().zip(shown) {
            let (Some(noise), Some(shown)) = (noise, shown) else { continue };
            if shown.std < noise.std {
                changed |= shown.std < 0.95 * noise.std;
                *noise = SensorNoise { colour: noise.colour, ..shown };
            }
        }
        changed
    }

    /// Adopts the correlated noise in a structure's errors, if they show nothing else. Returns whether that is so.
    ///
    /// Sensor noise has a short correlation time, is stationary, and is the same in all recordings. White errors of
    /// outputs stay white.
    fn recolour(&mut self, structure: StructureId) -> bool {
        if structure.is_base() && self.has_effects {
            return false;
        }
        self.hold_out(&[structure]);
        let Some(fitted) = self.fitted(structure) else { return false };
        let residuals = fitted.residuals(&self.data);
        let mut noise = self.data.noise.clone();
        for (output, noise) in noise.iter_mut().enumerate() {
            let Some(noise) = noise else { continue };
            let errors: Vec<(&[f64], &[f64])> = self
                .data
                .train
                .iter()
                .zip(&residuals)
                .map(|(recording, outputs)| (&*recording.times, &*outputs[output]))
                .collect();
            let white = SensorNoise { colour: None, ..*noise };
            *noise = coloured_noise(&errors, &white).unwrap_or(white);
        }
        let is_steady = |output: usize, noise: &SensorNoise| {
            self.data.train.iter().zip(&residuals).all(|(recording, outputs)| {
                let left = whitened(recording, &outputs[output], noise);
                noise.colour.is_none() || steadiness(&left) > self.thresholds.false_alarm
            })
        };
        let all_steady = noise
            .iter()
            .enumerate()
            .all(|(output, noise)| noise.as_ref().is_none_or(|noise| is_steady(output, noise)));
        if !all_steady || !self.leaves_noise(&residuals, &noise) {
            return false;
        }
        let mut data = SearchData { noise, ..self.data.clone() };
        if data.noise != self.data.noise
            && let Some(base) = self.fitted(StructureId::BASE)
        {
            data.counts_from = base.counts_from(&data, EVALUATIONS);
        }
        let mut fitted = fitted.clone();
        if data.counts_from != self.data.counts_from {
            fitted.hold_out(&data, EVALUATIONS);
        }
        if !is_the_same(&fitted, &data, &self.thresholds) {
            return false;
        }
        self.weigh_with(data);
        true
    }

    /// Adopts noise, and the times from which validation recordings count.
    fn weigh_with(&mut self, data: SearchData<'_>) {
        let SearchData { noise, counts_from, .. } = data;
        let is_reweighed = noise != self.data.noise;
        let is_recounted = counts_from != self.data.counts_from;
        (self.data.noise, self.data.counts_from) = (noise, counts_from);
        if is_reweighed {
            self.reweigh();
        }
        if is_recounted {
            let held_out = self.tried.values_mut().flatten();
            for fitted in held_out.filter(|fitted| fitted.valid.is_some()) {
                fitted.hold_out(&self.data, EVALUATIONS);
            }
        }
    }

    /// Reweights the errors of all structures, so that they are comparable.
    fn weigh_all(&mut self) {
        for fitted in self.tried.values_mut().flatten() {
            fitted.weigh(&self.data);
        }
    }

    /// Reweights all errors, and discards screens and evidence, after the noise has changed enough to matter for these.
    pub(crate) fn reweigh(&mut self) {
        self.weigh_all();
        self.screens.clear();
        self.doubted.clear();
        self.base_screens.clear();
        self.evidence.clear();
    }

    /// Adopts the correlated noise in the base model's errors, if they show nothing else and no candidate promises to
    /// be worth including.
    ///
    /// A discrepancy that is as short and stationary as sensor noise may be either. If an effect explains it, the
    /// effect is preferred.
    pub(crate) fn try_coloured_noise(&mut self) {
        let before = self.data.clone();
        let is_noise = self.recolour(StructureId::BASE) && self.nothing_promises();
        if !is_noise {
            self.weigh_with(before);
        }
        self.has_effects = !is_noise;
    }

    /// Whether no candidate, including templates, promises to be worth adding to the base model.
    fn nothing_promises(&mut self) -> bool {
        let samples = self.training_error(StructureId::BASE).map_or(1, |(_, n)| n) as f64;
        let mut scores = self.screened_of(OpenCandidates::Library, StructureId::BASE);
        scores.extend(self.screened_of(OpenCandidates::Templates, StructureId::BASE));
        let costs = |score: &CandidateScore| {
            let point = score.points.first().map_or(1, |point| point.values.len());
            self.thresholds.least_gain + point as f64 * samples.ln()
        };
        scores.iter().all(|score| score.gain < costs(score))
    }

    /// If the best structure shows less noise than assumed, all weights change, and fits continue from their current
    /// values.
    pub(crate) fn sharpen(&mut self) {
        let Some(best) = self.ranked().first().copied() else { return };
        let Some(Ok(fitted)) = self.tried.get(&best).cloned() else { return };
        let is_tightened = self.tighten_noise(&fitted);
        // However small the change of the noise, all errors are in units of it.
        self.weigh_all();
        let before = self.data.noise.clone();
        let is_recoloured = self.recolour(best) && before != self.data.noise;
        if !is_tightened && !is_recoloured {
            return;
        }
        self.reweigh();
        // The base model for comparison, and structures that may still be the best.
        let mut again = self.ranked();
        again.truncate(BEAM);
        if !again.contains(&StructureId::BASE) {
            again.push(StructureId::BASE);
        }
        let again = again.iter().map(|one| self.continued(*one)).collect();
        self.refit(again, AGAIN, ValidationUse::Now);
    }
}

/// Whether the noise of the training recordings explains the validation errors. Larger ones pass if the training
/// recordings leave parameters and start values uncertain enough to explain them. A small effect would not pass: it
/// adds different errors in each recording.
fn is_the_same(fitted: &FittedStructure, data: &SearchData<'_>, thresholds: &Thresholds) -> bool {
    let Some(residuals) = fitted.held_out_residuals(data) else { return true };
    let sums = chi_square(&residuals, &data.noise);
    if sums.iter().all(|(sum, n)| *sum <= thresholds.explained_held_out * *n as f64) {
        return true;
    }
    let least = thresholds.false_alarm / sums.len() as f64;
    let chances = fitted.held_out_chances(data, EVALUATIONS);
    chances.is_some_and(|chances| chances.iter().all(|chance| *chance > least))
}
