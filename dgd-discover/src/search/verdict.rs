//! What is believed of a ranking, and nothing else: no fit, no recording.
//!
//! Structures are ranked by the Bayesian information criterion; one is named only if it leaves nothing
//! but the sensors' noise, on validation recordings too, or nearly nothing of what there was.

use super::ranking::{HeldOutMisfit, Question, Ranking, Standing};
use super::thresholds::Thresholds;
use crate::library::StructureId;

/// The short of a discovery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The base model explains the data.
    Sufficient,
    /// Something was missing, and has a name.
    Effects,
    /// Something is missing, and no known effect passes.
    Unexplained,
}

impl Verdict {
    /// The word in `result.json`.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Sufficient => "sufficient",
            Verdict::Effects => "effects",
            Verdict::Unexplained => "unexplained",
        }
    }

    /// The verdict on a ranking, with the structure that it is about.
    pub(crate) fn of(ranking: &Ranking<'_>, thresholds: &Thresholds) -> Outcome {
        let judge = Judge::new(ranking, thresholds);
        let outcome = match ranking.question {
            Question::IsSufficient => judge.sufficient(),
            Question::WhatExplains => judge.simplest(),
            Question::IsNearlyAll(structure) => judge.nearly_all(structure),
            Question::WhatIsMost => judge.most(),
        };
        outcome.unwrap_or(Outcome::Unexplained)
    }
}

/// A verdict with the structure that it is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The base model explains the data.
    Sufficient,
    /// A structure with effects does.
    Effects(StructureId),
    /// None does, but effects of the library leave nearly nothing of the discrepancy.
    NearlyAll(StructureId),
    /// None does, but templates take most of the discrepancy away.
    Most(StructureId),
    /// None does.
    Unexplained,
}

impl Outcome {
    /// The short of it. Templates that leave more than noise explain nothing.
    pub(crate) fn verdict(self) -> Verdict {
        match self {
            Outcome::Sufficient => Verdict::Sufficient,
            Outcome::Effects(_) | Outcome::NearlyAll(_) => Verdict::Effects,
            Outcome::Most(_) | Outcome::Unexplained => Verdict::Unexplained,
        }
    }

    /// The structure that it is about.
    pub(crate) fn structure(self) -> StructureId {
        match self {
            Outcome::Sufficient | Outcome::Unexplained => StructureId::BASE,
            Outcome::Effects(structure)
            | Outcome::NearlyAll(structure)
            | Outcome::Most(structure) => structure,
        }
    }
}

/// Decides by a ranking and thresholds alone.
#[derive(Clone, Copy)]
pub(crate) struct Judge<'a, 'r> {
    ranking: &'a Ranking<'r>,
    thresholds: &'a Thresholds,
}

impl<'a, 'r> Judge<'a, 'r> {
    pub(crate) fn new(ranking: &'a Ranking<'r>, thresholds: &'a Thresholds) -> Self {
        Judge { ranking, thresholds }
    }

    /// The base model, where it leaves nothing but noise.
    fn sufficient(self) -> Option<Outcome> {
        let base = self.ranking.get(StructureId::BASE)?;
        (*base.is_noise).then_some(Outcome::Sufficient)
    }

