//! Which structures are fitted, from where, and how far.

use super::screen::{Remedy, Score};
use super::tried::Search;
use dgd_runtime::parallel::in_parallel_stateless;

use crate::fit::{Fitted, NoFit, StartPoint};
use crate::library::{MOST_EFFECTS, StructureId, Values};

/// How many structures the search goes on from.
pub(crate) const BEAM: usize = 3;

/// How many twins are tried for each effect of the best structure.
const EXCHANGED: usize = 3;

/// Simulations of the fits of a structure in the end.
pub(crate) const EVALUATIONS: usize = 40;

/// Fits that are not finished go on in stages: after so many simulations, those whose error is within
/// this factor of the least. A structure that is right shows it early.
const STAGES: [(usize, f64); 3] = [(4, 10.0), (6, 3.0), (10, 1.5)];

/// A part of a structure with at most so many times its error needs no fit from where the whole ended.
const NEARLY_AS_GOOD: f64 = 1.1;

/// A fit that has gone through the stages and still leaves so many times the noise is given up.
const HOPELESS: f64 = 10.0;

/// So many structures of templates are fitted to the end, in so many rounds at most.
const FINISHED: usize = 6;
const MOST_ROUNDS: usize = 4;

/// When validation recordings are simulated with a structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HeldOut {
    /// With its fit.
    Now,
    /// When it may be the best.
    Later,
}

/// A structure to fit, and from where.
#[derive(Debug, Clone)]
pub(crate) struct Wanted {
    structure: StructureId,
    /// Values that it starts from.
    from: Values,
    points: Vec<StartPoint>,
}

