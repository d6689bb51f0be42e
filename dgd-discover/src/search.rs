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

use dgd_runtime::identify::Recording;

use crate::candidates::Candidate;
use crate::colour::coloured_noise;
use crate::fitted::{Data, Fitted, NoFit, chi_square, whitened, whitened_square};
use crate::noise::{SensorNoise, white_noise};
use crate::parallel::in_parallel;
use crate::screen::{Score, StartPoint, are_parallel, screen};
use crate::structure::{BaseModel, Values};
use crate::whiteness::{steadiness, whiteness};

/// Most effects in one structure.
const MOST_EFFECTS: usize = 3;

/// How many structures the search goes on from.
const BEAM: usize = 3;

/// How many of the screened candidates are refitted, by number of effects that are in already.
const REFITTED: [usize; MOST_EFFECTS] = [8, 3, 3];

/// How many twins are tried for each effect of the best structure.
const EXCHANGED: usize = 3;

/// Simulations of the fits of a structure in the end.
const EVALUATIONS: usize = 40;

/// Fits that are not finished go on in stages: after so many simulations, those whose error is within
/// this factor of the least. A structure that is right shows it early.
const STAGES: [(usize, f64); 3] = [(4, 10.0), (6, 3.0), (10, 1.5)];

/// Simulations of fits that are made again with other weights.
const AGAIN: usize = 10;

/// A part of a structure with at most so many times its error needs no fit from where the whole ended.
const NEARLY_AS_GOOD: f64 = 1.1;

/// A fit that has gone through the stages and still leaves so many times the noise is given up.
const HOPELESS: f64 = 10.0;

/// Mean square of the errors, over that of the noise, up to which a structure explains the data: what
/// it leaves is a few per cent of the sensors' noise, more than rounding and less than any effect.
const EXPLAINED: f64 = 1.1;

/// The same of held-out data, 1.2 times the noise: there start values are known from a minute only,
/// and parameters no better than the training data tells.
const EXPLAINED_HELD_OUT: f64 = 1.44;

/// The same where a structure with more effects explains the data and is hardly more likely.
const NEARLY_EXPLAINED_HELD_OUT: f64 = 2.25;

/// Residuals are nothing but noise where no check of them has a p-value below this, over the number of
/// outputs: one false alarm in ten thousand models.
const FALSE_ALARM: f64 = 1e-4;

/// So many structures of templates are fitted to the end, in so many rounds at most.
const FINISHED: usize = 6;
const MOST_ROUNDS: usize = 4;

/// Templates that leave at most this share of the mean square name most of what is missing …
const MOSTLY: f64 = 0.4;

/// … where that is at most this share of what the next best leaves.
const CLEARLY: f64 = 0.8;

/// A further effect is worth its place where it takes away half of what is left beyond noise.
const WORTH_ITS_PLACE: f64 = 0.5;

/// And where the Bayesian information criterion falls by this: three times what is called very strong
/// evidence (Kass & Raftery, J. Am. Stat. Assoc. 90 (1995) 773), since it is the best of a library.
const LEAST_GAIN: f64 = 30.0;

/// A third effect is looked for where two have left less than this of the discrepancy.
const PROMISING: f64 = 0.1;

/// The search and what it has tried.
pub(crate) struct Search<'a> {
    pub base: &'a BaseModel,
    pub candidates: &'a [Candidate<'a>],
    pub data: Data<'a>,
    pub threads: usize,
    /// By positions of the candidates.
    pub tried: BTreeMap<Vec<usize>, Result<Fitted, NoFit>>,
    /// Candidates that the search may take: those of the library, or the templates.
    pub open: Range<usize>,
    /// Templates that come to the same as an effect of the library.
    pub doubled: BTreeSet<usize>,
    /// Screens of structures.
    pub screens: BTreeMap<Vec<usize>, Vec<Score>>,
    /// Parts of structures that were fitted from where the whole ended, with the whole.
    pub settled: BTreeSet<(Vec<usize>, Vec<usize>)>,
}

/// What a search ends with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The base model explains the data.
    Sufficient,
    /// A structure with effects does.
    Effects(Vec<usize>),
    /// None does, but one made of templates takes most of the discrepancy away.
    Partly(Vec<usize>),
    /// None does; the best that was tried.
    Unexplained(Vec<usize>),
}

