//! `result.json`: the result of a discovery, for programs.
//! Numbers are in the units that the model declares.

use dgd_discover::{
    ClosedPlace, DetectionPower, FoundEffect, FoundRegime, OutputGap, ParameterValue, PlaceKind,
    RankedStructure, ResemblingEffect, UnexplainedError,
};
use serde_json::json;

use super::{DiscoverySubject, UNEXPLAINED, condition, guess, kept_apart, law, plain, together};
use crate::output::json_text;
use crate::output::quantity::of_differences;
use crate::result::ByName;
use crate::result::discover::{
    AlternativeEntry, DescribedEntry, DiscoverDocument, EffectEntry, EvidenceEntry, FormEntry,
    FoundParameter, GapEntry, LeftEntry, PowerEntry, RankedEntry, RegimeEntry, RegimeLeft,
    ScreenedEntry, UnexplainedEntry, UntriedEffect, UntriedPlace, UsedRecording,
};

/// The text of the file.
pub(super) fn write(subject: &DiscoverySubject<'_>) -> String {
    json_text(&json!(result(subject)))
}

/// The content of the file.
pub(super) fn result(subject: &DiscoverySubject<'_>) -> DiscoverDocument {
    let discovery = subject.discovery;
    let recordings = discovery.traces.iter().map(|trace| UsedRecording {
        name: trace.name.clone(),
        held_out: trace.held_out,
        counts_from: trace.counts_from,
    });
    let held_out = discovery.traces.iter().filter(|trace| trace.held_out);
    let screened = discovery.screened.iter().map(|candidate| ScreenedEntry {
        name: candidate.name.clone(),
        share: number(candidate.share),
    });
    let not_tried = discovery
        .not_tried
        .iter()
        .map(|(name, reason)| UntriedEffect { name: name.clone(), reason: reason.clone() });
    DiscoverDocument {
        verdict: discovery.verdict.word().to_owned(),
        reason: discovery.reason.clone(),
        p_value: discovery.p_value.and_then(number),
        reservations: subject.reservations.to_vec(),
        model: subject.model_name(),
        model_file: subject.model.display().to_string(),
        effects: discovery.effects.iter().map(effect).collect(),
        law: discovery.law.as_ref().map(law::entry),
        regime: discovery.regime.as_ref().map(regime),
        rivals: discovery.rivals.iter().map(law::rival).collect(),
        plain: discovery.plain.as_ref().map(plain::entry),
        described: discovery.described.iter().enumerate().map(described).collect(),
        unexplained: discovery.unexplained.iter().enumerate().map(left_over).collect(),
        places_not_tried: discovery.closed.iter().map(untried).collect(),
        power: discovery.power.iter().map(smallest).collect(),
        gap: discovery.gap.iter().map(|gap| (gap.output.clone(), errors(gap))).collect(),
        parameters: parameters(&discovery.corrected_parameters),
        base_parameters: parameters(&discovery.base_parameters),
        recordings: recordings.collect(),
        counts_from: held_out.map(|trace| trace.counts_from).collect(),
        ranking: discovery.ranking.iter().map(ranked).collect(),
        screened: screened.collect(),
        not_tried: not_tried.collect(),
        provenance: subject.provenance.cloned(),
    }
}

fn effect(effect: &FoundEffect) -> EffectEntry {
    let alternatives = effect.alternatives.iter().map(|other| AlternativeEntry {
        name: other.name.clone(),
        form: other.form.clone(),
        valid_ratio: number(other.valid_ratio),
    });
    let other_forms = effect.other_forms.iter().map(|other| FormEntry {
        form: other.form.clone(),
        valid_ratio: number(other.valid_ratio),
    });
    EffectEntry {
        name: effect.name.clone(),
        kind: effect.kind.to_owned(),
        form: effect.form.clone(),
        target: effect.target.clone(),
        alternatives: alternatives.collect(),
        other_forms: other_forms.collect(),
        told_apart_by: effect.told_apart_by.clone(),
        onset: effect.onset.and_then(number),
        windows: windows(&effect.windows),
        condition: effect.condition.as_ref().map(condition::entry),
        parameters: parameters(&effect.parameters),
        evidence: EvidenceEntry {
            p_value: number(effect.evidence.p_value),
            resamples: effect.evidence.resamples,
            bic_gain: number(effect.evidence.bic_gain),
            inclusion: number(effect.evidence.inclusion),
        },
    }
}

