//! A discovery from beginning to end.
//!
//! ```text
//!   candidates: every way to apply the library          (candidates)
//!   search: fit, screen, refit, verdict                 (search, screen, fitted)
//!   what was found: size, onset, when, how sure         (activity, evidence)
//!   what is left over: the unknown input                (unknown_input)
//! ```

use std::collections::BTreeMap;
use std::fmt;

use dgd_compiler::diagnostics::{Diagnostics, Reported};
use dgd_compiler::effects::Effect;
use dgd_compiler::model::resolve;
use dgd_compiler::source::Sources;
use dgd_runtime::identify::Recording;
use dgd_runtime::{Observations, Options, System, Unit};

use crate::activity;
use crate::candidates::{Candidate, candidates};
use crate::corrected::corrected;
use crate::discovery::{
    Alternative, Discovery, FoundEffect, Gap, OutputTrace, ParameterValue, Ranked, RecordingTrace,
    Screened, Unexplained, Verdict,
};
use crate::discrepancy::{AVERAGING_LENGTHS, discrepancy_windows};
use crate::evidence::evidence;
use crate::fitted::{Data, Fitted, NoFit, chi_square};
use crate::missing::missing_inputs;
use crate::search::{Outcome, Search, noise_of};
use crate::structure::{BaseModel, Values};

/// What a discovery works on.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The model that may lack something.
    pub base: &'a BaseModel,
    /// Effects that it may lack.
    pub library: &'a [Effect],
    /// The texts of the model and the library.
    pub sources: &'a Sources,
    /// Recordings to fit to, one at least, with what they are called. Their start values are first
    /// guesses.
    pub train: (&'a [Recording], &'a [String]),
    /// Recordings kept out of the fits, with what they are called.
    pub valid: (&'a [Recording], &'a [String]),
    /// How to integrate.
    pub options: Options,
    /// Structures refitted at a time; the result does not depend on it.
    pub threads: usize,
    /// Seed of resampling.
    pub seed: u64,
}

/// Why there is no discovery.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiscoverError {
    /// The model has mistakes, which were reported.
    Model(Reported),
    /// There is no recording to fit to.
    NoRecording,
    /// No output of the model was measured often enough to know its noise.
    NothingMeasured,
    /// The model cannot be fitted as it is.
    BaseModel(String),
}

impl fmt::Display for DiscoverError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Model(_) => f.write_str("the model has mistakes"),
            Self::NoRecording => f.write_str("there is no recording to fit to"),
            Self::NothingMeasured => {
                f.write_str("no output of the model was measured often enough to tell its noise")
            }
            Self::BaseModel(reason) => write!(f, "the model cannot be fitted as it is: {reason}"),
        }
    }
}

impl std::error::Error for DiscoverError {}

/// A tolerance that is fine enough to rank structures: no sensor is good to 1e-4 of what it reads.
const RANKING_TOLERANCE: f64 = 1e-4;

/// Simulations of the last fit of what is reported.
const LAST_EVALUATIONS: usize = 60;

/// A structure is an alternative where its held-out error is at most so many times that of the best.
const ALTERNATIVE: f64 = 1.05;

