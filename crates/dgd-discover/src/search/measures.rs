//! Measures the misfit of the tried structures.

use std::collections::BTreeSet;

use dgd_runtime::System;
use dgd_screen::noise::SensorNoise;

use super::effort::EVALUATIONS;
use super::ranking::{
    HeldOutMisfit, LazyValue, RankedStanding, Ranking, StructureMisfit, VerdictQuestion,
};
use super::tried::{EffectSearch, OpenCandidates};
use crate::fit::{
    FittedStructure, as_far_as_readings, chi_square, mean, slack, too_many_steps, whitened,
    whitened_square,
};
use crate::library::StructureId;
use crate::noise::{size, whiteness};

impl EffectSearch<'_> {
    /// The current data for a verdict.
    pub(crate) fn ranking(&self, question: VerdictQuestion) -> Ranking<'_> {
        let standing = |structure: StructureId| {
            let fitted = self.fitted(structure)?;
            Some(RankedStanding {
                structure,
                names: structure.effects().map(|c| self.candidates[c].subject()).collect(),
                generic: structure.effects().filter(|c| self.candidates[*c].is_generic).collect(),
                template: self.template(structure),
                is_sayable: self.may_be_said(structure),
                numbers: fitted.free(),
                criterion: self.bic(structure)?,
                error: fitted.error,
                misfit: LazyValue::new(Box::new(|| self.misfit(fitted))),
                is_noise: LazyValue::new(Box::new(move || self.is_noise(structure))),
                is_sound: self.is_sound(structure) && self.is_finished(structure),
                is_doubted: self.doubted.contains_key(&structure),
                is_cancelling: LazyValue::new(Box::new(move || {
                    self.cancelling(structure).is_some()
                })),
            })
        };
        let standings = self.ranked().into_iter().filter_map(standing).collect();
        let discrepancy = LazyValue::new(Box::new(|| {
            self.fitted(StructureId::BASE).and_then(|base| self.bounded(base).squares())
        }));
        Ranking { standings, question, discrepancy }
    }

    /// The rank of a template by plainness, if a structure is a single template: the position of its file, which is
    /// that of its first candidate, as candidates are in the order of the files. Templates that scale a quantity whose
    /// zero is a convention, such as a temperature in °C, come last.
    fn template(&self, structure: StructureId) -> Option<(bool, usize)> {
        let mut effects = structure.effects().filter(|_| structure.len() == 1);
        let template = effects.next().filter(|c| self.candidates[*c].is_generic)?;
        let file = |c: usize| self.candidates[c].application.effect.full_name();
        let first = self.range(OpenCandidates::Templates).find(|&c| file(c) == file(template))?;
        let candidate = &self.candidates[template];
        Some((candidate.scales() && self.has_conventional_zero(&candidate.target()), first))
    }

    /// Whether an input or output has a unit with a conventional zero, such as °C.
    fn has_conventional_zero(&self, name: &str) -> bool {
        let Some(base) = self.fitted(StructureId::BASE) else { return false };
        let signature = base.structure.system.signature();
        let mut units = (signature.outputs.iter().map(|output| (&output.name, &output.unit)))
            .chain(signature.inputs.iter().map(|input| (&input.name, &input.unit)));
        units.any(|(own, unit)| *own == *name && unit.offset != 0.0)
    }

    /// The fitted structures by the Bayesian information criterion, the best first.
    pub(crate) fn ranked(&self) -> Vec<StructureId> {
        let criteria = self.tried.keys().filter_map(|&one| Some((self.bic(one)?, one)));
        let mut ranked: Vec<(f64, StructureId)> = criteria.collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        ranked.into_iter().map(|(_, structure)| structure).collect()
    }

    /// Σ (e/σ)² + k ln N on the training recordings, with the sum in units of the best structure's residual: if that
    /// exceeds noise, differences count less. A template is one of M that fit any model, and so costs an extra 2 ln M
    /// (the extended criterion of Chen & Chen, Biometrika 95 (2008) 759).
    pub(crate) fn bic(&self, structure: StructureId) -> Option<f64> {
        let fitted = self.fitted(structure)?;
        let (sum, n) = fitted.error;
        let templates = self.range(OpenCandidates::Templates).len().max(1) as f64;
        let generic = structure.effects().filter(|&c| self.candidates[c].is_generic).count();
        let generality = 2.0 * generic as f64 * templates.ln();
        Some(sum / self.unit() + fitted.free() as f64 * (n as f64).ln() + generality)
    }

    /// The mean ε² of the best structure, but at least that of noise.
    pub(crate) fn unit(&self) -> f64 {
        let errors = self.tried.keys().filter_map(|&structure| self.training_error(structure));
        let means = errors.map(|(sum, n)| sum / n as f64);
        means.fold(f64::INFINITY, f64::min).max(1.0)
    }

    /// Σ ε² of the training recordings, and the number of samples; ε is white if the errors are noise.
    pub(crate) fn training_error(&self, structure: StructureId) -> Option<(f64, usize)> {
        Some(self.fitted(structure)?.error)
    }

    /// The sum of [`Self::training_error`]; infinite for structures that could not be fitted.
    pub(crate) fn training_sum(&self, structure: StructureId) -> f64 {
        self.training_error(structure).map_or(f64::INFINITY, |(sum, _)| sum)
    }

    /// Mean square of the errors in the training recordings relative to the noise.
    pub(crate) fn training_square(&self, structure: StructureId) -> Option<f64> {
        mean(&chi_square(&self.fitted(structure)?.residuals(&self.data), &self.data.noise))
    }

    /// Mean square of the errors in the validation recordings relative to the noise; `None` if none of their samples
    /// counts.
    pub(crate) fn held_out_square(&self, structure: StructureId) -> Option<f64> {
        let residuals = self.fitted(structure)?.held_out_residuals(&self.data)?;
        mean(&chi_square(&residuals, &self.data.noise))
    }

    /// The misfit of a structure in each output.
    fn misfit(&self, fitted: &FittedStructure) -> StructureMisfit {
        let data = &self.data;
        let mut misfit = self.misfit_of(&fitted.residuals(data), fitted.held_out_residuals(data));
        // Parameters that the training recordings do not determine well predict no better.
        let (training, held_out) = (self.thresholds.explained, self.thresholds.explained_held_out);
        if misfit.is_at_most(training, f64::INFINITY)
            && !misfit.is_at_most(training, held_out)
            && let HeldOutMisfit::Left { slack, .. } = &mut misfit.held_out
        {
            slack.extend(fitted.foreseen_squares(data, EVALUATIONS).unwrap_or_default());
        }
        misfit
    }

    /// The misfit of a fit in each output, but at most the variance of the readings if the simulation diverges from
    /// them.
    fn bounded(&self, fitted: &FittedStructure) -> StructureMisfit {
        let data = &self.data;
        let held_out = fitted.held_out_residuals(data);
        self.misfit_of(
            &as_far_as_readings(data.train, fitted.residuals(data)),
            held_out.map(|residuals| as_far_as_readings(data.valid, residuals)),
        )
    }

    fn misfit_of(
        &self,
        trained: &[Vec<Vec<f64>>],
        held_out: Option<Vec<Vec<Vec<f64>>>>,
    ) -> StructureMisfit {
        let (data, noise) = (&self.data, &self.data.noise);
        let held_out = match held_out {
            _ if data.valid.is_empty() => HeldOutMisfit::NoRecording,
            None => HeldOutMisfit::NoSimulation,
            Some(residuals) => HeldOutMisfit::Left {
                by_output: chi_square(&residuals, noise),
                error: whitened_square(data.valid, &residuals, noise),
                slack: Vec::new(),
            },
        };
        let trained = chi_square(trained, noise);
        let slack = slack(&trained, noise, self.thresholds.explained);
        StructureMisfit { trained, slack, held_out }
    }

    /// Whether a structure's residuals are so small that nothing else need be missing.
    pub(crate) fn explains(&self, structure: StructureId) -> bool {
        self.fitted(structure).is_some_and(|fitted| self.leaves_nothing(fitted))
    }

    /// [`Self::explains`] for a fit.
    pub(crate) fn leaves_nothing(&self, fitted: &FittedStructure) -> bool {
        let (training, held_out) = (self.thresholds.explained, self.thresholds.explained_held_out);
        self.misfit(fitted).is_at_most(training, held_out)
    }

    /// Whether a fit leaves nothing and validation recordings confirm that without an allowance for its own
    /// uncertainty.
    pub(crate) fn validates(&self, fitted: &FittedStructure) -> bool {
        let square = fitted.held_out_residuals(&self.data);
        let square = square.and_then(|left| mean(&chi_square(&left, &self.data.noise)));
        square.is_some_and(|square| square <= self.thresholds.nearly_explained_held_out)
            && self.leaves_nothing(fitted)
    }

    /// Whether a fit leaves only noise in the training recordings.
    pub(crate) fn fits(&self, fitted: &FittedStructure) -> bool {
        let misfit = self.misfit_of(&fitted.residuals(&self.data), None);
        misfit.is_at_most_in_training(self.thresholds.explained)
    }

    /// Whether enough of the discrepancy is explained that the rest may be one more effect.
    pub(crate) fn is_promising(&self, structure: StructureId) -> bool {
        let excess = |of: StructureId| self.training_error(of).map(|(sum, n)| sum - n as f64);
        match (excess(structure), excess(StructureId::BASE)) {
            (Some(left), Some(all)) => left < self.thresholds.promising * all,
            _ => false,
        }
    }

    /// Whether a structure leaves only noise in the training recordings.
    ///
    /// Start values of validation recordings are estimated from only a minute of data, so their errors are never quite
    /// white; `explains` checks their size.
    pub(crate) fn is_noise(&self, structure: StructureId) -> bool {
        let Some(fitted) = self.fitted(structure) else { return false };
        self.leaves_noise(&fitted.residuals(&self.data), &self.data.noise)
    }

    /// Whether errors in the training recordings cannot be distinguished from a given noise.
    pub(crate) fn leaves_noise(
        &self,
        residuals: &[Vec<Vec<f64>>],
        noise: &[Option<SensorNoise>],
    ) -> bool {
        let measured = noise.iter().flatten().count() * residuals.len();
        let least = self.thresholds.false_alarm / measured.max(1) as f64;
        // Residuals of outputs in recordings that are too short for tests of their own.
        let mut short: Vec<Vec<f64>> = vec![Vec::new(); noise.len()];
        for (recording, outputs) in self.data.train.iter().zip(residuals) {
            for ((residuals, noise), short) in outputs.iter().zip(noise).zip(&mut short) {
                let Some(noise) = noise else { continue };
                let left = whitened(recording, residuals, noise);
                match whiteness(&left, &unit_of(noise), 0) {
                    Some(test) if test.p_value <= least => return false,
                    Some(_) => {}
                    None => short.extend(left),
                }
            }
        }
        let short_outputs =
            short.iter().zip(noise).filter_map(|(left, noise)| Some((left, (*noise)?)));
        short_outputs
            .map(|(left, noise)| size(left, &unit_of(&noise)))
            .all(|test| test.is_none_or(|test| test.p_value > least))
    }

    /// The structure that comes closest to another, on training and validation data, among those that lack one of its
    /// effects.
    pub(crate) fn without_one_of(&self, structure: StructureId) -> Option<StructureId> {
        let names = |of: StructureId| -> BTreeSet<String> {
            of.effects().map(|c| self.candidates[c].name()).collect()
        };
        let squares = |of: StructureId| self.misfit(self.fitted(of)?).squares();
        let (own, [trained, held_out]) = (names(structure), squares(structure)?);
        let others = self.ranked().into_iter().filter(|&other| !names(other).is_superset(&own));
        let distance = |other: StructureId| {
            let [of_training, of_held_out] = squares(other)?;
            Some((of_training / trained).max(of_held_out / held_out))
        };
        let others = others.filter_map(|other| Some((distance(other)?, other)));
        others.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, other)| other)
    }

    /// Structures with about the same misfit as another, on training and validation data.
    pub(crate) fn near(&self, structure: StructureId) -> Vec<StructureId> {
        let roots = |of: StructureId| {
            let held_out = self.held_out_square(of);
            let squares = [self.training_square(of), held_out.or_else(|| self.training_square(of))];
            Some([squares[0]?.sqrt(), squares[1]?.sqrt(), f64::from(u8::from(held_out.is_some()))])
        };
        let Some(own) = roots(structure) else { return Vec::new() };
        let apart = |one: f64, other: f64| (one / other).max(other / one);
        let is_near = |other: &StructureId| {
            *other != structure
                && self.is_sound(*other)
                && self.fitted(*other).is_some_and(|fitted| fitted.is_converged)
                && roots(*other).is_some_and(|found| {
                    // Either both have validation errors, or neither has.
                    found[2] == own[2]
                        && apart(found[0], own[0]).max(apart(found[1], own[1]))
                            <= self.thresholds.alternative
                })
        };
        self.ranked().into_iter().filter(is_near).collect()
    }

    /// A remark about a structure.
    pub(crate) fn note(&self, structure: StructureId) -> String {
        let Some(fitted) = self.fitted(structure) else { return String::new() };
        let mut notes = Vec::new();
        for estimate in &fitted.estimates {
            if estimate.at_bound.is_some() {
                notes.push(format!("`{}` is at its bound", estimate.name));
            } else if fitted.is_at_bound(estimate) {
                notes.push(format!("`{}` is not determined", estimate.name));
            }
        }
        if !fitted.is_converged {
            notes.push(if fitted.is_cut_short {
                format!("the fit was not finished: {}", too_many_steps())
            } else {
                "the fit was not finished".to_owned()
            });
        }
        notes.extend(self.doubted.get(&structure).cloned());
        if self.explains(structure)
            && let Some([a, b]) = self.cancelling(structure)
        {
            notes.push(format!("`{}` largely cancels `{}`", self.called(b), self.called(a)));
        }
        notes.join("; ")
    }
}

