//! A screening for programs.

use dgd_screen::redundant::{Kinship, RedundantPair};
use dgd_screen::{Estimate, Severity};
use serde_json::{Value, json};

use super::notice::{Notice, unit_of};
use super::{ScreenedRecording, apart, ends};

/// All recordings.
pub(crate) fn to_json(screened: &[ScreenedRecording]) -> Value {
    let recordings: Vec<Value> = screened.iter().map(recording).collect();
    let faults: usize = screened.iter().map(|one| one.count(Severity::Fault)).sum();
    json!({ "faults": faults, "recordings": recordings })
}

fn recording(one: &ScreenedRecording) -> Value {
    let screening = &one.screening;
    let name = |i: usize| &one.table.columns[i].name;
    let columns: Vec<Value> = one
        .table
        .columns
        .iter()
        .zip(&screening.channels)
        .map(|(column, summary)| {
            json!({
                "name": column.name,
                "unit": unit_of(column.unit.as_ref()),
                "values": summary.samples,
                "least": summary.range.map(|range| range.0),
                "mean": summary.mean,
                "most": summary.range.map(|range| range.1),
                "noise": summary.noise.map(|noise| noise.std),
                "step": summary.noise.and_then(|noise| noise.quantisation),
            })
        })
        .collect();
    let steady: Vec<Value> = screening
        .motion
        .steady
        .iter()
        .enumerate()
        .map(|(at, steady)| {
            let means = steady.means.iter().enumerate().filter_map(|(i, mean)| {
                let mean = mean.as_ref()?;
                Some((
                    name(i).clone(),
                    estimate(mean, &unit_of(one.table.columns[i].unit.as_ref())),
                ))
            });
            let point = screening.points.iter().position(|point| point.stretches.contains(&at));
            json!({
                "window": ends(&steady.stretch),
                "point": point,
                "means": means.collect::<serde_json::Map<String, Value>>(),
            })
        })
        .collect();
    let transients: Vec<Value> = screening
        .motion
        .transients
        .iter()
        .map(|transient| {
            let changes = transient.changes.iter().map(|(i, before, after)| {
                (name(*i).clone(), json!({ "before": before, "after": after }))
            });
            json!({
                "window": ends(&transient.stretch),
                "changes": changes.collect::<serde_json::Map<String, Value>>(),
            })
        })
        .collect();
    let points: Vec<Value> = screening
        .points
        .iter()
        .map(|point| {
            let means = point.means.iter().enumerate();
            let means = means.filter(|(_, mean)| mean.is_finite());
            json!({
                "stretches": point.stretches.len(),
                "seconds": point.seconds,
                "means": means
                    .map(|(i, mean)| (name(i).clone(), json!(mean)))
                    .collect::<serde_json::Map<String, Value>>(),
            })
        })
        .collect();
    json!({
        "file": one.path.display().to_string(),
        "rows": one.table.len(),
        "seconds": one.times().last(),
        "spacing": screening.sampling.usual,
        "findings": one.notices.iter().map(notice).collect::<Vec<_>>(),
        "columns": columns,
        "redundant": screening.comparisons.iter().map(|c| comparison(one, c)).collect::<Vec<_>>(),
        "steady": steady,
        "transients": transients,
        "operating_points": points,
    })
}

fn notice(notice: &Notice) -> Value {
    let amount = notice.amount.as_ref().map(|amount| {
        json!({ "value": amount.value, "half_width": amount.half_width, "unit": amount.unit })
    });
    json!({
        "kind": notice.kind,
        "severity": match notice.weight {
            Severity::Fault => "fault",
            Severity::Remark => "remark",
        },
        "channels": notice.channels,
        "windows": notice.stretches.iter().map(ends).collect::<Vec<_>>(),
        "amount": amount,
        "p_value": notice.p_value,
        "text": notice.text,
        "advice": notice.advice,
    })
}

fn comparison(one: &ScreenedRecording, pair: &RedundantPair) -> Value {
    let [a, b] = pair.channels;
    let unit = apart(&one.table, a);
    json!({
        "columns": [one.table.columns[a].name, one.table.columns[b].name],
        "by": match pair.kinship {
            Kinship::Moving => "motion",
            Kinship::Named => "name",
        },
        "offset": estimate(&pair.offset, &unit),
        "gain_difference": pair.gain.as_ref().map(|gain| estimate(gain, "")),
        "drift": pair.rate.as_ref().map(|rate| estimate(rate, &format!("{unit}/s"))),
        "noise": pair.noise.iter().map(|noise| noise.map(|n| n.std)).collect::<Vec<_>>(),
    })
}

fn estimate(estimate: &Estimate, unit: &str) -> Value {
    json!({ "value": estimate.value, "half_width": estimate.half_width(), "unit": unit })
}
