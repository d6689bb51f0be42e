//! Decides the verdict from a ranking alone, without fits or recordings.
//!
//! Structures are ranked by the Bayesian information criterion; one is named only if it leaves only the sensors' noise,
//! on validation recordings too, or almost none of the discrepancy.

use super::ranking::{HeldOutMisfit, RankedStanding, Ranking, VerdictQuestion};
use super::thresholds::Thresholds;
use crate::library::StructureId;

/// The verdict of a discovery.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The base model explains the data.
    Sufficient,
    /// Something was missing, and was identified.
    Effects,
    /// Something was missing that has no name in the library, and a formula for it was found.
    Law,
    /// Nothing is missing: a number of the model's text is wrong, or the recordings are.
    Plain,
    /// Something is missing, and no known effect passes the tests.
    Unexplained,
}

impl Verdict {
    /// The word in `result.json`.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Sufficient => "sufficient",
            Verdict::Effects => "effects",
            Verdict::Law => "law",
            Verdict::Plain => "plain",
            Verdict::Unexplained => "unexplained",
        }
    }

    /// The verdict on a ranking, with its structure.
    pub(crate) fn decide(ranking: &Ranking<'_>, thresholds: &Thresholds) -> JudgedOutcome {
        let judge = Judge::new(ranking, thresholds);
        let outcome = match ranking.question {
            VerdictQuestion::IsSufficient => judge.sufficient(),
            VerdictQuestion::WhatExplains => judge.simplest(),
            VerdictQuestion::IsNearlyAll(structure) => judge.nearly_all(structure),
            VerdictQuestion::WhatIsMost => judge.most(),
        };
        outcome.unwrap_or(JudgedOutcome::Unexplained)
    }
}

/// A verdict with its structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum JudgedOutcome {
    /// The base model explains the data.
    Sufficient,
    /// A structure with effects explains the data.
    Effects(StructureId),
    /// No structure explains the data, but effects of the library explain nearly all of the discrepancy.
    NearlyAll(StructureId),
    /// No structure explains the data, but templates explain most of the discrepancy.
    Most(StructureId),
    /// No structure explains the data.
    Unexplained,
}

impl JudgedOutcome {
    /// The verdict. Templates that leave more than noise explain nothing.
    pub(crate) fn verdict(self) -> Verdict {
        match self {
            JudgedOutcome::Sufficient => Verdict::Sufficient,
            JudgedOutcome::Effects(_) | JudgedOutcome::NearlyAll(_) => Verdict::Effects,
            JudgedOutcome::Most(_) | JudgedOutcome::Unexplained => Verdict::Unexplained,
        }
    }

    /// The structure whose effects are named.
    pub(crate) fn structure(self) -> StructureId {
        match self {
            JudgedOutcome::Sufficient | JudgedOutcome::Most(_) | JudgedOutcome::Unexplained => {
                StructureId::BASE
            }
            JudgedOutcome::Effects(structure) | JudgedOutcome::NearlyAll(structure) => structure,
        }
    }

    /// The structure that describes the recordings, if it is not named.
    pub(crate) fn described(self) -> Option<StructureId> {
        match self {
            JudgedOutcome::Most(structure) => Some(structure),
            _ => None,
        }
    }
}

/// Decides from a ranking and thresholds alone.
#[derive(Clone, Copy)]
pub(crate) struct Judge<'a, 'r> {
    ranking: &'a Ranking<'r>,
    thresholds: &'a Thresholds,
}

impl<'a, 'r> Judge<'a, 'r> {
    pub(crate) fn new(ranking: &'a Ranking<'r>, thresholds: &'a Thresholds) -> Self {
        Judge { ranking, thresholds }
    }

    /// The base model, if it leaves only noise and predicts validation recordings.
    fn sufficient(self) -> Option<JudgedOutcome> {
        let base = self.ranking.get(StructureId::BASE)?;
        let limit = self.thresholds.nearly_explained_held_out;
        (*base.is_noise && base.misfit.is_at_most(f64::INFINITY, limit))
            .then_some(JudgedOutcome::Sufficient)
    }

