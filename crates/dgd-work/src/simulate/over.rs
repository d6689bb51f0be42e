//! Outputs drawn over another quantity than time, such as characteristic curves.

use dgd_compiler::argument::{Argument, ArgumentUse};
use dgd_plot::{Figure, MathText, Panel, PlotSeries, PointLabel, SeriesMeaning, SeriesStyle};
use dgd_runtime::{Signature, Unit};

use super::SimulationResult;
use crate::error::{UsageError, WorkError};
use crate::output::columns::{in_unit, is_element};
use crate::output::quantity::rounded;
use crate::output::{ColumnKind, NamedColumn, TimeTable};
use crate::request::SimulateRequest;

/// Rows for a smooth curve.
const SMOOTH: usize = 400;

/// Digits of the value at the end of a curve.
const DIGITS: i32 = 4;

/// Plots of outputs over another quantity.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Sweep {
    /// The quantity.
    pub over: String,
    /// Arrays of curves, each with the array whose values label their ends.
    pub labels: Vec<(String, String)>,
    /// Abscissas and ordinates of marked points.
    pub marks: Vec<(String, String)>,
    /// The same run with enough rows for smooth curves, if the result has fewer.
    pub(super) fine: Option<TimeTable>,
}

impl Sweep {
    /// The requested sweep, if any; checked before anything is computed.
    pub(super) fn from_request(
        request: &SimulateRequest,
        signature: &Signature,
    ) -> Result<Option<Sweep>, WorkError> {
        let Some(over) = &request.over else { return Ok(None) };
        verify(over, signature)?;
        let sweep = Sweep {
            over: over.clone(),
            labels: request.labels.clone(),
            marks: request.marks.clone(),
            fine: None,
        };
        for (curves, by) in &sweep.labels {
            let given = Argument::Label.with(format!("{curves}={by}"));
            verify_pairs(&given, [curves, by], signature)?;
        }
        for (x, y) in &sweep.marks {
            let given = Argument::Mark.with(format!("{x},{y}"));
            verify_pairs(&given, [x, y], signature)?;
            if let (Some(own), Some(axis)) = (unit_of(x, signature), unit_of(over, signature))
                && own != axis
            {
                let (x, unit, over) = (x.clone(), own, over.clone());
                return Err(UsageError::MarksOffAxis { given, x, unit, over, axis }.into());
            }
        }
        Ok(Some(sweep))
    }

    /// Whether a quantity is shown by labels or marks instead of a curve.
    fn hides(&self, name: &str) -> bool {
        let labels = self.labels.iter().map(|(_, by)| by);
        let points = self.marks.iter().flat_map(|(x, y)| [x, y]);
        labels.chain(points).any(|hidden| base(name) == hidden)
    }
}

/// Rows between the given ones for smooth curves; `None` if there are enough.
pub(super) fn between(rows: &[f64]) -> Option<Vec<f64>> {
    let stretches = rows.windows(2).filter(|pair| pair[1] > pair[0]).count();
    if stretches == 0 || rows.len() >= SMOOTH {
        return None;
    }
    let parts = SMOOTH.div_ceil(stretches);
    let mut times = vec![rows[0]];
    for pair in rows.windows(2) {
        let step = (pair[1] - pair[0]) / parts as f64;
        if step > 0.0 {
            times.extend((1..parts).map(|k| pair[0] + k as f64 * step).filter(|t| *t < pair[1]));
        }
        times.push(pair[1]);
    }
    Some(times)
}

/// The array of an element, or the name itself.
fn base(name: &str) -> &str {
    if is_element(name) { name.split('[').next().unwrap_or(name) } else { name }
}

/// The display unit of a quantity, or of each element of an array.
fn unit_of(name: &str, signature: &Signature) -> Option<String> {
    let shown = |name: &str, unit: &Unit| (base(name).to_owned(), unit.symbol.to_string());
    let outputs = signature.outputs.iter().map(|output| shown(&output.name, &output.unit));
    let inputs = signature.inputs.iter().map(|input| shown(&input.name, &input.unit));
    let unknowns = signature.unknowns.iter().map(|unknown| shown(&unknown.name, &unknown.unit));
    let mut quantities = outputs.chain(inputs).chain(unknowns);
    quantities.find(|(other, _)| other == name).map(|(_, unit)| unit)
}

