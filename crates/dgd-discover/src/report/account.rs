//! Collects results for the report: errors, curves, ranking, and candidates not tried.

use std::collections::{BTreeMap, BTreeSet};

use dgd_identify::Recording;
use dgd_runtime::signature::number::with_unit;
use dgd_runtime::{Observations, Output, System, Unit};

use super::discovery::{
    OutputGap, OutputTrace, RankedStructure, RecordingTrace, ScreenedCandidate, UnexplainedError,
};
use super::reason::{ExcessOutput, significant};
use crate::conditions::{Circumstances, WindowCondition};
use crate::fit::{FittedStructure, NoFit, SearchData, chi_square, too_many_steps};
use crate::library::StructureId;
use crate::missing_input::{MissingInput, MissingPlace, PlaceKind};
use crate::noise::{averaging_lengths, discrepancy_windows};
use crate::request::DiscoveryOptions;
use crate::search::{
    CandidateScore, EffectSearch, OpenCandidates, ScoreRemedy, Screen, SilentCandidate, Thresholds,
    Verdict, best_first,
};
use dgd_screen::noise::SensorNoise;

/// Errors of each output before and after, each with the data that the model was fitted to.
pub(crate) fn gap(
    (before, data): (&FittedStructure, &SearchData<'_>),
    (after, data_after): (&FittedStructure, &SearchData<'_>),
    circumstances: &Circumstances,
) -> Vec<OutputGap> {
    let signature = before.structure.system.signature();
    let rms = |residuals: Option<Vec<Vec<Vec<f64>>>>, data: &SearchData<'_>| {
        let sums = residuals.map(|residuals| chi_square(&residuals, &data.noise));
        let noise: Vec<f64> = data
            .noise
            .iter()
            .map(|noise| noise.as_ref().map_or(f64::NAN, SensorNoise::total))
            .collect();
        move |output: usize| match &sums {
            Some(sums) if sums[output].1 > 0 => {
                noise[output] * (sums[output].0 / sums[output].1 as f64).sqrt()
            }
            _ => f64::NAN,
        }
    };
    let errors = before.residuals(data);
    let train_before = rms(Some(errors.clone()), data);
    let train_after = rms(Some(after.residuals(data_after)), data_after);
    let valid_before = rms(before.held_out_residuals(data), data);
    let valid_after = rms(after.held_out_residuals(data_after), data_after);
    let outputs = signature.outputs.iter().enumerate().zip(&data.noise);
    let of_output = |((i, output), noise): ((usize, &Output), &Option<_>)| {
        let noise: &SensorNoise = noise.as_ref()?;
        Some(OutputGap {
            output: output.name.to_string(),
            unit: output.unit.clone(),
            noise: noise.total(),
            train_before: train_before(i),
            train_after: train_after(i),
            valid_before: valid_before(i),
            valid_after: valid_after(i),
            condition: circumstances.condition(&standing_out(data, &errors, i)),
        })
    };
    outputs.filter_map(of_output).collect()
}

/// Windows in which errors of an output stand out from its noise, in each training recording.
fn standing_out(
    data: &SearchData<'_>,
    errors: &[Vec<Vec<f64>>],
    output: usize,
) -> Vec<Vec<[f64; 2]>> {
    let of_recording = |(recording, errors): (&Recording, &Vec<Vec<f64>>)| {
        let Some(noise) = &data.noise[output] else { return Vec::new() };
        let (times, errors) = (&recording.times, &errors[output]);
        let lengths = averaging_lengths(times, errors);
        let windows = discrepancy_windows(times, errors, noise, &lengths);
        windows.iter().map(|window| [window.from, window.until]).collect()
    };
    data.train.iter().zip(errors).map(of_recording).collect()
}

/// Measured and simulated outputs of all recordings.
pub(crate) fn traces(
    request: &DiscoveryOptions<'_>,
    data: &SearchData<'_>,
    before: &FittedStructure,
    after: &FittedStructure,
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
                 counts_from: Option<f64>,
                 before: Option<&Observations>,
                 after: Option<&Observations>| {
        let of_output = |(i, noise): (usize, &Option<SensorNoise>)| {
            let noise = noise.as_ref()?;
            let measured = recording.measured[i].as_ref()?;
            let simulated = |observations: Option<&Observations>| {
                let value = |k: usize| observations.map_or(f64::NAN, |all| all.w(k)[i]);
                (0..recording.times.len()).map(value).collect::<Vec<f64>>()
            };
            let (before, after) = (simulated(before), simulated(after));
            let residuals: Vec<f64> = measured.iter().zip(&before).map(|(m, w)| m - w).collect();
            let in_unit = |all: &[f64]| -> Vec<f64> {
                let samples = recording.times.iter().zip(all);
                let inputs = &recording.inputs;
                samples.map(|(t, y)| data.scales.unscaled(i, inputs, *t, *y)).collect()
            };
            let [measured, before, after] = [measured, &before, &after].map(|all| in_unit(all));
            let lengths = averaging_lengths(&recording.times, &residuals);
            let windows = discrepancy_windows(&recording.times, &residuals, noise, &lengths);
            let (name, unit) = outputs[i].clone();
            let noise = noise.total();
            Some(OutputTrace { name, unit, noise, measured, before, after, windows })
        };
        RecordingTrace {
            name: name.to_owned(),
            held_out: counts_from.is_some(),
            counts_from: counts_from.filter(|from| from.is_finite()),
            times: recording.times.clone(),
            outputs: data.noise.iter().enumerate().filter_map(of_output).collect(),
        }
    };
    let training =
        request.train.0.iter().zip(request.train.1).enumerate().map(|(r, (one, name))| {
            trace(one, name, None, before.train.get(r), after.train.get(r))
        });
    let held_out =
        request.valid.0.iter().zip(request.valid.1).enumerate().map(|(r, (one, name))| {
            let validation_of = |fitted: &'_ FittedStructure| {
                fitted.valid.as_ref().and_then(|all| all.get(r).cloned())
            };
            let from = data.counts_from.get(r).copied().unwrap_or(f64::NEG_INFINITY);
            trace(
                one,
                name,
                Some(from),
                validation_of(before).as_ref(),
                validation_of(after).as_ref(),
            )
        });
    training.chain(held_out).collect()
}

