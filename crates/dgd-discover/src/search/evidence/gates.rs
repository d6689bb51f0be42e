//! Conditions on the evidence for a verdict.
//!
//! | verdict | holds only if |
//! |---|---|
//! | `sufficient` | in at least one of ten thousand resamples, noise gains the best candidate as much as the data |
//! | an effect that is named | its own p-value is at most `significant` |
//! | | it, another form of it or an alternative is in the best structure of a share `included` of the resamples |
//! | | at least `aside` readings come before its onset, and after it |
//! | | no parameter of it is at a bound (`verdict.rs`) |
//! | | without validation data, it predicts left-out quarters to the noise or to half of the base model's mean square |
//!
//! A structure that does not hold is doubted, with the reason, and the search continues with the next.

use rand_pcg::Pcg64;

use super::super::screen::{
    BLOCKS, PointTrial, RESAMPLES, blocks, gain, independent_blocks, p_value, weighted,
};
use super::super::tried::{EffectSearch, OpenCandidates};
use super::super::verdict::JudgedOutcome;
use super::{Evidence, ResampledContender, WeighedEvidence, inclusion, is_no_chance};
use crate::fit::FittedStructure;
use crate::library::StructureId;

impl EffectSearch<'_> {
    /// Whether the evidence supports an outcome. If not, the outcome is doubted from then on.
    pub(crate) fn holds(&mut self, outcome: JudgedOutcome) -> bool {
        let doubt = match outcome {
            JudgedOutcome::Sufficient => self.doubt_of_the_base(),
            JudgedOutcome::Effects(structure) | JudgedOutcome::NearlyAll(structure) => {
                self.doubt(structure).or_else(|| self.doubt_of_parts(structure))
            }
            JudgedOutcome::Most(structure) => self.doubt(structure),
            JudgedOutcome::Unexplained => None,
        };
        let holds = doubt.is_none();
        let structure = outcome.described().unwrap_or(outcome.structure());
        self.doubted.extend(doubt.map(|why| (structure, why)));
        holds
    }

    /// Evidence for each effect of a structure, in its order.
    pub(crate) fn evidence(&mut self, structure: StructureId) -> Vec<Evidence> {
        self.weighed(structure).into_iter().map(|weighed| weighed.evidence).collect()
    }

    fn weighed(&mut self, structure: StructureId) -> Vec<WeighedEvidence> {
        if let Some(known) = self.evidence.get(&structure) {
            return known.clone();
        }
        let weighed: Vec<WeighedEvidence> =
            structure.effects().map(|effect| self.weigh(structure, effect)).collect();
        self.evidence.insert(structure, weighed.clone());
        weighed
    }

    /// Evidence for one effect of a structure.
    fn weigh(&mut self, structure: StructureId, effect: usize) -> WeighedEvidence {
        let rest = structure.without_candidate(effect);
        let bic_gain = self.bic(rest).zip(self.bic(structure)).map_or(0.0, |(a, b)| a - b);
        let mut random = Pcg64::new(u128::from(self.seed), 1 + effect as u128);
        let sizes = self.sizes_of_noise(structure, rest);
        let trials: Vec<PointTrial> =
            self.trials(rest).into_iter().map(|trial| trial.with_errors_of(&sizes)).collect();
        let of_effect = trials.iter().filter(|trial| trial.candidate == effect);
        // The first-order promise of a large effect, or one with jumps, is far below the gain of its refit.
        let left = |of: StructureId| self.training_error(of).map_or(0.0, |(sum, _)| sum);
        let observed = gain(of_effect).max(left(rest) - left(structure));
        let p_value = p_value(&trials, observed, &mut random);
        let contenders = self.contenders(structure, effect);
        let [inclusion, with_alike] = inclusion(&contenders, self.unit(), &mut random);
        let evidence = Evidence { p_value, resamples: RESAMPLES, bic_gain, inclusion };
        WeighedEvidence { evidence, with_alike }
    }

    /// The size of the noise in each block, as a fraction of the errors that a structure's rest leaves there.
    ///
    /// Errors that the effect explains are not noise. Where it shows in only a few blocks, their random signs often
    /// agree by chance, and then gain as much. All sizes are one if the structure does not explain the data.
    fn sizes_of_noise(&self, structure: StructureId, rest: StructureId) -> [f64; BLOCKS] {
        let mut sizes = [1.0; BLOCKS];
        let fits = self.fitted(structure).zip(self.fitted(rest));
        if let Some((whole, rest)) = fits.filter(|_| self.explains(structure)) {
            let number = independent_blocks(&self.data);
            let sums = [whole, rest].map(|fitted| self.sums_of_blocks(fitted, number));
            for (size, (noise, all)) in sizes.iter_mut().zip(sums[0].iter().zip(&sums[1])) {
                *size = if noise < all { (noise / all).sqrt() } else { 1.0 };
            }
        }
        sizes
    }

    /// Σ ε² of each of a number of blocks.
    fn sums_of_blocks(&self, fitted: &FittedStructure, number: usize) -> [f64; BLOCKS] {
        let residuals = fitted.residuals(&self.data);
        let mut sums = [0.0; BLOCKS];
        let errors = weighted(&self.data, &residuals);
        for (e, block) in errors.iter().zip(blocks(&self.data, &residuals, number)) {
            sums[block] += e * e;
        }
        sums
    }

    /// All structures, to look for an effect of one of them in resamples. Other forms of the effect, other templates at
    /// its place and its alternatives count as alike.
    fn contenders(&self, structure: StructureId, effect: usize) -> Vec<ResampledContender> {
        let alternatives = self.replacements(structure, effect).others;
        let alternatives = alternatives.into_iter().map(|other| other.candidate);
        let is_form = |c: &usize| self.are_forms(*c, effect) || self.are_near(*c, effect);
        let forms = (0..self.candidates.len()).filter(is_form);
        let alike: Vec<usize> = alternatives.chain(forms).collect();
        let contender = |of: StructureId| {
            let fitted = self.fitted(of)?;
            let (_, samples) = fitted.error;
            let penalty = fitted.free() as f64 * (samples as f64).ln();
            let has_effect = of.contains(effect);
            let either = has_effect || alike.iter().any(|other| of.contains(*other));
            let sums = self.sums_of_blocks(fitted, BLOCKS);
            Some(ResampledContender { has: [has_effect, either], penalty, sums })
        };
        self.ranked().into_iter().filter_map(contender).collect()
    }

    /// Why the base model is not sufficient although its residuals are as small as noise.
    fn doubt_of_the_base(&mut self) -> Option<String> {
        let open = if self.range(OpenCandidates::Library).is_empty() {
            OpenCandidates::Templates
        } else {
            OpenCandidates::Library
        };
        let screen = self.screen_of_the_base(open);
        let is_no_chance = is_no_chance(&screen.trials, self.seed);
        self.base_screens.insert(open, screen);
        is_no_chance.then(|| {
            "an effect would take more from the residuals than from any of ten thousand resamples of them"
                .to_owned()
        })
    }

    /// Why the evidence contradicts a structure.
    fn doubt(&mut self, structure: StructureId) -> Option<String> {
        let onsets = structure.effects().find_map(|c| self.doubt_of_onset(structure, c));
        if onsets.is_some() {
            return onsets;
        }
        let weighed = self.weighed(structure);
        structure.effects().zip(weighed).find_map(
            |(c, WeighedEvidence { evidence, with_alike })| {
                let (name, p) = (self.called(c), evidence.p_value);
                if p > self.thresholds.significant {
                    return Some(format!("`{name}` may be chance (p = {p:.3})"));
                }
                (with_alike < self.thresholds.included).then(|| {
                    let percent = 100.0 * with_alike;
                    format!("only {percent:.0} % of the resampled recordings ask for `{name}`")
                })
            },
        )
    }

    /// Why a structure without validation data is rejected: it predicts left-out parts of the recordings hardly better
    /// than the base model.
    fn doubt_of_parts(&self, structure: StructureId) -> Option<String> {
        if !self.data.valid.is_empty() || self.data.is_spent() {
            return None;
        }
        let mean = |of: StructureId| {
            let left = self.cross_validated(of)?;
            Some(left.iter().sum::<f64>() / left.len().max(1) as f64)
        };
        let Some(left) = mean(structure) else {
            return Some(
                "parts of the recordings cannot be predicted without their readings".to_owned(),
            );
        };
        let of_base = mean(StructureId::BASE)?;
        let is_better = left <= self.thresholds.explained_held_out
            || left <= self.thresholds.worth_its_place * of_base;
        (!is_better).then(|| {
            format!(
                "parts of the recordings that it was not fitted to are predicted to {left:.2} times the noise variance, \
                 and to {of_base:.2} times without it"
            )
        })
    }

    /// Why an onset is not credible.
    fn doubt_of_onset(&self, structure: StructureId, candidate: usize) -> Option<String> {
        let onset = self.onset(structure, candidate)?;
        let (mut before, mut after) = (0, 0);
        for recording in self.data.train {
            for (k, t) in recording.times.iter().enumerate() {
                let is_read = recording.measured.iter().flatten().any(|of| of[k].is_finite());
                before += usize::from(is_read && *t <= onset);
                after += usize::from(is_read && *t > onset);
            }
        }
        let (count, side) = if before < after { (before, "before") } else { (after, "after") };
        (count < self.thresholds.aside).then(|| {
            let name = self.called(candidate);
            let (s, come) = if count == 1 { ("", "comes") } else { ("s", "come") };
            format!("only {count} reading{s} {come} {side} the onset of `{name}`")
        })
    }

    /// The best doubted structure, or otherwise the base model, with the reason.
    pub(crate) fn doubts(&self) -> Option<(StructureId, &str)> {
        let doubt_of =
            |structure: StructureId| Some((structure, self.doubted.get(&structure)?.as_str()));
        let best = self.ranked().into_iter().filter(|one| !one.is_base()).find_map(doubt_of);
        best.or_else(|| doubt_of(StructureId::BASE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::FittedStructure;
    use crate::library::CarriedValues;
    use crate::search::draining::{SAMPLES, id, leaving, with_effects};
    use crate::search::screen::{BLOCKS, ErrorBlocks, OrthonormalBasis, PointTrial, Screen};

    /// The doubt about an effect with an onset at time `since`, given what structures leave of a mean square of 1.2;
    /// the first structure is the effect alone.
    fn doubt(since: f64, left: &[(&[usize], f64)]) -> Option<String> {
        // Unit errors unrelated to a column, whose gain is therefore about one.
        let errors: Vec<f64> =
            (0..SAMPLES).map(|k| if k / 3 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let column: Vec<f64> = (0..SAMPLES).map(|k| if k < 480 { 0.0 } else { 1.0 }).collect();
        let blocks = (0..SAMPLES).map(|k| k * BLOCKS / SAMPLES).collect();
        let errors = ErrorBlocks::new(&errors, blocks, &OrthonormalBasis::new(&[]));
        let contrasts = vec![errors.contrast(&column, [f64::NEG_INFINITY, f64::INFINITY])];
        let trials = vec![PointTrial { candidate: 0, contrasts }];
        let screen = Screen { trials, ..Screen::default() };
        with_effects(["inflow", "leak", "rain"], |base, candidates, data| {
            let fitted = |(chosen, left): &(&[usize], f64)| {
                let structure = base.structure(candidates, id(chosen)).expect("a structure");
                let onset = ("since_inflow".to_owned(), since);
                let values = CarriedValues { p: [onset].into(), starts: Vec::new() };
                (id(chosen), Ok(FittedStructure { values, ..leaving(*left, structure) }))
            };
            let base_alone: (&[usize], f64) = (&[], 1.2);
            let mut search = EffectSearch {
                tried: left.iter().chain([&base_alone]).map(fitted).collect(),
                screens: [((OpenCandidates::Library, StructureId::BASE), screen)].into(),
                ..EffectSearch::new(base, candidates, data, 1, 1)
            };
            let held = search.holds(JudgedOutcome::Effects(StructureId::one(0)));
            let doubt = search.doubted.get(&StructureId::one(0)).cloned();
            assert_eq!(held, doubt.is_none());
            doubt
        })
    }

    #[test]
    fn what_gains_far_more_than_chance_is_believed() {
        assert_eq!(doubt(500.0, &[(&[0], 1.0)]), None);
    }

    #[test]
    fn what_gains_as_much_as_chance_is_doubted() {
        let doubt =
            doubt(500.0, &[(&[0], 1.1999)]).expect("a gain of a tenth of a unit does not count");
        assert!(doubt.contains("`inflow` may be chance (p = 0."), "{doubt}");
    }

    #[test]
    fn an_effect_that_resampled_recordings_do_not_ask_for_is_doubted_unless_its_alternatives_are() {
        let doubted = doubt(500.0, &[(&[0], 1.0), (&[1, 2], 0.9)]).expect("others are better");
        assert_eq!(doubted, "only 0 % of the resampled recordings ask for `inflow`");
        assert_eq!(doubt(500.0, &[(&[0], 1.0), (&[1], 0.99)]), None);
    }

    #[test]
    fn an_onset_has_readings_on_both_sides() {
        let sides = [(991.5, ""), (992.5, "after"), (998.5, "after"), (3.0, "before"), (7.0, "")];
        for (since, side) in sides {
            match doubt(since, &[(&[0], 1.0)]) {
                None => assert_eq!(side, "", "{since} s"),
                Some(doubt) => {
                    assert!(!side.is_empty() && doubt.contains(side), "{since} s: {doubt}");
                }
            }
        }
    }
}
