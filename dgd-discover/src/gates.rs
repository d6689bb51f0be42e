//! What a verdict's own evidence must say of it.
//!
//! | verdict | holds only if |
//! |---|---|
//! | `sufficient` | noise gains the best candidate as much as the data does in one of ten thousand resamples at least |
//! | an effect that is named | its own p-value is at most 0.01 |
//! | | it, another form of it or an alternative is in the best structure of half of the resamples or more |
//! | | eight readings or more come before its onset, and after it |
//! | | no parameter of it is at a bound (`verdict.rs`) |
//!
//! What does not hold is doubted, with its reason, and the search goes on to what is next.

use crate::discovery::Evidence;
use crate::evidence::{evidence, is_no_chance};
use crate::search::{Open, Search};
use crate::verdict::Outcome;

/// The largest p-value of an effect that is named.
const SIGNIFICANT: f64 = 0.01;

/// The least share of resamples whose best structure has a named effect or what the data cannot tell from it.
const INCLUDED: f64 = 0.5;

/// Readings on either side of an onset: as many as the shortest mean that tells a misfit from noise has.
const ASIDE: usize = 8;

impl Search<'_> {
    /// Whether the evidence supports an outcome. An outcome that it does not support is doubted from then on.
    pub(crate) fn holds(&mut self, outcome: &Outcome) -> bool {
        let (chosen, doubt) = match outcome {
            Outcome::Sufficient => (Vec::new(), self.doubt_of_the_base()),
            Outcome::Effects(chosen) | Outcome::Partly(chosen) => {
                (chosen.clone(), self.doubt(chosen))
            }
            Outcome::Unexplained(_) => return true,
        };
        match doubt {
            None => true,
            Some(why) => {
                self.doubted.insert(chosen, why);
                false
            }
        }
    }

    /// Evidence for each effect of a structure, in its order.
    pub(crate) fn evidence(&mut self, chosen: &[usize]) -> Vec<Evidence> {
        self.weighed(chosen).into_iter().map(|(evidence, _)| evidence).collect()
    }

    /// The same, and how often each or what the data cannot tell from it is in the best structure.
    fn weighed(&mut self, chosen: &[usize]) -> Vec<(Evidence, f64)> {
        if let Some(known) = self.evidence.get(chosen) {
            return known.clone();
        }
        let all: Vec<_> = chosen.iter().map(|&c| evidence(self, chosen, c)).collect();
        self.evidence.insert(chosen.to_vec(), all.clone());
        all
    }

    /// Why the base model is not sufficient although what it leaves is as small as noise.
    fn doubt_of_the_base(&mut self) -> Option<String> {
        let open =
            if self.range(Open::Library).is_empty() { Open::Templates } else { Open::Library };
        let screen = self.screen_of_the_base(open);
        let is_no_chance = is_no_chance(&screen.trials, self.seed);
        self.base_screens.insert(self.range(open).start, screen);
        is_no_chance.then(|| {
            "an effect would take more from the residuals than from any of ten thousand resamples of them"
                .to_owned()
        })
    }

    /// Why a structure is not believed whose evidence contradicts it.
    fn doubt(&mut self, chosen: &[usize]) -> Option<String> {
        let onsets = chosen.iter().filter_map(|&c| self.doubt_of_onset(chosen, c));
        if let Some(doubt) = onsets.into_iter().next() {
            return Some(doubt);
        }
        let weighed = self.weighed(chosen);
        chosen.iter().zip(weighed).find_map(|(&c, (evidence, inclusion))| {
            let name = self.candidates[c].application.name();
            let p = evidence.p_value;
            if p > SIGNIFICANT {
                return Some(format!("`{name}` may be chance (p = {p:.3})"));
            }
            (inclusion < INCLUDED).then(|| {
                let percent = 100.0 * inclusion;
                format!("only {percent:.0} % of the resampled recordings ask for `{name}`")
            })
        })
    }

    /// Why an onset is none.
    fn doubt_of_onset(&self, chosen: &[usize], candidate: usize) -> Option<String> {
        let onset = self.onset(chosen, candidate)?;
        let (mut before, mut after) = (0, 0);
        for recording in self.data.train {
            for (k, t) in recording.times.iter().enumerate() {
                let is_read = recording.measured.iter().flatten().any(|of| of[k].is_finite());
                before += usize::from(is_read && *t <= onset);
                after += usize::from(is_read && *t > onset);
            }
        }
        let (count, side) = if before < after { (before, "before") } else { (after, "after") };
        (count < ASIDE).then(|| {
            let name = self.candidates[candidate].application.name();
            let (s, come) = if count == 1 { ("", "comes") } else { ("s", "come") };
            format!("only {count} reading{s} {come} {side} the onset of `{name}`")
        })
    }

    /// Since when an effect of a structure acts, s, where it has an onset.
    pub(crate) fn onset(&self, chosen: &[usize], candidate: usize) -> Option<f64> {
        let fitted = self.fitted(chosen)?;
        let place = fitted.structure.candidates.iter().position(|c| *c == candidate)?;
        let onsets = &self.candidates[candidate].onsets;
        let mut names = fitted.structure.brought.get(place)?.names.iter();
        let (_, name) = names.find(|(own, _)| onsets.contains(own))?;
        fitted.values.p.get(name).copied()
    }

    /// What is said of the best structure that was doubted, or of the base model if that is all.
    pub(crate) fn doubts(&self) -> Option<(Vec<usize>, &str)> {
        let ranked = self.ranked();
        let doubted = ranked.iter().filter(|chosen| !chosen.is_empty());
        let best =
            doubted.into_iter().find_map(|s| Some((s.clone(), self.doubted.get(s)?.as_str())));
        best.or_else(|| Some((Vec::new(), self.doubted.get(&Vec::new())?.as_str())))
    }
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
    use dgd_runtime::identify::{Recording, Unwatched};
    use dgd_runtime::journal::{Digest, Forgetful};
    use dgd_runtime::{Inputs, Observations, Options};
    use dgd_screen::noise::SensorNoise;

    use super::*;
    use crate::candidates::candidates;
    use crate::fitted::{Data, Fitted};
    use crate::keeping::Keeping;
    use crate::projection::Basis;
    use crate::resampled::{BLOCKS, Errors, Trial};
    use crate::screen::Screen;
    use crate::structure::{BaseModel, Values};

    const MODEL: &str = "\
model tank
parameter a [1/s] = 0.1 fixed
state h [m] = 1 fixed
equation level: der(h) = -a*h
output h [m]
";

    const NAMES: [&str; 3] = ["inflow", "leak", "rain"];

    const SAMPLES: usize = 1000;

    /// Why an effect is doubted that sets in at some time, where structures leave so much of a mean square of 1.2;
    /// the first is that of the effect alone.
    fn doubt(since: f64, left: &[(&[usize], f64)]) -> Option<String> {
        let (mut sources, mut diagnostics) = (Sources::default(), Diagnostics::default());
        let mut parsed = |text: &str| {
            let id = sources.add(Source { name: "test.dgd".to_owned(), text: text.to_owned() });
            parse(id, &sources, &mut diagnostics).expect("it is sound")
        };
        let asts = vec![parsed(MODEL)];
        let effect = |name: &str| {
            format!(
                "effect {name} on tank\nkind plant\nparameter by_{name} [m/s] = 0\n\
                 parameter since_{name} [s] = 0\nnull by_{name} = 0\n\
                 add if time > since_{name} then by_{name} else 0 [m/s] to level\n"
            )
        };
        let library = NAMES.map(|name| parsed(&effect(name)));
        let library = library.map(|ast| Effect::read(ast, &mut diagnostics).expect("an effect"));
        let options = ModelOptions::default();
        let model = resolve(&asts, &options, &mut diagnostics).expect("a model");
        let candidates = candidates(&library, &asts, &model);
        let (free, fix) = (Vec::new(), Vec::new());
        let base = BaseModel { asts, options, free, fix, engine: Engine::Interpreter };
        let times: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
        let measured = vec![Some(vec![0.0; SAMPLES])];
        let fitted = |(chosen, left): &(&[usize], f64)| {
            let onset = ("since_inflow".to_owned(), since);
            let values = Values { p: [onset].into(), starts: Vec::new() };
            let fitted = Fitted {
                structure: base.structure(&candidates, chosen).expect("a structure"),
                values,
                p: Vec::new(),
                estimates: Vec::new(),
                moments: Vec::new(),
                is_converged: true,
                is_cut_short: false,
                error: (left * SAMPLES as f64, SAMPLES),
                train: vec![Observations {
                    n_w: 1,
                    n_s: 0,
                    w: vec![left.sqrt(); SAMPLES],
                    dw: Vec::new(),
                }],
                valid: None,
                cancelling: OnceLock::from(None),
            };
            (chosen.to_vec(), Ok(fitted))
        };
        // Errors of one that know nothing of a column, which therefore gains about one.
        let errors: Vec<f64> =
            (0..SAMPLES).map(|k| if k / 3 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let column: Vec<f64> = (0..SAMPLES).map(|k| if k < 480 { 0.0 } else { 1.0 }).collect();
        let blocks = (0..SAMPLES).map(|k| k * BLOCKS / SAMPLES).collect();
        let errors = Errors::new(&errors, blocks, &Basis::new(&[]));
        let contrasts = vec![errors.contrast(&column, [f64::NEG_INFINITY, f64::INFINITY])];
        let trials = vec![Trial { candidate: 0, contrasts }];
        let screen = Screen { trials, ..Screen::default() };
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
        let base_alone: (&[usize], f64) = (&[], 1.2);
        let mut search = Search {
            tried: left.iter().chain([&base_alone]).map(fitted).collect(),
            screens: [((0, Vec::new()), screen)].into(),
            ..Search::new(&base, &candidates, data, 1, 1)
        };
        let held = search.holds(&Outcome::Effects(vec![0]));
        let doubt = search.doubted.get([0].as_slice()).cloned();
        assert_eq!(held, doubt.is_none());
        doubt
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
