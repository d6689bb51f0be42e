//! Laws: terms that equations lack, sought in all equations together.
//!
//! ```text
//!   readings ─► states and the missing terms, smoothed                    (sighting)
//!     ─► the effect of each term in each equation on the readings         (columns, terms)
//!     ─► the few terms that explain them                                  (beam)
//!     ─► the model with each of the best sets, fitted by simulation       (inserted)
//!     ─► the one that leaves only noise and has no rival                  (judged)
//! ```
//!
//! Nothing before the fits simulates the model for longer than from one sample to the next, so it may be far off or run
//! away; and coefficients enter linearly, so thousands of terms are compared within a second. The fits decide.

mod answer;
mod beam;
mod columns;
mod inserted;
mod judged;
mod kinematic;
mod proposed;
mod search;
mod sighting;
mod terms;

use std::ops::Range;
use std::sync::Arc;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_runtime::parallel::in_parallel;

use crate::missing_input::{MissingPlace, MissingTerms, PlaceKind, free_places};
use crate::search::EffectSearch;
pub(crate) use answer::{AnsweringLaw, LawAnswer, LawSearchResult};
use columns::{LawDraft, MOST_TERMS, drafts};
pub(crate) use inserted::FittedTerms;
use inserted::HOPEFUL;
pub use inserted::LawTerm;
pub(crate) use judged::NamedTemplates;
use judged::SufficientLaws;
use proposed::{FitOrigin, ProposedTerms};
pub(crate) use search::LawSearch;
use sighting::FollowedRecordings;
use terms::TermVocabulary;

/// Number of sets of each size that are fitted by simulation; half as many each if places are also examined alone.
const OF_EACH_SIZE: [usize; MOST_TERMS] = [8, 4, 4, 4];

/// Largest number of terms if some act in one regime only: with thresholds, more follow any recording.
const MOST_IN_REGIMES: usize = 2;

/// Number of training recordings that are examined alone.
const ALONE: usize = 2;

/// Number of the best fitted laws for which simpler forms are tried.
const SIMPLIFIED: usize = 2;