/// Finds where a model and recordings disagree, and which known effect is missing.
///
/// # Errors
///
/// [`DiscoverError`]: the model cannot be fitted at all. Whatever else does not work is said in the
/// result.
pub fn discover(
    request: &Request<'_>,
    diagnostics: &mut Diagnostics,
) -> Result<Discovery, DiscoverError> {
    let Request { base, library, options, threads, .. } = *request;
    let (train, valid) = (request.train.0, request.valid.0);
    if train.is_empty() {
        return Err(DiscoverError::NoRecording);
    }
    let model = resolve(&base.asts, &base.options, diagnostics).map_err(DiscoverError::Model)?;
    let candidates = candidates(library, &model);
    let noise = noise_of(train, &readings(train));
    if noise.iter().all(Option::is_none) {
        return Err(DiscoverError::NothingMeasured);
    }
    let ranking = Options {
        rtol: options.rtol.max(RANKING_TOLERANCE),
        atol: options.atol.max(RANKING_TOLERANCE),
        ..options
    };
    let mut search = Search {
        base,
        candidates: &candidates,
        data: Data { train, valid, noise, options: ranking },
        threads,
        tried: BTreeMap::new(),
        screens: BTreeMap::new(),
    };
    let failed = |NoFit(reason): NoFit| DiscoverError::BaseModel(reason);
    let outcome = search.run(&Values::default()).map_err(failed)?;
    let (verdict, chosen) = match &outcome {
        Outcome::Sufficient => (Verdict::Sufficient, Vec::new()),
        Outcome::Effects(chosen) => (Verdict::Effects, chosen.clone()),
        Outcome::Unexplained(_) => (Verdict::Unexplained, Vec::new()),
    };

    let evidence: Vec<_> =
        chosen.iter().map(|&c| evidence(&mut search, &chosen, c, request.seed)).collect();
    let refined =
        |search: &Search<'_>, chosen: &[usize]| refined(search, chosen, options).map_err(failed);
    let before = refined(&search, &[])?;
    let after = if chosen.is_empty() { before.clone() } else { refined(&search, &chosen)? };
    let data = Data { options, ..search.data.clone() };
    let missing = missing_inputs(&model, &before, &data);
    let effects = chosen.iter().zip(evidence).map(|(&c, evidence)| {
        let parts = Found { search: &search, data: &data, chosen: &chosen, after: &after };
        parts.effect(c, evidence)
    });
    let effects: Vec<FoundEffect> = effects.collect();
    let unexplained = match verdict {
        Verdict::Unexplained => missing.first().map(unexplained).into_iter().collect(),
        Verdict::Sufficient | Verdict::Effects => Vec::new(),
    };
    Ok(Discovery {
        verdict,
        reason: reason(&search, &outcome, &candidates),
        effects,
        unexplained,
        gap: gap(&data, &before, &after),
        traces: traces(request, &data, &before, &after),
        missing,
        ranking: ranking_of(&search),
        screened: screened(&mut search),
        base_parameters: parameters(&before, &[]),
        corrected_parameters: parameters(&after, &[]),
        corrected: corrected(request.base, request.sources, &after, diagnostics)
            .map_err(DiscoverError::Model)?,
    })
}

/// Readings of each recording and output; NaN where nothing was measured.
fn readings(recordings: &[Recording]) -> Vec<Vec<Vec<f64>>> {
    let of_recording = |recording: &Recording| {
        let missing = || vec![f64::NAN; recording.times.len()];
        let outputs = recording.measured.iter();
        outputs.map(|samples| samples.clone().unwrap_or_else(missing)).collect()
    };
    recordings.iter().map(of_recording).collect()
}

/// A structure that was tried, fitted to the end with the asked tolerance.
fn refined(search: &Search<'_>, chosen: &[usize], options: Options) -> Result<Fitted, NoFit> {
    let Some(fitted) = search.fitted(chosen) else {
        return Err(NoFit("it was never fitted".to_owned()));
    };
    let data = Data { options, ..search.data.clone() };
    let structure = fitted.structure.clone();
    let mut fitted =
        Fitted::new(structure, &fitted.values, &[Vec::new()], &data, LAST_EVALUATIONS)?;
    fitted.hold_out(&data, LAST_EVALUATIONS);
    Ok(fitted)
}

/// What is known about the effects of the structure that is believed.
struct Found<'a> {
    search: &'a Search<'a>,
    data: &'a Data<'a>,
    chosen: &'a [usize],
    after: &'a Fitted,
}

