//! The missing term of an equation, as text and JSON.

use std::fmt::Write as _;
use std::io;

use dgd_data::Epoch;
use dgd_identify::inversion::{InvertedTerm, SignalSource};
use dgd_plot::{Envelope, Figure, MathText, Panel, PlotSeries, SeriesStyle};
use dgd_runtime::{Signature, Unit};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::sensors::Sensor;
use super::twin::TwinInput;
use crate::output::columns::{ColumnKind, NamedColumn, TimeTable};
use crate::output::provenance::Provenance;
use crate::output::quantity::{moment, short, stretches, with_unit};
use crate::output::table::significant;
use crate::request::InvertRequest;

/// Significance threshold, in standard deviations.
const STANDS_OUT: f64 = 3.0;
/// Half width of the drawn band, in standard deviations.
const BAND: f64 = 2.0;
/// Significant digits of printed values.
const DIGITS: usize = 4;

/// The missing term on the right-hand side of an equation.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct InvertedReport {
    /// Name of the model.
    pub model: String,
    /// Label of the equation.
    pub equation: String,
    /// The inversion, SI.
    pub found: InvertedTerm,
    /// The smoothed estimate, if requested.
    pub twin: Option<TwinInput>,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
    /// The timestamp of time zero, if the data has timestamps.
    epoch: Option<Epoch>,
    unit: Unit,
    /// Spelling of its unit in SI.
    si: String,
    sensors: Vec<Sensor>,
    /// Each unknown that the equation reads, and the sensors that determine it.
    signals: Vec<(String, Vec<String>)>,
}

impl InvertedReport {
    pub(super) fn new(
        request: &InvertRequest,
        signature: &Signature,
        found: InvertedTerm,
        [unit, si]: [Unit; 2],
        sensors: Vec<Sensor>,
        twin: Option<TwinInput>,
        provenance: Provenance,
    ) -> Self {
        let source = |source: &SignalSource| match source {
            SignalSource::Output(i) => signature.outputs[*i].name.to_string(),
            SignalSource::Equation(i) => format!("equation {}", signature.equations.get(*i)),
            SignalSource::Together => "all outputs and equations together".to_owned(),
        };
        let signals = found.signals.iter().map(|signal| {
            let name = signature.unknowns.name(signal.unknown).into_owned();
            (name, signal.sources.iter().map(source).collect::<Vec<_>>())
        });
        let signals: Vec<(String, Vec<String>)> = signals.collect();
        let by_readings = |name: &String| signals.iter().any(|(_, of)| of.contains(name));
        let everything = found
            .signals
            .iter()
            .any(|own| own.sources.iter().any(|source| !matches!(source, SignalSource::Output(_))));
        let sensors = sensors.into_iter().filter(|own| everything || by_readings(&own.name));
        InvertedReport {
            model: signature.name.to_string(),
            equation: request.equation.clone(),
            sensors: sensors.collect(),
            signals,
            unit,
            si: si.symbol.to_string(),
            found,
            twin,
            provenance,
            epoch: None,
        }
    }

    /// Sets the timestamp of time zero.
    pub(super) fn since(self, epoch: Option<Epoch>) -> Self {
        InvertedReport { epoch, ..self }
    }

    /// The SI unit of its integral over time: cubic metres for a flow in cubic metres per second.
    fn sum_unit(&self) -> Unit {
        let symbol = match self.si.strip_suffix("/s") {
            Some(rest) if !rest.contains(['/', '(']) => rest.to_owned(),
            _ => format!("{}*s", self.si),
        };
        Unit { symbol: symbol.into(), factor: 1.0, offset: 0.0 }
    }

    /// The twin at the times of the inversion.
    fn twin_columns(&self) -> Option<[Vec<f64>; 2]> {
        let twin = self.twin.as_ref()?;
        let resample = |values: &Vec<f64>| {
            let one = |t: &f64| {
                let k = twin.times.partition_point(|own| own <= t);
                k.checked_sub(1).map_or(f64::NAN, |k| values[k])
            };
            self.found.times.iter().map(one).collect()
        };
        Some([resample(&twin.value), resample(&twin.std)])
    }