/// All structures that were tried, the best first, then those that failed.
pub(crate) fn ranking_of(search: &EffectSearch<'_>) -> Vec<RankedStructure> {
    let base = search.bic(StructureId::BASE).unwrap_or_default();
    let names = |of: StructureId| of.effects().map(|c| search.called(c)).collect();
    let fitted = search.ranked().into_iter().map(|structure| RankedStructure {
        effects: names(structure),
        train: search.training_square(structure).unwrap_or(f64::NAN),
        valid: search.held_out_square(structure),
        bic: search.bic(structure).unwrap_or(f64::NAN) - base,
        note: search.note(structure),
    });
    let failed = search.tried.iter().filter_map(|(structure, fitted)| {
        let reason = fitted.as_ref().err()?;
        // A template that does not fit is not worth reporting.
        if structure.effects().all(|c| search.candidates[c].is_generic) {
            return None;
        }
        Some(RankedStructure {
            effects: names(*structure),
            train: f64::NAN,
            valid: None,
            bic: f64::NAN,
            note: reason.to_string(),
        })
    });
    fitted.chain(failed).collect()
}

/// The promise of each candidate alone in some screens of the base model. A candidate that removes nothing has a share
/// of zero.
pub(crate) fn screened(search: &EffectSearch<'_>, screens: &[Screen]) -> Vec<ScreenedCandidate> {
    let Some((sum, n)) = search.training_error(StructureId::BASE) else { return Vec::new() };
    // An excess within the scatter of a sum of n squares of noise does not count.
    let excess = (sum - n as f64).max((2.0 * n as f64).sqrt());
    let mut scores: Vec<CandidateScore> =
        screens.iter().flat_map(|screen| &screen.scores).cloned().collect();
    scores.retain(|score| !search.doubled.contains_key(&score.candidate));
    best_first(&mut scores);
    let promised = scores.iter().map(|score| (score.candidate, score.gain / excess));
    let silent = screens.iter().flat_map(|screen| &screen.silent);
    let nothing = silent.filter(|silent| silent.remedy == ScoreRemedy::ScoreIsZero);
    let nothing = nothing.map(|silent| (silent.candidate, 0.0));
    let shown = |(candidate, share): (usize, f64)| ScreenedCandidate {
        name: search.called(candidate),
        share,
    };
    promised.chain(nothing).map(shown).collect()
}

/// Candidates that are neither ranked nor screened, with the reason: those of the library, then templates.
pub(crate) fn not_tried(
    search: &EffectSearch<'_>,
    screens: &[Screen],
    verdict: Verdict,
) -> [Vec<(String, String)>; 2] {
    let silent: BTreeMap<usize, &SilentCandidate> =
        screens.iter().flat_map(|screen| &screen.silent).map(|s| (s.candidate, s)).collect();
    let scored: BTreeSet<usize> =
        screens.iter().flat_map(|screen| &screen.scores).map(|s| s.candidate).collect();
    let fitted: BTreeSet<usize> =
        search.tried.iter().filter(|(_, fit)| fit.is_ok()).flat_map(|(s, _)| s.effects()).collect();
    let why = |c: usize| -> Option<String> {
        if fitted.contains(&c) {
            return None;
        }
        if let Some(known) = search.doubled.get(&c) {
            return Some(if search.candidates[*known].is_generic {
                "begins as another form there, which was not among the best".to_owned()
            } else {
                format!("does what `{}` does", search.called(*known))
            });
        }
        if let Some(Err(reason)) = search.tried.get(&StructureId::one(c)) {
            // Candidates of the library are in the ranking with the reason.
            return search.candidates[c].is_generic.then(|| reason.to_string());
        }
        match silent.get(&c) {
            Some(SilentCandidate { remedy: ScoreRemedy::ScoreIsZero, .. }) => None,
            _ if scored.contains(&c) => None,
            Some(silent) => Some(silent.why.clone()),
            None if verdict == Verdict::Sufficient => {
                Some("not needed: the model explains the recordings".to_owned())
            }
            None => Some("not needed: the library explains the recordings".to_owned()),
        }
    };
    [OpenCandidates::Library, OpenCandidates::Templates].map(|of| {
        let untried = search.range(of).filter_map(|c| Some((c, why(c)?)));
        untried.map(|(c, why)| (search.called(c), why)).collect()
    })
}

