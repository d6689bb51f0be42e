//! `result.json`: the result of a discovery, for programs.
//!
//! Numbers are in the units that the model declares. Residuals and noise are differences, whose units have no offset:
//! `bar` for an output in `bara`, `K` for one in `°C`.

use dgd_discover::{
    ClosedPlace, DetectionPower, Discovery, FoundEffect, FoundRegime, OutputGap, ParameterValue,
    PlaceKind, RankedStructure, ResemblingEffect, UnexplainedError,
};
use serde_json::{Map, Value, json};

use super::{DiscoverySubject, UNEXPLAINED, condition, guess, kept_apart, law, plain, together};
use crate::output::json_text;
use crate::output::quantity::of_differences;

/// The text of the file.
pub(super) fn write(subject: &DiscoverySubject<'_>) -> String {
    json_text(&value(subject))
}

/// The content of the file.
pub(super) fn value(subject: &DiscoverySubject<'_>) -> Value {
    let Discovery { verdict, reason, p_value, effects, unexplained, gap, .. } = subject.discovery;
    let Discovery { traces, ranking, screened, .. } = subject.discovery;
    let not_tried: Vec<Value> = (subject.discovery.not_tried.iter())
        .map(|(name, why)| json!({ "name": name, "reason": why }))
        .collect();
    let recordings: Vec<Value> = traces
        .iter()
        .map(|trace| {
            let (name, held_out, from) = (&trace.name, trace.held_out, trace.counts_from);
            json!({ "name": name, "held_out": held_out, "counts_from": from })
        })
        .collect();
    let held_out = traces.iter().filter(|trace| trace.held_out);
    let counts_from: Vec<Option<f64>> = held_out.map(|trace| trace.counts_from).collect();
    let screened: Vec<Value> = screened
        .iter()
        .map(|candidate| json!({ "name": candidate.name, "share": tidy(candidate.share) }))
        .collect();
    let described: Vec<Value> =
        subject.discovery.described.iter().enumerate().map(of_described).collect();
    let closed: Vec<Value> = subject.discovery.closed.iter().map(of_closed).collect();
    let mut result = json!({
        "verdict": verdict.word(),
        "reason": reason,
        "p_value": p_value.map(tidy),
        "reservations": subject.reservations,
        "model": subject.model_name(),
        "model_file": subject.model.display().to_string(),
        "effects": effects.iter().map(effect).collect::<Vec<_>>(),
        "law": subject.discovery.law.as_ref().map(law::value),
        "regime": subject.discovery.regime.as_ref().map(regime),
        "rivals": subject.discovery.rivals.iter().map(law::rival).collect::<Vec<_>>(),
        "plain": subject.discovery.plain.as_ref().map(plain::value),
        "described": described,
        "unexplained": unexplained.iter().enumerate().map(left_over).collect::<Vec<_>>(),
        "places_not_tried": closed,
        "power": subject.discovery.power.iter().map(smallest).collect::<Vec<_>>(),
        "gap": named(gap.iter().map(|gap| (&gap.output, errors(gap)))),
        "parameters": parameters(&subject.discovery.corrected_parameters),
        "base_parameters": parameters(&subject.discovery.base_parameters),
        "recordings": recordings,
        "counts_from": counts_from,
        "ranking": ranking.iter().map(ranked).collect::<Vec<_>>(),
        "screened": screened,
        "not_tried": not_tried,
    });
    if let Some(provenance) = subject.provenance {
        provenance.push_json(&mut result);
    }
    result
}

fn effect(effect: &FoundEffect) -> Value {
    let alternatives: Vec<Value> = effect
        .alternatives
        .iter()
        .map(|other| {
            let ratio = tidy(other.valid_ratio);
            json!({ "name": other.name, "form": other.form, "valid_ratio": ratio })
        })
        .collect();
    let other_forms: Vec<Value> = effect
        .other_forms
        .iter()
        .map(|other| json!({ "form": other.form, "valid_ratio": tidy(other.valid_ratio) }))
        .collect();
    json!({
        "name": effect.name,
        "kind": effect.kind,
        "form": effect.form,
        "target": effect.target,
        "alternatives": alternatives,
        "other_forms": other_forms,
        "told_apart_by": effect.told_apart_by,
        "onset": effect.onset.map(tidy),
        "windows": windows(&effect.windows),
        "condition": condition::value(effect.condition.as_ref()),
        "parameters": parameters(&effect.parameters),
        "evidence": {
            "p_value": tidy(effect.evidence.p_value),
            "resamples": effect.evidence.resamples,
            "bic_gain": tidy(effect.evidence.bic_gain),
            "inclusion": tidy(effect.evidence.inclusion),
        },
    })
}

