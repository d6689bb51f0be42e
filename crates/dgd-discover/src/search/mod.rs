//! The search over structures: candidates and recordings in, an [`JudgedOutcome`] out.
//!
//! ```text
//!   fit the base model ─ nothing but noise? ─► sufficient
//!        │ no
//!        ▼
//!   screen all candidates ─► refit the most promising ─ nothing but noise? ─► effects
//!        ▲                                                │ no
//!        └──── from each of the best few, one effect more ┘
//!   exchange each effect of the best structure for its near twins
//! ```
//!
//! Two effects that are missing together are rarely found one after the other: alone, a wrong twin often fits best. So
//! the search continues from several structures at a time, and accepted effects may be exchanged.
//!
//! The verdict depends only on a ranking and thresholds ([`Verdict::decide`]); a search makes the fits that a question
//! needs, asks, and asks again if the evidence contradicts the answer.

mod activity;
mod alternatives;
mod cancelling;
#[cfg(test)]
mod draining;
mod effort;
mod evidence;
mod measures;
mod ranking;
mod refits;
mod screen;
mod screened;
mod thresholds;
mod tried;
mod verdict;
mod weights;

pub(crate) use activity::{DivergentUnknown, farthest_apart, largest_disagreement, windows};
pub use alternatives::Alternative;
pub use evidence::Evidence;
pub(crate) use evidence::p_value_of_the_base;
pub(crate) use screen::{CandidateScore, ScoreRemedy, Screen, SilentCandidate, best_first};
pub(crate) use thresholds::Thresholds;
pub(crate) use tried::{EffectSearch, OpenCandidates};
pub(crate) use verdict::JudgedOutcome;
pub use verdict::Verdict;

use std::collections::BTreeMap;

use crate::fit::NoFit;
use crate::library::{MOST_EFFECTS, StructureId};
use effort::BEAM;
use ranking::{RankedStanding, VerdictQuestion};
use screen::are_parallel;
use verdict::Judge;

/// Number of screened candidates that are refitted, by number of effects already included.
const REFITTED: [usize; MOST_EFFECTS] = [8, 3, 3];