/// The base model and single candidates whose fits were abandoned because their simulations take too many steps, with
/// the reason.
pub(crate) fn given_up(search: &EffectSearch<'_>) -> Option<(Vec<String>, String)> {
    let reason = too_many_steps();
    let is_given_up = |fit: &Result<FittedStructure, NoFit>| match fit {
        Ok(fitted) => fitted.is_cut_short,
        Err(reason) => reason.is_too_long(),
    };
    let given_up = search.tried.iter().filter(|(_, fit)| is_given_up(fit)).filter_map(
        |(structure, _)| match (structure.len(), structure.effects().next()) {
            (0, _) => Some("the model as it is".to_owned()),
            (1, Some(one)) => Some(format!("`{}`", search.called(one))),
            _ => None,
        },
    );
    let given_up: Vec<String> = given_up.collect();
    (!given_up.is_empty()).then_some((given_up, reason))
}

/// A discrepancy without a name, at the place that explains it best.
pub(crate) fn unexplained(
    missing: &MissingInput,
    condition: Option<WindowCondition>,
    is_tied: bool,
) -> UnexplainedError {
    let range = missing
        .value
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], value| [a.min(*value), b.max(*value)]);
    let largest = range[0].abs().max(range[1].abs());
    let name = &missing.place.name;
    let largest = with_unit(significant(largest), &missing.unit);
    let description = match missing.place.kind {
        PlaceKind::Equation => format!("a missing term in `{name}` of up to {largest}"),
        PlaceKind::Parameter => {
            let [low, high] = range.map(significant);
            let high = with_unit(high, &missing.unit);
            format!("a parameter that is not constant: `{name}` between {low} and {high}")
        }
        PlaceKind::Input => {
            format!("an input that is not as recorded: `{name}`, off by up to {largest}")
        }
        PlaceKind::Output => {
            format!("a sensor that is wrong: `{name}`, off by up to {largest}")
        }
    };
    UnexplainedError {
        target: missing.target(),
        is_tied,
        is_joint: false,
        left: None,
        objection: None,
        told_apart_by: None,
        gain: missing.gain,
        windows: missing.windows.iter().map(|window| [window.from, window.until]).collect(),
        condition,
        description: format!("The recordings look as if there was {description}"),
        trace: missing.clone(),
        together: Vec::new(),
        guess: None,
    }
}

/// The remainder after effects that remove nearly all of the discrepancy: the residuals of the output that stands out
/// most, in the first training recording. `None` if none stands out.
pub(crate) fn left_over(
    data: &SearchData<'_>,
    after: &FittedStructure,
    circumstances: &Circumstances,
    thresholds: &Thresholds,
) -> Option<UnexplainedError> {
    let (residuals, recording) = (after.residuals(data), data.train.first()?);
    let excess = ExcessOutput::find(after, data, thresholds)?;
    let worst = excess.output;
    let output = &after.structure.system.signature().outputs[worst];
    let (noise, errors) = (data.noise[worst]?, residuals.first()?[worst].clone());
    let std = noise.total();
    let condition = circumstances.condition(&standing_out(data, &residuals, worst));
    let lengths = averaging_lengths(&recording.times, &errors);
    let windows = discrepancy_windows(&recording.times, &errors, &noise, &lengths);
    Some(UnexplainedError {
        target: output.name.to_string(),
        is_tied: false,
        is_joint: false,
        left: None,
        objection: None,
        told_apart_by: None,
        gain: 0.0,
        windows: windows.iter().map(|window| [window.from, window.until]).collect(),
        condition,
        description: format!(
            "The residuals of `{}` {} their noise variance; something smaller is missing as well",
            output.name,
            excess.words()
        ),
        trace: MissingInput {
            place: MissingPlace {
                kind: PlaceKind::Output,
                name: output.name.to_string(),
                unit: output.unit.symbol.to_string(),
            },
            unit: output.unit.symbol.to_string(),
            times: recording.times.clone(),
            value: errors.iter().map(|e| e / output.unit.factor).collect(),
            std: vec![std / output.unit.factor; errors.len()],
            windows,
            gain: 0.0,
        },
        together: Vec::new(),
        guess: None,
    })
}
