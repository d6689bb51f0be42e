//! Rows of estimates as lines, and as a figure.

use std::io::{self, Write};

use dgd_data::Epoch;
use dgd_data::write::{OutputColumn, write_header, write_rows};
use dgd_identify::filter::{FilterProblem, InnovationAlarm, TrackedEstimate, TrackedRow};
use dgd_plot::{Envelope, Figure, MathText, Panel, PlotSeries, SeriesStyle};
use dgd_runtime::Unit;
use serde_json::{Value, json};

/// Bands are drawn no wider than this many times their median, so that the initial uncertainty does not dwarf the rest.
const MOST_BAND: f64 = 5.0;

/// A quantity with a column.
struct ColumnQuantity {
    name: String,
    unit: Unit,
    /// The unit of its differences, which has no offset.
    difference: Unit,
}

impl ColumnQuantity {
    fn new(name: &str, unit: &Unit) -> Self {
        let difference = Unit { offset: 0.0, ..unit.clone() };
        ColumnQuantity { name: name.to_owned(), unit: unit.clone(), difference }
    }
}

/// The columns of a row.
pub(super) struct RowReport {
    states: Vec<ColumnQuantity>,
    parameters: Vec<ColumnQuantity>,
    /// Outputs in use, with their indices.
    outputs: Vec<(usize, ColumnQuantity)>,
    /// The timestamp of time zero, if times are timestamps.
    epoch: Option<Epoch>,
}

impl RowReport {
    pub(super) fn new(problem: &FilterProblem<'_>, used: &[bool], epoch: Option<Epoch>) -> Self {
        let signature = problem.system.signature();
        let states = problem.states().into_iter();
        let states = states
            .map(|i| ColumnQuantity::new(&signature.unknowns.name(i), signature.unknowns.unit(i)));
        let parameters = problem.parameters().into_iter().map(|i| &signature.parameters[i]);
        let outputs = signature.outputs.iter().enumerate().filter(|(i, _)| used[*i]);
        RowReport {
            states: states.collect(),
            parameters: parameters.map(|p| ColumnQuantity::new(&p.name, &p.unit)).collect(),
            outputs: outputs.map(|(i, w)| (i, ColumnQuantity::new(&w.name, &w.unit))).collect(),
            epoch,
        }
    }

    /// The header line.
    pub(super) fn header(&self, out: &mut dyn Write) -> io::Result<()> {
        self.with_columns(None, |columns| write_header(out, columns))
    }

    /// The line of a row.
    pub(super) fn line(&self, row: &TrackedRow, out: &mut dyn Write) -> io::Result<()> {
        self.with_columns(Some(row), |columns| write_rows(out, columns))
    }