impl EffectSearch<'_> {
    /// Searches on top of the fitted base model: first with the library, then, if that does not explain everything,
    /// with templates as well, in one ranking.
    pub(crate) fn run(&mut self) -> JudgedOutcome {
        self.refuse();
        if !self.is_noise(StructureId::BASE) {
            self.try_coloured_noise();
        }
        let base = self.judged(VerdictQuestion::IsSufficient);
        if base == JudgedOutcome::Sufficient && self.holds(base) {
            return base;
        }
        let of_library = self.search(vec![StructureId::BASE]);
        if of_library != JudgedOutcome::Unexplained {
            return of_library;
        }
        let nearly_all = self.nearly_all();
        let nearly_all =
            if self.holds(nearly_all) { nearly_all } else { JudgedOutcome::Unexplained };
        if self.range(OpenCandidates::Templates).is_empty() {
            return nearly_all;
        }
        self.open_templates();
        if nearly_all != JudgedOutcome::Unexplained {
            // Its remaining discrepancy may have another name, or all of it a name that explains more with no more
            // effects.
            let whole = nearly_all.structure();
            return match self.search(vec![StructureId::BASE, whole]) {
                JudgedOutcome::Effects(other)
                    if whole.is_part_of(other) || other.len() <= whole.len() =>
                {
                    JudgedOutcome::Effects(other)
                }
                _ => nearly_all,
            };
        }
        let explained = self.search(self.beginnings());
        if explained != JudgedOutcome::Unexplained {
            return explained;
        }
        // A discrepancy without a name may still be described, but not by fits that began from a diverging model.
        if !self.runs_away() {
            self.finish_templates();
        }
        let nearly_all = self.nearly_all();
        if nearly_all != JudgedOutcome::Unexplained && self.holds(nearly_all) {
            return nearly_all;
        }
        let most = self.judged(VerdictQuestion::WhatIsMost);
        if self.holds(most) { most } else { JudgedOutcome::Unexplained }
    }

    /// The starting structures of a search with templates: the base model, and the best structures of the library that
    /// reduce the misfit.
    fn beginnings(&self) -> Vec<StructureId> {
        let error = |of| self.training_sum(of);
        let base = error(StructureId::BASE);
        let mut best = self.ranked();
        best.retain(|&one| one.len() == 1 && error(one) < self.thresholds.mostly * base);
        best.truncate(BEAM);
        std::iter::once(StructureId::BASE).chain(best).collect()
    }

    /// The verdict on the structures tried so far.
    fn judged(&self, question: VerdictQuestion) -> JudgedOutcome {
        Verdict::decide(&self.ranking(question), &self.thresholds)
    }

    /// Whether the fitted base model diverges from the recordings.
    fn runs_away(&self) -> bool {
        self.fitted(StructureId::BASE).is_some_and(|base| base.runs_away(&self.data))
    }

    /// Opens the templates. Equivalents of a library effect keep the library's name.
    fn open_templates(&mut self) {
        self.open = OpenCandidates::All;
        self.refuse();
        let known = self.screened_of(OpenCandidates::Library, StructureId::BASE);
        let screened = self.screened_of(OpenCandidates::Templates, StructureId::BASE);
        let with_a_name = |score: &CandidateScore| {
            let known = known.iter().find(|known| are_parallel(known, score))?;
            Some((score.candidate, known.candidate))
        };
        let mut doubled: BTreeMap<usize, usize> = screened.iter().filter_map(with_a_name).collect();
        // Of two equivalent forms at one place, the first is used.
        let mut by_order: Vec<&CandidateScore> = screened.iter().collect();
        by_order.sort_by_key(|score| score.candidate);
        for (k, score) in by_order.iter().enumerate() {
            let place = self.candidates[score.candidate].target();
            let twin = by_order[..k].iter().find(|other| {
                self.candidates[other.candidate].target() == place && are_parallel(other, score)
            });
            if let Some(twin) = twin {
                doubled.entry(score.candidate).or_insert(twin.candidate);
            }
        }
        self.doubled = doubled;
    }

    /// Removes candidates that do not give a valid model.
    fn refuse(&mut self) {
        let range = self.range(self.open);
        for (candidate, refused) in self.base.refused(self.candidates, range, self.threads) {
            let refused = NoFit::NotApplied(refused);
            self.tried.insert(StructureId::one(candidate), Err(refused));
        }
    }

    /// Searches the open candidates for effects that some structures lack.
    fn search(&mut self, mut frontier: Vec<StructureId>) -> JudgedOutcome {
        // If the base model diverges, screens cannot tell which effects combine.
        let is_short = self.runs_away() && self.open != OpenCandidates::Library;
        let rounds = if is_short { 1 } else { REFITTED.len() };
        for refitted in REFITTED.into_iter().take(rounds) {
            self.grow(&frontier, refitted);
            self.exchange();
            let ranked = self.ranked();
            if ranked.first().is_none_or(|best| self.explains(*best)) {
                break;
            }
            let depth = frontier.iter().map(|structure| structure.len()).min().unwrap_or(0);
            if depth > 0 && !ranked.first().is_some_and(|best| self.is_promising(*best)) {
                break;
            }
            let is_open = |s: &StructureId| s.effects().all(|c| self.is_open(c));
            frontier =
                ranked.into_iter().filter(|s| s.len() > depth && is_open(s)).take(BEAM).collect();
            if frontier.is_empty() {
                break;
            }
        }
        self.try_near_forms();
        self.try_other_forms();
        self.try_forms_from_the_best();
        self.try_elsewhere();
        self.finish_rivals();
        self.explaining()
    }

    /// The structure that explains the data and is not contradicted by its evidence.
    fn explaining(&mut self) -> JudgedOutcome {
        let mut unfinished = self.ranked();
        unfinished.retain(|one| self.may_be_said(*one) && self.explains(*one));
        unfinished.truncate(BEAM);
        self.finish(&unfinished);
        loop {
            let outcome = self.judged(VerdictQuestion::WhatExplains);
            if self.holds(outcome) {
                return outcome;
            }
        }
    }

    /// The verdict if effects explain nearly all of the discrepancy, after the fits needed to compare them. Effects of
    /// little influence are left out.
    fn nearly_all(&mut self) -> JudgedOutcome {
        let thresholds = self.thresholds;
        let whole = Judge::new(&self.ranking(VerdictQuestion::WhatExplains), &thresholds)
            .without_spare_parts();
        let Some(mut best) = whole else { return JudgedOutcome::Unexplained };
        let question = loop {
            if best.is_base() {
                return JudgedOutcome::Unexplained;
            }
            self.finish(&[best]);
            // An effect at a bound cannot be named, but the rest may suffice without it.
            if let Some(effect) = self.at_bound(best).first() {
                let rest = best.without_candidate(*effect);
                self.settle(rest, best);
                best = rest;
                continue;
            }
            let question = VerdictQuestion::IsNearlyAll(best);
            if !Judge::new(&self.ranking(question), &thresholds).takes_nearly_all(best) {
                return JudgedOutcome::Unexplained;
            }
            for effect in best.effects() {
                self.settle(best.without_candidate(effect), best);
            }
            let ranking = self.ranking(question);
            let judge = Judge::new(&ranking, &thresholds);
            let Some(spare) = best.effects().find(|effect| !judge.is_essential(*effect, best))
            else {
                break question;
            };
            best = best.without_candidate(spare);
        };
        if self.finish_near_forms(best) {
            let explained = self.explaining();
            return if explained == JudgedOutcome::Unexplained {
                self.nearly_all()
            } else {
                explained
            };
        }
        let structures = |rivals: Vec<&RankedStanding<'_>>| -> Vec<StructureId> {
            rivals.iter().map(|rival| rival.structure).collect()
        };
        let rivals = structures(Judge::new(&self.ranking(question), &thresholds).rivals(best));
        self.finish(&rivals);
        self.judged(question)
    }
}

