//! The summary of a comparison, for programs and as text.

use std::fmt::Write as _;

use super::FitComparison;
use crate::output::agreement::Agreement;
use crate::output::quantity::{UncertainValue, short};
use crate::output::table::{push_table, significant};
use crate::result::compare::{ContenderEntry, ContenderOutput, RelativeError};
use crate::result::fit::FitStatus;

/// One contender, for programs.
pub(super) fn entry(all: &FitComparison, k: usize) -> ContenderEntry {
    let contender = &all.contenders[k];
    let least =
        |number: &dyn Fn(usize) -> Option<f64>| Some(number(k)? - number(all.least(number)?)?);
    let aic = |k: usize| all.contenders[k].score.aic();
    let bic = |k: usize| all.contenders[k].score.bic();
    let outputs = all.outputs().enumerate().map(|(i, (name, unit))| {
        let agreement = |is_valid| all.agreement(k, i, is_valid);
        let unit = unit.to_owned();
        (name.to_owned(), ContenderOutput { unit, train: agreement(false), valid: agreement(true) })
    });
    let result = contender.fitted.result();
    ContenderEntry {
        name: contender.name.clone(),
        model: contender.named.model.display().to_string(),
        model_digest: contender.fitted.provenance.model.clone(),
        variants: contender.named.choices.variant.clone(),
        effects: contender.named.choices.apply.clone(),
        converged: result.converged,
        status: result.status,
        parameters: result.parameters.clone(),
        estimates: contender.score.estimates,
        deviance: contender.score.deviance,
        aic: aic(k),
        bic: bic(k),
        aic_above_least: least(&aic),
        bic_above_least: least(&bic),
        relative_error: RelativeError {
            train: all.relative_error(k, false),
            valid: all.relative_error(k, true),
        },
        outputs: outputs.collect(),
    }
}

/// The conclusion, in a sentence.
pub(super) fn sentence(all: &FitComparison) -> String {
    let name = |k: usize| format!("`{}`", all.contenders[k].name);
    let by_bic = all.least(|k| all.contenders[k].score.bic());
    let by_valid = all.least(|k| all.relative_error(k, true));
    match (by_bic, by_valid) {
        (Some(bic), Some(valid)) if bic == valid => {
            format!("{} has the least BIC and the smallest validation errors", name(bic))
        }
        (Some(bic), Some(valid)) => format!(
            "{} has the least BIC, {} the smallest validation errors",
            name(bic),
            name(valid)
        ),
        (Some(bic), None) => {
            format!("{} has the least BIC; there is no validation data to test it by", name(bic))
        }
        (None, _) => "Nothing can be told from the likelihoods".to_owned(),
    }
}

/// A line for each likelihood ratio.
pub(super) fn ratios(all: &FitComparison) -> Vec<String> {
    let line = |one: &super::LikelihoodRatio| {
        let name = |k: usize| &all.contenders[k].name;
        let parameters = if one.degrees_of_freedom == 1 { "estimate" } else { "estimates" };
        let p = if one.p_value < 1e-12 {
            "p < 1e-12".to_owned()
        } else {
            format!("p = {}", short(one.p_value, 2))
        };
        format!(
            "`{}` is a special case of `{}`: with {} {parameters} more, −2 ln L falls by {} ({p} by chance)",
            name(one.null),
            name(one.alternative),
            one.degrees_of_freedom,
            short(one.statistic, 4)
        )
    };
    all.ratios.iter().map(line).collect()
}

/// Values of one parameter, by contender, with its unit.
pub(super) struct ParameterRow {
    pub name: String,
    pub unit: String,
    pub values: Vec<Option<UncertainValue>>,
}

/// The parameters of all contenders, in order of first appearance.
pub(super) fn parameters(all: &FitComparison) -> Vec<ParameterRow> {
    let mut rows: Vec<ParameterRow> = Vec::new();
    for k in 0..all.contenders.len() {
        for (name, entry) in &all.contenders[k].fitted.result().parameters {
            let position = rows.iter().position(|row| row.name == *name && row.unit == entry.unit);
            let position = position.unwrap_or_else(|| {
                let values = vec![None; all.contenders.len()];
                rows.push(ParameterRow { name: name.clone(), unit: entry.unit.clone(), values });
                rows.len() - 1
            });
            let std = entry.std.unwrap_or(f64::NAN);
            rows[position].values[k] = entry.value.map(|value| UncertainValue::with(value, std));
        }
    }
    rows
}

