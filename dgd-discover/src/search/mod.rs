//! Which structures are tried, and which of them is believed: candidates and recordings in, an [`Outcome`] out.
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
//! Two effects that are hidden together are rarely found one after the other: the wrong twin often
//! fits best while it is alone. So the search goes on from several structures at a time, and what
//! was accepted may be exchanged.
//!
//! A ranking and thresholds alone decide what is believed ([`Verdict::of`]); a search makes the fits
//! that a question needs, asks, and asks again where the evidence contradicts the answer.

mod activity;
mod alternatives;
mod cancelling;
#[cfg(test)]
mod draining;
mod evidence;
mod gates;
mod measures;
mod ranking;
mod refits;
mod screen;
mod screened;
mod thresholds;
mod tried;
mod verdict;
mod weights;

pub(crate) use activity::{largest_disagreement, windows};
pub use alternatives::Alternative;
pub use evidence::Evidence;
pub(crate) use evidence::p_value_of_the_base;
pub(crate) use screen::{Remedy, Score, Screen, Silent, best_first};
pub(crate) use thresholds::Thresholds;
pub(crate) use tried::{Open, Search};
pub(crate) use verdict::Outcome;
pub use verdict::Verdict;

use crate::fit::NoFit;
use crate::library::{MOST_EFFECTS, StructureId};
use ranking::{Question, Standing};
use refits::BEAM;
use screen::are_parallel;
use verdict::Judge;

/// How many of the screened candidates are refitted, by number of effects that are in already.
const REFITTED: [usize; MOST_EFFECTS] = [8, 3, 3];

impl Search<'_> {
    /// Searches on top of the base model, which is fitted already: first with the library, and with templates
    /// where that explains nothing.
    pub(crate) fn run(&mut self) -> Outcome {
        self.refuse();
        if !self.is_noise(StructureId::BASE) {
            self.try_coloured_noise();
        }
        let base = self.judged(Question::IsSufficient);
        if base == Outcome::Sufficient && self.holds(base) {
            return base;
        }
        let of_library = self.search();
        if of_library != Outcome::Unexplained {
            return of_library;
        }
        let nearly_all = self.nearly_all();
        if nearly_all != Outcome::Unexplained && self.holds(nearly_all) {
            return nearly_all;
        }
        if self.range(Open::Templates).is_empty() {
            return of_library;
        }
        self.open_templates();
        match self.search() {
            Outcome::Unexplained => {
                self.finish_templates();
                let most = self.judged(Question::WhatIsMost);
                if self.holds(most) { most } else { of_library }
            }
            Outcome::Effects(structure) if self.is_specific(structure) => of_library,
            explained => explained,
        }
    }

    /// The verdict on what was tried so far.
    fn judged(&self, question: Question) -> Outcome {
        Verdict::of(&self.ranking(question), &self.thresholds)
    }

    /// Goes on with templates. What the library has under a name of its own goes by that name.
    fn open_templates(&mut self) {
        self.open = Open::Templates;
        self.refuse();
        let known = self.screened_of(Open::Library, StructureId::BASE);
        let screened = self.screened(StructureId::BASE);
        let with_a_name = |score: &Score| {
            let known = known.iter().find(|known| are_parallel(known, score))?;
            Some((score.candidate, known.candidate))
        };
        self.doubled = screened.iter().filter_map(with_a_name).collect();
    }

    /// Takes out candidates that make no sound model.
    fn refuse(&mut self) {
        for candidate in self.range(self.open) {
            let alone = StructureId::one(candidate);
            if let Err(refused) = self.base.structure(self.candidates, alone) {
                let reason = format!("cannot be applied: {}", refused.0);
                self.tried.insert(alone, Err(NoFit(reason)));
            }
        }
    }

    /// Looks for what the base model lacks among the candidates that are open.
    fn search(&mut self) -> Outcome {
        let mut frontier = vec![StructureId::BASE];
        for refitted in REFITTED {
            self.grow(&frontier, refitted);
            self.exchange();
            let ranked = self.ranked();
            if ranked.first().is_none_or(|best| self.explains(*best)) {
                break;
            }
            let depth = frontier.first().map_or(0, |structure| structure.len());
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
        self.try_other_forms();
        loop {
            let outcome = self.judged(Question::WhatExplains);
            if self.holds(outcome) {
                return outcome;
            }
        }
    }

    /// The verdict where effects of the library leave nearly nothing of the discrepancy, after the fits that it
    /// takes to compare them.
    fn nearly_all(&mut self) -> Outcome {
        let thresholds = self.thresholds;
        let best =
            Judge::new(&self.ranking(Question::WhatExplains), &thresholds).without_spare_parts();
        let Some(best) = best.filter(|best| !best.is_base()) else { return Outcome::Unexplained };
        self.finish(&[best]);
        let question = Question::IsNearlyAll(best);
        let is_open = |judge: Judge<'_, '_>| {
            judge.without_spare_parts() == Some(best) && judge.takes_nearly_all(best)
        };
        if !is_open(Judge::new(&self.ranking(question), &thresholds)) {
            return Outcome::Unexplained;
        }
        for effect in best.effects() {
            self.settle(best.without(effect), best);
            if !Judge::new(&self.ranking(question), &thresholds).is_essential(effect, best) {
                return Outcome::Unexplained;
            }
        }
        let structures = |rivals: Vec<&Standing<'_>>| -> Vec<StructureId> {
            rivals.iter().map(|rival| rival.structure).collect()
        };
        let rivals = structures(Judge::new(&self.ranking(question), &thresholds).rivals(best));
        self.finish(&rivals);
        self.judged(question)
    }
}

