//! What candidates promise on top of structures that were tried: each screen is made once.

use std::ops::Range;

use super::screen::{Resolution, Score, Screen, Trial, best_first, screen};
use super::tried::{Open, Search};
use crate::fit::Fitted;
use crate::library::StructureId;

impl Search<'_> {
    /// What open candidates promise on top of a structure, the best first.
    pub(crate) fn screened(&mut self, structure: StructureId) -> Vec<Score> {
        self.screened_of(self.open, structure)
    }

    pub(crate) fn screened_of(&mut self, some: Open, structure: StructureId) -> Vec<Score> {
        self.screen(some, structure);
        let screen = self.known_screen(some, structure);
        let mut scores = screen.map_or_else(Vec::new, |screen| screen.scores.clone());
        scores.retain(|score| !self.doubled.contains_key(&score.candidate));
        best_first(&mut scores);
        scores
    }

    /// What each of the open candidates could gain there.
    pub(crate) fn trials(&mut self, structure: StructureId) -> Vec<Trial> {
        self.screen(self.open, structure);
        let screen = self.known_screen(self.open, structure);
        let trials = screen.into_iter().flat_map(|screen| &screen.trials);
        trials.filter(|trial| !self.doubled.contains_key(&trial.candidate)).cloned().collect()
    }

    /// What some candidates promise on top of the base model, which is screened where it is not.
    pub(crate) fn screen_of_the_base(&self, some: Open) -> Screen {
        let known = self.known_screen(some, StructureId::BASE);
        match known.or_else(|| self.base_screens.get(&some)) {
            Some(screen) => screen.clone(),
            None => self.fitted(StructureId::BASE).map_or_else(Screen::default, |fitted| {
                self.screen_of(fitted, self.range(some), Resolution::Grid)
            }),
        }
    }

    /// The screen of a structure, if it was made.
    pub(crate) fn known_screen(&self, some: Open, structure: StructureId) -> Option<&Screen> {
        self.screens.get(&(some, structure))
    }

    /// Screens candidates on top of a structure, unless that was done.
    pub(crate) fn screen(&mut self, some: Open, structure: StructureId) {
        let (range, key) = (self.range(some), (some, structure));
        if range.is_empty() || self.screens.contains_key(&key) {
            return;
        }
        let Some(fitted) = self.fitted(structure) else { return };
        let screen = self.screen_of(fitted, range, Resolution::Refined);
        self.screens.insert(key, screen);
    }

    fn screen_of(&self, fitted: &Fitted, some: Range<usize>, resolution: Resolution) -> Screen {
        let is_refused = |c: &usize| {
            let alone = self.tried.get(&StructureId::one(*c));
            self.doubled.contains_key(c) || matches!(alone, Some(Err(_)))
        };
        let structure = fitted.structure.id;
        let others = some.filter(|c| !structure.contains(*c) && !is_refused(c));
        let others: Vec<usize> = others.collect();
        screen(self.base, self.candidates, &others, fitted, &self.data, resolution, self.threads)
    }
}