    /// The simplest structure that explains the data, unless one with more effects is worth them.
    fn simplest(self) -> Option<Outcome> {
        let Thresholds { explained, nearly_explained_held_out, .. } = *self.thresholds;
        let ranked = &self.ranking.standings;
        let mut best =
            ranked.iter().find(|standing| self.explains(standing) && is_believable(standing))?;
        // A simpler one is believed although it predicts a little worse: that may be its estimates,
        // and a name that only noise suggests is worse than none.
        let nearly = |standing: &&Standing<'_>| {
            standing.misfit.is_at_most(explained, nearly_explained_held_out)
                && is_believable(standing)
        };
        while let Some(simpler) = ranked.iter().filter(nearly).find(|simpler| {
            simpler.structure.len() < best.structure.len() && !self.is_worth(best, simpler)
        }) {
            best = simpler;
        }
        // Where little is left of the base model already, every effect explains the rest.
        let base = self.ranking.get(StructureId::BASE);
        let is_idle = base.is_some_and(|base| {
            base.is_doubted && self.explains(base) && !self.is_worth(best, base)
        });
        match best.structure {
            StructureId::BASE => Some(Outcome::Sufficient),
            _ if is_idle => None,
            structure => Some(Outcome::Effects(structure)),
        }
    }

    /// A structure of effects of the library that takes nearly all of the discrepancy away, none of which
    /// can be spared, and with which no other names compare. What it leaves is more than noise: a plant
    /// is never all in its model.
    fn nearly_all(self, structure: StructureId) -> Option<Outcome> {
        let is_essential = |effect| self.is_essential(effect, structure);
        (self.takes_nearly_all(structure)
            && structure.effects().all(is_essential)
            && self.is_unrivalled(structure))
        .then_some(Outcome::NearlyAll(structure))
    }

    /// A structure of templates that leaves more than noise and yet is the answer as far as it goes:
    /// it takes most of the discrepancy away, from validation recordings as well, and every other that
    /// is no longer takes away clearly less.
    fn most(self) -> Option<Outcome> {
        let Thresholds { mostly, clearly, .. } = *self.thresholds;
        let ranked = &self.ranking.standings;
        let best = ranked.first()?;
        let [all_trained, all_held_out] = self.ranking.get(StructureId::BASE)?.misfit.squares()?;
        let [trained, held_out] = best.misfit.squares()?;
        let [trained, held_out] = [trained / all_trained, held_out / all_held_out];
        let structure = best.structure;
        let rivals = ranked.iter().filter(|Standing { structure: other, .. }| {
            let shares_one = structure.effects().any(|effect| other.contains(effect));
            other.len() <= structure.len() && !shares_one && !other.is_base()
        });
        let of_rivals = rivals.filter_map(|rival| rival.misfit.training_square());
        let rival = of_rivals.fold(f64::INFINITY, f64::min) / all_trained;
        let is_clear = !structure.is_base()
            && best.names.is_empty()
            && is_believable(best)
            && trained < mostly
            && held_out < mostly
            && trained < clearly * rival;
        is_clear.then_some(Outcome::Most(structure))
    }

    /// Whether a structure leaves so little that nothing need be missing.
    fn explains(self, standing: &Standing<'_>) -> bool {
        let Thresholds { explained, explained_held_out, .. } = *self.thresholds;
        standing.misfit.is_at_most(explained, explained_held_out)
    }

    /// Whether the effects that one structure has more than another are worth their place.
    fn is_worth(self, longer: &Standing<'_>, shorter: &Standing<'_>) -> bool {
        let Thresholds { worth_its_place, least_gain, .. } = *self.thresholds;
        let excess = |(sum, n): (f64, usize)| sum - n as f64;
        let halves = |longer, shorter| excess(longer) < worth_its_place * excess(shorter);
        (shorter.is_doubted || !*shorter.is_noise)
            && shorter.criterion - longer.criterion > least_gain
            && halves(longer.error, shorter.error)
            && match (&longer.misfit.held_out, &shorter.misfit.held_out) {
                (HeldOutMisfit::NoRecording, _) => true,
                (
                    HeldOutMisfit::Left { error: longer, .. },
                    HeldOutMisfit::Left { error: shorter, .. },
                ) => halves(*longer, *shorter),
                _ => false,
            }
    }

    /// The best structure, or a part of it whose rest the Bayesian information criterion hardly asks for.
    pub(crate) fn without_spare_parts(self) -> Option<StructureId> {
        let ranked = &self.ranking.standings;
        let mut best = ranked.first()?;
        while let Some(part) = ranked.iter().find(|part| {
            part.structure.is_part_of(best.structure)
                && part.criterion - best.criterion < self.thresholds.least_gain
        }) {
            best = part;
        }
        Some(best.structure)
    }

    /// Whether effects that may be named leave next to nothing of what the base model does.
    pub(crate) fn takes_nearly_all(self, structure: StructureId) -> bool {
        let Thresholds { nearly_all, nearly_all_held_out, .. } = *self.thresholds;
        let Some(standing) = self.ranking.get(structure) else { return false };
        let squares = |of: &Standing<'_>| of.misfit.squares();
        let base = self.ranking.get(StructureId::BASE);
        is_believable(standing)
            && match (squares(standing), base.and_then(squares)) {
                (Some([trained, held_out]), Some([all_trained, all_held_out])) => {
                    trained <= nearly_all * all_trained
                        && held_out <= nearly_all_held_out * all_held_out
                }
                _ => false,
            }
    }

    /// Whether far more is left without an effect of a structure, as far as that was fitted.
    pub(crate) fn is_essential(self, effect: usize, structure: StructureId) -> bool {
        let left = |of: StructureId| self.ranking.get(of)?.misfit.training_square();
        let without = left(structure.without(effect)).unwrap_or(f64::INFINITY);
        let is_spare = |left: f64| without < self.thresholds.essential * left;
        left(structure).is_some_and(|left| !is_spare(left))
    }

    /// Structures with other names that leave about as little of the training recordings. More effects beside
    /// a structure's own do not count.
    pub(crate) fn rivals(self, structure: StructureId) -> Vec<&'a Standing<'r>> {
        let Some(own) = self.ranking.get(structure) else { return Vec::new() };
        let Some([trained, _]) = own.misfit.squares() else { return Vec::new() };
        let is_rival = |other: &&Standing<'_>| {
            let left = other.misfit.training_square().unwrap_or(f64::INFINITY);
            left < self.thresholds.unrivalled * trained && !other.names.is_superset(&own.names)
        };
        self.ranking.standings.iter().filter(is_rival).collect()
    }

    /// Whether clearly more is left with other names, in training or in validation recordings.
    fn is_unrivalled(self, structure: StructureId) -> bool {
        let own = self.ranking.get(structure).and_then(|own| own.misfit.squares());
        own.is_some_and(|[_, held_out]| {
            self.rivals(structure).iter().all(|rival| {
                rival
                    .misfit
                    .squares()
                    .is_none_or(|[_, of_rival]| of_rival > self.thresholds.unrivalled * held_out)
            })
        })
    }
}