    /// The simplest structure that explains the data, unless one with more effects is worth them.
    fn simplest(self) -> Option<JudgedOutcome> {
        let Thresholds { explained, nearly_explained_held_out, least_gain, .. } = *self.thresholds;
        let ranked = &self.ranking.standings;
        let first = ranked
            .iter()
            .find(|standing| self.explains(standing) && self.may_be_named(standing))?;
        // A structure that is hardly less likely may predict the validation recordings better.
        let mut best = ranked
            .iter()
            .filter(|other| {
                other.structure.len() == first.structure.len()
                    && other.criterion - first.criterion < least_gain
                    && self.explains(other)
                    && self.may_be_named(other)
            })
            .min_by(|a, b| likelihood(a).total_cmp(&likelihood(b)))?;
        // A simpler structure is preferred even if it predicts slightly worse: the difference may be due to its
        // estimates, and a name that only noise suggests is worse than none.
        let nearly = |standing: &&RankedStanding<'_>| {
            standing.misfit.is_at_most(explained, nearly_explained_held_out)
                && self.may_be_named(standing)
        };
        // Of two forms of a template at one place, the one with more parameters must also be worth them.
        let is_simpler = |simpler: &RankedStanding<'_>, best: &RankedStanding<'_>| {
            let is_form = !best.is_specific() && simpler.names == best.names;
            simpler.structure.len() < best.structure.len()
                || (is_form
                    && simpler.structure.len() == best.structure.len()
                    && simpler.numbers < best.numbers)
        };
        let is_worth = |best: &RankedStanding<'_>, simpler: &RankedStanding<'_>| {
            if simpler.structure.len() < best.structure.len() {
                return self.is_worth(best, simpler);
            }
            // For forms of one effect, the criterion decides.
            simpler.criterion - best.criterion > least_gain
        };
        while let Some(simpler) = ranked
            .iter()
            .filter(nearly)
            .find(|simpler| is_simpler(simpler, best) && !is_worth(best, simpler))
        {
            best = simpler;
        }
        // Of two equivalent templates the plainer one is used, and of the same one at two places the first place,
        // regardless of rounding.
        let even = self.thresholds.even;
        let order = |standing: &RankedStanding<'_>| Some((standing.template?, standing.structure));
        let plainer = ranked.iter().filter(nearly).filter(|other| {
            self.explains(other)
                && order(other).is_some_and(|other| order(best).is_some_and(|own| other < own))
                && likelihood(other) - likelihood(best) < even
        });
        best = plainer.min_by_key(|other| order(other)).unwrap_or(best);
        // If the base model already leaves little, any effect explains the rest.
        let base = self.ranking.get(StructureId::BASE);
        let is_idle = base.is_some_and(|base| {
            base.is_doubted && self.explains(base) && !self.is_worth(best, base)
        });
        match best.structure {
            StructureId::BASE => Some(JudgedOutcome::Sufficient),
            _ if is_idle => None,
            structure => Some(JudgedOutcome::Effects(structure)),
        }
    }

    /// A structure of effects that explains nearly all of the discrepancy, with no dispensable effect and no comparable
    /// rival. It leaves more than noise: no model captures all of a plant.
    fn nearly_all(self, structure: StructureId) -> Option<JudgedOutcome> {
        let is_essential = |effect| self.is_essential(effect, structure);
        (self.takes_nearly_all(structure)
            && structure.effects().all(is_essential)
            && self.is_unrivalled(structure))
        .then_some(JudgedOutcome::NearlyAll(structure))
    }

    /// The best structure of only templates that explains most of the discrepancy, in validation recordings too, but
    /// leaves more than noise: it describes the recordings.
    fn most(self) -> Option<JudgedOutcome> {
        let Thresholds { mostly, .. } = *self.thresholds;
        let ranked = &self.ranking.standings;
        let [all_trained, all_held_out] = (*self.ranking.discrepancy)?;
        let looks_like = |standing: &&RankedStanding<'_>| {
            !standing.structure.is_base()
                && !standing.is_specific()
                && is_believable(standing)
                && standing.misfit.squares().is_some_and(|[trained, held_out]| {
                    trained < mostly * all_trained && held_out < mostly * all_held_out
                })
        };
        let best = ranked.iter().find(looks_like)?;
        Some(JudgedOutcome::Most(best.structure))
    }

    /// Whether effects may be named. Neither of two templates may serve only the remainder: a second template elsewhere
    /// usually absorbs what the wrong form at one place leaves.
    fn may_be_named(self, standing: &RankedStanding<'_>) -> bool {
        let is_one = standing.structure.len() < 2 || standing.is_specific();
        let is_needed = |effect: &usize| self.is_essential(*effect, standing.structure);
        is_believable(standing) && (is_one || standing.generic.iter().all(is_needed))
    }

    /// Whether a structure's residuals are so small that nothing else need be missing.
    fn explains(self, standing: &RankedStanding<'_>) -> bool {
        let Thresholds { explained, explained_held_out, .. } = *self.thresholds;
        standing.misfit.is_at_most(explained, explained_held_out)
    }

    /// Whether the additional effects of one structure over another are worth including.
    fn is_worth(self, longer: &RankedStanding<'_>, shorter: &RankedStanding<'_>) -> bool {
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

    /// The best structure, or a part of it if the Bayesian information criterion hardly favours the rest.
    pub(crate) fn without_spare_parts(self) -> Option<StructureId> {
        let ranked = &self.ranking.standings;
        let mut best = ranked.iter().find(|standing| standing.is_sayable)?;
        while let Some(part) = ranked.iter().find(|part| {
            part.structure.is_part_of(best.structure)
                && part.criterion - best.criterion < self.thresholds.least_gain
        }) {
            best = part;
        }
        Some(best.structure)
    }

    /// Whether effects that may be named leave almost nothing of the base model's excess.
    pub(crate) fn takes_nearly_all(self, structure: StructureId) -> bool {
        let Thresholds { nearly_all, nearly_all_held_out, .. } = *self.thresholds;
        let Some(standing) = self.ranking.get(structure) else { return false };
        is_believable(standing)
            && match (standing.misfit.squares(), *self.ranking.discrepancy) {
                (Some([trained, held_out]), Some([all_trained, all_held_out])) => {
                    // No effect can remove the noise itself.
                    let is_within =
                        |left: f64, share: f64, all: f64| left - 1.0 <= share * (all - 1.0);
                    is_within(trained, nearly_all, all_trained)
                        && is_within(held_out, nearly_all_held_out, all_held_out)
                }
                _ => false,
            }
    }

    /// Whether far more is left without an effect of a structure, as far as that was fitted.
    pub(crate) fn is_essential(self, effect: usize, structure: StructureId) -> bool {
        let left = |of: StructureId| self.ranking.get(of)?.misfit.training_square();
        let without = left(structure.without_candidate(effect)).unwrap_or(f64::INFINITY);
        let is_spare = |left: f64| without < self.thresholds.essential * left;
        left(structure).is_some_and(|left| !is_spare(left))
    }

    /// Structures with other names that leave about as little of the training recordings. Supersets of a structure's
    /// own effects do not count.
    pub(crate) fn rivals(self, structure: StructureId) -> Vec<&'a RankedStanding<'r>> {
        let Some(own) = self.ranking.get(structure) else { return Vec::new() };
        let Some([trained, _]) = own.misfit.squares() else { return Vec::new() };
        let is_rival = |other: &&RankedStanding<'_>| {
            let left = other.misfit.training_square().unwrap_or(f64::INFINITY);
            left < self.thresholds.unrivalled * trained && !other.names.is_superset(&own.names)
        };
        self.ranking.standings.iter().filter(is_rival).collect()
    }

    /// Whether other names leave clearly more, in training or in validation recordings.
    fn is_unrivalled(self, structure: StructureId) -> bool {
        let squares = self.ranking.get(structure).and_then(|own| own.misfit.squares());
        squares.is_some_and(|[_, held_out]| {
            self.rivals(structure).iter().all(|rival| {
                rival
                    .misfit
                    .squares()
                    .is_none_or(|[_, of_rival]| of_rival > self.thresholds.unrivalled * held_out)
            })
        })
    }
}

