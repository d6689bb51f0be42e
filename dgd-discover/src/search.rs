//! Which structures are tried, and which of them is believed.
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

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use dgd_compiler::effects::Application;

use crate::candidates::Candidate;
use crate::discovery::Evidence;
use crate::fitted::{Data, Fitted, NoFit};
use crate::parallel::in_parallel;
use crate::resampled::Trial;
use crate::screen::{Look, Remedy, Score, Screen, StartPoint, are_parallel, screen, sort};
use crate::structure::{BaseModel, Values};
use crate::verdict::Outcome;

/// Most effects in one structure.
const MOST_EFFECTS: usize = 3;

/// How many structures the search goes on from.
pub(crate) const BEAM: usize = 3;

/// How many of the screened candidates are refitted, by number of effects that are in already.
const REFITTED: [usize; MOST_EFFECTS] = [8, 3, 3];

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

/// The search and what it has tried.
pub(crate) struct Search<'a> {
    pub base: &'a BaseModel,
    pub candidates: &'a [Candidate<'a>],
    pub data: Data<'a>,
    pub threads: usize,
    /// By positions of the candidates.
    pub tried: BTreeMap<Vec<usize>, Result<Fitted, NoFit>>,
    /// Candidates that the search may take.
    pub open: Open,
    /// Templates that come to the same as an effect of the library, with that.
    pub doubled: BTreeMap<usize, usize>,
    /// Screens of structures by where the candidates stand that were screened.
    pub screens: BTreeMap<(usize, Vec<usize>), Screen>,
    /// Seed of resampling.
    pub seed: u64,
    /// Structures that their own evidence contradicts, and why.
    pub doubted: BTreeMap<Vec<usize>, String>,
    /// Evidence for each effect of a structure, and its inclusion with those that are alike.
    pub evidence: BTreeMap<Vec<usize>, Vec<(Evidence, f64)>>,
    /// The screen of the base model by where the candidates stand, where that was asked without a closer look.
    pub base_screens: BTreeMap<usize, Screen>,
    /// Whether candidates explain errors of the base model that could be correlated noise as well.
    pub has_effects: bool,
    /// Parts of structures that were fitted from where the whole ended, with the whole.
    pub settled: BTreeSet<(Vec<usize>, Vec<usize>)>,
}

impl<'a> Search<'a> {
    /// A search that has tried nothing.
    pub(crate) fn new(
        base: &'a BaseModel,
        candidates: &'a [Candidate<'a>],
        data: Data<'a>,
        threads: usize,
        seed: u64,
    ) -> Self {
        Search {
            base,
            candidates,
            data,
            threads,
            seed,
            tried: BTreeMap::new(),
            open: Open::Library,
            doubled: BTreeMap::new(),
            doubted: BTreeMap::new(),
            evidence: BTreeMap::new(),
            base_screens: BTreeMap::new(),
            has_effects: false,
            screens: BTreeMap::new(),
            settled: BTreeSet::new(),
        }
    }
}