/// Checks, before anything is computed, that the quantity exists.
fn verify(name: &str, signature: &Signature) -> Result<(), WorkError> {
    let inputs = signature.inputs.iter().map(|input| input.name.to_string());
    let unknowns = signature.unknowns.iter().map(|unknown| unknown.name.to_string());
    let unknowns = unknowns.filter(|name| !is_element(name));
    let outputs = signature.outputs.iter().map(|output| output.name.to_string());
    let known: Vec<String> = inputs.chain(unknowns).chain(outputs).collect();
    if known.iter().any(|known| known == name) {
        return Ok(());
    }
    let given = Some(Argument::Over.with(name));
    let (kind, name) = ("input, state or output", name.to_owned());
    Err(UsageError::Unknown { given, kind, name, known }.into())
}

/// Checks that two outputs, or arrays of outputs, match element by element.
fn verify_pairs(
    given: &ArgumentUse,
    names: [&str; 2],
    signature: &Signature,
) -> Result<(), WorkError> {
    let mut known: Vec<&str> = signature.outputs.iter().map(|output| base(&output.name)).collect();
    let count = |name: &str| known.iter().filter(|known| **known == name).count();
    let [first, second] = names.map(count);
    let missing = names.into_iter().find(|name| count(name) == 0);
    let given = given.clone();
    Err(match missing {
        Some(name) => {
            known.dedup();
            let known = known.into_iter().map(str::to_owned).collect();
            let (kind, name) = ("output", name.to_owned());
            UsageError::Unknown { given: Some(given), kind, name, known }
        }
        None if first != second => {
            let arrays = [(names[0].to_owned(), first), (names[1].to_owned(), second)];
            UsageError::UnequalLengths { given, arrays }
        }
        None => return Ok(()),
    }
    .into())
}

/// Over a column of the result: a panel for each measured output, with dots for the samples at rows of the result,
/// drawn over the measurements of that column if it has some; and one for each unit of the other outputs, in which an
/// array is one family of curves. No two curves or families share a colour, in any panel.
pub(super) fn figure(sweep: &Sweep, simulated: &SimulationResult) -> Option<Figure> {
    let name = &sweep.over;
    let table = sweep.fine.as_ref().unwrap_or(&simulated.table);
    let outputs = || table.columns.iter().filter(|column| column.kind == ColumnKind::Output);
    let abscissa = table.columns.iter().find(|column| column.name == *name)?;
    let x = abscissa.in_unit();
    let measured = |i: usize| {
        let samples = simulated.measured.outputs.get(i)?.as_ref()?;
        Some(measured_at(&table.times, &simulated.measured.times, samples))
    };
    let measured_x = (outputs().position(|output| output.name == *name))
        .and_then(measured)
        .map_or_else(|| x.clone(), |samples| in_unit(&samples, &abscissa.unit));
    let mut panels = SweepPanels::default();
    let mut places = 0..;
    let mut alike = || SeriesMeaning::Variant(places.next().unwrap_or_default());
    for (i, output) in outputs().enumerate() {
        if output.name == *name || sweep.hides(&output.name) {
            continue;
        }
        if let Some(samples) = measured(i) {
            let values = in_unit(&samples, &output.unit);
            panels.add_measured(output, &x, &measured_x, values);
            continue;
        }
        let series = &mut panels.panel_for(output).series;
        let array = base(&output.name);
        if array != output.name {
            // All curves share one series and are identified by their labels.
            let element = &output.name[array.len()..];
            let labelled = sweep.labels.iter().find(|(curves, _)| array == curves);
            let label = labelled
                .and_then(|(_, by)| outputs().find(|other| other.name == format!("{by}{element}")));
            append(series, array, &x, output, label, &mut alike);
            continue;
        }
        let line = PlotSeries::new(
            MathText::name(&output.name),
            SeriesStyle::Line,
            x.clone(),
            output.in_unit(),
        );
        series.push(PlotSeries { meaning: alike(), ..line });
    }
    for (at, heights) in &sweep.marks {
        let elements =
            |name: &str| outputs().filter(|output| base(&output.name) == name).collect::<Vec<_>>();
        let mut marks = PlotSeries {
            style: SeriesStyle::Marks,
            name: MathText::name(heights),
            meaning: alike(),
            ..PlotSeries::default()
        };
        let mut unit = None;
        for (x, y) in elements(at).into_iter().zip(elements(heights)) {
            marks.x.extend(x.in_unit());
            marks.y.extend(y.in_unit());
            unit = Some(y);
        }
        if let Some(column) = unit {
            panels.panel_for(column).series.push(marks);
        }
    }
    Some(Figure::new(MathText::name(name).with_unit(&abscissa.unit.symbol), panels.finished()))
}