/// Tables, then the conclusion.
pub(super) fn text(all: &FitComparison) -> String {
    let mut text = String::new();
    let number = |value: Option<f64>, digits| {
        value.map_or_else(|| "-".to_owned(), |value| significant(value, digits))
    };
    // Writing to a string cannot fail.
    let mut names: Vec<(&String, String)> =
        all.contenders.iter().map(|one| (&one.label, one.name.clone())).collect();
    let failed = all.failed.iter();
    names.extend(failed.map(|one| (&one.label, format!("{}: {}", one.name, one.reason))));
    names.sort_by_key(|(label, _)| (label.len(), *label));
    for (label, name) in names {
        let _ = writeln!(text, "{label}  {name}");
    }
    text.push('\n');
    let head = ["", "estimates", "-2 ln L", "AIC", "BIC", "errors, training", "validation", ""];
    let mut table = vec![head.map(str::to_owned)];
    let least_aic = all.least(|k| all.contenders[k].score.aic());
    let least_bic = all.least(|k| all.contenders[k].score.bic());
    for (k, contender) in all.contenders.iter().enumerate() {
        let score = &contender.score;
        let above = |own: Option<f64>, least: Option<f64>| {
            let above = own.zip(least).map(|(own, least)| own - least);
            above.map_or_else(|| "-".to_owned(), |above| format!("+{above:.1}"))
        };
        let status = Some(contender.fitted.result().status);
        table.push([
            contender.label.clone(),
            score.estimates.to_string(),
            score.deviance.map_or_else(|| "-".to_owned(), |deviance| format!("{deviance:.1}")),
            above(score.aic(), least_aic.and_then(|k| all.contenders[k].score.aic())),
            above(score.bic(), least_bic.and_then(|k| all.contenders[k].score.bic())),
            number(all.relative_error(k, false), 3),
            number(all.relative_error(k, true), 3),
            status
                .filter(|status| *status != FitStatus::Done)
                .map_or("", FitStatus::name)
                .to_owned(),
        ]);
    }
    let dashes = || std::iter::repeat_n("-".to_owned(), 6);
    for one in &all.failed {
        let cells = [one.label.clone()].into_iter().chain(dashes());
        let cells: Vec<String> = cells.chain(["failed".to_owned()]).collect();
        table.extend(<[String; 8]>::try_from(cells));
    }
    table[1..].sort_by_key(|row| (row[0].len(), row[0].clone()));
    push_table(&mut text, &table);
    let first = &all.contenders[0].label;
    let _ = writeln!(text, "AIC and BIC above the least of them; errors over those of {first}\n");
    push_outputs(&mut text, all);
    let labels = all.contenders.iter().map(|one| one.label.clone());
    let mut table = vec![
        ["parameter".to_owned(), "unit".to_owned()].into_iter().chain(labels).collect::<Vec<_>>(),
    ];
    for row in parameters(all) {
        let values = row.values.iter();
        let values = values.map(|one| one.map_or_else(|| "-".to_owned(), |one| one.to_string()));
        table.push([row.name.clone(), row.unit.clone()].into_iter().chain(values).collect());
    }
    if table.len() > 1 {
        text.push('\n');
        push_table(&mut text, &table);
    }
    text.push('\n');
    for line in ratios(all) {
        let _ = writeln!(text, "{line}");
    }
    let _ = writeln!(text, "{}", sentence(all));
    text
}

/// rms and fit of each output in training and validation.
fn push_outputs(text: &mut String, all: &FitComparison) {
    let mut head = vec!["output".to_owned(), "unit".to_owned()];
    for what in ["rms train", "rms valid", "fit valid %"] {
        head.extend(all.contenders.iter().map(|one| format!("{what} {}", one.label)));
    }
    let mut table = vec![head];
    for (i, (name, unit)) in all.outputs().enumerate() {
        let mut row = vec![name.to_owned(), unit.to_owned()];
        let mut push = |is_valid, number: &dyn Fn(Agreement) -> Option<f64>, digits| {
            for k in 0..all.contenders.len() {
                let value = all.agreement(k, i, is_valid).and_then(number);
                row.push(value.map_or_else(|| "-".to_owned(), |value| significant(value, digits)));
            }
        };
        push(false, &|one| Some(one.rms), 3);
        push(true, &|one| Some(one.rms), 3);
        push(true, &|one| one.fit_percent, 4);
        table.push(row);
    }
    push_table(text, &table);
}