    /// Columns: time; value and standard deviation of states and parameters; innovation and its expected standard
    /// deviation of outputs; the normalised square of the innovations.
    fn with_columns<T>(
        &self,
        row: Option<&TrackedRow>,
        write: impl FnOnce(&[OutputColumn<'_>]) -> T,
    ) -> T {
        let seconds = Unit { symbol: "s".into(), factor: 1.0, offset: 0.0 };
        let one = Unit { symbol: "1".into(), factor: 1.0, offset: 0.0 };
        let mut cells: Vec<(String, &Unit, [f64; 1])> = Vec::new();
        let none = TrackedEstimate { value: f64::NAN, std: f64::NAN };
        cells.push(("time".to_owned(), &seconds, [row.map_or(f64::NAN, |row| row.t)]));
        let states = self.states.iter().enumerate();
        let states = states.map(|(k, of)| (of, row.map_or(none, |row| row.states[k])));
        let parameters = self.parameters.iter().enumerate();
        let parameters = parameters.map(|(k, of)| (of, row.map_or(none, |row| row.parameters[k])));
        for (of, tracked) in states.chain(parameters) {
            cells.push((of.name.clone(), &of.unit, [tracked.value]));
            cells.push((format!("std({})", of.name), &of.difference, [tracked.std]));
        }
        for (i, of) in &self.outputs {
            let innovation = row.and_then(|row| row.innovations[*i]);
            let value = innovation.map_or(f64::NAN, |innovation| innovation.value);
            let std = innovation.map_or(f64::NAN, |innovation| innovation.std);
            cells.push((format!("innovation({})", of.name), &of.difference, [value]));
            cells.push((format!("std(innovation({}))", of.name), &of.difference, [std]));
        }
        let square = row.filter(|row| row.samples > 0).map(|row| row.normalised_square);
        cells.push(("nis".to_owned(), &one, [square.unwrap_or(f64::NAN)]));
        let mut columns: Vec<OutputColumn<'_>> = cells
            .iter()
            .map(|(name, unit, values)| OutputColumn::new(name, unit, values))
            .collect();
        columns[0].epoch = self.epoch;
        write(&columns)
    }

    /// A row for programs.
    pub(super) fn json(&self, row: &TrackedRow) -> Value {
        let tracked = |subjects: &[ColumnQuantity], rows: &[TrackedEstimate]| -> Value {
            let entries = subjects.iter().zip(rows).map(|(of, tracked)| {
                let value = of.unit.from_si(tracked.value);
                let std = tracked.std / of.unit.factor.abs();
                (of.name.clone(), json!({ "value": value, "std": std, "unit": of.unit.symbol }))
            });
            entries.collect::<serde_json::Map<_, _>>().into()
        };
        let innovations = self.outputs.iter().filter_map(|(i, of)| {
            let innovation = row.innovations[*i]?;
            let entry = json!({
                "value": innovation.value / of.unit.factor,
                "std": innovation.std / of.unit.factor.abs(),
                "unit": of.unit.symbol,
                "used": innovation.used,
            });
            Some((of.name.clone(), entry))
        });
        let innovations: Value = innovations.collect::<serde_json::Map<_, _>>().into();
        json!({
            "time": row.t,
            "states": tracked(&self.states, &row.states),
            "parameters": tracked(&self.parameters, &row.parameters),
            "innovations": innovations,
            "nis": (row.samples > 0).then_some(row.normalised_square),
            "failure": row.failure.as_ref().map(ToString::to_string),
            "alarm": row.alarm.map(|alarm| match alarm {
                InnovationAlarm::Diverged { .. } => "diverged",
                InnovationAlarm::Recovered => "recovered",
            }),
        })
    }

    /// Estimates with ± 2 standard deviations, then innovations with their expected ones.
    pub(super) fn figure(&self, rows: &[TrackedRow]) -> Figure {
        let times: Vec<f64> = rows.iter().map(|row| row.t).collect();
        let states = self.states.iter().enumerate();
        let states = states.map(|(k, of)| (of, rows.iter().map(|row| row.states[k]).collect()));
        let parameters = self.parameters.iter().enumerate();
        let parameters =
            parameters.map(|(k, of)| (of, rows.iter().map(|row| row.parameters[k]).collect()));
        let mut panels: Vec<Panel> = states
            .chain(parameters)
            .map(|(of, tracked): (&ColumnQuantity, Vec<TrackedEstimate>)| {
                let most = MOST_BAND * median(tracked.iter().map(|tracked| tracked.std));
                let bound =
                    |t: &TrackedEstimate, k: f64| of.unit.from_si(t.value + k * t.std.min(most));
                let edge = |k: f64| tracked.iter().map(|t| bound(t, k)).collect();
                panel(of, &times, edge(0.0), edge(-2.0), edge(2.0), SeriesStyle::Line)
            })
            .collect();
        for (i, of) in &self.outputs {
            let expected = rows.iter().filter_map(|row| Some(row.innovations[*i]?.std));
            let most = MOST_BAND * median(expected);
            let edge = |pick: fn(f64, f64) -> f64| -> Vec<f64> {
                let of_row = |row: &TrackedRow| {
                    let innovation = row.innovations[*i];
                    let std = |std: f64| std.min(most);
                    innovation.map_or(f64::NAN, |it| pick(it.value, std(it.std)) / of.unit.factor)
                };
                rows.iter().map(of_row).collect()
            };
            let (low, high) = (edge(|_, std| -2.0 * std), edge(|_, std| 2.0 * std));
            let mut panel = panel(of, &times, edge(|value, _| value), low, high, SeriesStyle::Dots);
            panel.title = MathText::plain("innovation of ").then(MathText::name(&of.name));
            panels.push(panel);
        }
        Figure::new(MathText::plain("Time").with_unit("s"), panels)
    }
}

/// The median of some numbers; infinity without any.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    if values.is_empty() {
        return f64::INFINITY;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn panel(
    of: &ColumnQuantity,
    times: &[f64],
    values: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
    style: SeriesStyle,
) -> Panel {
    let name = MathText::default();
    Panel {
        title: MathText::name(&of.name),
        y_label: MathText::default().with_unit(&of.unit.symbol),
        series: vec![PlotSeries::new(name.clone(), style, times.to_vec(), values)],
        envelopes: vec![Envelope { name, around: Some(0), x: times.to_vec(), low, high }],
        ..Panel::default()
    }
}
