//! What is believed of the structures that were tried.
//!
//! Structures are ranked by the Bayesian information criterion; one is named only if it leaves nothing
//! but the sensors' noise, on validation recordings too.

use std::collections::BTreeSet;

use crate::fitted::{chi_square, whitened, whitened_square};
use crate::patience::too_many_steps;
use crate::search::Search;
use crate::whiteness::{size, whiteness};
use dgd_screen::noise::SensorNoise;

/// Mean square of the errors, over that of the noise, up to which a structure explains the data: what
/// it leaves is a few per cent of the sensors' noise, more than rounding and less than any effect.
pub(crate) const EXPLAINED: f64 = 1.1;

/// The same of validation data, 1.2 times the noise: there start values are known from a minute only,
/// and parameters no better than the training data tells.
pub(crate) const EXPLAINED_HELD_OUT: f64 = 1.44;

/// The same where a structure with more effects explains the data and is hardly more likely.
const NEARLY_EXPLAINED_HELD_OUT: f64 = 2.25;

/// Residuals are nothing but noise where no check of them has a p-value below this, over the number of
/// outputs: one false alarm in ten thousand models.
pub(crate) const FALSE_ALARM: f64 = 1e-4;

/// Effects of the library that leave at most this share of the mean square are named although they
/// leave more than noise …
const NEARLY_ALL: f64 = 0.02;

/// … if it is at most this share on validation recordings, where parameters are no better than what is
/// left over lets them be …
const NEARLY_ALL_HELD_OUT: f64 = 0.1;

/// … without any one of them so many times as much is left …
const ESSENTIAL: f64 = 3.0;

/// … and all other names leave so many times as much, on one or the other of the recordings.
const UNRIVALLED: f64 = 1.5;

/// Templates that leave at most this share of the mean square name most of what is missing …
const MOSTLY: f64 = 0.4;

/// … where that is at most this share of what the next best leaves.
const CLEARLY: f64 = 0.8;

/// A further effect is worth its place where it takes away half of what is left beyond noise.
const WORTH_ITS_PLACE: f64 = 0.5;

/// And where the Bayesian information criterion falls by this: three times what is called very strong
/// evidence (Kass & Raftery, J. Am. Stat. Assoc. 90 (1995) 773), since it is the best of a library.
pub(crate) const LEAST_GAIN: f64 = 30.0;

/// A third effect is looked for where two have left less than this of the discrepancy.
const PROMISING: f64 = 0.1;

/// What a search ends with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The base model explains the data.
    Sufficient,
    /// A structure with effects does.
    Effects(Vec<usize>),
    /// None does, but one takes most of the discrepancy away.
    Partly(Vec<usize>),
    /// None does; the best that was tried.
    Unexplained(Vec<usize>),
}

