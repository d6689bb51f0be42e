//! Reports a law.

use std::collections::BTreeSet;

use super::discovery::{FoundLaw, NearForm, RivalLaw};
use crate::fit::FittedStructure;
use crate::law::{AnsweringLaw, FittedTerms};
use crate::library::{EffectCandidate, StructureId};
use crate::search::{EffectSearch, largest_disagreement};

/// A law with the constants of its last fit.
pub(crate) fn found_law(law: &AnsweringLaw, fitted: &FittedStructure) -> FoundLaw {
    let AnsweringLaw { inserted, near } = law;
    let near =
        near.iter().map(|(formula, ratio)| NearForm { formula: formula.clone(), ratio: *ratio });
    FoundLaw {
        terms: inserted.terms(fitted),
        ranges: inserted.ranges.clone(),
        near: near.collect(),
    }
}

/// Laws that explain the recordings equally well, and effects that do so too, if a structure has any.
pub(crate) fn rival_laws(
    laws: &[FittedTerms],
    search: &EffectSearch<'_>,
    doubted: StructureId,
) -> Vec<RivalLaw> {
    let Some(first) = laws.first() else { return Vec::new() };
    let data = &search.data;
    let told_apart_by = |other: &FittedStructure| {
        let train = data.train.first()?;
        let apart = largest_disagreement(&first.fitted, other, train, &data.options);
        Some(apart.map_or_else(
            || "a test with other inputs".to_owned(),
            |apart| format!("a measurement of `{}`", apart.name),
        ))
    };
    let rival = |fitted: &FittedStructure| RivalLaw {
        terms: Vec::new(),
        effects: Vec::new(),
        left: (fitted.mean_square(), fitted.held_out_square(data)),
        told_apart_by: None,
    };
    let of_law = |(k, law): (usize, &FittedTerms)| RivalLaw {
        terms: law.terms(&law.fitted),
        told_apart_by: if k > 0 { told_apart_by(&law.fitted) } else { None },
        ..rival(&law.fitted)
    };
    let mut rivals: Vec<RivalLaw> = laws.iter().enumerate().map(of_law).collect();
    let effects = || doubted.effects().map(|effect| &search.candidates[effect]);
    // A law in the same equations is the same answer.
    let targets: BTreeSet<String> = effects().map(EffectCandidate::target).collect();
    let is_law = |law: &FittedTerms| law.targets().iter().copied().eq(targets.iter());
    let is_told = doubted.is_base() || laws.iter().any(is_law);
    if let Some(fitted) = search.fitted(doubted).filter(|_| !is_told) {
        let sensor = effects().find(|effect| effect.kind() == "sensor");
        rivals.push(RivalLaw {
            effects: doubted.effects().map(|effect| search.called(effect)).collect(),
            told_apart_by: match sensor {
                Some(sensor) => Some(format!("a second sensor of `{}`", sensor.target())),
                None => told_apart_by(fitted),
            },
            ..rival(fitted)
        });
    }
    rivals
}