impl Search<'_> {
    /// Fits the base model and searches: first with the library, and with templates where that
    /// explains nothing.
    pub(crate) fn run(&mut self, start: &Values) -> Result<Outcome, NoFit> {
        self.refuse();
        self.fit_base(start)?;
        if self.is_noise(&[]) || (self.recolour(&[]) && self.nothing_promises()) {
            return Ok(Outcome::Sufficient);
        }
        let of_library = self.search();
        let is_explained = !matches!(of_library, Outcome::Unexplained(_));
        if is_explained || self.open.end == self.candidates.len() {
            return Ok(of_library);
        }
        let known = self.screened(&[]);
        self.open = self.open.end..self.candidates.len();
        self.screens.clear();
        self.refuse();
        // What the library has under a name of its own goes by that name.
        let has_a_name = |score: &&Score| known.iter().any(|known| are_parallel(known, score));
        let doubled = self.screened(&[]);
        self.doubled = doubled.iter().filter(has_a_name).map(|score| score.candidate).collect();
        self.screens.clear();
        Ok(match self.search() {
            Outcome::Unexplained(_) => self.partly().unwrap_or(of_library),
            Outcome::Effects(chosen) if self.is_specific(&chosen) => of_library,
            explained => explained,
        })
    }

    /// Whether a structure has an effect of the library.
    fn is_specific(&self, chosen: &[usize]) -> bool {
        chosen.iter().any(|&c| !self.candidates[c].is_generic)
    }

    /// A structure of templates that leaves more than noise and yet is the answer as far as it goes:
    /// it takes most of the discrepancy away, from held-out recordings as well, and every other that
    /// is no longer takes away clearly less.
    fn partly(&mut self) -> Option<Outcome> {
        self.finish();
        let best = &*self.ranked().into_iter().next()?;
        let share = |of: &dyn Fn(&Self, &[usize]) -> Option<f64>, chosen: &[usize]| {
            Some(of(self, chosen)? / of(self, &[])?)
        };
        let trained = share(&|s, chosen| s.training_square(chosen), best)?;
        let held_out = share(&|s, chosen| s.held_out_square(chosen), best)?;
        let rivals = self.ranked().into_iter().filter(|other| {
            let shares_one = best.iter().any(|effect| other.contains(effect));
            other.len() <= best.len() && !shares_one && !other.is_empty()
        });
        let of_rivals = rivals.filter_map(|other| share(&|s, c| s.training_square(c), &other));
        let rival = of_rivals.fold(f64::INFINITY, f64::min);
        let is_clear = !best.is_empty()
            && !self.is_specific(best)
            && self.is_sound(best)
            && trained < MOSTLY
            && held_out < MOSTLY
            && trained < CLEARLY * rival;
        is_clear.then(|| Outcome::Partly(best.to_vec()))
    }

    /// Fits to the end what may be the best structure of templates. What is far from noise was given up
    /// early, in an order that says little.
    fn finish(&mut self) {
        let base = self.training_error(&[]).map_or(f64::INFINITY, |(sum, _)| sum);
        let mut best = self.ranked();
        best.retain(|chosen| {
            let error = self.training_error(chosen).map_or(f64::INFINITY, |(sum, _)| sum);
            !chosen.is_empty() && !self.is_specific(chosen) && error < base
        });
        best.truncate(FINISHED);
        for _ in 0..MOST_ROUNDS {
            let is_open =
                |chosen: &&Vec<usize>| self.fitted(chosen).is_some_and(|f| !f.is_converged);
            let open: Vec<Wanted> =
                best.iter().filter(is_open).map(|chosen| self.continued(chosen)).collect();
            if open.is_empty() {
                break;
            }
            self.refit(open, EVALUATIONS, HeldOut::Later);
        }
        self.hold_out(&best);
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
            let is_open = |s: &Vec<usize>| s.iter().all(|c| self.open.contains(c));
            frontier =
                ranked.into_iter().filter(|s| s.len() > depth && is_open(s)).take(BEAM).collect();
            if frontier.is_empty() {
                break;
            }
        }
        self.outcome()
    }

    /// Whether so much of the discrepancy is taken away that what is left may be one effect more.
    fn is_promising(&self, chosen: &[usize]) -> bool {
        let excess = |s: &[usize]| self.training_error(s).map(|(sum, n)| sum - n as f64);
        match (excess(chosen), excess(&[])) {
            (Some(left), Some(all)) => left < PROMISING * all,
            _ => false,
        }
    }

    /// Tries one effect more with each of some structures.
    fn grow(&mut self, frontier: &[Vec<usize>], refitted: usize) {
        let mut wanted = Vec::new();
        for chosen in frontier {
            for score in self.screened(chosen).iter().take(refitted) {
                wanted.push(self.extended(chosen, score));
            }
        }
        self.confirm(wanted);
    }

    /// The simplest structure that explains the data, unless one with more effects is worth them.
    fn outcome(&self) -> Outcome {
        let ranked = self.ranked();
        let fits = |chosen: &&Vec<usize>| self.explains(chosen) && self.is_sound(chosen);
        let Some(mut best) = ranked.iter().find(fits) else {
            return Outcome::Unexplained(ranked.into_iter().next().unwrap_or_default());
        };
        // A simpler one is believed although it predicts a little worse: that may be its estimates,
        // and a name that only noise suggests is worse than none.
        let nearly = |chosen: &&Vec<usize>| {
            self.leaves_at_most(chosen, EXPLAINED, NEARLY_EXPLAINED_HELD_OUT)
                && self.is_sound(chosen)
        };
        while let Some(simpler) =
            ranked.iter().filter(nearly).find(|s| s.len() < best.len() && !self.is_worth(best, s))
        {
            best = simpler;
        }
        if best.is_empty() { Outcome::Sufficient } else { Outcome::Effects(best.clone()) }
    }

    /// Whether the effects that one structure has more than another are worth their place.
    fn is_worth(&self, longer: &[usize], shorter: &[usize]) -> bool {
        let excess = |error: Option<(f64, usize)>| error.map(|(sum, n)| sum - n as f64);
        let halves = |longer, shorter| match (excess(longer), excess(shorter)) {
            (Some(longer), Some(shorter)) => longer < WORTH_ITS_PLACE * shorter,
            _ => false,
        };
        let gain =
            self.bic(shorter).zip(self.bic(longer)).map(|(shorter, longer)| shorter - longer);
        !self.is_noise(shorter)
            && gain.is_some_and(|gain| gain > LEAST_GAIN)
            && halves(self.training_error(longer), self.training_error(shorter))
            && (self.data.valid.is_empty()
                || halves(self.held_out_error(longer), self.held_out_error(shorter)))
    }

    /// Takes out candidates that make no sound model.
    fn refuse(&mut self) {
        for candidate in self.open.clone() {
            if let Err(refused) = self.base.structure(self.candidates, &[candidate]) {
                let reason = format!("cannot be applied: {}", refused.0);
                self.tried.insert(vec![candidate], Err(NoFit(reason)));
            }
        }
    }

    /// Fits the base model twice if need be: the noise is known better from its residuals.
    fn fit_base(&mut self, start: &Values) -> Result<(), NoFit> {
        let refused = |refused: crate::structure::Refused| NoFit(refused.0);
        let structure = self.base.structure(self.candidates, &[]).map_err(refused)?;
        let fitted = Fitted::new(
            structure.clone(),
            start,
            &[StartPoint::default()],
            &self.data,
            4 * EVALUATIONS,
        )?;
        let changed = self.tighten_noise(&fitted);
        let mut fitted = if changed {
            let from = fitted.values.clone();
            Fitted::new(structure, &from, &[StartPoint::default()], &self.data, EVALUATIONS)?
        } else {
            fitted
        };
        fitted.weigh(&self.data);
        fitted.hold_out(&self.data, EVALUATIONS);
        self.tried.insert(Vec::new(), Ok(fitted));
        Ok(())
    }

    /// Takes over the noise that the residuals of a structure show where it is less; says whether
    /// it changed by what matters to weights.
    fn tighten_noise(&mut self, fitted: &Fitted) -> bool {
        let shown = noise_of(self.data.train, &fitted.residuals(&self.data));
        let mut changed = false;
        for (noise, shown) in self.data.noise.iter_mut().zip(shown) {
            let (Some(noise), Some(shown)) = (noise, shown) else { continue };
            if shown.std < noise.std {
                changed |= shown.std < 0.95 * noise.std;
                *noise = SensorNoise { colour: noise.colour, ..shown };
            }
        }
        changed
    }

    /// Takes over the correlated noise that the errors of a structure show, if that is all they show;
    /// says whether it is.
    ///
    /// What a sensor adds by itself is short, steady and the same in all recordings. Errors of outputs
    /// that are white stay white.
    fn recolour(&mut self, chosen: &[usize]) -> bool {
        let Some(fitted) = self.fitted(chosen) else { return false };
        let residuals = fitted.residuals(&self.data);
        let mut noise = self.data.noise.clone();
        for (output, noise) in noise.iter_mut().enumerate() {
            let Some(noise) = noise else { continue };
            let errors: Vec<(&[f64], &[f64])> = self
                .data
                .train
                .iter()
                .zip(&residuals)
                .map(|(recording, outputs)| (&*recording.times, &*outputs[output]))
                .collect();
            let white = SensorNoise { colour: None, ..*noise };
            *noise = coloured_noise(&errors, &white).unwrap_or(white);
        }
        let is_steady = |output: usize, noise: &SensorNoise| {
            self.data.train.iter().zip(&residuals).all(|(recording, outputs)| {
                let left = whitened(recording, &outputs[output], noise);
                noise.colour.is_none() || steadiness(&left) > FALSE_ALARM
            })
        };
        let all_steady = noise
            .iter()
            .enumerate()
            .all(|(output, noise)| noise.as_ref().is_none_or(|noise| is_steady(output, noise)));
        if !all_steady || !self.leaves_noise(&residuals, &noise) {
            return false;
        }
        if noise != self.data.noise {
            self.data.noise = noise;
            self.reweigh();
        }
        true
    }

    /// Weighs the errors of all structures anew, after the noise has changed.
    fn reweigh(&mut self) {
        for fitted in self.tried.values_mut().flatten() {
            fitted.weigh(&self.data);
        }
        self.screens.clear();
    }

    /// Whether no candidate promises to be worth its place in the base model.
    fn nothing_promises(&mut self) -> bool {
        let samples = self.training_error(&[]).map_or(1, |(_, n)| n) as f64;
        let scores = self.screened(&[]);
        let costs = |score: &Score| {
            let point = score.points.first().map_or(1, |point| point.values.len());
            LEAST_GAIN + point as f64 * samples.ln()
        };
        scores.iter().all(|score| score.gain < costs(score))
    }

    /// The screen of a structure, the best first.
    pub(crate) fn screened(&mut self, chosen: &[usize]) -> Vec<Score> {
        if let Some(scores) = self.screens.get(chosen) {
            return scores.clone();
        }
        let Some(Ok(fitted)) = self.tried.get(chosen) else { return Vec::new() };
        let is_refused = |c: &usize| {
            self.doubled.contains(c) || matches!(self.tried.get(&vec![*c]), Some(Err(_)))
        };
        let left = self.open.clone().filter(|c| !chosen.contains(c) && !is_refused(c));
        let others: Vec<usize> = left.collect();
        let scores = screen(self.base, self.candidates, &others, fitted, &self.data, self.threads);
        self.screens.insert(chosen.to_vec(), scores.clone());
        scores
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

    /// Simulates held-out recordings with some structures.
    fn hold_out(&mut self, structures: &[Vec<usize>]) {
        for chosen in structures {
            if let Some(Ok(fitted)) = self.tried.get_mut(chosen)
                && fitted.valid.is_none()
            {
                fitted.hold_out(&self.data, EVALUATIONS);
            }
        }
    }

    /// A structure to be fitted from where its fit ended.
    fn continued(&self, chosen: &[usize]) -> Wanted {
        let from = self.values(chosen);
        Wanted { chosen: chosen.to_vec(), from, points: vec![StartPoint::default()] }
    }

    /// Fits structures, several at a time.
    fn refit(&mut self, wanted: Vec<Wanted>, evaluations: usize, held_out: HeldOut) {
        let (base, candidates, data) = (self.base, self.candidates, &self.data);
        let results = in_parallel(self.threads, wanted.len(), |k| {
            let Wanted { chosen, from, points } = &wanted[k];
            let structure =
                base.structure(candidates, chosen).map_err(|refused| NoFit(refused.0))?;
            let mut fitted = Fitted::new(structure, from, points, data, evaluations)?;
            if held_out == HeldOut::Now {
                fitted.hold_out(data, evaluations);
            }
            Ok(fitted)
        });
        for (wanted, result) in wanted.into_iter().zip(results) {
            self.tried.insert(wanted.chosen, result);
        }
    }

    /// Where the best structure shows less noise than was known, all weights change: what was fitted
    /// goes on from where it is.
    fn sharpen(&mut self) {
        let Some(best) = self.ranked().first().cloned() else { return };
        let Some(Ok(fitted)) = self.tried.get(&best).cloned() else { return };
        let is_tightened = self.tighten_noise(&fitted);
        let before = self.data.noise.clone();
        let is_recoloured = self.recolour(&best) && before != self.data.noise;
        if !is_tightened && !is_recoloured {
            return;
        }
        self.reweigh();
        // The base model for comparison, and what may still be the best.
        let mut again = self.ranked();
        again.truncate(BEAM);
        if !again.contains(&Vec::new()) {
            again.push(Vec::new());
        }
        let again = again.iter().map(|chosen| self.continued(chosen)).collect();
        self.refit(again, AGAIN, HeldOut::Now);
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
                if !best.iter().all(|c| self.open.contains(c)) {
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

    /// Fits a part of a structure from where the whole ended, unless its own fit ended at a minimum
    /// that is nearly as good as the whole's.
    ///
    /// An effect that is right may have been given up early, from a point that the screen suggested, or
    /// have ended at another minimum; with another one beside it it then would look as if it took both.
    fn settle(&mut self, part: &[usize], whole: &[usize]) {
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
                self.screens.remove(part);
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

    /// The structures that could be fitted, the best first, by the Bayesian information criterion.
    pub(crate) fn ranked(&self) -> Vec<Vec<usize>> {
        let mut all: Vec<(f64, &Vec<usize>)> =
            self.tried.keys().filter_map(|chosen| Some((self.bic(chosen)?, chosen))).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(b.1)));
        all.into_iter().map(|(_, chosen)| chosen.clone()).collect()
    }

    /// Σ (e/σ)² + k ln N on the training recordings, with the sum in units of what the best
    /// structure leaves: where that is more than noise, differences count less.
    pub(crate) fn bic(&self, chosen: &[usize]) -> Option<f64> {
        let (sum, n) = self.training_error(chosen)?;
        let least = self.tried.keys().filter_map(|s| self.training_error(s));
        let least = least.map(|(sum, _)| sum).fold(f64::INFINITY, f64::min);
        let unit = (least / n as f64).max(1.0);
        let fitted = self.fitted(chosen)?;
        Some(sum / unit + fitted.free() as f64 * (n as f64).ln())
    }

    /// Σ ε² of the training recordings, and how many samples; ε is white if the errors are noise.
    pub(crate) fn training_error(&self, chosen: &[usize]) -> Option<(f64, usize)> {
        Some(self.fitted(chosen)?.error)
    }

    /// The same of the held-out recordings.
    fn held_out_error(&self, chosen: &[usize]) -> Option<(f64, usize)> {
        let residuals = self.fitted(chosen)?.held_out_residuals(&self.data)?;
        Some(whitened_square(self.data.valid, &residuals, &self.data.noise))
    }

    /// Mean square of the errors in the training recordings over that of the noise.
    pub(crate) fn training_square(&self, chosen: &[usize]) -> Option<f64> {
        Some(mean(&chi_square(&self.fitted(chosen)?.residuals(&self.data), &self.data.noise)))
    }

    /// The same of the held-out recordings.
    pub(crate) fn held_out_square(&self, chosen: &[usize]) -> Option<f64> {
        let residuals = self.fitted(chosen)?.held_out_residuals(&self.data)?;
        Some(mean(&chi_square(&residuals, &self.data.noise)))
    }

    pub(crate) fn fitted(&self, chosen: &[usize]) -> Option<&Fitted> {
        self.tried.get(chosen)?.as_ref().ok()
    }

    /// Whether a structure leaves nothing but noise of the training recordings.
    ///
    /// Start values of held-out recordings are known from a minute only, so that their errors are
    /// never quite white; whether they are small is asked by `explains`.
    fn is_noise(&self, chosen: &[usize]) -> bool {
        let Some(fitted) = self.fitted(chosen) else { return false };
        self.leaves_noise(&fitted.residuals(&self.data), &self.data.noise)
    }

    /// Whether errors in the training recordings cannot be told from a noise.
    fn leaves_noise(&self, residuals: &[Vec<Vec<f64>>], noise: &[Option<SensorNoise>]) -> bool {
        let measured = noise.iter().flatten().count() * residuals.len();
        let least = FALSE_ALARM / measured.max(1) as f64;
        let passes = |(recording, outputs): (&Recording, &Vec<Vec<f64>>)| {
            outputs.iter().zip(noise).all(|(residuals, noise)| {
                let Some(noise) = noise else { return true };
                let left = whitened(recording, residuals, noise);
                let unit = SensorNoise { std: 1.0, colour: None, ..*noise };
                whiteness(&left, &unit, 0).is_none_or(|test| test.p_value > least)
            })
        };
        self.data.train.iter().zip(residuals).all(passes)
    }

    /// Whether a structure leaves so little that nothing need be missing.
    pub(crate) fn explains(&self, chosen: &[usize]) -> bool {
        self.leaves_at_most(chosen, EXPLAINED, EXPLAINED_HELD_OUT)
    }

    /// Whether the mean square of each output's errors is at most so many times that of the noise,
    /// in training and in held-out data.
    fn leaves_at_most(&self, chosen: &[usize], train: f64, held_out: f64) -> bool {
        let Some(fitted) = self.fitted(chosen) else { return false };
        let all_within = |residuals: &[Vec<Vec<f64>>], limit: f64| {
            chi_square(residuals, &self.data.noise)
                .iter()
                .all(|(sum, n)| *n == 0 || *sum <= limit * *n as f64)
        };
        if !all_within(&fitted.residuals(&self.data), train) {
            return false;
        }
        if self.data.valid.is_empty() {
            return true;
        }
        let valid = fitted.held_out_residuals(&self.data);
        valid.is_some_and(|valid| all_within(&valid, held_out))
    }

    /// What there is to say about a structure.
    pub(crate) fn note(&self, chosen: &[usize]) -> String {
        let Some(fitted) = self.fitted(chosen) else { return String::new() };
        let mut notes = Vec::new();
        for estimate in &fitted.estimates {
            if estimate.at_bound.is_some() {
                notes.push(format!("`{}` is at its bound", estimate.name));
            }
        }
        if !fitted.is_converged {
            notes.push("the fit was not finished".to_owned());
        }
        notes.join("; ")
    }

    /// Whether no parameter of an effect has run into a bound.
    fn is_sound(&self, chosen: &[usize]) -> bool {
        let Some(fitted) = self.fitted(chosen) else { return false };
        let brought = &fitted.structure.brought;
        let mut own = brought.iter().flat_map(|brought| &brought.parameters);
        own.all(|name| !fitted.estimates.iter().any(|e| e.name == *name && e.at_bound.is_some()))
    }
}

/// When held-out recordings are simulated with a structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HeldOut {
    /// With its fit.
    Now,
    /// When it may be the best.
    Later,
}

