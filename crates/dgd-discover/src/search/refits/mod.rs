//! Chooses which structures are fitted, from which starting points, and how far.

mod elsewhere;
mod refit;

use std::borrow::Cow;

use dgd_runtime::System;

use super::effort::{BEAM, EVALUATIONS};
use super::screen::{CandidateScore, ScoreRemedy};
use super::tried::{EffectSearch, OpenCandidates};

use crate::fit::{FittedStructure, NoFit, StartPoint};
use crate::library::{EffectCandidate, MOST_EFFECTS, StructureId};
pub(super) use refit::ValidationUse;
use refit::{HOPELESS, ROUNDS, RefitRequest};

/// Number of further places at which forms are tried that begin like the one that does best there.
const OTHER_PLACES: usize = 3;

/// Number of near forms of a template that are tried.
const NEAR_FORMS: usize = 8;

/// Share of the largest promise in the base model from which a candidate is fitted, and the maximum number of these: a
/// screen around a base model that has strayed ranks them poorly.
const NEAR_THE_MOST: f64 = 0.5;
const MOST_REFITTED: usize = 16;

/// Number of templates of each kind that are fitted, whatever others promise.
const OF_EACH_KIND: usize = 2;

/// Share of its size by which a parameter of the base model differs from its file where fits also begin there.
const STRAYED: f64 = 0.1;

/// Number of twins tried for each effect of the best structure.
const EXCHANGED: usize = 3;

/// Unfinished fits continue in stages: after this many simulations, those whose error is within this factor of the
/// smallest. A correct structure shows early.
const STAGES: [(usize, f64); 3] = [(4, 10.0), (6, 3.0), (10, 1.5)];

/// A part of a structure with at most this multiple of its error needs no fit from the end point of the whole.
const NEARLY_AS_GOOD: f64 = 1.1;

/// Number of template structures that are fitted to the end.
const FINISHED: usize = 4;

/// Multiple of the best misfit up to which an unfinished fit may still become the best.
const NEAR_THE_BEST: f64 = 3.0;

/// Sorts the most promising first.
fn best_first_of(scores: &mut [&CandidateScore]) {
    scores.sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.candidate.cmp(&b.candidate)));
}