impl Search<'_> {
    /// Tries one effect more with each of some structures.
    pub(crate) fn grow(&mut self, frontier: &[StructureId], refitted: usize) {
        let mut wanted: Vec<Wanted> = Vec::new();
        for &structure in frontier {
            for score in self.screened(structure).iter().take(refitted) {
                wanted.push(self.extended(structure, score));
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

    /// A structure with each effect that has no score on top of another, to be fitted from the values
    /// that its file has: effects of the library, and few of the templates.
    fn without_score(&mut self, structure: StructureId) -> Vec<Wanted> {
        self.screen(self.open, structure);
        let screen = self.known_screen(self.open, structure);
        let silent = screen.into_iter().flat_map(|screen| &screen.silent);
        let is_generic = |candidate: usize| self.candidates[candidate].is_generic;
        let silent = silent.filter(|silent| match silent.remedy {
            Remedy::Fit => !is_generic(silent.candidate),
            Remedy::FitAnyway => structure.is_base() || !is_generic(silent.candidate),
            Remedy::ScoreIsZero | Remedy::LeaveOut => false,
        });
        let points = vec![StartPoint::default()];
        let nothing =
            |candidate| Score { candidate, gain: 0.0, points: points.clone(), columns: vec![] };
        silent.map(|silent| self.extended(structure, &nothing(silent.candidate))).collect()
    }

    /// Refits structures that were not tried before, each from the points that its screen suggests.
    fn confirm(&mut self, wanted: Vec<Wanted>) {
        let mut new: Vec<Wanted> = Vec::new();
        for wanted in wanted {
            let is_known = self.tried.contains_key(&wanted.structure);
            if !is_known && !new.iter().any(|other| other.structure == wanted.structure) {
                new.push(wanted);
            }
        }
        let mut open: Vec<StructureId> = new.iter().map(|wanted| wanted.structure).collect();
        let mut next = new;
        for (evaluations, within) in STAGES {
            self.refit(next, evaluations, HeldOut::Later);
            let error = |one: &StructureId| self.training_error(*one).map(|(sum, _)| sum);
            let least = self.tried.keys().filter_map(error).fold(f64::INFINITY, f64::min);
            open.retain(|one| error(one).is_some_and(|error| error <= within * least));
            let unfinished = open
                .iter()
                .filter(|one| self.fitted(**one).is_some_and(|fitted| !fitted.is_converged));
            next = unfinished.map(|one| self.continued(*one)).collect();
        }
        // Of what is still under way only the best goes on to the end, if there is hope for it.
        let best = self.ranked().into_iter().next().filter(|best| {
            self.training_error(*best).is_some_and(|(sum, n)| sum <= HOPELESS * n as f64)
        });
        next.retain(|wanted| Some(wanted.structure) == best);
        self.refit(next, EVALUATIONS, HeldOut::Later);
        self.sharpen();
        self.hold_out(&open);
    }

    /// Fits structures, several at a time.
    pub(crate) fn refit(&mut self, wanted: Vec<Wanted>, evaluations: usize, held_out: HeldOut) {
        let (base, candidates, data) = (self.base, self.candidates, &self.data);
        let count = data.keeping.count("structures fitted", wanted.len());
        let results = in_parallel_stateless(wanted.len(), self.threads, |k| {
            let Wanted { structure, from, points } = &wanted[k];
            let structure =
                base.structure(candidates, *structure).map_err(|refused| NoFit(refused.0))?;
            let fitted = Fitted::new(structure, from, points, data, evaluations);
            count.more(1);
            let mut fitted = fitted?;
            if held_out == HeldOut::Now {
                fitted.hold_out(data, evaluations);
            }
            Ok(fitted)
        });
        for (wanted, result) in wanted.into_iter().zip(results) {
            self.tried.insert(wanted.structure, result);
        }
    }

    /// Simulates validation recordings with some structures.
    pub(crate) fn hold_out(&mut self, structures: &[StructureId]) {
        for structure in structures {
            if let Some(Ok(fitted)) = self.tried.get_mut(structure)
                && fitted.valid.is_none()
            {
                fitted.hold_out(&self.data, EVALUATIONS);
            }
        }
    }

    /// Fits to the end what may be the best structure of templates. What is far from noise was given up
    /// early, in an order that says little.
    pub(crate) fn finish_templates(&mut self) {
        let error =
            |of| self.training_error(of).map_or(f64::INFINITY, |(sum, _): (f64, usize)| sum);
        let base = error(StructureId::BASE);
        let mut best = self.ranked();
        best.retain(|&one| !one.is_base() && !self.is_specific(one) && error(one) < base);
        best.truncate(FINISHED);
        self.finish(&best);
    }

    /// Fits some structures to the end, and simulates validation recordings with them.
    pub(crate) fn finish(&mut self, structures: &[StructureId]) {
        let mut open = structures.to_vec();
        for _ in 0..MOST_ROUNDS {
            open.retain(|one| self.fitted(*one).is_some_and(|fitted| !fitted.is_converged));
            if open.is_empty() {
                break;
            }
            let wanted = open.iter().map(|one| self.continued(*one)).collect();
            self.refit(wanted, EVALUATIONS, HeldOut::Later);
        }
        self.hold_out(structures);
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
                let rest = best.without(effect);
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

    /// Tries other forms of an effect that explains the data only with a parameter at its bound, from where
    /// that fit ended: a form with less to choose may explain as much.
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
            let forms = self.range(self.open).filter(move |form| self.are_forms(*form, effect));
            forms.map(move |form| structure.without(effect).with(form))
        });
        other_forms.collect()
    }

    /// Fits a part of a structure, or one like it, from where that ended, unless its own fit ended at a
    /// minimum that is nearly as good as the whole's.
    ///
    /// An effect that is right may have been given up early, from a point that the screen suggested, or
    /// have ended at another minimum; with another one beside it it then would look as if it took both.
    pub(crate) fn settle(&mut self, part: StructureId, whole: StructureId) {
        let of_whole = self.training_error(whole).map_or(f64::INFINITY, |(sum, _)| sum);
        let is_settled = |tried: &Result<Fitted, NoFit>| {
            let is_good = |fitted: &Fitted| fitted.error.0 < NEARLY_AS_GOOD * of_whole;
            tried.as_ref().map_or(true, |fitted| fitted.is_converged && is_good(fitted))
        };
        let is_new = self.settled.insert((part, whole));
        if !is_new || self.tried.get(&part).is_some_and(is_settled) {
            return;
        }
        let error = |search: &Self| search.training_error(part).map(|(sum, _)| sum);
        let (least, before) = (error(self), self.tried.remove(&part));
        let wanted = Wanted { structure: part, ..self.continued(whole) };
        self.confirm(vec![wanted]);
        match (least, error(self)) {
            (Some(least), Some(error)) if error < least => {
                self.screens.retain(|(_, structure), _| *structure != part);
            }
            (Some(_), _) => {
                self.tried.extend(before.map(|before| (part, before)));
            }
            (None, _) => {}
        }
    }

    /// A structure with one effect more, to be fitted from where its screen suggests.
    fn extended(&self, structure: StructureId, score: &Score) -> Wanted {
        let longer = structure.with(score.candidate);
        Wanted { structure: longer, from: self.values(structure), points: score.points.clone() }
    }

    /// A structure to be fitted from where its fit ended.
    pub(crate) fn continued(&self, structure: StructureId) -> Wanted {
        let points = vec![StartPoint::default()];
        Wanted { structure, from: self.values(structure), points }
    }
}
