//! Tables of the estimates: values, doubts, correlations, sources of information.

use dgd_page::{Markup, PageTable, heat_map};

use super::remark;
use crate::output::page::{count, name, number, unit};
use crate::output::quantity::{UncertainValue, rounded, short};
use crate::result::ByName;
use crate::result::fit::{
    EstimateEntry, FitDocument, OperatingPointEntry, RecordingValues, ValueEntry,
};

/// A larger relative standard deviation is pointed out.
const VAGUE: f64 = 0.5;

/// Standard deviation relative to the magnitude of the value.
fn relative(entry: &EstimateEntry) -> Option<f64> {
    let (std, value) = (entry.std?, entry.value?);
    (value != 0.0).then(|| std / value.abs())
}

/// The reason to doubt an estimate.
fn doubt(entry: &EstimateEntry) -> Option<String> {
    if let Some(bound) = entry.at_bound {
        return Some(format!("at its {} bound", bound.name()));
    }
    match relative(entry) {
        None if entry.std.is_none() => Some("no standard deviation".to_owned()),
        Some(relative) if relative > VAGUE => {
            Some(format!("known to ± {} %", short(100.0 * relative, 2)))
        }
        _ => None,
    }
}

/// The parameters to doubt, in a sentence.
pub(super) fn doubtful(result: &FitDocument, correlated: f64) -> String {
    let mut doubts: Vec<String> = result
        .parameters
        .iter()
        .filter_map(|(name, entry)| Some(format!("`{name}` ({})", doubt(entry)?)))
        .collect();
    let names = result.names.as_deref().unwrap_or_default();
    for (i, first) in names.iter().enumerate() {
        for (j, second) in names.iter().enumerate().skip(i + 1) {
            if let Some(r) = result.correlation_of(i, j)
                && r.abs() > correlated
            {
                let r = short(r, 3);
                doubts.push(format!("`{first}` and `{second}` one by one (correlation {r})"));
            }
        }
    }
    for combination in &result.undetermined {
        let names: Vec<String> =
            combination.iter().map(|term| format!("`{}`", term.name())).collect();
        if names.len() > 1 {
            doubts.push(format!("{} one by one (no output tells them apart)", names.join(", ")));
        }
    }
    if !doubts.is_empty() {
        return format!("Do not rely on {}.", doubts.join("; "));
    }
    let vaguest = result
        .parameters
        .iter()
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

/// Digits of an estimate without a standard deviation.
const DIGITS: i32 = 6;

const HEAD: [&str; 5] = ["estimate", "value ± std", "unit", "± std, %", "remark"];

fn push_rows(table: &mut PageTable, estimates: &ByName<EstimateEntry>) {
    for (called, entry) in estimates {
        let shown = match (entry.value, entry.std) {
            (None, _) => "–".to_owned(),
            (Some(value), Some(std)) if std > 0.0 => UncertainValue::new(value, std).to_string(),
            (Some(value), _) => rounded(value, DIGITS),
        };
        table.rows.push(vec![
            name(called),
            dgd_page::PageCell::number(&shown, entry.value),
            unit(&entry.unit),
            number(relative(entry).map(|relative| 100.0 * relative), 2),
            remark(&doubt(entry).unwrap_or_default()),
        ]);
    }
}

/// The estimated parameters.
pub(super) fn table(result: &FitDocument) -> Markup {
    let mut table = PageTable::new("Estimated parameters", &HEAD);
    push_rows(&mut table, &result.parameters);
    table.to_markup()
}

/// Estimated initial values, recording by recording.
pub(super) fn starts(result: &FitDocument) -> Markup {
    let mut tables = Markup::default();
    for RecordingValues { data, values } in result.starts.iter().flatten() {
        let mut table = PageTable::new(&format!("Start values of {data}"), &HEAD);
        push_rows(&mut table, values);
        if !table.rows.is_empty() {
            let heading = format!("<h3>Start values of {}</h3>\n", Markup::code(data));
            tables = tables.then(&Markup::trusted(heading)).then(&table.to_markup());
        }
    }
    tables
}

/// The correlation matrix in colours, so that strong correlations stand out.
pub(super) fn correlation(result: &FitDocument) -> Markup {
    let names = result.names.as_deref().unwrap_or_default();
    if names.len() < 2 {
        return Markup::default();
    }
    let value = |i: usize, j: usize| result.correlation_of(i, j);
    let note = "Coloured from ± 0.3, 0.7 and 0.95: the stronger, the less can be said of one without the other.";
    heat_map("Correlation of the estimates", names, value).then(&Markup::text(note).caption())
}

/// The information on each estimate from steady operation and from transients, and where most of it comes from.
pub(super) fn information(result: &FitDocument) -> Markup {
    let head = ["estimate", "at rest, %", "transients, %", "most at, s", "in", "of"];
    let mut table = PageTable::new("Which data determines the parameters", &head);
    for (called, entry) in result.information.iter().flat_map(ByName::iter) {
        let percent = |part: Option<f64>| number(part.map(|part| 100.0 * part), 3);
        let best = entry.best.as_ref();
        table.rows.push(vec![
            name(called),
            percent(entry.steady),
            percent(entry.transient),
            number(best.map(|best| best.time), 5),
            name(best.map_or("", |best| &best.data)),
            name(best.map_or("", |best| &best.output)),
        ]);
    }
    table.to_markup()
}

/// The steady operating points of the recordings.
pub(super) fn operating_points(result: &FitDocument) -> Markup {
    let points = result.operating_points.as_deref().unwrap_or_default();
    let Some(first) = points.first() else { return Markup::default() };
    let quantities = |point: &OperatingPointEntry| -> Vec<(String, ValueEntry)> {
        let all = point.inputs.iter().chain(point.outputs.iter());
        all.map(|(name, entry)| (name.to_owned(), entry.clone())).collect()
    };
    let mut table = PageTable::new("Operating points", &[]);
    table.head = vec![Markup::text("point"), Markup::text("samples, %")];
    table.head.extend(quantities(first).iter().map(|(name, entry)| {
        Markup::code(name).then(&Markup::text(&format!(" [{}]", entry.unit)))
    }));
    for (k, point) in points.iter().enumerate() {
        let mut row = vec![count(k + 1), number(point.share.map(|share| 100.0 * share), 3)];
        row.extend(quantities(point).into_iter().map(|(_, entry)| number(entry.value, 4)));
        table.rows.push(row);
    }
    table.to_markup()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::result::fit::tests::with;

    #[test]
    fn what_is_not_to_be_believed_is_named_with_the_reason() {
        let parameter = |value: f64, std: Option<f64>, bound: Option<&str>| json!({ "value": value, "unit": "m", "std": std, "at_bound": bound });
        let result = with(&json!({
            "parameters": {
                "a": parameter(2.0, Some(0.1), None),
                "b": parameter(1.0, Some(0.8), None),
                "c": parameter(5.0, None, Some("upper")),
                "d": parameter(5.0, None, None),
            },
            "names": ["a", "b"],
            "correlation": [[1.0, -0.99], [-0.99, 1.0]],
            "undetermined": [[{ "name": "c", "relative_change": 1.0 }, { "name": "d", "relative_change": 1.0 }]],
        }));
        assert_eq!(
            doubtful(&result, 0.95),
            "Do not rely on `b` (known to ± 80 %); `c` (at its upper bound); `d` (no standard deviation); \
             `a` and `b` one by one (correlation −0.99); `c`, `d` one by one (no output tells them apart)."
        );
        let fine = with(&json!({ "parameters": { "a": parameter(-2.0, Some(0.1), None) } }));
        assert!(doubtful(&fine, 0.95).ends_with("the least certain is `a`, to ± 5 %."));
    }
}