fn of_described((k, described): (usize, &ResemblingEffect)) -> Value {
    let file = kept_apart::described(k);
    let apply = match described.arguments.as_slice() {
        [] => file.clone(),
        arguments => format!("{file}({})", arguments.join(", ")),
    };
    json!({
        "name": described.name,
        "kind": described.kind,
        "form": described.form,
        "target": described.target,
        "parameters": parameters(&described.parameters),
        "left": { "train": tidy(described.left.0), "valid": described.left.1.map(tidy) },
        "file": file,
        "apply": apply,
    })
}

fn regime(regime: &FoundRegime) -> Value {
    json!({
        "condition": condition::value(Some(&regime.condition)),
        "left": { "outside": tidy(regime.outside), "inside": tidy(regime.inside) },
        "parameters": parameters(&regime.parameters),
    })
}

fn of_closed(closed: &ClosedPlace) -> Value {
    json!({ "target": closed.place.called(), "reason": closed.reason })
}

fn smallest(power: &DetectionPower) -> Value {
    json!({
        "name": power.name,
        "parameter": power.parameter,
        "smallest": tidy(power.smallest / power.unit.factor),
        "unit": of_differences(&power.unit).symbol,
    })
}

/// The kind of equation that lacks a term.
fn kind(kind: PlaceKind) -> &'static str {
    match kind {
        PlaceKind::Equation => "equation",
        PlaceKind::Parameter => "parameter",
        PlaceKind::Input => "input",
        PlaceKind::Output => "sensor",
    }
}

fn left_over((k, unexplained): (usize, &UnexplainedError)) -> Value {
    json!({
        "target": unexplained.target,
        "kind": kind(unexplained.trace.place.kind),
        "tied": unexplained.is_tied,
        "joint": unexplained.is_joint,
        "left": unexplained.left.map(tidy),
        "objection": unexplained.objection,
        "told_apart_by": unexplained.told_apart_by,
        "gain": tidy(unexplained.gain),
        "windows": windows(&unexplained.windows),
        "condition": condition::value(unexplained.condition.as_ref()),
        "together": together::value(&unexplained.together),
        "trace": UNEXPLAINED,
        "description": unexplained.description,
        "guess": guess::value(unexplained.guess.as_ref()),
        "law": unexplained.guess.as_ref().map(|guess| guess::as_file(guess, &kept_apart::law(k))),
    })
}

fn errors(gap: &OutputGap) -> Value {
    let unit = of_differences(&gap.unit);
    let shown = |error: f64| tidy(error / unit.factor);
    json!({
        "unit": unit.symbol,
        "noise": shown(gap.noise),
        "train_before": shown(gap.train_before),
        "train_after": shown(gap.train_after),
        "valid_before": shown(gap.valid_before),
        "valid_after": shown(gap.valid_after),
        "condition": condition::value(gap.condition.as_ref()),
    })
}

fn ranked(ranked: &RankedStructure) -> Value {
    json!({
        "effects": ranked.effects,
        "train": tidy(ranked.train),
        "valid": ranked.valid.map(tidy),
        "bic": tidy(ranked.bic),
        "note": ranked.note,
    })
}

fn parameters(parameters: &[ParameterValue]) -> Value {
    named(parameters.iter().map(|parameter| {
        let unit = &parameter.unit;
        let value = json!({
            "value": tidy(unit.from_si(parameter.value)),
            "unit": unit.symbol,
            "std": parameter.std.map(|std| tidy(std / unit.factor)),
            "std_model": parameter.std_model.map(|std| tidy(std / unit.factor)),
        });
        (&parameter.name, value)
    }))
}

fn windows(windows: &[[f64; 2]]) -> Vec<[f64; 2]> {
    windows.iter().map(|window| window.map(tidy)).collect()
}

fn named<'a>(entries: impl Iterator<Item = (&'a String, Value)>) -> Value {
    Value::Object(entries.map(|(name, value)| (name.clone(), value)).collect::<Map<_, _>>())
}

/// Rounds to twelve digits, which removes the rounding of unit conversions.
pub(super) fn tidy(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}
