//! Tables of the estimates: values, doubts, correlations, sources of information.

use dgd_page::{Markup, PageTable, heat_map};
use serde_json::Value;

use super::remark;
use crate::output::page::{count, name, number, unit};
use crate::output::quantity::{UncertainValue, rounded, short};

/// A larger relative standard deviation is pointed out.
const VAGUE: f64 = 0.5;

/// The entries of an object; none for other values.
fn entries(value: &Value) -> impl Iterator<Item = (&String, &Value)> {
    value.as_object().into_iter().flatten()
}

/// Standard deviation relative to the magnitude of the value.
fn relative(entry: &Value) -> Option<f64> {
    let (std, value) = (entry["std"].as_f64()?, entry["value"].as_f64()?);
    (value != 0.0).then(|| std / value.abs())
}

/// The reason to doubt an estimate.
fn doubt(entry: &Value) -> Option<String> {
    if let Some(bound) = entry["at_bound"].as_str() {
        return Some(format!("at its {bound} bound"));
    }
    match relative(entry) {
        None if entry["std"].is_null() => Some("no standard deviation".to_owned()),
        Some(relative) if relative > VAGUE => {
            Some(format!("known to ± {} %", short(100.0 * relative, 2)))
        }
        _ => None,
    }
}

/// The parameters to doubt, in a sentence.
pub(super) fn doubtful(json: &Value, correlated: f64) -> String {
    let mut doubts: Vec<String> = entries(&json["parameters"])
        .filter_map(|(name, entry)| Some(format!("`{name}` ({})", doubt(entry)?)))
        .collect();
    let names = names(json);
    for (i, first) in names.iter().enumerate() {
        for (j, second) in names.iter().enumerate().skip(i + 1) {
            if let Some(r) = json["correlation"][i][j].as_f64()
                && r.abs() > correlated
            {
                let r = short(r, 3);
                doubts.push(format!("`{first}` and `{second}` one by one (correlation {r})"));
            }
        }
    }
    for combination in json["undetermined"].as_array().into_iter().flatten() {
        let names: Vec<String> = combination
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|term| Some(format!("`{}`", term["name"].as_str().or(term.as_str())?)))
            .collect();
        if names.len() > 1 {
            doubts.push(format!("{} one by one (no output tells them apart)", names.join(", ")));
        }
    }
    if !doubts.is_empty() {
        return format!("Do not rely on {}.", doubts.join("; "));
    }
    let vaguest = entries(&json["parameters"])
        .filter_map(|(name, entry)| Some((name, relative(entry)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1));
    match vaguest {
        Some((name, relative)) => format!(
            "All parameters are determined; the least certain is `{name}`, to ± {} %.",
            short(100.0 * relative, 2)
        ),
        None => "No parameters were estimated.".to_owned(),
    }
}

fn names(json: &Value) -> Vec<String> {
    let names = json["names"].as_array().map_or(&[][..], Vec::as_slice);
    names.iter().filter_map(|name| name.as_str().map(str::to_owned)).collect()
}

/// Digits of an estimate without a standard deviation.
const DIGITS: i32 = 6;

const HEAD: [&str; 5] = ["estimate", "value ± std", "unit", "± std, %", "remark"];

fn push_rows(table: &mut PageTable, values: &Value) {
    for (called, entry) in entries(values) {
        let (value, std) = (entry["value"].as_f64(), entry["std"].as_f64());
        let shown = match (value, std) {
            (None, _) => "–".to_owned(),
            (Some(value), Some(std)) if std > 0.0 => UncertainValue::new(value, std).to_string(),
            (Some(value), _) => rounded(value, DIGITS),
        };
        table.rows.push(vec![
            name(called),
            dgd_page::PageCell::number(&shown, value),
            unit(entry["unit"].as_str().unwrap_or_default()),
            number(relative(entry).map(|relative| 100.0 * relative), 2),
            remark(&doubt(entry).unwrap_or_default()),
        ]);
    }
}

/// The estimated parameters.
pub(super) fn table(json: &Value) -> Markup {
    let mut table = PageTable::new("Estimated parameters", &HEAD);
    push_rows(&mut table, &json["parameters"]);
    table.to_markup()
}