impl LawSearch<'_> {
    /// Looks for a law, which has to explain the recordings better than templates that were named. The thresholds are
    /// those of the search for effects. Without validation recordings there is no law: four terms of thousands follow
    /// any recording.
    pub(crate) fn search(
        &self,
        search: &EffectSearch<'_>,
        named: Option<&NamedTemplates<'_>>,
    ) -> LawSearchResult {
        if self.data.valid.is_empty() {
            return LawSearchResult::NOTHING;
        }
        let engine = self.base.engine;
        let terms =
            MissingTerms::scaled(self.model, self.data.scales, engine, &mut Diagnostics::default());
        let Ok(terms) = terms else { return LawSearchResult::NOTHING };
        let places = terms.places();
        let equations: Vec<usize> =
            (0..places.len()).filter(|i| places[*i].kind == PlaceKind::Equation).collect();
        let is_kinematic = |i: &usize| kinematic::is_kinematic(self.model, &places[*i].name);
        let physical: Vec<usize> = equations.iter().copied().filter(|i| !is_kinematic(i)).collect();
        let free = free_places(&terms, self.fitted);
        let is_hidden = self.data.noise.iter().flatten().count() < equations.len();
        let labels: Vec<&str> = equations.iter().map(|i| &*places[*i].name).collect();
        if named.is_some_and(|named| !named.is_open(&labels, is_hidden)) {
            return LawSearchResult::NOTHING;
        }
        let every_recording = 0..self.data.train.len();
        let mut is_unconfirmed = false;
        let mut lacking: Option<Vec<String>> = None;
        let mut laws_for = |around: &LawSearch<'_>,
                            suspected: Vec<Vec<usize>>,
                            recordings: Range<usize>,
                            vocabulary: TermVocabulary| {
            let (proposed, first) = around.proposed(&terms, suspected, recordings, vocabulary);
            let name = |place: usize| places[place].name.clone();
            lacking.get_or_insert_with(|| first.into_iter().map(name).collect());
            let SufficientLaws { laws, is_unconfirmed: own } =
                around.explaining(search, places, &proposed);
            is_unconfirmed |= own;
            laws
        };
        let mut laws = laws_for(
            self,
            self.together(&physical),
            every_recording.clone(),
            TermVocabulary::Smooth,
        );
        // Between recordings, states that are not read may differ arbitrarily; within one, they are continuous.
        if is_hidden && every_recording.len() > 1 {
            for r in every_recording.clone().take(ALONE) {
                if laws.is_empty() {
                    laws =
                        laws_for(self, self.together(&physical), r..r + 1, TermVocabulary::Smooth);
                }
            }
        }
        // A free parameter may be a law.
        if laws.is_empty() && named.is_none() {
            let places = free.iter().map(|free| vec![free.place]).collect();
            laws = laws_for(self, places, every_recording.clone(), TermVocabulary::Smooth);
            // The base model's parameters may have hidden a plainer term of an equation, which those of the law show.
            let of_law = laws.first().map(|law| law.parameters_for(self.fitted));
            let of_equations = of_law.map_or_else(Vec::new, |fitted| {
                let around = LawSearch { fitted: &fitted, ..*self };
                let smooth = TermVocabulary::Smooth;
                laws_for(&around, self.together(&physical), every_recording.clone(), smooth)
            });
            let cost = |laws: &[FittedTerms]| laws.first().map_or(f64::INFINITY, FittedTerms::cost);
            if cost(&of_equations) < cost(&laws) {
                laws = of_equations;
            }
        }
        // Kinematic equations hold by definition, unless nothing else helps.
        if laws.is_empty() && named.is_none() && physical.len() < equations.len() {
            laws = laws_for(
                self,
                self.together(&equations),
                every_recording.clone(),
                TermVocabulary::Smooth,
            );
        }
        // Terms that act in one regime only, which a sum of smooth ones follows less plainly.
        if !laws.iter().any(FittedTerms::has_one_term_each) {
            laws.extend(laws_for(self, vec![physical], every_recording, TermVocabulary::Regimes));
            laws.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        }
        // Sums of many terms follow any recording of a few states.
        if is_hidden {
            laws.retain(FittedTerms::is_plain);
        }
        // Effects that leave more than a law does are not named, even if recordings do not confirm the law.
        if laws.is_empty() && named.is_none() && is_hidden && is_unconfirmed {
            return LawSearchResult {
                answer: LawAnswer::Doubt(Vec::new()),
                lacking: lacking.unwrap_or_default(),
            };
        }
        let answer = judged::answer(laws, named, self.data, &labels, is_hidden);
        LawSearchResult { answer, lacking: lacking.unwrap_or_default() }
    }

    /// Laws that leave only noise.
    fn explaining(
        &self,
        search: &EffectSearch<'_>,
        places: &[MissingPlace],
        proposed: &[ProposedTerms],
    ) -> SufficientLaws {
        let LawSearch { base, sources, model, data, threads, .. } = *self;
        let begun = in_parallel(self.fitted, proposed.len(), threads, |fitted, k| {
            if data.is_over() {
                return None;
            }
            let laws = LawSearch { base, sources, model, fitted, data, threads };
            Some((&proposed[k], laws.insert(places, &proposed[k])?))
        });
        let mut begun: Vec<(&ProposedTerms, FittedTerms)> = begun.into_iter().flatten().collect();
        let left = |one: &FittedTerms| one.fitted.mean_square();
        let least = begun.iter().map(|(_, one)| left(one)).fold(f64::INFINITY, f64::min);
        begun.retain(|(_, one)| left(one) <= HOPEFUL * least.max(1.0));
        let mut fits =
            in_parallel(&begun, begun.len(), threads, |begun, k| begun[k].1.finished(data));
        let mut order: Vec<usize> = (0..fits.len()).collect();
        order.sort_by(|a, b| fits[*a].cost().total_cmp(&fits[*b].cost()));
        for k in order.into_iter().take(SIMPLIFIED) {
            if search.fits(&fits[k].fitted) {
                fits.extend(self.simplified(places, begun[k].0, &fits[k]));
            }
        }
        self.leaving_noise(fits, search)
    }

    /// Fitted laws that are simpler than one: without a term, or without a factor of a term, as long as that lowers the
    /// cost. Trials that do not lower it are included.
    ///
    /// Terms are ranked along one smoothed course of the states, where a factor may compensate for errors that a
    /// simulation does not have.
    fn simplified(
        &self,
        places: &[MissingPlace],
        proposed: &ProposedTerms,
        fit: &FittedTerms,
    ) -> Vec<FittedTerms> {
        let LawSearch { base, sources, model, data, threads, .. } = *self;
        let sighting = &proposed.sighting;
        let mut draft = fit.draft(&proposed.draft);
        let (mut all, mut cost) = (Vec::new(), fit.cost());
        while !data.is_over() {
            let simpler = draft.simpler(sighting);
            let fits = in_parallel(self.fitted, simpler.len(), threads, |fitted, k| {
                let laws = LawSearch { base, sources, model, fitted, data, threads };
                let proposed = ProposedTerms { draft: simpler[k].clone(), ..proposed.clone() };
                Some((k, laws.insert(places, &proposed)?.finished(data)))
            });
            let fits: Vec<(usize, FittedTerms)> = fits.into_iter().flatten().collect();
            let best = fits.iter().min_by(|(_, a), (_, b)| a.cost().total_cmp(&b.cost()));
            let next = best.filter(|(_, next)| next.cost() < cost);
            let next = next.map(|(k, next)| (next.cost(), next.draft(&simpler[*k])));
            all.extend(fits.into_iter().map(|(_, fit)| fit));
            let Some(next) = next else { break };
            (cost, draft) = next;
        }
        all
    }

    /// Groups of equations that may lack something together: all of them; with fewer outputs than equations, so that
    /// the states depend on where something is missing, also each alone.
    fn together(&self, equations: &[usize]) -> Vec<Vec<usize>> {
        let measured = self.data.noise.iter().flatten().count();
        let mut suspected = vec![equations.to_vec()];
        if measured < equations.len() {
            suspected.extend(equations.iter().map(|place| vec![*place]));
        }
        suspected
    }

    /// Sets of terms to be fitted, and the places of the first suspicion that stand out.
    fn proposed(
        &self,
        terms: &MissingTerms,
        suspected: Vec<Vec<usize>>,
        recordings: Range<usize>,
        vocabulary: TermVocabulary,
    ) -> (Vec<ProposedTerms>, Vec<usize>) {
        let mut first = None;
        let mut proposals: Vec<ProposedTerms> = Vec::new();
        let is_alone = recordings.len() < self.data.train.len();
        let begin = if is_alone { FitOrigin::Alone(recordings.start) } else { FitOrigin::All };
        let mut of_each_size =
            if suspected.len() > 1 { OF_EACH_SIZE.map(|n| n.div_ceil(2)) } else { OF_EACH_SIZE };
        if vocabulary == TermVocabulary::Regimes {
            of_each_size[MOST_IN_REGIMES..].fill(0);
        }
        for places in suspected {
            if self.data.is_over() {
                break;
            }
            let sighting = FollowedRecordings::new(self, terms, &places, recordings.clone());
            first.get_or_insert_with(|| {
                sighting.as_ref().map_or_else(Vec::new, |sighting| sighting.places.clone())
            });
            let Some(sighting) = sighting else { continue };
            let best_drafts = chosen(drafts(&sighting, vocabulary, self.threads), of_each_size);
            let sighting = Arc::new(sighting);
            proposals.extend(best_drafts.into_iter().map(|draft| ProposedTerms {
                draft,
                sighting: sighting.clone(),
                begin,
            }));
        }
        proposals.sort_by(|a, b| a.draft.cost.total_cmp(&b.draft.cost));
        let mut earlier: Vec<LawDraft> = Vec::new();
        proposals.retain(|one| {
            let is_same = |other: &LawDraft| {
                other.is_part_of(&one.draft) && one.draft.terms.len() == other.terms.len()
            };
            let is_new = !earlier.iter().any(is_same);
            earlier.push(one.draft.clone());
            is_new
        });
        (proposals, first.unwrap_or_default())
    }
}

/// The drafts to be fitted: the best few of each size. A set that contains a better one is left out.
///
/// Sizes are not compared here. A linear model from sample to sample is inaccurate where the plant is fast, and prefers
/// terms that compensate for that; a simulation does not.
fn chosen(drafts: Vec<LawDraft>, of_each_size: [usize; MOST_TERMS]) -> Vec<LawDraft> {
    let mut kept: Vec<LawDraft> = Vec::new();
    let mut of_size = [0; MOST_TERMS];
    for draft in drafts {
        let size = draft.terms.len() - 1;
        let count = &mut of_size[size];
        let is_idle = |better: &LawDraft| better.is_part_of(&draft) || draft.is_twin_of(better);
        if *count < of_each_size[size] && !kept.iter().any(is_idle) {
            *count += 1;
            kept.push(draft);
        }
    }
    kept
}
