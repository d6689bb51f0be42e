//! Reports an identified effect.

use dgd_identify::ParameterEstimate;
use dgd_runtime::System;
use dgd_runtime::signature::number::short;

use super::discovery::{FoundEffect, ParameterValue};
use super::model_spread::ModelSpread;
use crate::conditions::Circumstances;
use crate::fit::{FittedStructure, SearchData};
use crate::library::StructureId;
use crate::search::{self, DivergentUnknown, EffectSearch, Evidence};

/// Data for the report on the effects of the accepted structure.
pub(crate) struct EffectReport<'a> {
    pub search: &'a EffectSearch<'a>,
    pub data: &'a SearchData<'a>,
    pub structure: StructureId,
    pub after: &'a FittedStructure,
    /// Uncertainty of the estimates of `after` because of remaining model error.
    pub model_spread: &'a ModelSpread,
    pub circumstances: &'a Circumstances,
}

impl EffectReport<'_> {
    /// The report on one effect of the structure.
    pub(crate) fn effect(&self, candidate: usize, evidence: Evidence) -> FoundEffect {
        let EffectReport { search, data, structure, after, model_spread, circumstances } = *self;
        let described = &search.candidates[candidate];
        let effect = described.application.effect;
        let brought = after.structure.brought_by(candidate);
        let parameter_names: Vec<String> =
            brought.map(|b| b.parameters.clone()).unwrap_or_default();
        let onset = brought.and_then(|brought| {
            let is_onset = |name: &&(String, String)| described.onsets.contains(&name.0);
            let (_, name) = brought.names.iter().find(is_onset)?;
            after.values.p.get(name).copied()
        });
        let rest = structure.without_candidate(candidate);
        let mut windows = match search.base.structure(search.candidates, rest) {
            Ok(without) => search::windows(
                &after.structure,
                &without,
                &after.values,
                data.train,
                &data.options,
            ),
            Err(_) => vec![Vec::new(); data.train.len()],
        };
        let condition = circumstances.condition(&windows);
        let replacements = search.replacements(structure, candidate);
        let told_apart_by =
            replacements.others.first().map(|other| self.told_apart_by(other.structure));
        FoundEffect {
            name: described.name(),
            kind: described.kind(),
            form: described.form(),
            doc: effect.doc.clone(),
            target: described.target(),
            alternatives: (replacements.others.into_iter())
                .map(|other| other.alternative)
                .collect(),
            other_forms: replacements.forms,
            told_apart_by,
            onset,
            windows: windows.swap_remove(0),
            condition,
            parameters: parameters(after, model_spread, &parameter_names),
            evidence,
        }
    }

    /// The unknown in which two equally good structures differ most, in units of its size.
    fn told_apart_by(&self, other: StructureId) -> String {
        let named = self.search.fitted(self.structure);
        let largest = named.zip(self.search.fitted(other)).and_then(|(a, b)| {
            let recording = &self.data.train[0];
            search::largest_disagreement(a, b, recording, &self.data.options)
        });
        match largest {
            Some(DivergentUnknown { name, difference, unit }) => {
                let difference = difference / unit.factor.abs();
                let symbol = &unit.symbol;
                format!(
                    "a measurement of `{name}`: the two differ by up to {} {symbol}",
                    short(difference, 3)
                )
            }
            None => "a test with other inputs: this recording cannot tell them apart".to_owned(),
        }
    }
}

/// Estimated parameters of a fit by name; all if no names are given.
pub(crate) fn parameters(
    fitted: &FittedStructure,
    model_spread: &ModelSpread,
    names: &[String],
) -> Vec<ParameterValue> {
    let signature = fitted.structure.system.signature();
    let wanted = |name: &str| names.is_empty() || names.iter().any(|other| other == name);
    let estimates = fitted.estimates.iter().filter(|estimate| estimate.recording.is_none());
    let value = |estimate: &ParameterEstimate| {
        let parameter = signature.parameters.iter().find(|p| p.name == estimate.name)?;
        Some(ParameterValue {
            name: estimate.name.clone(),
            unit: parameter.unit.clone(),
            value: estimate.value,
            std: estimate.std,
            std_model: model_spread.get(&estimate.name),
        })
    };
    estimates.filter(|estimate| wanted(&estimate.name)).filter_map(value).collect()
}
