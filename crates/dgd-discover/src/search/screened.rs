//! Screens on top of tried structures, each computed once.

use std::ops::Range;

use super::screen::{CandidateScore, OnsetResolution, PointTrial, Screen, best_first, screen};
use super::tried::{EffectSearch, OpenCandidates};
use crate::fit::FittedStructure;
use crate::library::{MOST_EFFECTS, StructureId};

/// Number of templates with unknowns of their own that are screened on top of a structure.
const PROMISING: usize = 6;

impl EffectSearch<'_> {
    /// Scores of open candidates on top of a structure, the best first.
    pub(crate) fn screened(&mut self, structure: StructureId) -> Vec<CandidateScore> {
        self.screened_of(self.open, structure)
    }

    pub(crate) fn screened_of(
        &mut self,
        some: OpenCandidates,
        structure: StructureId,
    ) -> Vec<CandidateScore> {
        self.screen(some, structure);
        let screens = self.known_screens(some, structure);
        let mut scores: Vec<CandidateScore> =
            screens.flat_map(|screen| &screen.scores).cloned().collect();
        scores.retain(|score| !self.doubled.contains_key(&score.candidate));
        best_first(&mut scores);
        scores
    }

    /// Possible gains of the open candidates on top of a structure.
    pub(crate) fn trials(&mut self, structure: StructureId) -> Vec<PointTrial> {
        self.screen(self.open, structure);
        let trials = self.known_screens(self.open, structure).flat_map(|screen| &screen.trials);
        trials.filter(|trial| !self.doubled.contains_key(&trial.candidate)).cloned().collect()
    }

    /// The screen of some candidates on top of the base model, computed if necessary.
    pub(crate) fn screen_of_the_base(&self, some: OpenCandidates) -> Screen {
        let known = self.known_screen(some, StructureId::BASE);
        match known.or_else(|| self.base_screens.get(&some)) {
            Some(screen) => screen.clone(),
            None => self.fitted(StructureId::BASE).map_or_else(Screen::default, |fitted| {
                let candidates: Vec<usize> = self.range(some).collect();
                self.screen_of(fitted, &candidates, OnsetResolution::Grid)
            }),
        }
    }

    /// The screen of a structure, if it was computed.
    pub(crate) fn known_screen(
        &self,
        some: OpenCandidates,
        structure: StructureId,
    ) -> Option<&Screen> {
        self.screens.get(&(some, structure))
    }

    /// The computed screens of a structure: of the library, of templates, or both.
    pub(crate) fn known_screens(
        &self,
        some: OpenCandidates,
        structure: StructureId,
    ) -> impl Iterator<Item = &Screen> {
        some.parts().iter().filter_map(move |part| self.known_screen(*part, structure))
    }

    /// Screens candidates on top of a structure, unless already done.
    pub(crate) fn screen(&mut self, some: OpenCandidates, structure: StructureId) {
        for part in some.parts() {
            let (range, key) = (self.range(*part), (*part, structure));
            let is_late = self.data.is_spent();
            if range.is_empty() || self.screens.contains_key(&key) || is_late {
                continue;
            }
            let Some(fitted) = self.fitted(structure) else { return };
            let some = self.worth_screening(*part, structure, range);
            let screen = self.screen_of(fitted, &some, OnsetResolution::Refined);
            self.screens.insert(key, screen);
        }
    }

    /// Candidates worth screening on top of a structure. Templates are added to others only if they may be reported
    /// together and, if each needs simulations of its own, if they promised most in the base model.
    fn worth_screening(
        &self,
        part: OpenCandidates,
        structure: StructureId,
        all: Range<usize>,
    ) -> Vec<usize> {
        if part != OpenCandidates::Templates || structure.is_base() {
            return all.collect();
        }
        let base = self.known_screen(OpenCandidates::Templates, StructureId::BASE);
        let is_apart = |c: usize| self.candidates[c].brings_unknowns;
        let promising: Vec<usize> = (base.into_iter().flat_map(|screen| &screen.scores))
            .map(|score| score.candidate)
            .filter(|c| is_apart(*c))
            .take(PROMISING)
            .collect();
        let is_worth = |c: &usize| {
            let is_new = !structure.contains(*c);
            is_new
                && self.may_be_said(structure.with_candidate(*c))
                && (!is_apart(*c) || promising.contains(c))
        };
        if structure.len() == MOST_EFFECTS { Vec::new() } else { all.filter(is_worth).collect() }
    }

    fn screen_of(
        &self,
        fitted: &FittedStructure,
        some: &[usize],
        resolution: OnsetResolution,
    ) -> Screen {
        let is_refused = |c: &usize| {
            let alone = self.tried.get(&StructureId::one(*c));
            self.doubled.contains_key(c) || matches!(alone, Some(Err(_)))
        };
        let structure = fitted.structure.id;
        let others = some.iter().copied();
        let others: Vec<usize> =
            others.filter(|c| !structure.contains(*c) && !is_refused(c)).collect();
        screen(self.base, self.candidates, &others, fitted, &self.data, resolution, self.threads)
    }
}