    /// Integral of the twin from its first sample on; it is constant between samples.
    fn twin_sum(&self) -> Option<Vec<f64>> {
        let twin = self.twin.as_ref()?;
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for (pair, value) in twin.times.windows(2).zip(&twin.value) {
            sum += value * (pair[1] - pair[0]);
            sums.push(sum);
        }
        Some(sums)
    }

    /// Time, the missing term and its standard deviation, its integral, and the smoothed estimate, with theirs.
    pub fn table(&self) -> TimeTable {
        let column = |name: &str, unit: &Unit, values: &[f64]| {
            NamedColumn::new(name, unit, ColumnKind::Output, values.to_vec())
        };
        let sum_unit = self.sum_unit();
        let InvertedTerm { times, missing, integral, .. } = &self.found;
        let mut columns = vec![
            column("missing", &self.unit, &missing.value),
            column("missing_std", &self.unit, &missing.std),
        ];
        if let Some(integral) = integral {
            columns.push(column("integral", &sum_unit, &integral.value));
            columns.push(column("integral_std", &sum_unit, &integral.std));
        }
        if let Some([value, std]) = self.twin_columns() {
            columns.push(column("estimate", &self.unit, &value));
            columns.push(column("estimate_std", &self.unit, &std));
        }
        TimeTable { times: times.clone(), epoch: self.epoch, columns }
    }

    /// Writes the table as CSV.
    ///
    /// # Errors
    ///
    /// Those of `out`.
    pub fn write_csv(&self, out: &mut dyn io::Write) -> io::Result<()> {
        self.table().write_csv(out)
    }

    /// Index of its largest value.
    fn largest(&self) -> Option<usize> {
        let missing = &self.found.missing;
        let finite = (0..missing.value.len()).filter(|k| missing.value[*k].is_finite());
        finite.max_by(|a, b| missing.value[*a].abs().total_cmp(&missing.value[*b].abs()))
    }

    /// Intervals in which it is significant, s.
    fn windows(&self) -> Vec<[f64; 2]> {
        let InvertedTerm { times, missing, .. } = &self.found;
        let mut windows: Vec<[f64; 2]> = Vec::new();
        let mut is_open = false;
        for (k, t) in times.iter().enumerate() {
            let (value, std) = (missing.value[k], missing.std[k]);
            let stands_out = value.abs() > STANDS_OUT * std;
            match (is_open, stands_out) {
                (true, true) => {
                    if let Some(last) = windows.last_mut() {
                        last[1] = *t;
                    }
                }
                (false, true) => windows.push([*t, *t]),
                _ => {}
            }
            is_open = stands_out;
        }
        windows
    }

