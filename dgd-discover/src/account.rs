//! What a search leaves to be reported: errors, curves, ranking, and the reason of the verdict.

use dgd_runtime::identify::Recording;
use dgd_runtime::{Observations, Output, System, Unit};

use crate::candidates::Candidate;
use crate::condition::Condition;
use crate::discover::Request;
use crate::discovery::{
    Gap, MissingInput, OutputTrace, Ranked, RecordingTrace, Screened, Unexplained,
};
use crate::discrepancy::{AVERAGING_LENGTHS, discrepancy_windows};
use crate::fitted::{Data, Fitted, NoFit, chi_square};
use crate::known::Circumstances;
use crate::search::{Open, Search};
use crate::verdict::Outcome;
use dgd_screen::noise::SensorNoise;

/// Errors of each output before and after.
pub(crate) fn gap(
    data: &Data<'_>,
    before: &Fitted,
    after: &Fitted,
    circumstances: &Circumstances,
) -> Vec<Gap> {
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
    let errors = before.residuals(data);
    let train_before = rms(Some(errors.clone()));
    let train_after = rms(Some(after.residuals(data)));
    let valid_before = rms(before.held_out_residuals(data));
    let valid_after = rms(after.held_out_residuals(data));
    let outputs = signature.outputs.iter().enumerate().zip(&data.noise);
    let of_output = |((i, output), noise): ((usize, &Output), &Option<_>)| {
        let noise: &SensorNoise = noise.as_ref()?;
        Some(Gap {
            output: output.name.to_string(),
            unit: output.unit.clone(),
            noise: noise.total(),
            train_before: train_before(i, noise.total()),
            train_after: train_after(i, noise.total()),
            valid_before: valid_before(i, noise.total()),
            valid_after: valid_after(i, noise.total()),
            condition: circumstances.condition(&standing_out(data, &errors, i)),
        })
    };
    outputs.filter_map(of_output).collect()
}

/// Where errors of an output stand out from its noise, in each training recording.
fn standing_out(data: &Data<'_>, errors: &[Vec<Vec<f64>>], output: usize) -> Vec<Vec<[f64; 2]>> {
    let of_recording = |(recording, errors): (&Recording, &Vec<Vec<f64>>)| {
        let Some(noise) = &data.noise[output] else { return Vec::new() };
        let (times, errors) = (&recording.times, &errors[output]);
        let windows = discrepancy_windows(times, errors, noise, &AVERAGING_LENGTHS);
        windows.iter().map(|window| [window.from, window.until]).collect()
    };
    data.train.iter().zip(errors).map(of_recording).collect()
}