fn described((k, described): (usize, &ResemblingEffect)) -> DescribedEntry {
    let file = kept_apart::described(k);
    let apply = match described.arguments.as_slice() {
        [] => file.clone(),
        arguments => format!("{file}({})", arguments.join(", ")),
    };
    DescribedEntry {
        name: described.name.clone(),
        kind: described.kind.to_owned(),
        form: described.form.clone(),
        target: described.target.clone(),
        parameters: parameters(&described.parameters),
        left: left(described.left),
        file,
        apply,
    }
}

/// Residual variances in training and validation.
pub(super) fn left((train, valid): (f64, Option<f64>)) -> LeftEntry {
    LeftEntry { train: number(train), valid: valid.and_then(number) }
}

fn regime(regime: &FoundRegime) -> RegimeEntry {
    RegimeEntry {
        condition: Some(condition::entry(&regime.condition)),
        left: RegimeLeft { outside: number(regime.outside), inside: number(regime.inside) },
        parameters: parameters(&regime.parameters),
    }
}

fn untried(closed: &ClosedPlace) -> UntriedPlace {
    UntriedPlace { target: closed.place.called().clone(), reason: closed.reason.clone() }
}

fn smallest(power: &DetectionPower) -> PowerEntry {
    PowerEntry {
        name: power.name.clone(),
        parameter: power.parameter.clone(),
        smallest: number(power.smallest / power.unit.factor),
        unit: of_differences(&power.unit).symbol.to_string(),
    }
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

fn left_over((k, unexplained): (usize, &UnexplainedError)) -> UnexplainedEntry {
    let guess = unexplained.guess.as_ref();
    UnexplainedEntry {
        target: unexplained.target.clone(),
        kind: kind(unexplained.trace.place.kind).to_owned(),
        tied: unexplained.is_tied,
        joint: unexplained.is_joint,
        left: unexplained.left.and_then(number),
        objection: unexplained.objection.clone(),
        told_apart_by: unexplained.told_apart_by.clone(),
        gain: number(unexplained.gain),
        windows: windows(&unexplained.windows),
        condition: unexplained.condition.as_ref().map(condition::entry),
        together: unexplained.together.iter().map(together::entry).collect(),
        trace: UNEXPLAINED.to_owned(),
        description: unexplained.description.clone(),
        guess: guess.map(guess::entry),
        law: guess.map(|guess| guess::as_file(guess, &kept_apart::law(k))),
    }
}

fn errors(gap: &OutputGap) -> GapEntry {
    let unit = of_differences(&gap.unit);
    let shown = |error: f64| number(error / unit.factor);
    GapEntry {
        noise: shown(gap.noise),
        train_before: shown(gap.train_before),
        train_after: shown(gap.train_after),
        valid_before: shown(gap.valid_before),
        valid_after: shown(gap.valid_after),
        condition: gap.condition.as_ref().map(condition::entry),
        unit: unit.symbol.to_string(),
    }
}

fn ranked(ranked: &RankedStructure) -> RankedEntry {
    RankedEntry {
        effects: ranked.effects.clone(),
        train: number(ranked.train),
        valid: ranked.valid.and_then(number),
        bic: number(ranked.bic),
        note: ranked.note.clone(),
    }
}

fn parameters(parameters: &[ParameterValue]) -> ByName<FoundParameter> {
    let entry = |parameter: &ParameterValue| {
        let unit = &parameter.unit;
        let spread = |std: Option<f64>| std.and_then(|std| number(std / unit.factor));
        let entry = FoundParameter {
            value: number(unit.from_si(parameter.value)),
            unit: unit.symbol.to_string(),
            std: spread(parameter.std),
            std_model: spread(parameter.std_model),
        };
        (parameter.name.clone(), entry)
    };
    parameters.iter().map(entry).collect()
}

fn windows(windows: &[[f64; 2]]) -> Vec<[f64; 2]> {
    windows.iter().map(|window| window.map(tidy)).collect()
}

/// A number of the result; `None` if it is not finite.
pub(super) fn number(value: f64) -> Option<f64> {
    value.is_finite().then(|| tidy(value))
}

/// Rounds to twelve digits, which removes the rounding of unit conversions.
fn tidy(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}