/// Unit noise, for whitened errors.
fn unit_of(noise: &SensorNoise) -> SensorNoise {
    SensorNoise { std: 1.0, colour: None, ..*noise }
}

#[cfg(test)]
mod tests {
    use super::super::draining::{id, leaving, with_effects};
    use super::*;

    #[test]
    fn near_structures_leave_as_much() {
        let left: [(&[usize], f64); 4] = [(&[], 400.0), (&[0], 6.0), (&[1], 6.5), (&[2], 7.0)];
        with_effects(["density", "clock", "influx"], |base, candidates, data| {
            let fitted = |(chosen, left): &(&[usize], f64)| {
                let structure = base.structure(candidates, id(chosen)).expect("a structure");
                (id(chosen), Ok(leaving(*left, structure)))
            };
            let tried = left.iter().map(fitted).collect();
            let mut search =
                EffectSearch { tried, ..EffectSearch::new(base, candidates, data, 1, 1) };
            // Roots: 6.5 is 4 % above 6, and 7 is 8 % above.
            assert_eq!(search.near(id(&[0])), [id(&[1])]);
            assert_eq!(search.near(id(&[1])), [id(&[0]), id(&[2])]);
            assert_eq!(search.near(StructureId::BASE), []);
            // Fits that did not converge are not compared.
            if let Some(Ok(one)) = search.tried.get_mut(&id(&[1])) {
                one.is_converged = false;
            }
            assert_eq!(search.near(id(&[0])), []);
        });
    }
}
