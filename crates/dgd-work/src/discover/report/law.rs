//! A law, as text and JSON.

use dgd_discover::{FoundLaw, LawParameter, LawRange, LawTerm, NearForm, RivalLaw};
use serde_json::{Map, Value, json};

use super::result_json::tidy;
use crate::output::quantity::{UncertainValue, rounded, with_unit};

/// For programs.
pub(super) fn value(law: &FoundLaw) -> Value {
    let near = |near: &NearForm| json!({ "formula": near.formula, "ratio": tidy(near.ratio) });
    json!({
        "terms": law.terms.iter().map(term).collect::<Vec<_>>(),
        "range": ranges(&law.ranges),
        "near": law.near.iter().map(near).collect::<Vec<_>>(),
    })
}

/// One of several rival laws, for programs.
pub(super) fn rival(law: &RivalLaw) -> Value {
    json!({
        "terms": law.terms.iter().map(term).collect::<Vec<_>>(),
        "effects": law.effects,
        "left": { "train": tidy(law.left.0), "valid": law.left.1.map(tidy) },
        "told_apart_by": law.told_apart_by,
    })
}

fn term(term: &LawTerm) -> Value {
    json!({
        "target": term.target,
        "formula": term.formula,
        "coefficients": term.coefficients.iter().map(constant).collect::<Vec<_>>(),
    })
}

/// A constant in its unit.
pub(super) fn constant(constant: &LawParameter) -> Value {
    json!({
        "name": constant.name,
        "value": tidy(constant.value / constant.unit.factor),
        "unit": constant.unit.symbol,
        "std": constant.std.map(|std| tidy(std / constant.unit.factor)),
    })
}

/// Recorded ranges by name, in the quantities' units.
pub(super) fn ranges(ranges: &[LawRange]) -> Map<String, Value> {
    let range = |range: &LawRange| {
        let shown = |x: f64| tidy(x / range.unit.factor);
        let (low, high) = (shown(range.low), shown(range.high));
        (range.name.clone(), json!({ "low": low, "high": high, "unit": range.unit.symbol }))
    };
    ranges.iter().map(range).collect()
}

/// The terms with their equations; code is between backticks.
pub(super) fn formula(terms: &[LawTerm]) -> String {
    let term = |term: &LawTerm| format!("`{}` in `{}`", term.formula, term.target);
    terms.iter().map(term).collect::<Vec<_>>().join(" and ")
}

/// The terms of a rival law, or its effects.
pub(super) fn rival_name(law: &RivalLaw) -> String {
    match law.effects.as_slice() {
        [] => formula(&law.terms),
        effects => effects.join(" and "),
    }
}

/// Table rows of a rival law.
pub(super) fn rival_rows(law: &RivalLaw) -> Vec<[String; 2]> {
    let name = if law.effects.is_empty() { "terms" } else { "effect" };
    let mut rows = vec![[name.to_owned(), rival_name(law)]];
    rows.extend(constant_rows(&law.terms));
    let (training, validation) = law.left;
    let validation = validation
        .map_or_else(String::new, |left| format!(", {} on validation data", rounded(left, 2)));
    let left = format!("{} times the noise variance{validation}", rounded(training, 2));
    rows.push(["leaves".to_owned(), left]);
    let test = law.told_apart_by.iter();
    rows.extend(test.map(|test| ["told apart by".to_owned(), test.clone()]));
    rows
}

fn constant_rows(terms: &[LawTerm]) -> Vec<[String; 2]> {
    let row = |one: &LawParameter| {
        let scale = one.unit.factor;
        let std = one.std.map_or(f64::NAN, |std| std / scale);
        let quantity = UncertainValue::with(one.value / scale, std);
        [one.name.clone(), with_unit(quantity, &one.unit.symbol)]
    };
    terms.iter().flat_map(|term| &term.coefficients).map(row).collect()
}

/// Rows of constants, ranges and near forms.
pub(super) fn rows(law: &FoundLaw) -> Vec<[String; 2]> {
    let mut rows = constant_rows(&law.terms);
    let range = |range: &LawRange| {
        let [low, high] = [range.low, range.high].map(|x| rounded(x / range.unit.factor, 3));
        with_unit(format!("`{}` between {low} and {high}", range.name), &range.unit.symbol)
    };
    let ranges: Vec<String> = law.ranges.iter().map(range).collect();
    if !ranges.is_empty() {
        rows.push(["holds for".to_owned(), ranges.join(", ")]);
    }
    for near in &law.near {
        let ratio = rounded(near.ratio, 4);
        rows.push(["or".to_owned(), format!("{} (rms residual × {ratio})", near.formula)]);
    }
    rows
}