/// Adds the curve of an element to the series of its array, after a gap, labelled with the value of another column or
/// the element's index.
fn append(
    series: &mut Vec<PlotSeries>,
    array: &str,
    x: &[f64],
    curve: &NamedColumn,
    label: Option<&NamedColumn>,
    meaning: &mut impl FnMut() -> SeriesMeaning,
) {
    let name = MathText::name(array);
    let position = series.iter().position(|series| series.name == name).unwrap_or_else(|| {
        series.push(PlotSeries { name, meaning: meaning(), ..PlotSeries::default() });
        series.len() - 1
    });
    let (all, y) = (&mut series[position], curve.in_unit());
    if !all.x.is_empty() {
        all.x.push(f64::NAN);
        all.y.push(f64::NAN);
    }
    let end = x.iter().zip(&y).rfind(|(x, y)| x.is_finite() && y.is_finite());
    if let Some((x, y)) = end {
        let index = || curve.name[array.len()..].trim_matches(['[', ']']);
        let text = label.map_or_else(|| MathText::plain(index()), last_value);
        all.labels.push(PointLabel { x: *x, y: *y, text });
    }
    all.x.extend_from_slice(x);
    all.y.extend(y);
}

/// The last value of a column, with its unit.
fn last_value(column: &NamedColumn) -> MathText {
    let value = column.in_unit().last().copied().unwrap_or(f64::NAN);
    let value = MathText::plain(&rounded(value, DIGITS));
    match &*column.unit.symbol {
        "1" => value,
        symbol => value.then(MathText::plain(" ")).then(MathText::unit(symbol)),
    }
}

/// Panels of single outputs, then panels by unit.
#[derive(Default)]
struct SweepPanels {
    measured: Vec<Panel>,
    by_unit: Vec<Panel>,
}

impl SweepPanels {
    /// The panel for a column's unit.
    fn panel_for(&mut self, column: &NamedColumn) -> &mut Panel {
        let label = MathText::default().with_unit(&column.unit.symbol);
        let panels = &mut self.by_unit;
        let position =
            panels.iter().position(|panel| panel.y_label == label).unwrap_or_else(|| {
                panels.push(Panel { y_label: label, ..Panel::default() });
                panels.len() - 1
            });
        &mut panels[position]
    }

    /// Adds an output with its measurements.
    fn add_measured(&mut self, column: &NamedColumn, x: &[f64], at: &[f64], samples: Vec<f64>) {
        let series = |name: &str, style, meaning, x: &[f64], y| PlotSeries {
            meaning,
            ..PlotSeries::new(MathText::plain(name), style, x.to_vec(), y)
        };
        let simulated =
            series("simulated", SeriesStyle::Line, SeriesMeaning::Simulated, x, column.in_unit());
        let measured = series("measured", SeriesStyle::Dots, SeriesMeaning::Measured, at, samples);
        self.measured.push(Panel {
            title: MathText::name(&column.name),
            y_label: MathText::default().with_unit(&column.unit.symbol),
            series: vec![simulated, measured],
            ..Panel::default()
        });
    }

    fn finished(mut self) -> Vec<Panel> {
        for panel in &mut self.by_unit {
            // A legend names two or more.
            if let [only] = panel.series.as_slice() {
                panel.title = only.name.clone();
            }
        }
        self.measured.append(&mut self.by_unit);
        self.measured
    }
}

