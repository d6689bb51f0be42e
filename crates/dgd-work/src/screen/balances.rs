//! Balances of a fully measured model, and their imbalance.
//!
//! An equation ẏᵢ = fᵢ(y, u) is checked if it has no free parameter, and yᵢ and all unknowns that it reads follow from
//! outputs without one. Unknowns are computed as for `--start measured`, from means over a few samples.

use dgd_runtime::{EvaluationPoint, Pattern, System};
use dgd_screen::balance::{Balance, Explanation, ImbalanceCause, imbalance};
use dgd_screen::{Estimate, RARE, Severity};

use super::ScreenedRecording;
use super::against_model::{ModelColumns, ScreenModel, listed};
use super::notice::{Amount, Notice};
use crate::output::quantity::of_differences;

/// Most times at which unknowns are computed.
const TIMES: usize = 4000;
/// An explanation counts if it leaves less than this share of the imbalance.
const EXPLAINS: f64 = 0.1;
/// The same without an overall drift, when mostly noise is left.
const EXPLAINS_SOME: f64 = 0.4;
/// Other explanations are as good if they leave at most this many times as much.
const AS_GOOD: f64 = 3.0;
/// Unknowns that agree to this from other initial guesses are determined.
const SAME: f64 = 1e-6;

/// The unknowns of a model, reconstructed from a recording.
struct ReconstructedUnknowns {
    times: Vec<f64>,
    /// Values of each unknown, NaN where they are undetermined.
    y: Vec<Vec<f64>>,
    u: Vec<Vec<f64>>,
    determined: Vec<bool>,
}

/// The findings of a model's balances in a recording.
pub(super) fn notices(
    model: &ScreenModel<'_>,
    one: &ScreenedRecording,
    columns: &ModelColumns,
) -> Vec<Notice> {
    let signature = model.signature();
    if !signature.discrete.is_empty() || signature.n_u() != signature.inputs.len() {
        return Vec::new();
    }
    let free = model.free();
    let has = |pattern: &Pattern, row: usize, wanted: &dyn Fn(usize) -> bool| {
        pattern.positions().any(|(r, column)| r == row && wanted(column))
    };
    let rows: Vec<usize> = (signature.unknowns.differential())
        .filter(|i| !has(&signature.parameter_jacobian, *i, &|p| free.contains(&p)))
        .collect();
    if rows.is_empty() {
        return Vec::new();
    }
    let Some(found) = reconstruct(model, one, columns) else { return Vec::new() };
    rows.into_iter()
        .filter(|i| found.determined[*i])
        .filter(|i| !has(&signature.jacobian, *i, &|j| !found.determined[j]))
        .flat_map(|i| balance(model, one, &found, i))
        .collect()
}

/// The unknowns of the model, from the outputs that do not depend on free parameters.
fn reconstruct(
    model: &ScreenModel<'_>,
    one: &ScreenedRecording,
    columns: &ModelColumns,
) -> Option<ReconstructedUnknowns> {
    let signature = model.signature();
    let times = one.times();
    let block = times.len().div_ceil(TIMES).max(1);
    let means = |values: &[f64]| -> Vec<f64> {
        values.chunks(block).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect()
    };
    let u: Vec<Vec<f64>> =
        columns.inputs.iter().map(|x| x.as_deref().map(means)).collect::<Option<_>>()?;
    let known = model.known_outputs();
    let w: Vec<Option<Vec<f64>>> = columns
        .outputs
        .iter()
        .zip(&known)
        .map(|(values, known)| values.as_deref().filter(|_| *known).map(means))
        .collect();
    let times = means(times);
    let p = model.p();
    let mut y = vec![vec![f64::NAN; times.len()]; signature.unknowns.len()];
    let mut start: Vec<(usize, f64)> = Vec::new();
    let mut determined: Option<Vec<bool>> = None;
    for k in 0..times.len() {
        let inputs: Vec<f64> = u.iter().map(|values| values[k]).collect();
        let measured: Vec<Option<f64>> = w.iter().map(|x| x.as_ref().map(|x| x[k])).collect();
        if inputs.iter().chain(measured.iter().flatten()).any(|x| !x.is_finite()) {
            continue;
        }
        let Some(found) = model.state_at(&inputs, &p, &measured, &start, None) else { continue };
        if determined.is_none() {
            let other = model.state_at(&inputs, &p, &measured, &start, Some(0.1))?;
            let pairs = found.iter().zip(&other);
            determined =
                Some(pairs.map(|(a, b)| (a - b).abs() <= SAME * a.abs().max(1e-9)).collect());
        }
        for (i, value) in found.iter().enumerate() {
            y[i][k] = *value;
        }
        start = found.into_iter().enumerate().collect();
    }
    Some(ReconstructedUnknowns { times, y, u, determined: determined? })
}

