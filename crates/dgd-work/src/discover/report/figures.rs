//! The figures of a report: one panel for each output or equation, stacked over a common time axis.

use dgd_discover::{Discovery, MissingInput, OutputTrace, RecordingTrace, SignalWindow};
use dgd_plot::{
    Envelope, Figure, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle, ShadedBand,
};
use dgd_runtime::Unit;

use crate::output::quantity::of_differences;

/// Panels per page; more are split into several figures.
const PANELS: usize = 4;

/// Half width of a shaded band, in standard deviations: 95 % of a normal distribution.
const REACH: f64 = 2.0;

/// Whether the corrected model differs from the base model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CorrectionState {
    /// Curves before and after.
    Made,
    /// One curve, because both models are the same.
    None,
}

impl CorrectionState {
    /// Whether a discovery has corrected the model.
    pub(super) fn from_discovery(discovery: &Discovery) -> CorrectionState {
        if discovery.is_corrected() { CorrectionState::Made } else { CorrectionState::None }
    }
}

/// Measured against simulated.
pub(super) fn fit(trace: &RecordingTrace, correction: CorrectionState) -> Vec<Figure> {
    let panel = |output: &OutputTrace| {
        let in_unit = |values: &[f64]| shifted(values, &output.unit);
        let mut series = match correction {
            CorrectionState::None => {
                vec![series(
                    SeriesMeaning::Simulated,
                    SeriesStyle::Line,
                    &trace.times,
                    in_unit(&output.after),
                )]
            }
            CorrectionState::Made => vec![
                series(
                    SeriesMeaning::Before,
                    SeriesStyle::Line,
                    &trace.times,
                    in_unit(&output.before),
                ),
                series(
                    SeriesMeaning::After,
                    SeriesStyle::Line,
                    &trace.times,
                    in_unit(&output.after),
                ),
            ],
        };
        let measured = in_unit(&output.measured);
        series.push(self::series(
            SeriesMeaning::Measured,
            SeriesStyle::ThinLine,
            &trace.times,
            measured,
        ));
        Panel {
            title: MathText::name(&output.name),
            y_label: MathText::default().with_unit(&output.unit.symbol),
            series,
            bands: bands(&output.windows),
            ..Panel::default()
        }
    };
    pages(&trace.outputs.iter().map(panel).collect::<Vec<_>>())
}

/// Residuals (measured − simulated) over the noise.
pub(super) fn errors(trace: &RecordingTrace, correction: CorrectionState) -> Vec<Figure> {
    pages(&error_panels(trace, correction))
}

/// Residuals (measured − simulated) over the noise, one panel for each output.
pub(super) fn error_panels(trace: &RecordingTrace, correction: CorrectionState) -> Vec<Panel> {
    let panel = |output: &OutputTrace| {
        let unit = of_differences(&output.unit);
        let error = |simulated: &[f64]| -> Vec<f64> {
            let pairs = output.measured.iter().zip(simulated);
            pairs.map(|(measured, simulated)| (measured - simulated) / unit.factor).collect()
        };
        let thin = |meaning, simulated| {
            series(meaning, SeriesStyle::ThinLine, &trace.times, error(simulated))
        };
        let series = match correction {
            CorrectionState::None => vec![PlotSeries {
                name: MathText::plain("measured − simulated"),
                ..thin(SeriesMeaning::Residual, &output.after)
            }],
            CorrectionState::Made => {
                vec![
                    thin(SeriesMeaning::Before, &output.before),
                    thin(SeriesMeaning::After, &output.after),
                ]
            }
        };
        let ends: Vec<f64> =
            trace.times.first().into_iter().chain(trace.times.last()).copied().collect();
        let reach = vec![REACH * output.noise / unit.factor; ends.len()];
        let noise = Envelope {
            name: MathText::plain("± 2 standard deviations of the noise"),
            around: None,
            x: ends,
            low: reach.iter().map(|reach| -reach).collect(),
            high: reach,
        };
        Panel {
            title: MathText::name(&output.name),
            y_label: MathText::default().with_unit(&unit.symbol),
            series,
            bands: bands(&output.windows),
            envelopes: vec![noise],
            ..Panel::default()
        }
    };
    trace.outputs.iter().map(panel).collect()
}

/// The missing term on the right-hand side of each equation.
pub(super) fn missing<'a>(traces: impl IntoIterator<Item = &'a MissingInput>) -> Vec<Figure> {
    let panel = |trace: &MissingInput| {
        let edge = |side: f64| -> Vec<f64> {
            trace.value.iter().zip(&trace.std).map(|(value, std)| value + side * std).collect()
        };
        Panel {
            title: MathText::plain(&trace.target()),
            y_label: MathText::default().with_unit(&trace.unit),
            series: vec![PlotSeries::new(
                MathText::plain("missing"),
                SeriesStyle::Line,
                trace.times.clone(),
                trace.value.clone(),
            )],
            bands: bands(&trace.windows),
            envelopes: vec![Envelope {
                name: MathText::plain("± 2 standard deviations"),
                around: Some(0),
                x: trace.times.clone(),
                low: edge(-REACH),
                high: edge(REACH),
            }],
            ..Panel::default()
        }
    };
    pages(&traces.into_iter().map(panel).collect::<Vec<_>>())
}

fn series(meaning: SeriesMeaning, style: SeriesStyle, times: &[f64], y: Vec<f64>) -> PlotSeries {
    let name = match meaning {
        SeriesMeaning::Measured => "measured",
        SeriesMeaning::Simulated => "simulated",
        SeriesMeaning::Before => "before",
        SeriesMeaning::After => "after",
        SeriesMeaning::Residual
        | SeriesMeaning::Input(_)
        | SeriesMeaning::Variant(_)
        | SeriesMeaning::OneOfSeveral => "",
    };
    PlotSeries { meaning, ..PlotSeries::new(MathText::plain(name), style, times.to_vec(), y) }
}

fn shifted(values: &[f64], unit: &Unit) -> Vec<f64> {
    values.iter().map(|value| unit.from_si(*value)).collect()
}

fn bands(windows: &[SignalWindow]) -> Vec<ShadedBand> {
    windows.iter().map(|window| ShadedBand { from: window.from, to: window.until }).collect()
}

fn pages(panels: &[Panel]) -> Vec<Figure> {
    panels.chunks(PANELS).map(below_each_other).collect()
}

/// Stacks panels over one time axis.
pub(super) fn below_each_other(panels: &[Panel]) -> Figure {
    Figure { columns: 1, ..Figure::new(MathText::plain("Time").with_unit("s"), panels.to_vec()) }
}