#[cfg(test)]
mod tests {
    use dgd_identify::Estimate;
    use dgd_runtime::Direction;

    use super::draining::{SAMPLES, id, leaving, with_effects};
    use super::*;
    use crate::fit::Fitted;

    /// Names of effects, by position.
    const DENSITY: usize = 0;
    const CLOCK: usize = 1;
    const INFLUX: usize = 2;
    const NAMES: [&str; 3] = ["density", "clock", "influx"];

    /// What each effect costs of the criterion: two parameters.
    fn cost() -> f64 {
        2.0 * (SAMPLES as f64).ln()
    }

    /// The verdict on structures of which each leaves so many times the noise's mean square of the errors.
    fn nearly_all(left: &[(&[usize], f64)]) -> Outcome {
        with_effects(NAMES, |base, candidates, data| {
            let fitted = |(chosen, left): &(&[usize], f64)| {
                let structure = base.structure(candidates, id(chosen)).expect("a structure");
                let parameters = structure.brought.iter().flat_map(|brought| &brought.parameters);
                let estimate = |(i, name): (usize, &String)| Estimate {
                    name: name.clone(),
                    of: Direction::Parameter(i),
                    recording: None,
                    value: 0.0,
                    std: None,
                    at_bound: None,
                };
                let estimates = parameters.enumerate().map(estimate).collect();
                let fitted = leaving(*left, structure);
                (id(chosen), Ok(Fitted { estimates, valid: Some(Vec::new()), ..fitted }))
            };
            let all = || left.iter().map(|(chosen, _)| id(chosen));
            let mut search = Search {
                tried: left.iter().map(fitted).collect(),
                // Nothing is fitted once more.
                settled: all().flat_map(|part| all().map(move |whole| (part, whole))).collect(),
                ..Search::new(base, candidates, data, 1, 1)
            };
            search.nearly_all()
        })
    }

    /// What a name leaves that leaves 1.18 of 400 times the noise, with an effect beside it for which the
    /// criterion falls by `gain`.
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
        assert_eq!(nearly_all(&tried), Outcome::NearlyAll(id(name)));
        let Thresholds { least_gain, .. } = Thresholds::default();
        // Until the part is asked for; it then belongs to the answer, and is not essential to it.
        let with =
            |gain: f64| tried.map(|(s, left)| (s, if s.len() < 2 { left } else { beside(gain) }));
        assert_ne!(nearly_all(&with(least_gain - 1.0)), Outcome::Unexplained);
        assert_eq!(nearly_all(&with(least_gain + 1.0)), Outcome::Unexplained);
    }

    #[test]
    fn another_name_that_leaves_as_little_is_a_rival() {
        let Thresholds { unrivalled, .. } = Thresholds::default();
        let alone: [(&[usize], f64); 2] = [(&[], 400.0), (&[DENSITY], 1.18)];
        assert_ne!(nearly_all(&alone), Outcome::Unexplained);
        for rival in [&[INFLUX] as &[usize], &[CLOCK, INFLUX]] {
            let tried = |left: f64| [&alone[..], &[(rival, left)]].concat();
            assert_ne!(nearly_all(&tried(1.6 * unrivalled)), Outcome::Unexplained);
            assert_eq!(nearly_all(&tried(1.3)), Outcome::Unexplained);
        }
    }
}