/// The imbalance of one unknown.
fn balance(
    model: &ScreenModel<'_>,
    one: &ScreenedRecording,
    found: &ReconstructedUnknowns,
    row: usize,
) -> Vec<Notice> {
    let signature = model.signature();
    let p = model.p();
    let of_row = |pattern: &Pattern| -> Vec<(usize, usize)> {
        let positions = pattern.positions().enumerate();
        positions.filter(|(_, (r, _))| *r == row).map(|(at, (_, column))| (at, column)).collect()
    };
    let unknowns: Vec<(usize, usize)> =
        of_row(&signature.jacobian).into_iter().filter(|(_, j)| *j != row).collect();
    let inputs: Vec<(usize, usize)> = of_row(&signature.input_jacobian);
    let n = signature.unknowns.len();
    let mut rate = vec![f64::NAN; found.times.len()];
    let mut shares = vec![vec![f64::NAN; found.times.len()]; unknowns.len() + inputs.len()];
    let (mut f, mut dfdt) = (vec![0.0; n], vec![0.0; n]);
    let mut dfdy = vec![0.0; signature.jacobian.len()];
    let mut dfdu = vec![0.0; signature.input_jacobian.len()];
    let still = vec![0.0; signature.n_u()];
    for (k, &t) in found.times.iter().enumerate() {
        let y: Vec<f64> = found.y.iter().map(|values| values[k]).collect();
        if y.iter().any(|value| !value.is_finite()) {
            continue;
        }
        let u: Vec<f64> = found.u.iter().map(|values| values[k]).collect();
        let point = EvaluationPoint { t, y: &y, u: &u, p: &p, z: &[] };
        model.system.linearize(point, &still, &mut f, &mut dfdy, &mut dfdt);
        model.system.input_jacobian(point, &mut dfdu);
        rate[k] = f[row];
        for (share, (point, j)) in shares.iter_mut().zip(&unknowns) {
            share[k] = dfdy[*point] * y[*j];
        }
        for (share, (point, j)) in shares[unknowns.len()..].iter_mut().zip(&inputs) {
            share[k] = dfdu[*point] * u[*j];
        }
    }
    let names: Vec<String> = unknowns
        .iter()
        .map(|(_, j)| signature.unknowns.name(*j).to_string())
        .chain(inputs.iter().map(|(_, j)| signature.inputs[*j].name.to_string()))
        .collect();
    let sensors = sensors_of(model, one, row);
    let balance =
        Balance { times: &found.times, unknown: &found.y[row], rate: &rate, shares: &shares };
    let Some(left) = imbalance(&balance) else { return Vec::new() };
    let subject = BalanceSubject {
        unknown: signature.unknowns.name(row).to_string(),
        equation: signature.equations.get(row).to_string(),
        sensors,
        names,
    };
    let unit = of_differences(signature.unknowns.unit(row));
    let hourly = Estimate {
        value: left.drift.value * 3600.0 / unit.factor,
        std_error: left.drift.std_error * 3600.0 / unit.factor,
        ..left.drift
    };
    let drifts = hourly.p_value() < RARE;
    let good = good(&left.explanations, if drifts { EXPLAINS } else { EXPLAINS_SOME });
    let is_late =
        |e: &&Explanation| matches!(e.cause, ImbalanceCause::Lag(_) | ImbalanceCause::UnknownLag);
    // A drift may hide in temporary changes; a cause that explains most of those reveals it.
    let p_value = good.first().map_or(1.0, |best| best.size.p_value()).min(hourly.p_value());
    if drifts || good.first().is_some_and(|e| !is_late(e)) {
        let amount = Amount::from_estimate(&hourly, &format!("{}/h", unit.symbol));
        let causes: Vec<String> =
            good.iter().filter_map(|e| subject.cause(e, &unit.symbol, unit.factor)).collect();
        let hint = match causes.as_slice() {
            [] => "; no single gain, flow or delay explains it".to_owned(),
            causes => format!("; as if {}", causes.join(", or ")),
        };
        let text = format!(
            "the balance `{}` leaves over {} of `{}`{hint}",
            subject.equation,
            amount.signed(),
            subject.unknown
        );
        return vec![subject.notice("balance", text, amount, p_value)];
    }
    let Some(late) = good.first().filter(|e| is_late(e)) else { return Vec::new() };
    let amount = Amount::from_estimate(&late.size, "s");
    // Two delayed columns are equivalent to an early third one.
    let causes: Vec<String> = good
        .iter()
        .filter(|e| is_late(e))
        .filter_map(|e| subject.cause(e, &unit.symbol, unit.factor))
        .collect();
    let text = format!("the balance `{}` is as if {}", subject.equation, causes.join(", or "));
    vec![subject.notice("late", text, amount, late.size.p_value())]
}