#[cfg(test)]
mod tests {
    use dgd_identify::{BoundReached, ParameterEstimate};
    use dgd_runtime::Direction;

    use super::draining::{SAMPLES, id, leaving, with_effects};
    use super::*;
    use crate::fit::FittedStructure;

    /// Names of effects, by position.
    const DENSITY: usize = 0;
    const CLOCK: usize = 1;
    const INFLUX: usize = 2;
    const NAMES: [&str; 3] = ["density", "clock", "influx"];

    /// The penalty of each effect in the criterion: two parameters.
    fn cost() -> f64 {
        2.0 * (SAMPLES as f64).ln()
    }

    /// The verdict on structures with these mean squares of residuals relative to the noise.
    fn nearly_all(left: &[(&[usize], f64)]) -> JudgedOutcome {
        nearly_all_at_bound(left, &[])
    }

    /// The same if an effect's parameters end at a bound in these structures.
    fn nearly_all_at_bound(
        left: &[(&[usize], f64)],
        at_bound: &[(&[usize], usize)],
    ) -> JudgedOutcome {
        with_effects(NAMES, |base, candidates, data| {
            let fitted = |(chosen, left): &(&[usize], f64)| {
                let structure = base.structure(candidates, id(chosen)).expect("a structure");
                let brought = structure.id.effects().zip(&structure.brought);
                let estimates = brought.flat_map(|(effect, brought)| {
                    let is_at_bound = at_bound.contains(&(chosen, effect));
                    brought.parameters.iter().enumerate().map(move |(i, name)| ParameterEstimate {
                        name: name.clone(),
                        of: Direction::Parameter(i),
                        recording: None,
                        value: 0.0,
                        std: None,
                        at_bound: is_at_bound.then_some(BoundReached::Lower),
                    })
                });
                let estimates = estimates.collect();
                let fitted = leaving(*left, structure);
                (id(chosen), Ok(FittedStructure { estimates, valid: Some(Vec::new()), ..fitted }))
            };
            let all = || left.iter().map(|(chosen, _)| id(chosen));
            let mut search = EffectSearch {
                tried: left.iter().map(fitted).collect(),
                // Marks everything as settled, so that nothing is refitted.
                settled: all().flat_map(|part| all().map(move |whole| (part, whole))).collect(),
                ..EffectSearch::new(base, candidates, data, 1, 1)
            };
            search.nearly_all()
        })
    }

    /// The mean square that remains after adding, to an effect that leaves 1.18 of 400, an effect that lowers the
    /// criterion by `gain`.
    fn beside(gain: f64) -> f64 {
        // n (1.18 − left)/left − cost = gain: the least that is left is the unit.
        1.18 / (1.0 + (gain + cost()) / SAMPLES as f64)
    }

    #[test]
    fn a_name_with_a_spare_part_beside_it_is_named_without() {
        let name: &[usize] = &[DENSITY];
        let tried: [(&[usize], f64); 5] = [
            (&[], 400.0),
            (name, 1.18),
            (&[CLOCK], 390.0),
            (&[DENSITY, CLOCK], beside(5.0)),
            (&[DENSITY, INFLUX], 1.17),
        ];
        assert_eq!(nearly_all(&tried), JudgedOutcome::NearlyAll(id(name)));
        let Thresholds { least_gain, .. } = Thresholds::default();
        // Even if the criterion favours the part, its influence is small.
        let with =
            |gain: f64| tried.map(|(s, left)| (s, if s.len() < 2 { left } else { beside(gain) }));
        for gain in [least_gain - 1.0, least_gain + 1.0] {
            assert_eq!(nearly_all(&with(gain)), JudgedOutcome::NearlyAll(id(name)));
        }
    }

    #[test]
    fn a_name_with_a_part_at_its_bound_beside_it_is_named_without() {
        let (name, both): (&[usize], &[usize]) = (&[DENSITY], &[DENSITY, CLOCK]);
        let tried: [(&[usize], f64); 3] = [(&[], 400.0), (name, 1.18), (both, 1.0)];
        let at_bound = |effect| nearly_all_at_bound(&tried, &[(both, effect)]);
        assert_eq!(at_bound(CLOCK), JudgedOutcome::NearlyAll(id(name)));
        // Without the name that is at its bound, far more is left.
        assert_eq!(at_bound(DENSITY), JudgedOutcome::Unexplained);
    }

    #[test]
    fn another_name_that_leaves_as_little_is_a_rival() {
        let Thresholds { unrivalled, .. } = Thresholds::default();
        let alone: [(&[usize], f64); 2] = [(&[], 400.0), (&[DENSITY], 1.18)];
        assert_ne!(nearly_all(&alone), JudgedOutcome::Unexplained);
        for rival in [&[INFLUX] as &[usize], &[CLOCK, INFLUX]] {
            let tried = |left: f64| [&alone[..], &[(rival, left)]].concat();
            assert_ne!(nearly_all(&tried(1.6 * unrivalled)), JudgedOutcome::Unexplained);
            assert_eq!(nearly_all(&tried(1.3)), JudgedOutcome::Unexplained);
        }
    }
}
