//! The report on a fleet as text, CSV and JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use super::reading::{FleetEstimate, PeriodResults};
use super::{AssetResults, Fleet};

/// Reasons listed in the text.
const MOST_TOLD: usize = 20;

/// A missing term, and the wells that lack it.
pub(super) struct SharedLack<'a> {
    pub(super) name: &'a str,
    /// Indices of the wells.
    pub(super) wells: Vec<usize>,
    /// Number of those in which only the last search found it.
    pub(super) new: usize,
}

/// Terms missing at the last search of each well, the most frequent first.
pub(super) fn missing(fleet: &Fleet) -> Vec<SharedLack<'_>> {
    let mut missing_terms: BTreeMap<&str, SharedLack<'_>> = BTreeMap::new();
    for (w, well) in fleet.wells.iter().enumerate() {
        for lack in &well.lacks {
            let new = || SharedLack { name: &lack.name, wells: Vec::new(), new: 0 };
            let one = missing_terms.entry(&lack.name).or_insert_with(new);
            one.wells.push(w);
            one.new += usize::from(lack.is_new);
        }
    }
    let mut missing_terms: Vec<SharedLack<'_>> = missing_terms.into_values().collect();
    missing_terms.sort_by_key(|one| std::cmp::Reverse(one.wells.len()));
    missing_terms
}

/// The summary in one sentence: the number of wells, and of those with missing terms.
pub(super) fn headline(fleet: &Fleet) -> String {
    let wells = fleet.wells.len();
    let searched = |well: &&AssetResults| well.occasions.iter().any(|found| found.search.is_some());
    let searched: Vec<&AssetResults> = fleet.wells.iter().filter(searched).collect();
    let lacking = searched.iter().filter(|well| !well.lacks.is_empty()).count();
    let unlike = fleet.compared.distances.iter().flatten().filter(|one| one.is_unlike).count();
    let mut parts = vec![match wells {
        1 => "1 well".to_owned(),
        n => format!("{n} wells"),
    }];
    if !searched.is_empty() {
        parts.push(format!("{lacking} of {} searched lack something", searched.len()));
    }
    if fleet.compared.without.is_none() {
        let verb = if unlike == 1 { "is" } else { "are" };
        parts.push(format!("{unlike} {verb} unlike the others"));
    }
    parts.join(", ")
}

/// The progress of the job.
pub(super) fn progress(fleet: &Fleet) -> String {
    let counts = fleet.counts;
    let open = counts.pieces - counts.done - counts.failed;
    let open = if open == 0 { String::new() } else { format!(", {open} have no result yet") };
    format!("{} of {} pieces are done, {} failed{open}", counts.done, counts.pieces, counts.failed)
}

/// The basis of the comparison of wells, or why there is none.
pub(super) fn comparison(fleet: &Fleet) -> String {
    let compared = &fleet.compared;
    let name = |j: &usize| format!("`{}`", fleet.parameters[*j].0);
    let left_out =
        compared.left_out.iter().map(|(j, why)| format!("{} is left out: {why}", name(j)));
    let left_out: Vec<String> = left_out.collect();
    let mut parts = if let Some(why) = &compared.without {
        vec![format!("Wells are not compared: {why}")]
    } else {
        let names: Vec<String> = compared.parameters.iter().map(name).collect();
        vec![format!("{} wells are compared in {}", compared.wells, names.join(", "))]
    };
    parts.extend(left_out);
    parts.join("; ")
}

/// As text.
pub(super) fn text(fleet: &Fleet) -> String {
    let mut text = format!("{}\n{}\n{}\n", headline(fleet), progress(fleet), comparison(fleet));
    // Writing to a string cannot fail.
    for one in missing(fleet) {
        let wells = if one.wells.len() == 1 { "well lacks" } else { "wells lack" };
        let new =
            if one.new == 0 { String::new() } else { format!(", {} of them only now", one.new) };
        let _ = writeln!(text, "{} {wells} {}{new}", one.wells.len(), one.name);
    }
    if !fleet.first.is_empty() {
        text.push_str("\nLook first at\n");
    }
    for (w, reason) in fleet.first.iter().take(MOST_TOLD) {
        let _ = writeln!(text, "  {}: {}", fleet.wells[*w].name, reason.words());
    }
    if let Some(more @ 1..) = fleet.first.len().checked_sub(MOST_TOLD) {
        let _ = writeln!(text, "  and {more} more, which the files of the report list");
    }
    text
}

/// A row for each occasion of each well.
pub(super) fn csv(fleet: &Fleet) -> String {
    let mut text = String::from("well,when,verdict,missing,since,converged,distance,open,failed");
    // Writing to a string cannot fail.
    for (name, unit) in &fleet.parameters {
        for part in ["", " low", " high"] {
            text.push(',');
            text.push_str(&cell(&format!("{name}{part} [{unit}]")));
        }
    }
    text.push('\n');
    for (w, well) in fleet.wells.iter().enumerate() {
        for found in &well.occasions {
            let verdict = found.search.as_ref().map_or("", |search| &search.verdict);
            let missing = found.search.iter().flat_map(|search| &search.missing);
            let missing: Vec<&str> = missing.map(|(name, _)| name.as_str()).collect();
            let since =
                missing.iter().filter_map(|name| well.lacks.iter().find(|lack| lack.name == *name));
            let since: Vec<&str> = since.map(|lack| lack.since.as_str()).collect();
            let converged = match &found.fit {
                None => "",
                Some(Ok(())) => "yes",
                Some(Err(_)) => "no",
            };
            let is_latest = well.latest().is_some_and(|latest| std::ptr::eq(latest, found));
            let distance = fleet.compared.distances[w].filter(|_| is_latest);
            let distance = distance.map_or_else(String::new, |distance| distance.value.to_string());
            let words = [
                &well.name,
                &found.when,
                verdict,
                &missing.join("; "),
                &since.join("; "),
                converged,
            ];
            let words: Vec<String> = words.into_iter().map(cell).collect();
            let _ = write!(
                text,
                "{},{distance},{},{}",
                words.join(","),
                found.open,
                found.failures.len()
            );
            for (name, _) in &fleet.parameters {
                let estimate = found.estimate(name);
                let band = estimate.and_then(|estimate| estimate.band);
                let numbers = [estimate.map(|e| e.value), band.map(|b| b.0), band.map(|b| b.1)];
                for number in numbers {
                    let _ = write!(text, ",{}", number.map_or_else(String::new, |n| n.to_string()));
                }
            }
            text.push('\n');
        }
    }
    text
}