impl Found<'_> {
    fn effect(&self, candidate: usize, evidence: crate::discovery::Evidence) -> FoundEffect {
        let Found { search, data, chosen, after } = *self;
        let described = &search.candidates[candidate];
        let effect = described.application.effect;
        let place = after.structure.candidates.iter().position(|c| *c == candidate);
        let brought = place.and_then(|place| after.structure.brought.get(place));
        let own: Vec<String> = brought.map(|b| b.parameters.clone()).unwrap_or_default();
        let onset = brought.and_then(|brought| {
            let is_onset = |own: &&(String, String)| described.onsets.contains(&own.0);
            let (_, name) = brought.names.iter().find(is_onset)?;
            after.values.p.get(name).copied()
        });
        let rest: Vec<usize> = chosen.iter().copied().filter(|c| *c != candidate).collect();
        let windows = match search.base.structure(search.candidates, &rest) {
            Ok(without) => activity::windows(
                &after.structure,
                &without,
                &after.values,
                &data.train[0],
                &data.options,
            ),
            Err(_) => Vec::new(),
        };
        let alternatives = self.alternatives(candidate, &rest);
        let told_apart_by = alternatives.first().map(|(_, other)| self.told_apart_by(other));
        FoundEffect {
            name: effect.name.text.clone(),
            kind: described.kind(),
            form: effect.form.as_ref().map(|form| form.text.clone()),
            doc: effect.doc.clone(),
            target: described.target(),
            alternatives: alternatives.into_iter().map(|(alternative, _)| alternative).collect(),
            told_apart_by,
            onset,
            windows,
            parameters: parameters(after, &own),
            evidence,
        }
    }

    /// Structures in which another effect stands in the place of one, and that predict held-out data
    /// nearly as well; the best first.
    fn alternatives(&self, candidate: usize, rest: &[usize]) -> Vec<(Alternative, Vec<usize>)> {
        let error = |chosen: &[usize]| {
            let held_out = self.search.held_out_error(chosen);
            let (sum, n) = held_out.or_else(|| self.search.training_error(chosen))?;
            (n > 0).then(|| (sum / n as f64).sqrt())
        };
        let Some(best) = error(self.chosen) else { return Vec::new() };
        let own = self.search.candidates[candidate].name();
        let mut all: Vec<(Alternative, Vec<usize>)> = Vec::new();
        for other in 0..self.search.candidates.len() {
            let name = self.search.candidates[other].name();
            if rest.contains(&other) || name == own {
                continue;
            }
            let mut exchanged = rest.to_vec();
            exchanged.push(other);
            exchanged.sort_unstable();
            let Some(ratio) = error(&exchanged).map(|error| error / best) else { continue };
            if ratio <= ALTERNATIVE && self.search.explains(&exchanged) {
                let alternative = Alternative { name: name.to_owned(), valid_ratio: ratio };
                all.push((alternative, exchanged));
            }
        }
        all.sort_by(|a, b| a.0.valid_ratio.total_cmp(&b.0.valid_ratio));
        let mut names = Vec::new();
        all.retain(|(alternative, _)| {
            let is_new = !names.contains(&alternative.name);
            names.push(alternative.name.clone());
            is_new
        });
        all
    }

    /// The unknown on which two structures that fit alike disagree most, in units of its size.
    fn told_apart_by(&self, other: &[usize]) -> String {
        let own = self.search.fitted(self.chosen);
        let largest = own.zip(self.search.fitted(other)).and_then(|(a, b)| {
            let recording = &self.data.train[0];
            activity::largest_disagreement(a, b, recording, &self.data.options)
        });
        match largest {
            Some((name, difference, unit)) => {
                let difference = difference / unit.factor.abs();
                let symbol = &unit.symbol;
                format!(
                    "a measurement of `{name}`: there the two differ by up to {difference:.2e} {symbol}"
                )
            }
            None => "a test with other inputs: nothing that the model knows differs in this one"
                .to_owned(),
        }
    }
}