/// Measured and simulated outputs of all recordings.
pub(crate) fn traces(
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
        let of_output = |(i, noise): (usize, &Option<SensorNoise>)| {
            let noise = noise.as_ref()?;
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
            let noise = noise.total();
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

/// All structures that were tried, the best first, then those that could not be.
pub(crate) fn ranking_of(search: &Search<'_>) -> Vec<Ranked> {
    let base = search.bic(&[]).unwrap_or_default();
    let names = |chosen: &[usize]| {
        chosen.iter().map(|&c| search.candidates[c].application.name()).collect()
    };
    let fitted = search.ranked().into_iter().map(|chosen| Ranked {
        effects: names(&chosen),
        train: search.training_square(&chosen).unwrap_or(f64::NAN),
        valid: search.held_out_square(&chosen),
        bic: search.bic(&chosen).unwrap_or(f64::NAN) - base,
        note: search.note(&chosen),
    });
    let failed = search.tried.iter().filter_map(|(chosen, fitted)| {
        let NoFit(reason) = fitted.as_ref().err()?;
        // That a template does not fit everything is no news.
        if chosen.iter().all(|&c| search.candidates[c].is_generic) {
            return None;
        }
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

/// What each candidate alone promised.
pub(crate) fn screened(search: &Search<'_>) -> Vec<Screened> {
    let Some((sum, n)) = search.training_error(&[]) else { return Vec::new() };
    let excess = (sum - n as f64).max(1.0);
    search
        .scores(Open::All, &[])
        .into_iter()
        .map(|score| Screened {
            name: search.candidates[score.candidate].application.name(),
            share: score.gain / excess,
        })
        .collect()
}

/// A discrepancy without a name, by what explains it most.
pub(crate) fn unexplained(missing: &MissingInput, condition: Option<Condition>) -> Unexplained {
    let largest = missing.value.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    Unexplained {
        target: missing.equation.clone(),
        windows: missing.windows.iter().map(|window| [window.from, window.until]).collect(),
        condition,
        description: format!(
            "`{}` is where an unknown input explains most; it would have to be as large as {largest:.2e} {}",
            missing.equation, missing.unit
        ),
        trace: missing.clone(),
        guess: None,
    }
}

/// What effects leave over that take nearly all of the discrepancy away: the errors of the output
/// that is furthest from its noise, in the first training recording.
pub(crate) fn left_over(
    data: &Data<'_>,
    after: &Fitted,
    circumstances: &Circumstances,
) -> Option<Unexplained> {
    let (residuals, recording) = (after.residuals(data), data.train.first()?);
    let squares = chi_square(&residuals, &data.noise);
    let ratio = |i: usize| squares[i].0 / squares[i].1 as f64;
    let worst = (0..squares.len())
        .filter(|i| squares[*i].1 > 0)
        .max_by(|a, b| ratio(*a).total_cmp(&ratio(*b)))?;
    let output = &after.structure.system.signature().outputs[worst];
    let (noise, errors) = (data.noise[worst]?, residuals.first()?[worst].clone());
    let std = noise.total();
    let condition = circumstances.condition(&standing_out(data, &residuals, worst));
    let windows = discrepancy_windows(&recording.times, &errors, &noise, &AVERAGING_LENGTHS);
    Some(Unexplained {
        target: output.name.to_string(),
        windows: windows.iter().map(|window| [window.from, window.until]).collect(),
        condition,
        description: format!(
            "errors of `{}` are still {:.1} times its noise, root mean square; something smaller is \
             missing besides",
            output.name,
            ratio(worst).sqrt()
        ),
        trace: MissingInput {
            equation: format!("sensor {}", output.name),
            unit: output.unit.symbol.to_string(),
            times: recording.times.clone(),
            value: errors.iter().map(|e| e / output.unit.factor).collect(),
            std: vec![std / output.unit.factor; errors.len()],
            windows,
            gain: 0.0,
        },
        guess: None,
    })
}

/// Why the verdict is what it is.
pub(crate) fn reason(
    search: &Search<'_>,
    outcome: &Outcome,
    candidates: &[Candidate<'_>],
) -> String {
    let training = |chosen: &[usize]| search.training_square(chosen).unwrap_or(f64::NAN);
    // Neither without held-out recordings nor where they cannot be simulated.
    let held_out = |chosen: &[usize]| search.held_out_square(chosen);
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
        Outcome::Partly(chosen) => {
            let on_held_out = held_out(&[])
                .zip(held_out(chosen))
                .map(|(all, left)| format!(", on held-out recordings from {all:.1} to {left:.1}"))
                .unwrap_or_default();
            format!(
                "The mean square of the errors falls from {base:.1} to {:.1} times that of the \
                 sensors' noise{on_held_out}: most of the discrepancy, and far more than anything \
                 else takes away. Something smaller is left over.",
                training(chosen)
            )
        }
        Outcome::Unexplained(best) if best.is_empty() => format!(
            "The mean square of the errors is {base:.1} times that of the sensors' noise, and no \
             known effect makes it smaller."
        ),
        Outcome::Unexplained(best)
            if search.explains(best) && search.cancelling(best).is_some() =>
        {
            format!(
                "The mean square of the errors is {base:.1} times that of the sensors' noise. With {} it is \
                 {:.2} times, but one of them only takes back what another does: that describes \
                 something that comes and goes, and is no name for it.",
                names(best),
                training(best)
            )
        }
        Outcome::Unexplained(best) if search.explains(best) && !search.is_sound(best) => {
            format!(
                "The mean square of the errors is {base:.1} times that of the sensors' noise. With {} it is \
                 {:.2} times, but {}: a name is given only to an effect of a size that its file allows.",
                names(best),
                training(best),
                search.note(best)
            )
        }
        Outcome::Unexplained(best) => format!(
            "The mean square of the errors is {base:.1} times that of the sensors' noise. The best \
             that known effects do, {}, leaves {:.2} times: too much to call it found.",
            names(best),
            training(best)
        ),
    }
}