/// A structure to fit, and from where.
#[derive(Debug, Clone)]
struct Wanted {
    chosen: Vec<usize>,
    /// Values that it starts from.
    from: Values,
    points: Vec<StartPoint>,
}

/// The noise of each output, from residuals or readings of some recordings; `None` where it is not
/// measured.
pub(crate) fn noise_of(
    recordings: &[Recording],
    residuals: &[Vec<Vec<f64>>],
) -> Vec<Option<SensorNoise>> {
    let outputs = recordings.first().map_or(0, |recording| recording.measured.len());
    let of_output = |output: usize| {
        let parts = recordings.iter().zip(residuals).filter_map(|(recording, residuals)| {
            let measured = recording.measured[output].as_ref()?;
            let noise = white_noise(&recording.times, &residuals[output], measured)?;
            Some((noise, measured.len() as f64))
        });
        let parts: Vec<(SensorNoise, f64)> = parts.collect();
        let all: f64 = parts.iter().map(|(_, n)| n).sum();
        // σ² = Σ n σᵢ² / Σ n; relative errors of independent parts add in squares.
        let mean = |f: &dyn Fn(&SensorNoise) -> f64| {
            parts.iter().map(|(noise, n)| n / all * f(noise)).sum::<f64>()
        };
        let (noise, _) = parts.first()?;
        Some(SensorNoise {
            std: mean(&|noise| noise.std * noise.std).sqrt(),
            relative_error: mean(&|noise| noise.relative_error) / (parts.len() as f64).sqrt(),
            ..*noise
        })
    };
    (0..outputs).map(of_output).collect()
}

fn mean(by_output: &[(f64, usize)]) -> f64 {
    let (sum, n) = by_output.iter().fold((0.0, 0), |(sum, n), (s, m)| (sum + s, n + m));
    sum / n as f64
}
