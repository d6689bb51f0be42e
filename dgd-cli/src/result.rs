//! A table as a command's result: a CSV file, CSV text or JSON.

use dgd_runtime::{Event, Solution, Unit};
use serde_json::{Value, json};

use crate::console::{Console, print};
use crate::data::write::{Written, save_table, write_table};
use crate::failure::CommandError;

/// A column of a result.
#[derive(Debug, Clone)]
pub(crate) struct NamedColumn {
    pub name: String,
    pub unit: Unit,
    /// Values, SI.
    pub values: Vec<f64>,
}

impl NamedColumn {
    pub(crate) fn new(name: &str, unit: &Unit, values: Vec<f64>) -> Self {
        NamedColumn { name: name.to_owned(), unit: unit.clone(), values }
    }
}

/// Writes a table: as CSV to `--out`, else to standard output, where it is left out if a picture
/// was drawn instead. With `--format json`, `details` and the columns go to standard output.
pub(crate) fn write(
    console: Console<'_>,
    times: &[f64],
    columns: &[NamedColumn],
    details: &Value,
    drawn: bool,
) -> Result<(), CommandError> {
    let written: Vec<Written<'_>> = columns
        .iter()
        .map(|column| Written { name: &column.name, unit: &column.unit, values: &column.values })
        .collect();
    if let Some(path) = console.out() {
        save_table(path, Some(times), &written)?;
        console.remark(&format!("wrote {} ({} rows)", path.display(), times.len()));
        if console.is_json() {
            return print(&format!("{details:#}\n"));
        }
        return Ok(());
    }
    if console.is_json() {
        let columns: Vec<Value> = columns
            .iter()
            .map(|column| {
                let unit = &column.unit;
                let values: Vec<f64> =
                    column.values.iter().map(|v| (v - unit.offset) / unit.factor).collect();
                json!({ "name": column.name, "unit": unit.symbol, "values": values })
            })
            .collect();
        let mut all = details.clone();
        if let Some(all) = all.as_object_mut() {
            all.insert("time".to_owned(), json!(times));
            all.insert("columns".to_owned(), json!(columns));
        }
        return print(&format!("{all:#}\n"));
    }
    if drawn {
        return Ok(());
    }
    let mut text = Vec::new();
    write_table(&mut text, Some(times), &written)
        .map_err(|error| CommandError::Found(error.to_string()))?;
    print(&String::from_utf8_lossy(&text))
}

/// What happened at events, for `--format json`: the modes of a `when` have no names.
pub(crate) fn events(solution: &Solution) -> Vec<Value> {
    let event = |event: &Event| {
        json!({
            "t": event.t,
            "modes": event.automaton,
            "from": event.from,
            "to": event.to,
        })
    };
    solution.events.iter().map(event).collect()
}