/// The explanations that count, all about equally good.
fn good(explanations: &[Explanation], explains: f64) -> Vec<&Explanation> {
    let least = explanations.iter().map(|e| e.left).min_by(f64::total_cmp);
    let Some(best) = least else { return Vec::new() };
    explanations
        .iter()
        .filter(|e| e.left <= explains.min(AS_GOOD * best) && e.size.p_value() < RARE)
        .collect()
}

/// Columns that determine an unknown: outputs without a free parameter that depend on it.
fn sensors_of(model: &ScreenModel<'_>, one: &ScreenedRecording, unknown: usize) -> Vec<String> {
    let known = model.known_outputs();
    let signature = model.signature();
    let read: Vec<usize> = signature.output_jacobians[0]
        .positions()
        .filter(|(row, column)| *column == unknown && known[*row])
        .map(|(row, _)| row)
        .collect();
    let names = read.into_iter().map(|row| signature.outputs[row].name.to_string());
    names.filter(|name| one.table.column(name).is_some()).collect()
}

/// The subject of a balance, in the user's names.
struct BalanceSubject {
    unknown: String,
    equation: String,
    sensors: Vec<String>,
    /// Names of the shares.
    names: Vec<String>,
}

impl BalanceSubject {
    /// A cause in words; `None` if it would mean nothing to the user.
    fn cause(&self, explanation: &Explanation, unit: &str, factor: f64) -> Option<String> {
        let size = &explanation.size;
        match explanation.cause {
            ImbalanceCause::Gain(share) => {
                // The true value is the reading times 1 + size.
                let gain = 1.0 + size.value;
                let read = Estimate {
                    value: 1.0 / gain,
                    std_error: size.std_error / (gain * gain),
                    ..*size
                };
                (gain > 0.0).then(|| {
                    let factor = Amount::from_estimate(&read, "").signed();
                    format!("`{}` read {factor} times what flows", self.names[share])
                })
            }
            ImbalanceCause::Lag(share) => {
                let late = Amount::from_estimate(size, "s").signed();
                Some(format!("`{}` were {late} late", self.names[share]))
            }
            ImbalanceCause::UnknownLag => {
                let late = Amount::from_estimate(size, "s").signed();
                Some(format!("{} were {late} late", listed(&self.sensors)))
            }
            ImbalanceCause::Flow => {
                let hourly = Estimate {
                    value: size.value * 3600.0 / factor,
                    std_error: size.std_error * 3600.0 / factor,
                    ..*size
                };
                let amount = Amount::from_estimate(&hourly, &format!("{unit}/h")).signed();
                Some(format!("a steady flow of {amount} were in no column"))
            }
        }
    }

    fn notice(&self, kind: &'static str, text: String, amount: Amount, p_value: f64) -> Notice {
        let channels = self.sensors.iter().chain(&self.names).cloned().collect();
        Notice {
            kind,
            weight: Severity::Fault,
            channels,
            stretches: Vec::new(),
            amount: Some(amount),
            p_value: Some(p_value),
            text,
            advice: "look at these sensors; `dgd discover` tells more causes apart".to_owned(),
        }
    }
}