/// Samples at the rows that have one; NaN, which is not drawn, elsewhere. Of two rows at one time, the sides of a jump,
/// the second has the second sample of that time, if there are two.
pub(super) fn measured_at(rows: &[f64], times: &[f64], samples: &[f64]) -> Vec<f64> {
    let sample = |(at, row): (usize, &f64)| {
        let first = times.partition_point(|time| time < row);
        let end = times.partition_point(|time| time <= row);
        let side = usize::from(at > 0 && rows[at - 1] == *row);
        if first == end { f64::NAN } else { samples[(first + side).min(end - 1)] }
    };
    rows.iter().enumerate().map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_rows_with_a_sample_have_one() {
        let measured = measured_at(&[0.0, 0.5, 1.0, 3.0], &[0.0, 1.0, 2.0], &[5.0, 6.0, 7.0]);
        assert_eq!(measured[0], 5.0);
        assert!(measured[1].is_nan() && measured[3].is_nan());
        assert_eq!(measured[2], 6.0);
    }

    #[test]
    fn both_sides_of_a_jump_are_drawn() {
        let times = [0.0, 1.0, 1.0, 2.0];
        let samples = [5.0, 6.0, 7.0, 8.0];
        assert_eq!(measured_at(&times, &times, &samples), samples);
        // A result that jumps where the samples do not, and vice versa.
        assert_eq!(measured_at(&[0.0, 0.0, 1.0], &times, &samples), [5.0, 5.0, 6.0]);
    }

    #[test]
    fn rows_between_keep_the_given_ones_and_their_jumps() {
        let rows = between(&[0.0, 1.0, 1.0, 3.0]).unwrap_or_default();
        assert!(rows.len() >= SMOOTH && rows.is_sorted());
        assert_eq!(rows.iter().filter(|t| **t == 1.0).count(), 2);
        assert_eq!((rows[0], rows[rows.len() - 1]), (0.0, 3.0));
        // Nothing to refine.
        assert!(between(&[0.0; 3]).is_none() && between(&[]).is_none());
        let enough: Vec<f64> = (0..SMOOTH).map(|k| k as f64).collect();
        assert!(between(&enough).is_none());
    }

    #[test]
    fn curves_of_an_array_are_one_series_with_a_label_at_each_end() {
        let column = |name: &str, symbol: &str, values: [f64; 3]| {
            let unit = Unit { symbol: symbol.to_owned().into(), factor: 1.0, offset: 0.0 };
            NamedColumn::new(name, &unit, ColumnKind::Output, values.to_vec())
        };
        let mut series = Vec::new();
        let x = [0.0, 1.0, 2.0];
        // The second one ends where it stops being finite.
        let curves = [
            (column("head[1]", "m", [3.0, 2.0, 1.0]), column("speed[1]", "rpm", [1000.0; 3])),
            (column("head[2]", "m", [5.0, 4.0, f64::NAN]), column("speed[2]", "1", [0.5; 3])),
        ];
        let mut places = 3..;
        let mut alike = || SeriesMeaning::Variant(places.next().unwrap_or_default());
        for (curve, label) in &curves {
            append(&mut series, "head", &x, curve, Some(label), &mut alike);
        }
        let [all] = series.as_slice() else { unreachable!("one series") };
        assert_eq!((all.x.len(), all.meaning), (7, SeriesMeaning::Variant(3)));
        assert!(all.y[3].is_nan());
        let labels: Vec<(f64, f64, String)> =
            all.labels.iter().map(|label| (label.x, label.y, label.text.to_html())).collect();
        let expected = [(2.0, 1.0, "1000 rpm".to_owned()), (1.0, 4.0, "0.5000".to_owned())];
        assert_eq!(labels, expected);
        append(&mut series, "q", &x, &column("q[7]", "m", [1.0; 3]), None, &mut alike);
        assert_eq!(series[1].labels[0].text, MathText::plain("7"), "its index");
        assert_eq!(series[1].meaning, SeriesMeaning::Variant(4));
    }
}
