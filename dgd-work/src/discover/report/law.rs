//! A law that was found, in words and for programs.

use dgd_discover::{FoundLaw, LawParameter, LawRange, LawTerm, NearForm};
use serde_json::{Map, Value, json};

use super::result_json::tidy;
use crate::output::quantity::{Quantity, rounded, with_unit};

/// For programs.
pub(super) fn value(law: &FoundLaw) -> Value {
    let term = |term: &LawTerm| {
        json!({
            "target": term.target,
            "formula": term.formula,
            "coefficients": term.coefficients.iter().map(constant).collect::<Vec<_>>(),
        })
    };
    let near = |near: &NearForm| json!({ "formula": near.formula, "ratio": tidy(near.ratio) });
    json!({
        "terms": law.terms.iter().map(term).collect::<Vec<_>>(),
        "range": ranges(&law.ranges),
        "near": law.near.iter().map(near).collect::<Vec<_>>(),
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
pub(super) fn formula(law: &FoundLaw) -> String {
    let term = |term: &LawTerm| format!("`{}` in `{}`", term.formula, term.target);
    law.terms.iter().map(term).collect::<Vec<_>>().join(" and ")
}

/// Rows of constants, ranges and near forms.
pub(super) fn rows(law: &FoundLaw) -> Vec<[String; 2]> {
    let constants = law.terms.iter().flat_map(|term| &term.coefficients);
    let constant = |one: &LawParameter| {
        let scale = one.unit.factor;
        let std = one.std.map_or(f64::NAN, |std| std / scale);
        let quantity = Quantity::with(one.value / scale, std);
        [one.name.clone(), with_unit(quantity, &one.unit.symbol)]
    };
    let mut rows: Vec<[String; 2]> = constants.map(constant).collect();
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
