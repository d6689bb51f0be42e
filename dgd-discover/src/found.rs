//! What is said of an effect that the data shows.

use dgd_runtime::System;
use dgd_runtime::identify::Estimate;

use crate::activity;
use crate::discovery::{Alternative, Evidence, FoundEffect, ParameterValue};
use crate::fitted::{Data, Fitted};
use crate::known::Circumstances;
use crate::search::Search;

/// A structure is an alternative where its validation error is at most so many times that of the best.
const ALTERNATIVE: f64 = 1.05;

/// An effect in the place of another.
#[derive(Debug, Clone)]
pub(crate) struct InItsPlace {
    pub alternative: Alternative,
    /// Its position among the candidates.
    pub candidate: usize,
    /// The structure with it.
    pub structure: Vec<usize>,
}

impl Search<'_> {
    /// Structures in which another effect stands in the place of one, and that predict validation data
    /// nearly as well; the best first.
    pub(crate) fn alternatives(&self, chosen: &[usize], candidate: usize) -> Vec<InItsPlace> {
        let rest: Vec<usize> = chosen.iter().copied().filter(|c| *c != candidate).collect();
        let error = |chosen: &[usize]| {
            let held_out = self.held_out_square(chosen);
            held_out.or_else(|| self.training_square(chosen)).map(f64::sqrt)
        };
        let Some(best) = error(chosen) else { return Vec::new() };
        let own = self.candidates[candidate].name();
        let mut all: Vec<InItsPlace> = Vec::new();
        for other in 0..self.candidates.len() {
            let name = self.candidates[other].name();
            if rest.contains(&other) || name == own || !self.is_open(other) {
                continue;
            }
            let mut exchanged = rest.clone();
            exchanged.push(other);
            exchanged.sort_unstable();
            let Some(ratio) = error(&exchanged).map(|error| error / best) else { continue };
            let as_good = self.explains(&exchanged) || !self.explains(chosen);
            if ratio <= ALTERNATIVE && as_good {
                let alternative = Alternative { name, valid_ratio: ratio };
                all.push(InItsPlace { alternative, candidate: other, structure: exchanged });
            }
        }
        all.sort_by(|a, b| a.alternative.valid_ratio.total_cmp(&b.alternative.valid_ratio));
        let mut names = Vec::new();
        all.retain(|InItsPlace { alternative, .. }| {
            let is_new = !names.contains(&alternative.name);
            names.push(alternative.name.clone());
            is_new
        });
        all
    }
}

/// What is known about the effects of the structure that is believed.
pub(crate) struct Found<'a> {
    pub search: &'a Search<'a>,
    pub data: &'a Data<'a>,
    pub chosen: &'a [usize],
    pub after: &'a Fitted,
    pub circumstances: &'a Circumstances,
}

impl Found<'_> {
    /// All about one effect of the structure.
    pub(crate) fn effect(&self, candidate: usize, evidence: Evidence) -> FoundEffect {
        let Found { search, data, chosen, after, circumstances } = *self;
        let described = &search.candidates[candidate];
        let effect = described.application.effect;
        let place = after.structure.candidates.iter().position(|c| *c == candidate);
        let brought = place.and_then(|place| after.structure.brought.get(place));
        let own: Vec<String> = brought.map(|b| b.parameters.clone()).unwrap_or_default();
        let onset = brought.and_then(|brought| {
            let is_onset = |own: &&(String, String)| described.onsets.contains(&own.0);
            let (_, name) = brought.names.iter().find(is_onset)?;
            after.values.p.get(name).copied()
        });
        let rest: Vec<usize> = chosen.iter().copied().filter(|c| *c != candidate).collect();
        let mut windows = match search.base.structure(search.candidates, &rest) {
            Ok(without) => activity::windows(
                &after.structure,
                &without,
                &after.values,
                data.train,
                &data.options,
            ),
            Err(_) => vec![Vec::new(); data.train.len()],
        };
        let condition = circumstances.condition(&windows);
        let alternatives = search.alternatives(chosen, candidate);
        let told_apart_by = alternatives.first().map(|other| self.told_apart_by(&other.structure));
        FoundEffect {
            name: described.name(),
            kind: described.kind(),
            form: effect.form.as_ref().map(|form| form.text.clone()),
            doc: effect.doc.clone(),
            target: described.target(),
            alternatives: alternatives.into_iter().map(|other| other.alternative).collect(),
            told_apart_by,
            onset,
            windows: windows.swap_remove(0),
            condition,
            parameters: parameters(after, &own),
            evidence,
        }
    }

    /// The unknown on which two structures that fit alike disagree most, in units of its size.
    fn told_apart_by(&self, other: &[usize]) -> String {
        let own = self.search.fitted(self.chosen);
        let largest = own.zip(self.search.fitted(other)).and_then(|(a, b)| {
            let recording = &self.data.train[0];
            activity::largest_disagreement(a, b, recording, &self.data.options)
        });
        match largest {
            Some((name, difference, unit)) => {
                let difference = difference / unit.factor.abs();
                let symbol = &unit.symbol;
                format!(
                    "a measurement of `{name}`: the two differ by up to {difference:.2e} {symbol}"
                )
            }
            None => "a test with other inputs, perhaps; this recording cannot tell them apart"
                .to_owned(),
        }
    }
}

/// Estimated parameters of a fit by name; all that were estimated where no names are given.
pub(crate) fn parameters(fitted: &Fitted, names: &[String]) -> Vec<ParameterValue> {
    let signature = fitted.structure.system.signature();
    let wanted = |name: &str| names.is_empty() || names.iter().any(|other| other == name);
    let estimates = fitted.estimates.iter().filter(|estimate| estimate.recording.is_none());
    let value = |estimate: &Estimate| {
        let parameter = signature.parameters.iter().find(|p| p.name == estimate.name)?;
        Some(ParameterValue {
            name: estimate.name.clone(),
            unit: parameter.unit.clone(),
            value: estimate.value,
            std: estimate.std,
        })
    };
    estimates.filter(|estimate| wanted(&estimate.name)).filter_map(value).collect()
}