impl Search<'_> {
    /// Whether a structure has an effect of the library.
    pub(crate) fn is_specific(&self, chosen: &[usize]) -> bool {
        chosen.iter().any(|&c| !self.candidates[c].is_generic)
    }

    /// A structure of effects of the library that takes nearly all of the discrepancy away, none of which
    /// can be spared, and with which no other names compare. What it leaves is more than noise: a plant
    /// is never all in its model.
    pub(crate) fn nearly_all(&mut self) -> Option<Outcome> {
        let best = self.without_spare_parts().filter(|best| !best.is_empty())?;
        self.finish(std::slice::from_ref(&best));
        if self.without_spare_parts().as_ref() != Some(&best) || !self.is_believable(&best) {
            return None;
        }
        let [trained, held_out] = self.squares(&best)?;
        let [all_trained, all_held_out] = self.squares(&[])?;
        if trained > NEARLY_ALL * all_trained || held_out > NEARLY_ALL_HELD_OUT * all_held_out {
            return None;
        }
        (self.are_essential(&best) && self.is_unrivalled(&best)).then_some(Outcome::Partly(best))
    }

    /// The best structure, or a part of it whose rest the Bayesian information criterion hardly asks for.
    fn without_spare_parts(&self) -> Option<Vec<usize>> {
        let ranked = self.ranked();
        let mut best = ranked.first()?;
        let is_part = |part: &Vec<usize>, whole: &Vec<usize>| {
            part.len() < whole.len() && part.iter().all(|effect| whole.contains(effect))
        };
        let gain = |part: &[usize], whole: &[usize]| {
            let both = self.bic(part).zip(self.bic(whole));
            both.map_or(f64::INFINITY, |(part, whole)| part - whole)
        };
        while let Some(part) =
            ranked.iter().find(|part| is_part(part, best) && gain(part, best) < LEAST_GAIN)
        {
            best = part;
        }
        Some(best.clone())
    }

    /// Whether far more is left without any one of the library's effects of a structure.
    fn are_essential(&mut self, chosen: &[usize]) -> bool {
        let Some(left) = self.training_square(chosen) else { return false };
        let specific = chosen.iter().filter(|&&c| !self.candidates[c].is_generic);
        let specific: Vec<usize> = specific.copied().collect();
        specific.iter().all(|effect| {
            let rest: Vec<usize> = chosen.iter().copied().filter(|other| other != effect).collect();
            self.settle(&rest, chosen);
            !self.training_square(&rest).is_some_and(|without| without < ESSENTIAL * left)
        })
    }

    /// Whether clearly more is left with other effects of the library, or with none. More effects beside its
    /// own are no others.
    fn is_unrivalled(&mut self, chosen: &[usize]) -> bool {
        let Some([trained, held_out]) = self.squares(chosen) else { return false };
        let candidates = self.candidates;
        let names = |chosen: &[usize]| -> BTreeSet<String> {
            let specific = chosen.iter().filter(|&&c| !candidates[c].is_generic);
            specific.map(|&c| candidates[c].name()).collect()
        };
        let own = names(chosen);
        let mut rivals = self.ranked();
        rivals.retain(|other| {
            let left = self.training_square(other).unwrap_or(f64::INFINITY);
            left < UNRIVALLED * trained && !names(other).is_superset(&own)
        });
        self.finish(&rivals);
        rivals.iter().all(|rival| {
            self.squares(rival).is_none_or(|[of_training, of_held_out]| {
                of_training > UNRIVALLED * trained || of_held_out > UNRIVALLED * held_out
            })
        })
    }

    /// The structure that comes closest to another, in training and validation data alike, among those
    /// that lack one of its effects.
    pub(crate) fn without_one_of(&self, chosen: &[usize]) -> Option<Vec<usize>> {
        let names = |chosen: &[usize]| -> BTreeSet<String> {
            chosen.iter().map(|&c| self.candidates[c].name()).collect()
        };
        let (own, [trained, held_out]) = (names(chosen), self.squares(chosen)?);
        let others = self.ranked().into_iter().filter(|other| !names(other).is_superset(&own));
        let distance = |other: &Vec<usize>| {
            let [of_training, of_held_out] = self.squares(other)?;
            Some((of_training / trained).max(of_held_out / held_out))
        };
        let others = others.filter_map(|other| Some((distance(&other)?, other)));
        others.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, other)| other)
    }

    /// Mean squares of the errors over the noise, in training and in validation recordings; the former
    /// twice where there are no validation samples that count.
    fn squares(&self, chosen: &[usize]) -> Option<[f64; 2]> {
        let trained = self.training_square(chosen)?;
        if self.data.valid.is_empty() {
            return Some([trained, trained]);
        }
        let residuals = self.fitted(chosen)?.held_out_residuals(&self.data)?;
        let held_out = mean(&chi_square(&residuals, &self.data.noise));
        Some([trained, held_out.unwrap_or(trained)])
    }

    /// A structure of templates that leaves more than noise and yet is the answer as far as it goes:
    /// it takes most of the discrepancy away, from validation recordings as well, and every other that
    /// is no longer takes away clearly less.
    pub(crate) fn partly(&mut self) -> Option<Outcome> {
        self.finish_templates();
        let best = &*self.ranked().into_iter().next()?;
        let [all_trained, all_held_out] = self.squares(&[])?;
        let [trained, held_out] = self.squares(best)?;
        let [trained, held_out] = [trained / all_trained, held_out / all_held_out];
        let rivals = self.ranked().into_iter().filter(|other| {
            let shares_one = best.iter().any(|effect| other.contains(effect));
            other.len() <= best.len() && !shares_one && !other.is_empty()
        });
        let of_rivals = rivals.filter_map(|other| self.training_square(&other));
        let rival = of_rivals.fold(f64::INFINITY, f64::min) / all_trained;
        let is_clear = !best.is_empty()
            && !self.is_specific(best)
            && self.is_believable(best)
            && trained < MOSTLY
            && held_out < MOSTLY
            && trained < CLEARLY * rival;
        is_clear.then(|| Outcome::Partly(best.to_vec()))
    }

    /// Whether so much of the discrepancy is taken away that what is left may be one effect more.
    pub(crate) fn is_promising(&self, chosen: &[usize]) -> bool {
        let excess = |s: &[usize]| self.training_error(s).map(|(sum, n)| sum - n as f64);
        match (excess(chosen), excess(&[])) {
            (Some(left), Some(all)) => left < PROMISING * all,
            _ => false,
        }
    }

    /// The simplest structure that explains the data, unless one with more effects is worth them.
    pub(crate) fn outcome(&self) -> Outcome {
        let ranked = self.ranked();
        let fits = |chosen: &&Vec<usize>| self.explains(chosen) && self.is_believable(chosen);
        let Some(mut best) = ranked.iter().find(fits) else {
            return Outcome::Unexplained(ranked.into_iter().next().unwrap_or_default());
        };
        // A simpler one is believed although it predicts a little worse: that may be its estimates,
        // and a name that only noise suggests is worse than none.
        let nearly = |chosen: &&Vec<usize>| {
            self.leaves_at_most(chosen, EXPLAINED, NEARLY_EXPLAINED_HELD_OUT)
                && self.is_believable(chosen)
        };
        while let Some(simpler) =
            ranked.iter().filter(nearly).find(|s| s.len() < best.len() && !self.is_worth(best, s))
        {
            best = simpler;
        }
        // Where little is left of the base model already, every effect explains the rest.
        let is_idle = self.doubted.contains_key(&Vec::new())
            && self.explains(&[])
            && !self.is_worth(best, &[]);
        match best.as_slice() {
            [] => Outcome::Sufficient,
            _ if is_idle => Outcome::Unexplained(best.clone()),
            _ => Outcome::Effects(best.clone()),
        }
    }

    /// Whether the effects that one structure has more than another are worth their place.
    pub(crate) fn is_worth(&self, longer: &[usize], shorter: &[usize]) -> bool {
        let excess = |error: Option<(f64, usize)>| error.map(|(sum, n)| sum - n as f64);
        let halves = |longer, shorter| match (excess(longer), excess(shorter)) {
            (Some(longer), Some(shorter)) => longer < WORTH_ITS_PLACE * shorter,
            _ => false,
        };
        let gain =
            self.bic(shorter).zip(self.bic(longer)).map(|(shorter, longer)| shorter - longer);
        (self.doubted.contains_key(shorter) || !self.is_noise(shorter))
            && gain.is_some_and(|gain| gain > LEAST_GAIN)
            && halves(self.training_error(longer), self.training_error(shorter))
            && (self.data.valid.is_empty()
                || halves(self.held_out_error(longer), self.held_out_error(shorter)))
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
        let fitted = self.fitted(chosen)?;
        Some(sum / self.unit() + fitted.free() as f64 * (n as f64).ln())
    }

    /// The mean of what the best structure leaves, ε², but at least that of noise.
    pub(crate) fn unit(&self) -> f64 {
        let errors = self.tried.keys().filter_map(|chosen| self.training_error(chosen));
        let means = errors.map(|(sum, n)| sum / n as f64);
        means.fold(f64::INFINITY, f64::min).max(1.0)
    }

    /// Σ ε² of the training recordings, and how many samples; ε is white if the errors are noise.
    pub(crate) fn training_error(&self, chosen: &[usize]) -> Option<(f64, usize)> {
        Some(self.fitted(chosen)?.error)
    }

    /// The same of the validation recordings.
    pub(crate) fn held_out_error(&self, chosen: &[usize]) -> Option<(f64, usize)> {
        let residuals = self.fitted(chosen)?.held_out_residuals(&self.data)?;
        Some(whitened_square(self.data.valid, &residuals, &self.data.noise))
    }

    /// Mean square of the errors in the training recordings over that of the noise.
    pub(crate) fn training_square(&self, chosen: &[usize]) -> Option<f64> {
        mean(&chi_square(&self.fitted(chosen)?.residuals(&self.data), &self.data.noise))
    }

    /// The same of the validation recordings; `None` where none of their samples counts.
    pub(crate) fn held_out_square(&self, chosen: &[usize]) -> Option<f64> {
        let residuals = self.fitted(chosen)?.held_out_residuals(&self.data)?;
        mean(&chi_square(&residuals, &self.data.noise))
    }

    /// Whether a structure leaves nothing but noise of the training recordings.
    ///
    /// Start values of validation recordings are known from a minute only, so that their errors are
    /// never quite white; whether they are small is asked by `explains`.
    pub(crate) fn is_noise(&self, chosen: &[usize]) -> bool {
        let Some(fitted) = self.fitted(chosen) else { return false };
        self.leaves_noise(&fitted.residuals(&self.data), &self.data.noise)
    }

    /// Whether errors in the training recordings cannot be told from a noise.
    pub(crate) fn leaves_noise(
        &self,
        residuals: &[Vec<Vec<f64>>],
        noise: &[Option<SensorNoise>],
    ) -> bool {
        let measured = noise.iter().flatten().count() * residuals.len();
        let least = FALSE_ALARM / measured.max(1) as f64;
        // What is left of outputs in recordings that are too short for tests of their own.
        let mut short: Vec<Vec<f64>> = vec![Vec::new(); noise.len()];
        for (recording, outputs) in self.data.train.iter().zip(residuals) {
            for ((residuals, noise), short) in outputs.iter().zip(noise).zip(&mut short) {
                let Some(noise) = noise else { continue };
                let left = whitened(recording, residuals, noise);
                match whiteness(&left, &unit_of(noise), 0) {
                    Some(test) if test.p_value <= least => return false,
                    Some(_) => {}
                    None => short.extend(left),
                }
            }
        }
        let all = short.iter().zip(noise).filter_map(|(left, noise)| Some((left, (*noise)?)));
        all.map(|(left, noise)| size(left, &unit_of(&noise)))
            .all(|test| test.is_none_or(|test| test.p_value > least))
    }

    /// Whether a structure leaves so little that nothing need be missing.
    pub(crate) fn explains(&self, chosen: &[usize]) -> bool {
        self.leaves_at_most(chosen, EXPLAINED, EXPLAINED_HELD_OUT)
    }

    /// Whether the mean square of each output's errors is at most so many times that of the noise,
    /// in training and in validation data.
    pub(crate) fn leaves_at_most(&self, chosen: &[usize], train: f64, held_out: f64) -> bool {
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
            notes.push(if fitted.is_cut_short {
                format!("the fit was not finished: {}", too_many_steps())
            } else {
                "the fit was not finished".to_owned()
            });
        }
        notes.extend(self.doubted.get(chosen).cloned());
        if self.explains(chosen)
            && let Some([a, b]) = self.cancelling(chosen)
        {
            let [a, b] = [a, b].map(|c| self.candidates[c].application.name());
            notes.push(format!("`{b}` largely cancels `{a}`"));
        }
        notes.join("; ")
    }

    /// Whether the effects of a structure may be named: none is at a bound, takes another back or is doubted.
    fn is_believable(&self, chosen: &[usize]) -> bool {
        self.is_sound(chosen)
            && !self.doubted.contains_key(chosen)
            && self.cancelling(chosen).is_none()
    }

    /// Whether no parameter of an effect has run into a bound.
    pub(crate) fn is_sound(&self, chosen: &[usize]) -> bool {
        self.fitted(chosen).is_some() && self.at_bound(chosen).is_empty()
    }

    /// Effects of a structure that have a parameter at a bound.
    pub(crate) fn at_bound(&self, chosen: &[usize]) -> Vec<usize> {
        let Some(fitted) = self.fitted(chosen) else { return Vec::new() };
        let is_at_bound = |name: &String| {
            fitted.estimates.iter().any(|e| e.name == *name && e.at_bound.is_some())
        };
        let effects = chosen.iter().zip(&fitted.structure.brought);
        let at_bound = effects.filter(|(_, brought)| brought.parameters.iter().any(is_at_bound));
        at_bound.map(|(effect, _)| *effect).collect()
    }
}