/// Estimated parameters of a fit by name; all that were estimated where no names are given.
fn parameters(fitted: &Fitted, names: &[String]) -> Vec<ParameterValue> {
    let signature = fitted.structure.system.signature();
    let wanted = |name: &str| names.is_empty() || names.iter().any(|other| other == name);
    let estimates = fitted.estimates.iter().filter(|estimate| estimate.recording.is_none());
    let value = |estimate: &dgd_runtime::identify::Estimate| {
        let parameter = signature.parameters.iter().find(|p| p.name == estimate.name)?;
        Some(ParameterValue {
            name: estimate.name.clone(),
            unit: parameter.unit.clone(),
            value: estimate.value,
            std: estimate.std,
        })
    };
    estimates.filter(|estimate| wanted(&estimate.name)).filter_map(value).collect()
}

fn gap(data: &Data<'_>, before: &Fitted, after: &Fitted) -> Vec<Gap> {
    let signature = before.structure.system.signature();
    let rms = |residuals: Option<Vec<Vec<Vec<f64>>>>| {
        let sums = residuals.map(|residuals| chi_square(&residuals, &data.noise));
        move |output: usize, noise: f64| match &sums {
            Some(sums) if sums[output].1 > 0 => {
                noise * (sums[output].0 / sums[output].1 as f64).sqrt()
            }
            _ => f64::NAN,
        }
    };
    let train_before = rms(Some(before.residuals(data)));
    let train_after = rms(Some(after.residuals(data)));
    let valid_before = rms(before.held_out_residuals(data));
    let valid_after = rms(after.held_out_residuals(data));
    let outputs = signature.outputs.iter().enumerate().zip(&data.noise);
    let of_output = |((i, output), noise): ((usize, &dgd_runtime::Output), &Option<_>)| {
        let noise: &crate::noise::SensorNoise = noise.as_ref()?;
        Some(Gap {
            output: output.name.to_string(),
            unit: output.unit.clone(),
            noise: noise.std,
            train_before: train_before(i, noise.std),
            train_after: train_after(i, noise.std),
            valid_before: valid_before(i, noise.std),
            valid_after: valid_after(i, noise.std),
        })
    };
    outputs.filter_map(of_output).collect()
}

fn traces(
    request: &Request<'_>,
    data: &Data<'_>,
    before: &Fitted,
    after: &Fitted,
) -> Vec<RecordingTrace> {
    let outputs: Vec<(String, Unit)> = before
        .structure
        .system
        .signature()
        .outputs
        .iter()
        .map(|output| (output.name.to_string(), output.unit.clone()))
        .collect();
    let trace = |recording: &Recording,
                 name: &str,
                 held_out: bool,
                 before: Option<&Observations>,
                 after: Option<&Observations>| {
        let of_output = |(i, noise): (usize, &Option<crate::noise::SensorNoise>)| {
            let noise = noise.as_ref()?.std;
            let measured = recording.measured[i].clone()?;
            let simulated = |observations: Option<&Observations>| {
                let value = |k: usize| observations.map_or(f64::NAN, |all| all.w(k)[i]);
                (0..recording.times.len()).map(value).collect::<Vec<f64>>()
            };
            let (before, after) = (simulated(before), simulated(after));
            let residuals: Vec<f64> = measured.iter().zip(&before).map(|(m, w)| m - w).collect();
            let windows =
                discrepancy_windows(&recording.times, &residuals, noise, &AVERAGING_LENGTHS);
            let (name, unit) = outputs[i].clone();
            Some(OutputTrace { name, unit, noise, measured, before, after, windows })
        };
        RecordingTrace {
            name: name.to_owned(),
            held_out,
            times: recording.times.clone(),
            outputs: data.noise.iter().enumerate().filter_map(of_output).collect(),
        }
    };
    let training =
        request.train.0.iter().zip(request.train.1).enumerate().map(|(r, (one, name))| {
            trace(one, name, false, before.train.get(r), after.train.get(r))
        });
    let held_out =
        request.valid.0.iter().zip(request.valid.1).enumerate().map(|(r, (one, name))| {
            let of = |fitted: &'_ Fitted| fitted.valid.as_ref().and_then(|all| all.get(r).cloned());
            trace(one, name, true, of(before).as_ref(), of(after).as_ref())
        });
    training.chain(held_out).collect()
}

