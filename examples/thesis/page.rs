//! What a figure of the thesis is made of here.

use dgd_plot::{Figure, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle};

use crate::claims::Claim;

/// A figure of the thesis, drawn from the recordings.
pub(crate) struct Finding {
    /// Its number in the thesis.
    pub(crate) number: &'static str,
    pub(crate) title: &'static str,
    /// What the thesis found.
    pub(crate) thesis: &'static str,
    /// What is found here.
    pub(crate) here: String,
    /// What must come out, and whether it does; one at least.
    pub(crate) claims: Vec<Claim>,
    pub(crate) figure: Figure,
}

/// A part of the thesis.
pub(crate) struct Section {
    pub(crate) title: &'static str,
    pub(crate) findings: Vec<Finding>,
}

/// A panel with a title and the unit of its axis.
pub(crate) fn panel(title: &str, unit: &str, series: Vec<PlotSeries>) -> Panel {
    Panel {
        title: MathText::plain(title),
        y_label: MathText::default().with_unit(unit),
        series,
        ..Panel::default()
    }
}

/// What was measured, over time.
pub(crate) fn measured(name: &str, x: &[f64], y: Vec<f64>) -> PlotSeries {
    series(name, SeriesStyle::ThinLine, SeriesMeaning::Measured, x, y)
}

/// One of several sensors, over time.
pub(crate) fn sensor(name: &str, x: &[f64], y: Vec<f64>) -> PlotSeries {
    series(name, SeriesStyle::ThinLine, SeriesMeaning::OneOfSeveral, x, y)
}

/// An input of the models, over time: `w_ssp`, `q_boost` and `q_tf` in this order.
pub(crate) fn input(place: usize, name: &str, x: &[f64], y: Vec<f64>) -> PlotSeries {
    series(name, SeriesStyle::Line, SeriesMeaning::Input(place), x, y)
}

/// What was computed, over time: the first of several, the second, and so on.
pub(crate) fn computed(name: &str, x: &[f64], y: Vec<f64>) -> PlotSeries {
    series(name, SeriesStyle::Line, SeriesMeaning::OneOfSeveral, x, y)
}

/// Single points that were measured.
pub(crate) fn points(name: &str, x: &[f64], y: Vec<f64>) -> PlotSeries {
    series(name, SeriesStyle::Dots, SeriesMeaning::Measured, x, y)
}

/// Single points that were chosen of these.
pub(crate) fn chosen(name: &str, x: &[f64], y: Vec<f64>) -> PlotSeries {
    series(name, SeriesStyle::Dots, SeriesMeaning::OneOfSeveral, x, y)
}

fn series(
    name: &str,
    style: SeriesStyle,
    meaning: SeriesMeaning,
    x: &[f64],
    y: Vec<f64>,
) -> PlotSeries {
    PlotSeries { meaning, ..PlotSeries::new(MathText::plain(name), style, x.to_vec(), y) }
}

/// Panels below each other over time.
pub(crate) fn over_time(panels: Vec<Panel>) -> Figure {
    Figure { columns: 1, ..Figure::new(MathText::plain("Time").with_unit("s"), panels) }
}

/// Panels below each other over something else.
pub(crate) fn over(x: &str, unit: &str, panels: Vec<Panel>) -> Figure {
    Figure { columns: 1, ..Figure::new(MathText::plain(x).with_unit(unit), panels) }
}

/// Values in another unit.
pub(crate) fn per(values: &[f64], unit: f64) -> Vec<f64> {
    values.iter().map(|value| value / unit).collect()
}

/// a − b.
pub(crate) fn less(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Root mean square of values.
pub(crate) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Lowest and highest of values.
pub(crate) fn ends(values: &[f64]) -> (f64, f64) {
    let wider = |(low, high): (f64, f64), value: &f64| (low.min(*value), high.max(*value));
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), wider)
}

/// From the lowest to the highest of values.
pub(crate) fn range(values: &[f64]) -> f64 {
    let (low, high) = ends(values);
    high - low
}