/// Whether the effects of a structure may be named: none is at a bound, takes another back or is doubted.
fn is_believable(standing: &Standing<'_>) -> bool {
    standing.is_sound && !standing.is_doubted && !*standing.is_cancelling
}

#[cfg(test)]
mod tests {
    use super::super::ranking::{Asked, Misfit};
    use super::*;

    /// Samples of one output, in training and in validation recordings alike.
    const SAMPLES: usize = 1000;

    /// Positions of effects of the library; from here on, templates.
    const LEAK: usize = 0;
    const RAIN: usize = 1;
    const TEMPLATE: usize = 10;
    const OTHER_TEMPLATE: usize = 11;

    /// A structure that leaves so many times the noise in training and in validation recordings. Each effect
    /// has two parameters.
    fn left(effects: &[usize], training: f64, held_out: f64) -> Standing<'static> {
        let all = |square: f64| (square * SAMPLES as f64, SAMPLES);
        let specific = effects.iter().filter(|effect| **effect < TEMPLATE);
        let misfit = Misfit {
            trained: vec![all(training)],
            held_out: HeldOutMisfit::Left { by_output: vec![all(held_out)], error: all(held_out) },
        };
        Standing {
            structure: effects.iter().copied().collect(),
            names: specific.map(|effect| format!("effect {effect}")).collect(),
            criterion: all(training).0 + 2.0 * effects.len() as f64 * (SAMPLES as f64).ln(),
            error: all(training),
            misfit: known(misfit),
            is_noise: known(training <= 1.05),
            is_sound: true,
            is_doubted: false,
            is_cancelling: known(false),
        }
    }

    fn known<T: 'static>(value: T) -> Asked<'static, T> {
        Asked::new(Box::new(|| value))
    }

    fn of(question: Question, mut standings: Vec<Standing<'static>>) -> Outcome {
        standings.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        Verdict::of(&Ranking { standings, question }, &Thresholds::default())
    }

    fn explaining(standings: Vec<Standing<'static>>) -> Outcome {
        of(Question::WhatExplains, standings)
    }

    fn one(effect: usize) -> StructureId {
        StructureId::one(effect)
    }

    #[test]
    fn a_model_is_sufficient_where_it_leaves_noise() {
        assert_eq!(of(Question::IsSufficient, vec![left(&[], 1.0, 1.0)]), Outcome::Sufficient);
        assert_eq!(of(Question::IsSufficient, vec![left(&[], 1.2, 1.0)]), Outcome::Unexplained);
        // An effect that takes little away is not worth its place.
        let tried = vec![left(&[], 1.08, 1.08), left(&[LEAK], 1.03, 1.06)];
        assert_eq!(explaining(tried), Outcome::Sufficient);
        assert_eq!(Outcome::Sufficient.verdict(), Verdict::Sufficient);
    }

    #[test]
    fn an_effect_that_leaves_noise_is_named() {
        let tried = |held_out| vec![left(&[], 5.0, 5.0), left(&[LEAK], 1.0, held_out)];
        assert_eq!(explaining(tried(1.4)), Outcome::Effects(one(LEAK)));
        assert_eq!(explaining(tried(1.5)), Outcome::Unexplained);
        assert_eq!(Outcome::Effects(one(LEAK)).verdict(), Verdict::Effects);
    }

    #[test]
    fn two_effects_are_named_where_one_leaves_twice_the_excess() {
        let both: StructureId = [LEAK, RAIN].into_iter().collect();
        let tried = |alone| {
            vec![left(&[], 5.0, 5.0), left(&[LEAK], alone, 2.2), left(&[LEAK, RAIN], 1.0, 1.0)]
        };
        assert_eq!(explaining(tried(1.2)), Outcome::Effects(both));
        assert_eq!(explaining(tried(1.04)), Outcome::Effects(one(LEAK)));
    }

    #[test]
    fn what_cannot_be_believed_is_passed_over() {
        let with = |change: fn(&mut Standing<'static>)| {
            let mut best = left(&[RAIN], 1.0, 1.0);
            change(&mut best);
            explaining(vec![left(&[], 5.0, 5.0), left(&[LEAK], 1.05, 1.0), best])
        };
        assert_eq!(with(|_| {}), Outcome::Effects(one(RAIN)));
        assert_eq!(with(|best| best.is_sound = false), Outcome::Effects(one(LEAK)));
        assert_eq!(with(|best| best.is_doubted = true), Outcome::Effects(one(LEAK)));
        assert_eq!(with(|best| best.is_cancelling = known(true)), Outcome::Effects(one(LEAK)));
    }

    #[test]
    fn a_base_model_that_is_doubted_needs_an_effect_that_is_worth_its_place() {
        let tried = |with_it| {
            let doubted = Standing { is_doubted: true, ..left(&[], 1.08, 1.08) };
            explaining(vec![doubted, left(&[LEAK], with_it, 1.03)])
        };
        assert_eq!(tried(1.06), Outcome::Unexplained);
        assert_eq!(tried(1.01), Outcome::Effects(one(LEAK)));
    }

    #[test]
    fn an_effect_that_leaves_next_to_nothing_is_named_without_a_rival() {
        let question = Question::IsNearlyAll(one(LEAK));
        let verdict = |held_out, others: Vec<Standing<'static>>| {
            let own = vec![left(&[], 400.0, 400.0), left(&[LEAK], 4.0, held_out)];
            of(question, own.into_iter().chain(others).collect())
        };
        assert_eq!(verdict(30.0, vec![]), Outcome::NearlyAll(one(LEAK)));
        assert_eq!(verdict(50.0, vec![]), Outcome::Unexplained);
        assert_eq!(verdict(30.0, vec![left(&[RAIN], 5.0, 30.0)]), Outcome::Unexplained);
        // A rival that predicts far worse is none, nor is the effect with another beside it.
        let fine = vec![left(&[RAIN], 5.0, 50.0), left(&[LEAK, RAIN], 3.0, 30.0)];
        assert_eq!(verdict(30.0, fine), Outcome::NearlyAll(one(LEAK)));
        assert_eq!(Outcome::NearlyAll(one(LEAK)).verdict(), Verdict::Effects);
    }

    #[test]
    fn each_of_several_effects_that_leave_next_to_nothing_is_essential() {
        let both: StructureId = [LEAK, RAIN].into_iter().collect();
        let verdict = |alone| {
            let tried = vec![
                left(&[], 400.0, 400.0),
                left(&[LEAK], alone, 300.0),
                left(&[RAIN], 300.0, 300.0),
                left(&[LEAK, RAIN], 4.0, 4.0),
            ];
            of(Question::IsNearlyAll(both), tried)
        };
        assert_eq!(verdict(13.0), Outcome::NearlyAll(both));
        assert_eq!(verdict(11.0), Outcome::Unexplained);
    }

    #[test]
    fn templates_that_leave_clearly_least_name_most() {
        let verdict = |best: f64, rival: f64, effect| {
            let tried = vec![
                left(&[], 100.0, 100.0),
                left(&[effect], best, best),
                left(&[OTHER_TEMPLATE], rival, rival),
            ];
            of(Question::WhatIsMost, tried)
        };
        let most = Outcome::Most(one(TEMPLATE));
        assert_eq!(verdict(30.0, 40.0, TEMPLATE), most);
        assert_eq!(verdict(30.0, 35.0, TEMPLATE), Outcome::Unexplained);
        assert_eq!(verdict(45.0, 90.0, TEMPLATE), Outcome::Unexplained);
        assert_eq!(verdict(30.0, 40.0, LEAK), Outcome::Unexplained);
        assert_eq!(most.verdict(), Verdict::Unexplained);
        assert_eq!(most.structure(), one(TEMPLATE));
    }

    #[test]
    fn nothing_is_believed_of_what_validation_recordings_cannot_be_simulated_with() {
        let mut best = left(&[LEAK], 1.0, 1.0);
        let trained = best.misfit.trained.clone();
        best.misfit = known(Misfit { trained, held_out: HeldOutMisfit::NoSimulation });
        assert_eq!(explaining(vec![left(&[], 5.0, 5.0), best]), Outcome::Unexplained);
    }
}