impl EffectSearch<'_> {
    /// Tries adding one effect to each of some structures.
    pub(crate) fn grow(&mut self, frontier: &[StructureId], refitted: usize) {
        let mut wanted: Vec<RefitRequest> = Vec::new();
        for &structure in frontier.iter().filter(|structure| structure.len() < MOST_EFFECTS) {
            let scores = self.screened(structure);
            let is_sayable = |score: &&CandidateScore| {
                self.may_be_said(structure.with_candidate(score.candidate))
            };
            // An effect with unknowns of its own does more than its derivative at null shows.
            let is_understated = |c: usize| {
                let candidate = &self.candidates[c];
                structure.is_base() && !candidate.is_generic && candidate.brings_unknowns
            };
            let sayable: Vec<&CandidateScore> = scores.iter().filter(is_sayable).collect();
            let of_kinds = if structure.is_base() { self.first_of_kinds(&sayable) } else { vec![] };
            let mut counted = Vec::new();
            let most = sayable.first().map_or(0.0, |score| score.gain);
            let is_near = |score: &CandidateScore, n: usize| {
                structure.is_base() && score.gain >= NEAR_THE_MOST * most && n < MOST_REFITTED
            };
            for score in sayable {
                let candidate = score.candidate;
                // More forms of one template at one place are tried once it is among the best.
                let is_first = !counted.iter().any(|other| self.are_forms(*other, candidate));
                let is_counted = !self.candidates[candidate].is_generic || is_first;
                let has_place = counted.len() < refitted || is_near(score, counted.len());
                let is_ranked = is_counted && has_place;
                if is_counted {
                    counted.push(candidate);
                }
                if is_ranked || of_kinds.contains(&candidate) || is_understated(candidate) {
                    wanted.push(self.extended(structure, score));
                }
            }
            for other in self.without_score(structure) {
                match wanted.iter_mut().find(|wanted| wanted.structure == other.structure) {
                    Some(wanted) => wanted.points.extend(other.points),
                    None => wanted.push(other),
                }
            }
        }
        self.confirm(wanted);
    }

    /// The most promising templates of each kind. If the base model's parameters are strongly biased, a screen
    /// understates effects in several equations, such as an input error, and overstates effects in one.
    fn first_of_kinds(&self, scores: &[&CandidateScore]) -> Vec<usize> {
        let mut chosen: Vec<usize> = Vec::new();
        for score in scores {
            let candidate = &self.candidates[score.candidate];
            let kind =
                |of: &EffectCandidate<'_>| (of.kind(), of.changes_a_parameter(), of.is_at_input());
            let is_alike = |c: &&usize| kind(&self.candidates[**c]) == kind(candidate);
            if candidate.is_generic && chosen.iter().filter(is_alike).count() < OF_EACH_KIND {
                chosen.push(score.candidate);
            }
        }
        chosen
    }

    /// A structure extended by each effect without a score, to be fitted from the values in its file: effects of the
    /// library, and a few templates.
    fn without_score(&mut self, structure: StructureId) -> Vec<RefitRequest> {
        self.screen(self.open, structure);
        let screens = self.known_screens(self.open, structure);
        let silent = screens.flat_map(|screen| &screen.silent);
        let is_generic = |candidate: usize| self.candidates[candidate].is_generic;
        let silent = silent.filter(|silent| match silent.remedy {
            ScoreRemedy::Fit => !is_generic(silent.candidate),
            ScoreRemedy::FitAnyway => structure.is_base() || !is_generic(silent.candidate),
            ScoreRemedy::ScoreIsZero | ScoreRemedy::LeaveOut => false,
        });
        silent.map(|silent| self.unscreened(structure, silent.candidate)).collect()
    }

    /// Fits structures that were not tried before, each from the points that its screen suggests.
    fn confirm(&mut self, wanted: Vec<RefitRequest>) {
        let mut new: Vec<RefitRequest> = Vec::new();
        for wanted in wanted {
            let is_known = self.tried.contains_key(&wanted.structure);
            if !is_known && !new.iter().any(|other| other.structure == wanted.structure) {
                new.push(wanted);
            }
        }
        let mut open: Vec<StructureId> = new.iter().map(|wanted| wanted.structure).collect();
        let mut next = new;
        for (evaluations, within) in STAGES {
            self.refit(next, evaluations, ValidationUse::Later);
            let error = |one: &StructureId| self.training_error(*one).map(|(sum, _)| sum);
            let least = self.tried.keys().filter_map(error).fold(f64::INFINITY, f64::min);
            open.retain(|one| error(one).is_some_and(|error| error <= within * least));
            let unfinished = open.iter().filter(|one| self.may_go_on(**one));
            next = unfinished.map(|one| self.continued(*one)).collect();
        }
        // Of the unfinished fits only the best is completed, if it is promising.
        let best = self.ranked().into_iter().next().filter(|best| {
            self.training_error(*best).is_some_and(|(sum, n)| sum <= HOPELESS * n as f64)
        });
        next.retain(|wanted| Some(wanted.structure) == best);
        self.refit(next, EVALUATIONS, ValidationUse::Later);
        self.sharpen();
        self.hold_out(&open);
    }

    /// Completes the fits of template structures that may be the best. Those far from noise were abandoned early, and
    /// their order means little.
    pub(crate) fn finish_templates(&mut self) {
        let error = |of| self.training_sum(of);
        let base = error(StructureId::BASE);
        let mut best = self.ranked();
        let is_worth = |one: StructureId| error(one) < self.thresholds.mostly * base;
        best.retain(|&one| !one.is_base() && self.may_be_said(one) && is_worth(one));
        best.truncate(FINISHED);
        self.finish(&best);
    }

    /// Completes the fits of structures near the best, if that has templates: the first to reach the noise does not
    /// always have the smallest misfit. Its parts are fitted from its end point.
    pub(crate) fn finish_rivals(&mut self) {
        let is_generic = |search: &Self, one: StructureId| {
            one.effects().any(|effect| search.candidates[effect].is_generic)
        };
        let ranked = self.ranked();
        let best = ranked.iter().copied().find(|one| self.may_be_said(*one) && self.explains(*one));
        let Some(best) = best.filter(|best| is_generic(self, *best)) else { return };
        let error = |of| self.training_sum(of);
        let is_rival = |one: &StructureId| {
            *one != best
                && one.len() <= best.len()
                && self.may_be_said(*one)
                && error(*one) < NEAR_THE_BEST * error(best)
        };
        let rivals: Vec<StructureId> = ranked.into_iter().filter(is_rival).take(FINISHED).collect();
        self.finish(&rivals);
        for effect in best.effects().filter(|_| best.len() > 1) {
            self.settle(best.without_candidate(effect), best);
        }
    }

    /// Completes the fits of some structures, and simulates validation recordings with them.
    pub(crate) fn finish(&mut self, structures: &[StructureId]) {
        let mut open = structures.to_vec();
        for evaluations in ROUNDS {
            open.retain(|one| self.may_go_on(*one));
            if open.is_empty() {
                break;
            }
            let wanted = open.iter().map(|one| self.continued(*one)).collect();
            self.refit(wanted, evaluations, ValidationUse::Later);
            open.retain(|one| !self.at_rest.contains(one));
        }
        self.hold_out(structures);
    }

    /// Whether a fit is worth another round.
    fn may_go_on(&self, structure: StructureId) -> bool {
        self.fitted(structure).is_some_and(|fitted| !fitted.is_converged)
            && !self.lost.contains(&structure)
    }

    /// Tries near twins for each effect of the best structure, until none is better.
    pub(crate) fn exchange(&mut self) {
        for _ in 0..MOST_EFFECTS {
            let Some(best) = self.ranked().first().copied() else { return };
            if best.len() < 2 || !best.effects().all(|effect| self.is_open(effect)) {
                return;
            }
            let mut wanted = Vec::new();
            for effect in best.effects() {
                let rest = best.without_candidate(effect);
                self.settle(rest, best);
                for score in self.screened(rest).iter().take(EXCHANGED) {
                    wanted.push(self.extended(rest, score));
                }
            }
            self.confirm(wanted);
            if self.ranked().first() == Some(&best) {
                return;
            }
        }
    }

    /// Tries other templates at the place of one in the best structure: the right form shows only when all are fitted.
    pub(crate) fn try_near_forms(&mut self) {
        let Some(best) = self.ranked().into_iter().find(|one| self.may_be_said(*one)) else {
            return;
        };
        let mut wanted = Vec::new();
        let generic: Vec<usize> =
            best.effects().filter(|c| self.candidates[*c].is_generic).collect();
        // With the others of the structure, and alone: the right form may need no others.
        let beside = generic.iter().map(|effect| (*effect, best.without_candidate(*effect)));
        let alone = generic.iter().map(|effect| (*effect, StructureId::BASE));
        let mut places: Vec<(usize, StructureId)> = beside.chain(alone).collect();
        places.dedup();
        let others = if self.explains(best) { Vec::new() } else { self.other_places(best) };
        places.extend(others.iter().map(|effect| (*effect, StructureId::BASE)));
        for (effect, rest) in places {
            let near = self.near_forms(effect);
            let scores = self.screened(rest);
            let score_of = |c: usize| scores.iter().find(|score| score.candidate == c);
            let mut scored: Vec<&CandidateScore> =
                near.iter().copied().filter_map(score_of).collect();
            best_first_of(&mut scored);
            let new = scored.into_iter().map(|score| self.extended(rest, score));
            // Forms with equal derivatives at null are screened as one, and differ as they grow: the misfit of the
            // screened one shows whether the others are worth a fit.
            let is_worth = |twin: usize| {
                self.candidates[twin].is_generic
                    && self.training_sum(rest.with_candidate(twin))
                        <= NEAR_THE_BEST * self.training_sum(rest.with_candidate(effect))
            };
            let alike = near.iter().filter(|c| {
                self.doubled.get(c).is_some_and(|twin| {
                    *twin == effect || others.contains(&effect) || is_worth(*twin)
                })
            });
            let alike = alike.map(|c| self.unscreened(rest, *c));
            let is_new = |wanted: &RefitRequest| !self.tried.contains_key(&wanted.structure);
            wanted.extend(alike.chain(new).filter(is_new).take(NEAR_FORMS));
        }
        self.confirm(wanted);
    }

    /// The templates that do best alone, at other places than those of a structure that does not explain the
    /// recordings: the right form may be at one of them, if it begins like a form that was tried and differs as it
    /// grows.
    fn other_places(&self, best: StructureId) -> Vec<usize> {
        let target = |c: &usize| self.candidates[*c].target();
        let mut known: Vec<String> = best.effects().map(|c| target(&c)).collect();
        let alone = self.ranked().into_iter().filter(|one| one.len() == 1);
        let mut places = Vec::new();
        for one in alone.flat_map(|one| one.effects().collect::<Vec<_>>()) {
            if self.candidates[one].is_generic && !known.contains(&target(&one)) {
                known.push(target(&one));
                places.push(one);
            }
        }
        places.truncate(OTHER_PLACES);
        places
    }

    /// Templates that are near forms of one.
    fn near_forms(&self, effect: usize) -> Vec<usize> {
        self.range(OpenCandidates::Templates).filter(|c| self.are_near(*c, effect)).collect()
    }

    /// Completes the fits of the near forms of a structure's templates, each once. Returns whether one of them has a
    /// smaller misfit. If the base model is strongly biased, the right form may have been abandoned early in favour of
    /// one that adapts sooner.
    pub(crate) fn finish_near_forms(&mut self, structure: StructureId) -> bool {
        let generic = structure.effects().filter(|c| self.candidates[*c].is_generic);
        let mut wanted = Vec::new();
        for effect in generic.collect::<Vec<_>>() {
            let rest = structure.without_candidate(effect);
            for near in self.near_forms(effect) {
                let form = rest.with_candidate(near);
                let is_refused = matches!(self.tried.get(&StructureId::one(near)), Some(Err(_)));
                let is_open = self.fitted(form).is_none_or(|fitted| !fitted.is_converged);
                if near != effect
                    && is_open
                    && !is_refused
                    && self.may_be_said(form)
                    && self.settled.insert((form, structure))
                {
                    let is_new = self.fitted(form).is_none();
                    wanted.push(if is_new {
                        self.unscreened(rest, near)
                    } else {
                        self.continued(form)
                    });
                }
            }
        }
        let forms: Vec<StructureId> = wanted.iter().map(|wanted| wanted.structure).collect();
        self.refit(wanted, EVALUATIONS, ValidationUse::Later);
        self.hold_out(&forms);
        let error = |of| self.training_sum(of);
        forms.into_iter().any(|form| error(form) < error(structure))
    }

    /// Tries other forms of an effect that explains the data only with a parameter at its bound, from the end point of
    /// that fit: a form with fewer parameters may explain as much. So may another template at its place: a stop without
    /// a gap is a leak.
    pub(crate) fn try_other_forms(&mut self) {
        let mut explaining = self.ranked();
        explaining.retain(|one| self.explains(*one));
        let first_sound = explaining.iter().position(|one| self.is_sound(*one));
        explaining.truncate(first_sound.unwrap_or(BEAM).min(BEAM));
        for whole in explaining {
            let others = self.with_other_forms(whole);
            for other in &others {
                self.settle(*other, whole);
            }
            self.finish(&others);
        }
    }

    /// Structures with another form of an effect that has a parameter at its bound.
    fn with_other_forms(&self, structure: StructureId) -> Vec<StructureId> {
        let other_forms = self.at_bound(structure).into_iter().flat_map(|effect| {
            let is_other = move |form: &usize| {
                let is_template = self.are_near(*form, effect) && *form != effect;
                let is_tried = self
                    .fitted(structure.without_candidate(effect).with_candidate(*form))
                    .is_some();
                self.are_forms(*form, effect)
                    || (is_template && is_tried && self.have_one_place(*form, effect))
            };
            let forms = self.range(self.open).filter(is_other);
            forms.map(move |form| structure.without_candidate(effect).with_candidate(form))
        });
        other_forms.collect()
    }

    /// Fits a part of a structure, or one like it, from the structure's end point, unless its own fit converged to
    /// nearly the misfit of the whole.
    ///
    /// A correct effect may have been abandoned early, from a point that the screen suggested, or have ended at another
    /// minimum; then two effects would seem necessary.
    pub(crate) fn settle(&mut self, part: StructureId, whole: StructureId) {
        let of_whole = self.training_sum(whole);
        let is_settled = |tried: &Result<FittedStructure, NoFit>| {
            let is_good = |fitted: &FittedStructure| fitted.error.0 < NEARLY_AS_GOOD * of_whole;
            tried.as_ref().map_or(true, |fitted| fitted.is_converged && is_good(fitted))
        };
        let is_new = self.settled.insert((part, whole)) && !self.data.is_spent();
        if !is_new || self.tried.get(&part).is_some_and(is_settled) {
            return;
        }
        let error = |search: &Self| search.training_error(part).map(|(sum, _)| sum);
        let (least, before) = (error(self), self.tried.remove(&part));
        let points = vec![StartPoint { held: self.known_to(whole, part), ..StartPoint::default() }];
        let from = self.values(whole);
        self.confirm(vec![RefitRequest { structure: part, from, points }]);
        match (least, error(self)) {
            (Some(least), Some(error)) if error < least => {
                self.screens.retain(|(_, structure), _| *structure != part);
                if matches!(&before, Some(Ok(before)) if before.valid.is_some()) {
                    self.hold_out(&[part]);
                }
            }
            (Some(_), _) => {
                self.tried.extend(before.map(|before| (part, before)));
            }
            (None, _) => {}
        }
    }

    /// Names that are held until an effect in place of another has adapted: the rest of the model as found with that
    /// one.
    fn known_to(&self, whole: StructureId, part: StructureId) -> Vec<String> {
        let Some(fitted) = self.fitted(whole).filter(|_| !part.is_part_of(whole)) else {
            return Vec::new();
        };
        let replaced = whole.effects().filter(|effect| !part.contains(*effect));
        let brought = replaced.filter_map(|effect| fitted.structure.brought_by(effect));
        let brought_parameters: Vec<&String> =
            brought.flat_map(|brought| &brought.parameters).collect();
        let signature = fitted.structure.system.signature();
        let names = (0..signature.directions.len()).map(|j| signature.direction_name(j));
        names.map(Cow::into_owned).filter(|name| !brought_parameters.contains(&name)).collect()
    }

    /// A structure with one more effect, to be fitted from the points that its screen suggests.
    fn extended(&self, structure: StructureId, score: &CandidateScore) -> RefitRequest {
        let longer = structure.with_candidate(score.candidate);
        let mut points = score.points.clone();
        if self.has_strayed(structure) {
            points.extend(points.first().map(StartPoint::afresh));
        }
        RefitRequest { structure: longer, from: self.values(structure), points }
    }

    /// A structure with one more effect, to be fitted from the values in its file.
    fn unscreened(&self, structure: StructureId, candidate: usize) -> RefitRequest {
        let mut points = vec![StartPoint::default()];
        if self.has_strayed(structure) {
            points.push(StartPoint::default().afresh());
        }
        RefitRequest {
            structure: structure.with_candidate(candidate),
            from: self.values(structure),
            points,
        }
    }

    /// Whether the base model was fitted to values far from those of its file, so that fits also begin at the latter.
    fn has_strayed(&self, structure: StructureId) -> bool {
        let Some(fitted) = self.fitted(structure).filter(|_| structure.is_base()) else {
            return false;
        };
        let mut parameters = fitted.structure.system.signature().parameters.iter().zip(&fitted.p);
        parameters.any(|(declared, value)| {
            let size = value.abs().max(declared.value.abs());
            (value - declared.value).abs() > STRAYED * size
        })
    }
}
