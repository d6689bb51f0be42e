//! Steady intervals as a table: `steady.csv`.

use dgd_data::cell::{push_number, quoted};

use super::ScreenedRecording;

/// Each steady interval with the mean of every column and its standard error, over the columns of all recordings.
/// Without a time column the rows are independent, as fits of static models expect.
pub(super) fn steady(screened: &[ScreenedRecording]) -> String {
    let mut heads: Vec<(String, String)> = Vec::new();
    for column in screened.iter().flat_map(|one| &one.table.columns) {
        let unit = column.unit.as_ref().map_or(String::new(), |unit| format!(" [{}]", unit.symbol));
        if !heads.iter().any(|(name, _)| *name == column.name) {
            heads.push((column.name.clone(), unit));
        }
    }
    let mut text = "recording,from [s],until [s],point".to_owned();
    for (name, unit) in &heads {
        let spread = unit_of_spread(unit);
        for cell in [format!("{name}{unit}"), format!("std({name}){spread}")] {
            text.push(',');
            text.push_str(&quoted(&cell));
        }
    }
    text.push('\n');
    for (at, one) in screened.iter().enumerate() {
        for (k, steady) in one.screening.motion.steady.iter().enumerate() {
            let point = one.screening.points.iter().position(|p| p.stretches.contains(&k));
            push_number(&mut text, (at + 1) as f64);
            for value in [steady.stretch.from, steady.stretch.until] {
                text.push(',');
                push_number(&mut text, value);
            }
            text.push(',');
            if let Some(point) = point {
                push_number(&mut text, (point + 1) as f64);
            }
            for (name, _) in &heads {
                let column = one.table.columns.iter().position(|column| column.name == *name);
                let mean = column.and_then(|i| steady.means[i]);
                for value in [mean.map(|m| m.value), mean.map(|m| m.std_error)] {
                    text.push(',');
                    if let Some(value) = value {
                        push_number(&mut text, value);
                    }
                }
            }
            text.push('\n');
        }
    }
    text
}

/// The unit of a standard error: that of differences.
fn unit_of_spread(unit: &str) -> String {
    let symbol = unit.trim().trim_start_matches('[').trim_end_matches(']');
    match dgd_compiler::units::parse_unit(symbol) {
        Ok(parsed) if !symbol.is_empty() => format!(" [{}]", parsed.of_differences().symbol),
        _ => unit.to_owned(),
    }
}