/// A CSV cell, escaped if a spreadsheet would evaluate it.
fn cell(text: &str) -> String {
    let text =
        if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text.to_owned() };
    if text.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text
    }
}

/// As JSON.
pub(super) fn json(fleet: &Fleet) -> Value {
    let counts = fleet.counts;
    let names = |positions: &[usize]| -> Vec<&str> {
        positions.iter().map(|j| fleet.parameters[*j].0.as_str()).collect()
    };
    let compared = &fleet.compared;
    let left_out: Map<String, Value> = compared
        .left_out
        .iter()
        .map(|(j, why)| (fleet.parameters[*j].0.clone(), json!(why)))
        .collect();
    let missing = missing(fleet).into_iter().map(|one| {
        let wells: Vec<&str> = one.wells.iter().map(|w| fleet.wells[*w].name.as_str()).collect();
        json!({ "name": one.name, "wells": wells, "new": one.new })
    });
    let first = fleet.first.iter().map(|(w, reason)| {
        json!({ "well": fleet.wells[*w].name, "kind": reason.kind(), "why": reason.words() })
    });
    json!({
        "schema": dgd_work::SCHEMA_VERSION,
        "identity": fleet.identity,
        "pieces": counts.pieces,
        "done": counts.done,
        "failed": counts.failed,
        "open": counts.pieces - counts.done - counts.failed,
        "compared": {
            "parameters": names(&compared.parameters),
            "left_out": left_out,
            "wells": compared.wells,
            "without": compared.without,
        },
        "missing": missing.collect::<Vec<Value>>(),
        "first": first.collect::<Vec<Value>>(),
        "wells": fleet.wells.iter().enumerate().map(|(w, well)| of_well(fleet, w, well)).collect::<Vec<Value>>(),
    })
}

fn of_well(fleet: &Fleet, w: usize, well: &AssetResults) -> Value {
    let lacks = well.lacks.iter().map(|lack| {
        json!({ "name": lack.name, "since": lack.since, "onset": lack.onset, "new": lack.is_new })
    });
    let changes = well.changes.iter().map(|change| {
        json!({
            "parameter": change.parameter,
            "from": change.from,
            "to": change.to,
            "by": change.by,
            "deviations": change.deviations,
        })
    });
    let distance = fleet.compared.distances[w].map(|distance| {
        json!({
            "value": distance.value,
            "p_value": distance.p_value,
            "unlike": distance.is_unlike,
            "parameter": fleet.parameters[distance.most].0,
        })
    });
    json!({
        "name": well.name,
        "lacks": lacks.collect::<Vec<Value>>(),
        "changes": changes.collect::<Vec<Value>>(),
        "distance": distance,
        "occasions": well.occasions.iter().map(of_occasion).collect::<Vec<Value>>(),
    })
}

fn of_occasion(found: &PeriodResults) -> Value {
    let estimate = |(name, estimate): &(String, FleetEstimate)| {
        let entry = json!({
            "value": estimate.value,
            "unit": estimate.unit,
            "std": estimate.std,
            "band": estimate.band.map(|(low, high)| [low, high]),
            "by": estimate.by.name(),
        });
        (name.clone(), entry)
    };
    let failures = found.failures.iter().map(|(what, why)| json!({ "what": what, "error": why }));
    let missing = |search: &super::reading::SearchOutcome| {
        search.missing.iter().map(|(name, _)| name.clone()).collect::<Vec<String>>()
    };
    json!({
        "when": found.when,
        "verdict": found.search.as_ref().map(|search| &search.verdict),
        "missing": found.search.as_ref().map(missing),
        "converged": found.fit.as_ref().map(Result::is_ok),
        "reduced_chi_square": found.reduced_chi_square,
        "starts": found.starts.map(|(led, of)| json!({ "led_to_best": led, "of": of })),
        "parameters": found.estimates.iter().map(estimate).collect::<Map<String, Value>>(),
        "failures": failures.collect::<Vec<Value>>(),
        "open": found.open,
    })
}

impl Fleet {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        json(self)
    }

    /// As text.
    pub fn to_text(&self) -> String {
        text(self)
    }
}

#[cfg(test)]
mod tests {
    use super::cell;

    #[test]
    fn a_cell_is_text_whatever_stands_in_it() {
        assert_eq!(cell("a,b"), "\"a,b\"");
        assert_eq!(cell("say \"a\""), "\"say \"\"a\"\"\"");
        assert_eq!(cell("=1+1"), "'=1+1");
        assert_eq!(cell("plain"), "plain");
    }
}