/// Estimated initial values, recording by recording.
pub(super) fn starts(json: &Value) -> Markup {
    let mut tables = Markup::default();
    for of in json["starts"].as_array().into_iter().flatten() {
        let data = of["data"].as_str().unwrap_or_default();
        let mut table = PageTable::new(&format!("Start values of {data}"), &HEAD);
        push_rows(&mut table, &of["values"]);
        if !table.rows.is_empty() {
            let heading = format!("<h3>Start values of {}</h3>\n", Markup::code(data));
            tables = tables.then(&Markup::trusted(heading)).then(&table.to_markup());
        }
    }
    tables
}

/// The correlation matrix in colours, so that strong correlations stand out.
pub(super) fn correlation(json: &Value) -> Markup {
    let names = names(json);
    if names.len() < 2 || json["correlation"].as_array().is_none_or(Vec::is_empty) {
        return Markup::default();
    }
    let value = |i: usize, j: usize| json["correlation"][i][j].as_f64();
    let note = "Coloured from ± 0.3, 0.7 and 0.95: the stronger, the less can be said of one without the other.";
    heat_map("Correlation of the estimates", &names, value).then(&Markup::text(note).caption())
}

/// The information on each estimate from steady operation and from transients, and where most of it comes from.
pub(super) fn information(json: &Value) -> Markup {
    let head = ["estimate", "at rest, %", "transients, %", "most at, s", "in", "of"];
    let mut table = PageTable::new("Which data determines the parameters", &head);
    for (called, entry) in entries(&json["information"]) {
        let part = |key: &str| number(entry[key].as_f64().map(|part| 100.0 * part), 3);
        let best = &entry["best"];
        table.rows.push(vec![
            name(called),
            part("steady"),
            part("transient"),
            number(best["time"].as_f64(), 5),
            name(best["data"].as_str().unwrap_or_default()),
            name(best["output"].as_str().unwrap_or_default()),
        ]);
    }
    table.to_markup()
}

/// The steady operating points of the recordings.
pub(super) fn operating_points(json: &Value) -> Markup {
    let points = json["operating_points"].as_array().map_or(&[][..], Vec::as_slice);
    let Some(first) = points.first() else { return Markup::default() };
    let quantities = |point: &Value| -> Vec<(String, Option<f64>, String)> {
        ["inputs", "outputs"]
            .iter()
            .flat_map(|key| {
                entries(&point[*key]).map(|(name, entry)| {
                    let unit = entry["unit"].as_str().unwrap_or_default().to_owned();
                    (name.clone(), entry["value"].as_f64(), unit)
                })
            })
            .collect()
    };
    let mut table = PageTable::new("Operating points", &[]);
    table.head = vec![Markup::text("point"), Markup::text("samples, %")];
    table.head.extend(
        quantities(first)
            .iter()
            .map(|(name, _, unit)| Markup::code(name).then(&Markup::text(&format!(" [{unit}]")))),
    );
    for (k, point) in points.iter().enumerate() {
        let mut row =
            vec![count(k + 1), number(point["share"].as_f64().map(|share| 100.0 * share), 3)];
        row.extend(quantities(point).into_iter().map(|(_, value, _)| number(value, 4)));
        table.rows.push(row);
    }
    table.to_markup()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_is_not_to_be_believed_is_named_with_the_reason() {
        let parameter = |value: f64, std: Option<f64>, bound: Option<&str>| json!({ "value": value, "unit": "m", "std": std, "at_bound": bound });
        let json = json!({
            "parameters": {
                "a": parameter(2.0, Some(0.1), None),
                "b": parameter(1.0, Some(0.8), None),
                "c": parameter(5.0, None, Some("upper")),
                "d": parameter(5.0, None, None),
            },
            "names": ["a", "b"],
            "correlation": [[1.0, -0.99], [-0.99, 1.0]],
            "undetermined": [[{ "name": "c" }, { "name": "d" }]],
        });
        assert_eq!(
            doubtful(&json, 0.95),
            "Do not rely on `b` (known to ± 80 %); `c` (at its upper bound); `d` (no standard deviation); \
             `a` and `b` one by one (correlation −0.99); `c`, `d` one by one (no output tells them apart)."
        );
        let fine = json!({ "parameters": { "a": parameter(-2.0, Some(0.1), None) } });
        assert!(doubtful(&fine, 0.95).ends_with("the least certain is `a`, to ± 5 %."));
    }
}