fn ranking_of(search: &Search<'_>) -> Vec<Ranked> {
    let base = search.bic(&[]).unwrap_or_default();
    let mean =
        |error: Option<(f64, usize)>| error.filter(|(_, n)| *n > 0).map(|(sum, n)| sum / n as f64);
    let names = |chosen: &[usize]| {
        chosen.iter().map(|&c| search.candidates[c].application.name()).collect()
    };
    let fitted = search.ranked().into_iter().map(|chosen| Ranked {
        effects: names(&chosen),
        train: mean(search.training_error(&chosen)).unwrap_or(f64::NAN),
        valid: mean(search.held_out_error(&chosen)),
        bic: search.bic(&chosen).unwrap_or(f64::NAN) - base,
        note: search.note(&chosen),
    });
    let failed = search.tried.iter().filter_map(|(chosen, fitted)| {
        let NoFit(reason) = fitted.as_ref().err()?;
        Some(Ranked {
            effects: names(chosen),
            train: f64::NAN,
            valid: None,
            bic: f64::NAN,
            note: reason.clone(),
        })
    });
    fitted.chain(failed).collect()
}

fn screened(search: &mut Search<'_>) -> Vec<Screened> {
    let Some((sum, n)) = search.training_error(&[]) else { return Vec::new() };
    let excess = (sum - n as f64).max(1.0);
    let scores = search.screens.get(&Vec::new()).cloned().unwrap_or_default();
    scores
        .iter()
        .map(|score| Screened {
            name: search.candidates[score.candidate].application.name(),
            share: score.gain / excess,
        })
        .collect()
}

fn unexplained(missing: &crate::discovery::MissingInput) -> Unexplained {
    let largest = missing.value.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    Unexplained {
        target: missing.equation.clone(),
        windows: missing.windows.iter().map(|window| [window.from, window.until]).collect(),
        description: format!(
            "`{}` is where an unknown input explains most; it would have to be as large as {largest:.2e} {}",
            missing.equation, missing.unit
        ),
        trace: missing.clone(),
    }
}

fn reason(search: &Search<'_>, outcome: &Outcome, candidates: &[Candidate<'_>]) -> String {
    let mean = |(sum, n): (f64, usize)| sum / n.max(1) as f64;
    let training = |chosen: &[usize]| search.training_error(chosen).map_or(f64::NAN, mean);
    // Neither without held-out recordings nor where they cannot be simulated.
    let held_out = |chosen: &[usize]| search.held_out_error(chosen).filter(|e| e.1 > 0).map(mean);
    let names = |chosen: &[usize]| {
        let names: Vec<String> = chosen.iter().map(|&c| candidates[c].application.name()).collect();
        names.join(" and ")
    };
    let base = training(&[]);
    match outcome {
        Outcome::Sufficient => {
            let on_held_out = held_out(&[])
                .map(|left| format!(", on held-out recordings {left:.2} times"))
                .unwrap_or_default();
            format!(
                "What the model leaves is the sensors' noise: the mean square of its errors is \
                 {base:.2} times that of the noise{on_held_out}."
            )
        }
        Outcome::Effects(chosen) => {
            let on_held_out = held_out(&[])
                .zip(held_out(chosen))
                .map(|(all, left)| format!(", on held-out recordings from {all:.1} to {left:.2}"))
                .unwrap_or_default();
            format!(
                "The mean square of the errors falls from {base:.1} to {:.2} times that of the \
                 sensors' noise{on_held_out}.",
                training(chosen)
            )
        }
        Outcome::Unexplained(best) if best.is_empty() => format!(
            "The mean square of the errors is {base:.1} times that of the sensors' noise, and no \
             known effect makes it smaller."
        ),
        Outcome::Unexplained(best) => format!(
            "The mean square of the errors is {base:.1} times that of the sensors' noise. The best \
             that known effects do, {}, leaves {:.2} times: too much to call it found.",
            names(best),
            training(best)
        ),
    }
}