/// The noise of whitened errors.
fn unit_of(noise: &SensorNoise) -> SensorNoise {
    SensorNoise { std: 1.0, colour: None, ..*noise }
}

/// `None` of nothing.
pub(crate) fn mean(by_output: &[(f64, usize)]) -> Option<f64> {
    let (sum, n) = by_output.iter().fold((0.0, 0), |(sum, n), (s, m)| (sum + s, n + m));
    (n > 0).then(|| sum / n as f64)
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use dgd_compiler::diagnostics::Diagnostics;
    use dgd_compiler::effects::Effect;
    use dgd_compiler::model::{ModelOptions, resolve};
    use dgd_compiler::source::{Source, Sources};
    use dgd_compiler::syntax::parse;
    use dgd_execute::Engine;
    use dgd_runtime::identify::{Estimate, Recording, Unwatched};
    use dgd_runtime::journal::{Digest, Forgetful};
    use dgd_runtime::{Direction, Inputs, Observations, Options};

    use super::*;
    use crate::candidates::candidates;
    use crate::fitted::{Data, Fitted};
    use crate::keeping::Keeping;
    use crate::structure::{BaseModel, Values};

    const MODEL: &str = "\
model tank
parameter a [1/s] = 0.1 fixed
state h [m] = 1 fixed
equation level: der(h) = -a*h
output h [m]
";

    /// Names of effects, by position.
    const DENSITY: usize = 0;
    const CLOCK: usize = 1;
    const INFLUX: usize = 2;
    const NAMES: [&str; 3] = ["density", "clock", "influx"];

    const SAMPLES: usize = 1000;

    /// What each effect costs of the criterion: two parameters.
    fn cost() -> f64 {
        2.0 * (SAMPLES as f64).ln()
    }

    /// The verdict on structures of which each leaves so many times the noise's mean square of the errors.
    fn nearly_all(left: &[(&[usize], f64)]) -> Option<Outcome> {
        let (mut sources, mut diagnostics) = (Sources::default(), Diagnostics::default());
        let mut parsed = |text: String| {
            let id = sources.add(Source { name: "test.dgd".to_owned(), text });
            parse(id, &sources, &mut diagnostics).expect("it is sound")
        };
        let asts = vec![parsed(MODEL.to_owned())];
        let effect = |name: &str| {
            format!(
                "effect {name} on tank\nkind plant\nparameter by_{name} [m/s] = 0\n\
                 parameter since_{name} [s] = 0\nnull by_{name} = 0\n\
                 add if time > since_{name} then by_{name} else 0 [m/s] to level\n"
            )
        };
        let library = NAMES.map(|name| parsed(effect(name)));
        let library = library.map(|ast| Effect::read(ast, &mut diagnostics).expect("an effect"));
        let options = ModelOptions::default();
        let model = resolve(&asts, &options, &mut diagnostics).expect("a model");
        let candidates = candidates(&library, &asts, &model);
        let (free, fix) = (Vec::new(), Vec::new());
        let base = BaseModel { asts, options, free, fix, engine: Engine::Interpreter };
        let times: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
        let measured = vec![Some(vec![0.0; SAMPLES])];
        let fitted = |(chosen, left): &(&[usize], f64)| {
            let structure = base.structure(&candidates, chosen).expect("a structure");
            let parameters = structure.brought.iter().flat_map(|brought| &brought.parameters);
            let estimate = |(i, name): (usize, &String)| Estimate {
                name: name.clone(),
                of: Direction::Parameter(i),
                recording: None,
                value: 0.0,
                std: None,
                at_bound: None,
            };
            let observed =
                Observations { n_w: 1, n_s: 0, w: vec![left.sqrt(); SAMPLES], dw: Vec::new() };
            let fitted = Fitted {
                estimates: parameters.enumerate().map(estimate).collect(),
                structure,
                values: Values::default(),
                p: Vec::new(),
                moments: Vec::new(),
                is_converged: true,
                is_cut_short: false,
                error: (left * SAMPLES as f64, SAMPLES),
                train: vec![observed],
                valid: Some(Vec::new()),
                cancelling: OnceLock::from(None),
            };
            (chosen.to_vec(), Ok(fitted))
        };
        let all = || left.iter().map(|(chosen, _)| chosen.to_vec());
        let keeping = Keeping { journal: &Forgetful, watch: &Unwatched, request: Digest::EMPTY };
        let data = Data {
            train: &[Recording::new(times, Inputs::none(), measured)],
            valid: &[],
            noise: vec![Some(SensorNoise::known(1.0))],
            counts_from: Vec::new(),
            options: Options::default(),
            own_weights: false,
            keeping,
        };
        let mut search = Search {
            tried: left.iter().map(fitted).collect(),
            // Nothing is fitted once more.
            settled: all().flat_map(|part| all().map(move |whole| (part.clone(), whole))).collect(),
            ..Search::new(&base, &candidates, data, 1, 1)
        };
        search.nearly_all()
    }

    /// What a name leaves that leaves 1.18 of 400 times the noise, with an effect beside it for which the
    /// criterion falls by `gain`.
    fn beside(gain: f64) -> f64 {
        // n (1.18 − left)/left − cost = gain: the least that is left is the unit.
        1.18 / (1.0 + (gain + cost()) / SAMPLES as f64)
    }

    #[test]
    fn a_name_with_a_spare_part_beside_it_is_named_without() {
        let name: &[usize] = &[DENSITY];
        let tried: [(&[usize], f64); 5] = [
            (&[], 400.0),
            (name, 1.18),
            (&[CLOCK], 390.0),
            (&[DENSITY, CLOCK], beside(5.0)),
            (&[DENSITY, INFLUX], 1.17),
        ];
        assert_eq!(nearly_all(&tried), Some(Outcome::Partly(name.to_vec())));
        // Until the part is asked for; it then belongs to the answer, and is not essential to it.
        let with =
            |gain: f64| tried.map(|(s, left)| (s, if s.len() < 2 { left } else { beside(gain) }));
        assert!(nearly_all(&with(LEAST_GAIN - 1.0)).is_some());
        assert_eq!(nearly_all(&with(LEAST_GAIN + 1.0)), None);
    }

    #[test]
    fn another_name_that_leaves_as_little_is_a_rival() {
        let alone: [(&[usize], f64); 2] = [(&[], 400.0), (&[DENSITY], 1.18)];
        assert!(nearly_all(&alone).is_some());
        for rival in [&[INFLUX] as &[usize], &[CLOCK, INFLUX]] {
            let tried = |left: f64| [&alone[..], &[(rival, left)]].concat();
            assert!(nearly_all(&tried(1.6 * UNRIVALLED)).is_some());
            assert_eq!(nearly_all(&tried(1.3)), None);
        }
    }
}