    /// The result as text.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}: what equation `{}` lacks on its right-hand side, from what was measured\n\n",
            self.model, self.equation
        );
        let in_unit = |value: f64| significant(value / self.unit.factor, DIGITS);
        let how = if self.found.is_chosen { "the most likely" } else { "as asked" };
        let _ =
            writeln!(text, "window     ± {} s, {how}", significant(self.found.bandwidth, DIGITS));
        for (name, of) in &self.signals {
            let _ = writeln!(text, "{name:<10} from {}", of.join(", "));
        }
        for sensor in &self.sensors {
            let (noise, unit, of) = sensor.shown();
            let _ = writeln!(
                text,
                "{:<10} noise {}, {of}",
                sensor.name,
                with_unit(significant(noise, DIGITS), unit)
            );
        }
        if let Some(k) = self.largest() {
            let missing = &self.found.missing;
            let _ = writeln!(
                text,
                "largest    {} ± {} {} at {}",
                in_unit(missing.value[k]),
                in_unit(missing.std[k]),
                self.unit.symbol,
                moment(self.found.times[k])
            );
        }
        if let Some(integral) = &self.found.integral {
            let unit = self.sum_unit();
            let last = (0..integral.value.len()).rev().find(|k| integral.value[*k].is_finite());
            let last = last.map(|k| (integral.value[k], integral.std[k]));
            let (value, std) = last.unwrap_or((0.0, 0.0));
            let _ = writeln!(
                text,
                "in all     {} ± {} {}",
                significant(value / unit.factor, DIGITS),
                significant(std / unit.factor, DIGITS),
                unit.symbol
            );
        }
        if self.found.left_out > 0.0 {
            let _ = writeln!(
                text,
                "left out   {} s, in which readings are missing or unknowns jump",
                significant(self.found.left_out, DIGITS)
            );
        }
        let windows = self.windows();
        let _ = if windows.is_empty() {
            writeln!(text, "nothing stands out of the sensors' noise")
        } else {
            writeln!(text, "stands out {}", stretches(windows))
        };
        if let Some(twin) = &self.twin {
            let _ = writeln!(
                text,
                "estimate   of a smoother with the whole model: {} nats more likely than nothing missing",
                significant(twin.gain, DIGITS)
            );
        }
        text
    }

    /// The JSON without the columns.
    pub fn details(&self) -> Value {
        let InvertedTerm { bandwidth, is_chosen, left_out, integral, missing, times, .. } =
            &self.found;
        let largest = self.largest().map(|k| {
            json!({
                "t": times[k],
                "value": missing.value[k] / self.unit.factor,
                "std": missing.std[k] / self.unit.factor,
            })
        });
        let signals = self.signals.iter().map(|(name, of)| json!({ "unknown": name, "from": of }));
        let mut details = json!({
            "model": self.model,
            "equation": self.equation,
            "unit": self.unit.symbol,
            "integral_unit": integral.as_ref().map(|_| self.sum_unit().symbol),
            "bandwidth": bandwidth,
            "bandwidth_from": if *is_chosen { "likelihood" } else { "request" },
            "left_out": left_out,
            "signals": signals.collect::<Vec<_>>(),
            "sensors": self.sensors.iter().map(Sensor::to_json).collect::<Vec<_>>(),
            "largest": largest,
            "windows": self.windows(),
            "estimate_gain": self.twin.as_ref().map(|twin| twin.gain),
        });
        self.provenance.push_json(&mut details);
        details
    }

    /// The whole result as JSON.
    pub fn to_json(&self) -> Value {
        let mut result = self.details();
        self.table().push_json(&mut result);
        result
    }

    /// The missing term with its band and the smoothed estimate; below, the integral.
    pub fn figure(&self) -> Figure {
        let InvertedTerm { times, missing, integral, bandwidth, .. } = &self.found;
        let mut top = Panel {
            title: MathText::plain(&format!("Missing in {}", self.equation)),
            y_label: MathText::default().with_unit(&self.unit.symbol),
            ..Panel::default()
        };
        let title = format!("measured, means over ± {} s", short(*bandwidth, 2));
        let name = MathText::plain(&title);
        add(&mut top, name, times, [&missing.value, &missing.std], self.unit.factor);
        let mut panels = vec![];
        if let Some(twin) = &self.twin {
            let name = MathText::plain("estimated by a smoother");
            add(&mut top, name, &twin.times, [&twin.value, &twin.std], self.unit.factor);
        }
        panels.push(top);
        if let Some(integral) = integral {
            let unit = self.sum_unit();
            let mut below = Panel {
                title: MathText::plain("Its integral"),
                y_label: MathText::default().with_unit(&unit.symbol),
                ..Panel::default()
            };
            let name = MathText::plain("measured");
            add(&mut below, name, times, [&integral.value, &integral.std], unit.factor);
            if let (Some(twin), Some(sum)) = (&self.twin, self.twin_sum()) {
                let name = MathText::plain("estimated by a smoother");
                let y = sum.iter().map(|value| value / unit.factor).collect();
                below.series.push(PlotSeries::new(name, SeriesStyle::Line, twin.times.clone(), y));
            }
            panels.push(below);
        }
        Figure::new(MathText::plain("Time").with_unit("s"), panels)
    }
}

/// Adds a line with its band of twice the standard deviation.
fn add(
    panel: &mut Panel,
    name: MathText,
    times: &[f64],
    [value, std]: [&Vec<f64>; 2],
    factor: f64,
) {
    let edge = |k: f64| value.iter().zip(std).map(|(v, s)| (v + k * s) / factor).collect();
    panel.envelopes.push(Envelope {
        name: MathText::default(),
        around: Some(panel.series.len()),
        x: times.to_vec(),
        low: edge(-BAND),
        high: edge(BAND),
    });
    panel.series.push(PlotSeries::new(name, SeriesStyle::Line, times.to_vec(), edge(0.0)));
}

impl Serialize for InvertedReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}
