//! A law, as text and JSON.

use dgd_discover::{FoundLaw, LawParameter, LawRange, LawTerm, NearForm, RivalLaw};

use super::result_json::{left, number};
use crate::output::quantity::{UncertainValue, rounded, with_unit};
use crate::result::ByName;
use crate::result::discover::{
    CoefficientEntry, LawEntry, LawTermEntry, NearEntry, RangeEntry, RivalEntry,
};

/// For programs.
pub(super) fn entry(law: &FoundLaw) -> LawEntry {
    let near =
        |near: &NearForm| NearEntry { formula: near.formula.clone(), ratio: number(near.ratio) };
    LawEntry {
        terms: law.terms.iter().map(term).collect(),
        range: ranges(&law.ranges),
        near: law.near.iter().map(near).collect(),
    }
}

/// One of several rival laws, for programs.
pub(super) fn rival(law: &RivalLaw) -> RivalEntry {
    RivalEntry {
        terms: law.terms.iter().map(term).collect(),
        effects: law.effects.clone(),
        left: left(law.left),
        told_apart_by: law.told_apart_by.clone(),
    }
}

fn term(term: &LawTerm) -> LawTermEntry {
    LawTermEntry {
        target: term.target.clone(),
        formula: term.formula.clone(),
        coefficients: term.coefficients.iter().map(constant).collect(),
    }
}

/// A constant in its unit.
pub(super) fn constant(constant: &LawParameter) -> CoefficientEntry {
    CoefficientEntry {
        name: constant.name.clone(),
        value: number(constant.value / constant.unit.factor),
        unit: constant.unit.symbol.to_string(),
        std: constant.std.and_then(|std| number(std / constant.unit.factor)),
    }
}

/// Recorded ranges by name, in the quantities' units.
pub(super) fn ranges(ranges: &[LawRange]) -> ByName<RangeEntry> {
    let range = |range: &LawRange| {
        let shown = |x: f64| number(x / range.unit.factor);
        let unit = range.unit.symbol.to_string();
        (range.name.clone(), RangeEntry { low: shown(range.low), high: shown(range.high), unit })
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
