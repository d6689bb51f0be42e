//! Columns over time, for files and for programs.

use std::io::{self, Write};

use serde_json::{Value, json};

use crate::result::simulate::EventEntry;
use dgd_data::Epoch;
use dgd_data::write::{OutputColumn, write_table_at};
use dgd_runtime::{Event, Solution, Unit};

/// A column of a result.
#[derive(Debug, Clone)]
pub struct NamedColumn {
    /// Its name.
    pub name: String,
    /// The display unit.
    pub unit: Unit,
    /// Its role.
    pub kind: ColumnKind,
    /// Values, SI.
    pub values: Vec<f64>,
}

/// The role of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// An input.
    Input,
    /// A state or another unknown.
    Unknown,
    /// An output.
    Output,
    /// A derivative with respect to a parameter or initial value.
    Derivative,
}

impl NamedColumn {
    /// A column of SI values.
    pub fn new(name: &str, unit: &Unit, kind: ColumnKind, values: Vec<f64>) -> Self {
        NamedColumn { name: name.to_owned(), unit: unit.clone(), kind, values }
    }

    /// Its values in its unit.
    pub fn in_unit(&self) -> Vec<f64> {
        in_unit(&self.values, &self.unit)
    }
}

/// Columns over a common time axis.
#[derive(Debug, Clone, Default)]
pub struct TimeTable {
    /// Times of the rows, s.
    pub times: Vec<f64>,
    /// The timestamp of time zero, if the data has timestamps; the table then has timestamps, too.
    pub epoch: Option<Epoch>,
    /// The columns other than time.
    pub columns: Vec<NamedColumn>,
}

impl TimeTable {
    /// Writes it as CSV.
    ///
    /// # Errors
    ///
    /// Those of `out`.
    pub fn write_csv(&self, out: &mut dyn Write) -> io::Result<()> {
        let written: Vec<OutputColumn<'_>> = self
            .columns
            .iter()
            .map(|column| OutputColumn::new(&column.name, &column.unit, &column.values))
            .collect();
        write_table_at(out, &self.times, self.epoch, &written)
    }

    /// Adds `time` and `columns` to a result for programs.
    pub fn push_json(&self, details: &mut Value) {
        let columns: Vec<Value> = self
            .columns
            .iter()
            .map(|column| {
                let unit = &column.unit;
                let values: Vec<f64> =
                    column.values.iter().map(|si| dgd_data::write::in_unit(*si, unit)).collect();
                json!({ "name": column.name, "unit": unit.symbol, "values": values })
            })
            .collect();
        if let Some(all) = details.as_object_mut() {
            if let Some(start) = self.epoch.and_then(|epoch| epoch.stamp(0.0)) {
                all.insert("start".to_owned(), json!(start));
            }
            all.insert("time".to_owned(), json!(self.times));
            all.insert("columns".to_owned(), json!(columns));
        }
    }
}

/// SI values in a unit.
pub(crate) fn in_unit(values: &[f64], unit: &Unit) -> Vec<f64> {
    values.iter().map(|value| unit.from_si(*value)).collect()
}

/// The unit of a derivative.
pub(crate) fn quotient(of: &Unit, to: &Unit) -> Unit {
    let symbol = match &*to.symbol {
        "1" => of.symbol.to_string(),
        to if to.contains(['*', '/', '·', ' ']) => format!("{}/({to})", of.symbol),
        to => format!("{}/{to}", of.symbol),
    };
    Unit { symbol: symbol.into(), factor: of.factor / to.factor, offset: 0.0 }
}

/// Number of steps per sample, for programs; `None` for adaptive steps.
pub(crate) fn per_sample(solution: &Solution) -> Option<u32> {
    Some(solution.statistics.per_sample).filter(|n| *n > 0)
}

/// The events of a run, for programs; modes of a `when` have no names.
pub(crate) fn events(solution: &Solution) -> Vec<EventEntry> {
    let event = |event: &Event| EventEntry {
        t: event.t,
        modes: event.automaton.to_string(),
        from: event.from.to_string(),
        to: event.to.to_string(),
    };
    solution.events.iter().map(event).collect()
}

/// Whether an unknown is an element of an array; results only keep outputs computed from those.
pub(crate) fn is_element(unknown: &str) -> bool {
    unknown.ends_with(']')
}

/// Whether it is the share of the two sides of a switch in a sliding mode: an unknown of the solver, which cannot be
/// measured.
pub(crate) fn is_share(unknown: &str) -> bool {
    unknown.starts_with("share(")
}

/// Whether the compiler added this: a derivative or a combination, which tables have and figures leave out.
pub(crate) fn is_added(unknown: &str) -> bool {
    unknown.ends_with(')')
}