impl Search<'_> {
    /// Searches on top of the base model, which is fitted already: first with the library, and with templates
    /// where that explains nothing.
    pub(crate) fn run(&mut self) -> Outcome {
        self.refuse();
        let is_noise = self.is_noise(&[]) || self.is_coloured_noise();
        if is_noise && self.holds(&Outcome::Sufficient) {
            return Outcome::Sufficient;
        }
        let of_library = self.search();
        if !matches!(of_library, Outcome::Unexplained(_)) {
            return of_library;
        }
        if let Some(nearly_all) = self.nearly_all()
            && self.holds(&nearly_all)
        {
            return nearly_all;
        }
        if self.range(Open::Templates).is_empty() {
            return of_library;
        }
        self.open = Open::Templates;
        self.refuse();
        // What the library has under a name of its own goes by that name.
        let known = self.screened_of(Open::Library, &[]);
        let with_a_name = |score: &Score| {
            let known = known.iter().find(|known| are_parallel(known, score))?;
            Some((score.candidate, known.candidate))
        };
        let doubled = self.screened(&[]);
        self.doubled = doubled.iter().filter_map(with_a_name).collect();
        match self.search() {
            Outcome::Unexplained(_) => match self.partly() {
                Some(partly) if self.holds(&partly) => partly,
                _ => of_library,
            },
            Outcome::Effects(chosen) if self.is_specific(&chosen) => of_library,
            explained => explained,
        }
    }

    /// Fits to the end what may be the best structure of templates. What is far from noise was given up
    /// early, in an order that says little.
    pub(crate) fn finish_templates(&mut self) {
        let base = self.training_error(&[]).map_or(f64::INFINITY, |(sum, _)| sum);
        let mut best = self.ranked();
        best.retain(|chosen| {
            let error = self.training_error(chosen).map_or(f64::INFINITY, |(sum, _)| sum);
            !chosen.is_empty() && !self.is_specific(chosen) && error < base
        });
        best.truncate(FINISHED);
        self.finish(&best);
    }

    /// Fits some structures to the end, and simulates validation recordings with them.
    pub(crate) fn finish(&mut self, structures: &[Vec<usize>]) {
        let mut open = structures.to_vec();
        for _ in 0..MOST_ROUNDS {
            open.retain(|chosen| self.fitted(chosen).is_some_and(|fitted| !fitted.is_converged));
            if open.is_empty() {
                break;
            }
            let wanted = open.iter().map(|chosen| self.continued(chosen)).collect();
            self.refit(wanted, EVALUATIONS, HeldOut::Later);
        }
        self.hold_out(structures);
    }

    /// Looks for what the base model lacks among the candidates that are open.
    fn search(&mut self) -> Outcome {
        let mut frontier = vec![Vec::new()];
        for refitted in REFITTED {
            self.grow(&frontier, refitted);
            self.exchange();
            let ranked = self.ranked();
            if ranked.first().is_none_or(|best| self.explains(best)) {
                break;
            }
            let depth = frontier.first().map_or(0, Vec::len);
            if depth > 0 && !ranked.first().is_some_and(|best| self.is_promising(best)) {
                break;
            }
            let is_open = |s: &Vec<usize>| s.iter().all(|c| self.is_open(*c));
            frontier =
                ranked.into_iter().filter(|s| s.len() > depth && is_open(s)).take(BEAM).collect();
            if frontier.is_empty() {
                break;
            }
        }
        self.other_forms();
        loop {
            let outcome = self.outcome();
            if self.holds(&outcome) {
                return outcome;
            }
        }
    }

    /// Tries one effect more with each of some structures.
    fn grow(&mut self, frontier: &[Vec<usize>], refitted: usize) {
        let mut wanted: Vec<Wanted> = Vec::new();
        for chosen in frontier {
            for score in self.screened(chosen).iter().take(refitted) {
                wanted.push(self.extended(chosen, score));
            }
            for other in self.without_score(chosen) {
                match wanted.iter_mut().find(|wanted| wanted.chosen == other.chosen) {
                    Some(wanted) => wanted.points.extend(other.points),
                    None => wanted.push(other),
                }
            }
        }
        self.confirm(wanted);
    }

    /// A structure with each effect that has no score on top of another, to be fitted from the values
    /// that its file has: effects of the library, and few of the templates.
    fn without_score(&mut self, chosen: &[usize]) -> Vec<Wanted> {
        self.screen(self.open, chosen);
        let screen = self.known_screen(self.open, chosen);
        let silent = screen.into_iter().flat_map(|screen| &screen.silent);
        let silent = silent.filter(|silent| match silent.remedy {
            Remedy::Fit => !self.candidates[silent.candidate].is_generic,
            Remedy::FitAnyway => chosen.is_empty() || !self.candidates[silent.candidate].is_generic,
            Remedy::ScoreIsZero | Remedy::LeaveOut => false,
        });
        let points = vec![StartPoint::default()];
        let nothing =
            |candidate| Score { candidate, gain: 0.0, points: points.clone(), columns: vec![] };
        silent.map(|silent| self.extended(chosen, &nothing(silent.candidate))).collect()
    }

    /// Takes out candidates that make no sound model.
    fn refuse(&mut self) {
        for candidate in self.range(self.open) {
            if let Err(refused) = self.base.structure(self.candidates, &[candidate]) {
                let reason = format!("cannot be applied: {}", refused.0);
                self.tried.insert(vec![candidate], Err(NoFit(reason)));
            }
        }
    }

    /// Positions of candidates.
    pub(crate) fn range(&self, of: Open) -> Range<usize> {
        let first = self.candidates.partition_point(|candidate| !candidate.is_generic);
        match of {
            Open::Library => 0..first,
            Open::Templates => first..self.candidates.len(),
        }
    }

    /// Whether the search may take a candidate.
    pub(crate) fn is_open(&self, candidate: usize) -> bool {
        self.range(self.open).contains(&candidate)
    }

    /// What open candidates promise on top of a structure, the best first.
    pub(crate) fn screened(&mut self, chosen: &[usize]) -> Vec<Score> {
        self.screened_of(self.open, chosen)
    }

    pub(crate) fn screened_of(&mut self, some: Open, chosen: &[usize]) -> Vec<Score> {
        self.screen(some, chosen);
        self.scores(some, chosen)
    }

    /// The same of what was screened so far.
    pub(crate) fn scores(&self, some: Open, chosen: &[usize]) -> Vec<Score> {
        let screen = self.known_screen(some, chosen);
        let mut scores = screen.map_or_else(Vec::new, |screen| screen.scores.clone());
        scores.retain(|score| !self.doubled.contains_key(&score.candidate));
        sort(&mut scores);
        scores
    }

    /// What each of the open candidates could gain there.
    pub(crate) fn trials(&mut self, chosen: &[usize]) -> Vec<Trial> {
        self.screen(self.open, chosen);
        let screen = self.known_screen(self.open, chosen);
        let trials = screen.into_iter().flat_map(|screen| &screen.trials);
        trials.filter(|trial| !self.doubled.contains_key(&trial.candidate)).cloned().collect()
    }

    /// What some candidates promise on top of the base model, which is screened where it is not.
    pub(crate) fn screen_of_the_base(&self, some: Open) -> Screen {
        let known = self.known_screen(some, &[]);
        match known.or_else(|| self.base_screens.get(&self.range(some).start)) {
            Some(screen) => screen.clone(),
            None => self.fitted(&[]).map_or_else(Screen::default, |fitted| {
                self.screen_of(fitted, self.range(some), Look::OnTheGrid)
            }),
        }
    }

    /// The screen of a structure, if it was made.
    fn known_screen(&self, some: Open, chosen: &[usize]) -> Option<&Screen> {
        let range = self.range(some);
        let key = || (range.start, chosen.to_vec());
        (!range.is_empty()).then(|| self.screens.get(&key()))?
    }

    /// Screens candidates on top of a structure, unless that was done.
    fn screen(&mut self, some: Open, chosen: &[usize]) {
        let range = self.range(some);
        let key = (range.start, chosen.to_vec());
        if range.is_empty() || self.screens.contains_key(&key) {
            return;
        }
        let Some(fitted) = self.fitted(chosen) else { return };
        let screen = self.screen_of(fitted, range, Look::Closer);
        self.screens.insert(key, screen);
    }

    fn screen_of(&self, fitted: &Fitted, some: Range<usize>, look: Look) -> Screen {
        let is_refused = |c: &usize| {
            self.doubled.contains_key(c) || matches!(self.tried.get(&vec![*c]), Some(Err(_)))
        };
        let chosen = &fitted.structure.candidates;
        let others: Vec<usize> = some.filter(|c| !chosen.contains(c) && !is_refused(c)).collect();
        screen(self.base, self.candidates, &others, fitted, &self.data, look, self.threads)
    }

    /// Refits structures that were not tried before, each from the points that its screen suggests.
    fn confirm(&mut self, wanted: Vec<Wanted>) {
        let mut new: Vec<Wanted> = Vec::new();
        for wanted in wanted {
            let is_known = self.tried.contains_key(&wanted.chosen);
            if !is_known && !new.iter().any(|other| other.chosen == wanted.chosen) {
                new.push(wanted);
            }
        }
        let mut open: Vec<Vec<usize>> = new.iter().map(|wanted| wanted.chosen.clone()).collect();
        let mut next = new;
        for (evaluations, within) in STAGES {
            self.refit(next, evaluations, HeldOut::Later);
            let error = |chosen: &Vec<usize>| self.training_error(chosen).map(|(sum, _)| sum);
            let least = self.tried.keys().filter_map(error).fold(f64::INFINITY, f64::min);
            open.retain(|chosen| error(chosen).is_some_and(|error| error <= within * least));
            let unfinished =
                open.iter().filter(|c| self.fitted(c).is_some_and(|fitted| !fitted.is_converged));
            next = unfinished.map(|chosen| self.continued(chosen)).collect();
        }
        // Of what is still under way only the best goes on to the end, if there is hope for it.
        let best = self.ranked().into_iter().next().filter(|best| {
            self.training_error(best).is_some_and(|(sum, n)| sum <= HOPELESS * n as f64)
        });
        next.retain(|wanted| Some(&wanted.chosen) == best.as_ref());
        self.refit(next, EVALUATIONS, HeldOut::Later);
        self.sharpen();
        self.hold_out(&open);
    }

    /// Simulates validation recordings with some structures.
    pub(crate) fn hold_out(&mut self, structures: &[Vec<usize>]) {
        for chosen in structures {
            if let Some(Ok(fitted)) = self.tried.get_mut(chosen)
                && fitted.valid.is_none()
            {
                fitted.hold_out(&self.data, EVALUATIONS);
            }
        }
    }

    /// A structure to be fitted from where its fit ended.
    pub(crate) fn continued(&self, chosen: &[usize]) -> Wanted {
        let from = self.values(chosen);
        Wanted { chosen: chosen.to_vec(), from, points: vec![StartPoint::default()] }
    }

    /// Fits structures, several at a time.
    pub(crate) fn refit(&mut self, wanted: Vec<Wanted>, evaluations: usize, held_out: HeldOut) {
        let (base, candidates, data) = (self.base, self.candidates, &self.data);
        let count = data.keeping.count("structures fitted", wanted.len());
        let results = in_parallel(self.threads, wanted.len(), |k| {
            let Wanted { chosen, from, points } = &wanted[k];
            let structure =
                base.structure(candidates, chosen).map_err(|refused| NoFit(refused.0))?;
            let fitted = Fitted::new(structure, from, points, data, evaluations);
            count.more(1);
            let mut fitted = fitted?;
            if held_out == HeldOut::Now {
                fitted.hold_out(data, evaluations);
            }
            Ok(fitted)
        });
        for (wanted, result) in wanted.into_iter().zip(results) {
            self.tried.insert(wanted.chosen, result);
        }
    }

    /// Tries near twins for each effect of the best structure, until none is better.
    fn exchange(&mut self) {
        for _ in 0..MOST_EFFECTS {
            let Some(best) = self.ranked().first().cloned() else { return };
            if best.len() < 2 {
                return;
            }
            let mut wanted = Vec::new();
            for effect in &best {
                let rest: Vec<usize> = best.iter().copied().filter(|c| c != effect).collect();
                if !best.iter().all(|c| self.is_open(*c)) {
                    return;
                }
                self.settle(&rest, &best);
                for score in self.screened(&rest).iter().take(EXCHANGED) {
                    wanted.push(self.extended(&rest, score));
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
    fn other_forms(&mut self) {
        let mut explaining = self.ranked();
        explaining.retain(|chosen| self.explains(chosen));
        let first_sound = explaining.iter().position(|chosen| self.is_sound(chosen));
        explaining.truncate(first_sound.unwrap_or(BEAM).min(BEAM));
        for chosen in &explaining {
            let others = self.with_other_forms(chosen);
            for other in &others {
                self.settle(other, chosen);
            }
            self.finish(&others);
        }
    }

    /// Structures with another form of an effect that has a parameter at its bound.
    fn with_other_forms(&self, chosen: &[usize]) -> Vec<Vec<usize>> {
        let other_forms = self.at_bound(chosen).into_iter().flat_map(|effect| {
            let forms = self.range(self.open).filter(move |form| self.are_forms(*form, effect));
            forms.map(move |form| {
                let rest = chosen.iter().copied().filter(|other| *other != effect);
                let mut other: Vec<usize> = rest.chain([form]).collect();
                other.sort_unstable();
                other
            })
        });
        other_forms.collect()
    }

    /// Whether two candidates are different forms of one effect at one place.
    pub(crate) fn are_forms(&self, one: usize, other: usize) -> bool {
        let place = |c: usize| {
            let Application { effect, arguments, .. } = &self.candidates[c].application;
            (&effect.name.text, arguments.iter().map(|name| &name.text).collect::<Vec<_>>())
        };
        one != other && place(one) == place(other)
    }

    /// Fits a part of a structure, or one like it, from where that ended, unless its own fit ended at a
    /// minimum that is nearly as good as the whole's.
    ///
    /// An effect that is right may have been given up early, from a point that the screen suggested, or
    /// have ended at another minimum; with another one beside it it then would look as if it took both.
    pub(crate) fn settle(&mut self, part: &[usize], whole: &[usize]) {
        let of_whole = self.training_error(whole).map_or(f64::INFINITY, |(sum, _)| sum);
        let is_settled = |tried: &Result<Fitted, NoFit>| {
            let is_good = |fitted: &Fitted| fitted.error.0 < NEARLY_AS_GOOD * of_whole;
            tried.as_ref().map_or(true, |fitted| fitted.is_converged && is_good(fitted))
        };
        let is_new = self.settled.insert((part.to_vec(), whole.to_vec()));
        if !is_new || self.tried.get(part).is_some_and(is_settled) {
            return;
        }
        let error = |search: &Self| search.training_error(part).map(|(sum, _)| sum);
        let (least, before) = (error(self), self.tried.remove(part));
        let wanted = Wanted { chosen: part.to_vec(), ..self.continued(whole) };
        self.confirm(vec![wanted]);
        match (least, error(self)) {
            (Some(least), Some(error)) if error < least => {
                self.screens.retain(|(_, chosen), _| chosen != part);
            }
            (Some(_), _) => {
                self.tried.extend(before.map(|before| (part.to_vec(), before)));
            }
            (None, _) => {}
        }
    }

    /// A structure with one effect more, to be fitted from where its screen suggests.
    fn extended(&self, chosen: &[usize], score: &Score) -> Wanted {
        let mut longer = chosen.to_vec();
        longer.push(score.candidate);
        longer.sort_unstable();
        Wanted { chosen: longer, from: self.values(chosen), points: score.points.clone() }
    }

    /// Parameters and start values of a structure.
    fn values(&self, chosen: &[usize]) -> Values {
        self.fitted(chosen).map(|fitted| fitted.values.clone()).unwrap_or_default()
    }

    pub(crate) fn fitted(&self, chosen: &[usize]) -> Option<&Fitted> {
        self.tried.get(chosen)?.as_ref().ok()
    }
}

/// Which candidates a search may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Open {
    /// Those of the library.
    Library,
    /// Templates.
    Templates,
}

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
    chosen: Vec<usize>,
    /// Values that it starts from.
    from: Values,
    points: Vec<StartPoint>,
}