/// The criterion of a structure plus its validation error, as a measure of its likelihood; less is better. It was
/// fitted to the training recordings only.
fn likelihood(standing: &RankedStanding<'_>) -> f64 {
    let held_out = match &standing.misfit.held_out {
        HeldOutMisfit::Left { error: (sum, _), .. } => *sum,
        HeldOutMisfit::NoRecording | HeldOutMisfit::NoSimulation => 0.0,
    };
    standing.criterion + held_out
}

/// Whether the effects of a structure may be named: none is at a bound, cancels another or is doubted.
fn is_believable(standing: &RankedStanding<'_>) -> bool {
    standing.is_sayable && standing.is_sound && !standing.is_doubted && !*standing.is_cancelling
}

#[cfg(test)]
mod tests {
    use super::super::ranking::{LazyValue, StructureMisfit};
    use super::*;

    /// Samples of one output, in training and in validation recordings alike.
    const SAMPLES: usize = 1000;

    /// Positions of effects of the library; from here on, templates.
    const LEAK: usize = 0;
    const RAIN: usize = 1;
    const TEMPLATE: usize = 10;
    const OTHER_TEMPLATE: usize = 11;

    /// A structure with these mean squares relative to the noise in training and in validation recordings. Each effect
    /// has two parameters.
    fn left(effects: &[usize], training: f64, held_out: f64) -> RankedStanding<'static> {
        let all = |square: f64| (square * SAMPLES as f64, SAMPLES);
        let specific = effects.iter().filter(|effect| **effect < TEMPLATE);
        let misfit = StructureMisfit {
            trained: vec![all(training)],
            slack: Vec::new(),
            held_out: HeldOutMisfit::Left {
                by_output: vec![all(held_out)],
                error: all(held_out),
                slack: Vec::new(),
            },
        };
        RankedStanding {
            structure: effects.iter().copied().collect(),
            names: specific.map(|effect| format!("effect {effect}")).collect(),
            generic: effects.iter().copied().filter(|effect| *effect >= TEMPLATE).collect(),
            template: (effects.first().copied())
                .filter(|one| effects.len() == 1 && *one >= TEMPLATE)
                .map(|one| (false, one)),
            is_sayable: true,
            numbers: 2 * effects.len(),
            criterion: all(training).0 + 2.0 * effects.len() as f64 * (SAMPLES as f64).ln(),
            error: all(training),
            misfit: known(misfit),
            is_noise: known(training <= 1.05),
            is_sound: true,
            is_doubted: false,
            is_cancelling: known(false),
        }
    }

    fn known<T: 'static>(value: T) -> LazyValue<'static, T> {
        LazyValue::new(Box::new(|| value))
    }

    fn decide(
        question: VerdictQuestion,
        mut standings: Vec<RankedStanding<'static>>,
    ) -> JudgedOutcome {
        standings.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        let base = standings.iter().find(|standing| standing.structure.is_base());
        let discrepancy = known(base.and_then(|base| base.misfit.squares()));
        Verdict::decide(&Ranking { standings, question, discrepancy }, &Thresholds::default())
    }

    fn explaining(standings: Vec<RankedStanding<'static>>) -> JudgedOutcome {
        decide(VerdictQuestion::WhatExplains, standings)
    }

    fn one(effect: usize) -> StructureId {
        StructureId::one(effect)
    }

    #[test]
    fn a_model_is_sufficient_where_it_leaves_noise() {
        assert_eq!(
            decide(VerdictQuestion::IsSufficient, vec![left(&[], 1.0, 1.0)]),
            JudgedOutcome::Sufficient
        );
        assert_eq!(
            decide(VerdictQuestion::IsSufficient, vec![left(&[], 1.2, 1.0)]),
            JudgedOutcome::Unexplained
        );
        assert_eq!(
            decide(VerdictQuestion::IsSufficient, vec![left(&[], 1.0, 2.3)]),
            JudgedOutcome::Unexplained
        );
        // An effect that explains little is not worth including.
        let tried = vec![left(&[], 1.08, 1.08), left(&[LEAK], 1.03, 1.06)];
        assert_eq!(explaining(tried), JudgedOutcome::Sufficient);
        assert_eq!(JudgedOutcome::Sufficient.verdict(), Verdict::Sufficient);
    }

    #[test]
    fn an_effect_that_leaves_noise_is_named() {
        let tried = |held_out| vec![left(&[], 5.0, 5.0), left(&[LEAK], 1.0, held_out)];
        assert_eq!(explaining(tried(1.4)), JudgedOutcome::Effects(one(LEAK)));
        assert_eq!(explaining(tried(1.5)), JudgedOutcome::Unexplained);
        assert_eq!(JudgedOutcome::Effects(one(LEAK)).verdict(), Verdict::Effects);
    }

    #[test]
    fn two_effects_are_named_where_one_leaves_twice_the_excess() {
        let both: StructureId = [LEAK, RAIN].into_iter().collect();
        let tried = |alone| {
            vec![left(&[], 5.0, 5.0), left(&[LEAK], alone, 2.2), left(&[LEAK, RAIN], 1.0, 1.0)]
        };
        assert_eq!(explaining(tried(1.2)), JudgedOutcome::Effects(both));
        assert_eq!(explaining(tried(1.04)), JudgedOutcome::Effects(one(LEAK)));
    }

    #[test]
    fn two_templates_are_named_where_neither_is_there_for_the_rest_alone() {
        let both: StructureId = [TEMPLATE, OTHER_TEMPLATE].into_iter().collect();
        let verdict = |alone: f64| {
            let whole = left(&[TEMPLATE, OTHER_TEMPLATE], 1.0, 1.0);
            let parts = [left(&[TEMPLATE], alone, alone), left(&[OTHER_TEMPLATE], 5.0, 5.0)];
            explaining([left(&[], 9.0, 9.0), whole].into_iter().chain(parts).collect())
        };
        assert_eq!(verdict(4.0), JudgedOutcome::Effects(both));
        assert_eq!(verdict(2.0), JudgedOutcome::Unexplained);
    }

    #[test]
    fn what_cannot_be_believed_is_passed_over() {
        let with = |change: fn(&mut RankedStanding<'static>)| {
            let mut best = left(&[RAIN], 1.0, 1.0);
            change(&mut best);
            explaining(vec![left(&[], 5.0, 5.0), left(&[LEAK], 1.05, 1.0), best])
        };
        assert_eq!(with(|_| {}), JudgedOutcome::Effects(one(RAIN)));
        assert_eq!(with(|best| best.is_sound = false), JudgedOutcome::Effects(one(LEAK)));
        assert_eq!(with(|best| best.is_doubted = true), JudgedOutcome::Effects(one(LEAK)));
        assert_eq!(
            with(|best| best.is_cancelling = known(true)),
            JudgedOutcome::Effects(one(LEAK))
        );
    }

    #[test]
    fn a_base_model_that_is_doubted_needs_an_effect_that_is_worth_its_place() {
        let tried = |with_it| {
            let doubted = RankedStanding { is_doubted: true, ..left(&[], 1.08, 1.08) };
            explaining(vec![doubted, left(&[LEAK], with_it, 1.03)])
        };
        assert_eq!(tried(1.06), JudgedOutcome::Unexplained);
        assert_eq!(tried(1.01), JudgedOutcome::Effects(one(LEAK)));
    }

    #[test]
    fn an_effect_that_leaves_next_to_nothing_is_named_without_a_rival() {
        let question = VerdictQuestion::IsNearlyAll(one(LEAK));
        let verdict = |held_out, others: Vec<RankedStanding<'static>>| {
            let own = vec![left(&[], 400.0, 400.0), left(&[LEAK], 4.0, held_out)];
            decide(question, own.into_iter().chain(others).collect())
        };
        assert_eq!(verdict(30.0, vec![]), JudgedOutcome::NearlyAll(one(LEAK)));
        assert_eq!(verdict(50.0, vec![]), JudgedOutcome::Unexplained);
        assert_eq!(verdict(30.0, vec![left(&[RAIN], 5.0, 30.0)]), JudgedOutcome::Unexplained);
        // A rival that predicts far worse does not count, nor does a superset of the effect.
        let fine = vec![left(&[RAIN], 5.0, 50.0), left(&[LEAK, RAIN], 3.0, 30.0)];
        assert_eq!(verdict(30.0, fine), JudgedOutcome::NearlyAll(one(LEAK)));
        assert_eq!(JudgedOutcome::NearlyAll(one(LEAK)).verdict(), Verdict::Effects);
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
            decide(VerdictQuestion::IsNearlyAll(both), tried)
        };
        assert_eq!(verdict(13.0), JudgedOutcome::NearlyAll(both));
        assert_eq!(verdict(11.0), JudgedOutcome::Unexplained);
    }

    #[test]
    fn templates_that_take_most_away_are_described() {
        let verdict = |best: f64, effect| {
            let tried = vec![left(&[], 100.0, 100.0), left(&[effect], best, best)];
            decide(VerdictQuestion::WhatIsMost, tried)
        };
        let most = JudgedOutcome::Most(one(TEMPLATE));
        assert_eq!(verdict(30.0, TEMPLATE), most);
        assert_eq!(verdict(45.0, TEMPLATE), JudgedOutcome::Unexplained);
        // An effect that the library has is either named or not reported.
        assert_eq!(verdict(30.0, LEAK), JudgedOutcome::Unexplained);
        assert_eq!(most.verdict(), Verdict::Unexplained);
        assert_eq!((most.structure(), most.described()), (StructureId::BASE, Some(one(TEMPLATE))));
        // A structure that fits better but predicts worse does not count against it.
        let bent = left(&[OTHER_TEMPLATE], 20.0, 60.0);
        let tried = vec![left(&[], 100.0, 100.0), bent, left(&[TEMPLATE], 30.0, 30.0)];
        assert_eq!(decide(VerdictQuestion::WhatIsMost, tried), most);
    }

    #[test]
    fn of_two_forms_the_one_with_fewer_numbers_is_named_unless_the_other_is_worth_more() {
        let names: std::collections::BTreeSet<String> = ["at force".to_owned()].into();
        let verdict = |plain: f64| {
            let plain = RankedStanding { names: names.clone(), ..left(&[TEMPLATE], plain, plain) };
            let more = left(&[OTHER_TEMPLATE], 1.0, 1.0);
            let more = RankedStanding { names: names.clone(), numbers: 4, ..more };
            explaining(vec![left(&[], 5.0, 5.0), plain, more])
        };
        assert_eq!(verdict(1.02), JudgedOutcome::Effects(one(TEMPLATE)));
        assert_eq!(verdict(1.09), JudgedOutcome::Effects(one(OTHER_TEMPLATE)));
    }

    #[test]
    fn of_two_templates_that_leave_the_same_the_plainer_is_named() {
        let verdict = |plain: f64| {
            let base = left(&[], 5.0, 5.0);
            explaining(vec![base, left(&[TEMPLATE], plain, 1.0), left(&[OTHER_TEMPLATE], 1.0, 1.0)])
        };
        assert_eq!(verdict(1.001), JudgedOutcome::Effects(one(TEMPLATE)));
        assert_eq!(verdict(1.01), JudgedOutcome::Effects(one(OTHER_TEMPLATE)));
    }

    #[test]
    fn nothing_is_believed_of_what_validation_recordings_cannot_be_simulated_with() {
        let mut best = left(&[LEAK], 1.0, 1.0);
        let trained = best.misfit.trained.clone();
        let slack = Vec::new();
        best.misfit =
            known(StructureMisfit { trained, slack, held_out: HeldOutMisfit::NoSimulation });
        assert_eq!(explaining(vec![left(&[], 5.0, 5.0), best]), JudgedOutcome::Unexplained);
    }
}
