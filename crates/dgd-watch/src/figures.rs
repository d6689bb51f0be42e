//! The charts of an answer: simulated and kept curves, and sensitivities by output.

use std::collections::BTreeSet;

use dgd_compiler::units::parse_unit;
use dgd_page::{ChartLink, LiveCharts, Markup};
use dgd_plot::{Figure, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle};
use dgd_work::{Sensitivities, SimulationResult};

/// Headings of the figures of a run.
const HEADINGS: [&str; 3] = ["Outputs", "Measured less simulated", "Other quantities"];

/// All share one time axis.
const TIME: ChartLink<'static> = ChartLink::With("time");

/// Kept curves, which stay when values change.
#[derive(Debug)]
pub(crate) struct KeptCurves {
    /// Its number, from 1.
    pub(crate) number: u32,
    /// Choices and settings.
    pub(crate) what: String,
    /// The figures of its run.
    pub(crate) figures: [Figure; 3],
}

/// Sections of a page, and the data for its script.
pub(crate) struct SectionCharts {
    pub(crate) markup: String,
    pub(crate) json: String,
}

/// Charts of a run, with the curves of others beside its own.
pub(crate) fn of_run(
    simulated: &SimulationResult,
    kept: &[&KeptCurves],
    have: &BTreeSet<String>,
) -> SectionCharts {
    let mut charts = LiveCharts::new(have.clone());
    let mut markup = String::new();
    let figures = simulated.figures();
    for (k, (heading, mut figure)) in HEADINGS.iter().zip(figures).enumerate() {
        for other in kept {
            lay_beside(&mut figure, &other.figures[k], other.number);
        }
        push(&mut charts, &mut markup, heading, &figure, &Markup::default());
    }
    SectionCharts { markup, json: charts.to_json() }
}

/// Charts of derivatives: a panel for each output, a line for each parameter, multiplied by it, so that all have the
/// output's unit; `units` are the outputs' declared units.
pub(crate) fn of_sensitivities(
    found: &Sensitivities,
    units: &[&str],
    have: &BTreeSet<String>,
) -> SectionCharts {
    let mut charts = LiveCharts::new(have.clone());
    let mut markup = String::new();
    let each = found.table.columns.len() / found.trajectories.len().max(1);
    let mut columns = found.table.columns.iter();
    let mut panels = Vec::new();
    for (trajectory, symbol) in found.trajectories.iter().zip(units) {
        // A state of the same name may have another declared unit.
        let unit = parse_unit(symbol).map_or(1.0, |unit| unit.of_differences().factor);
        let group = columns.by_ref().take(each);
        let series = group.enumerate().map(|(k, column)| PlotSeries {
            meaning: SeriesMeaning::Variant(k),
            ..PlotSeries::new(
                MathText::name(column.name.split('*').next().unwrap_or(&column.name)),
                SeriesStyle::Line,
                found.table.times.clone(),
                column.values.iter().map(|si| si / unit).collect(),
            )
        });
        panels.push(Panel {
            title: MathText::name(&trajectory.name),
            y_label: MathText::default().with_unit(symbol),
            series: series.collect(),
            ..Panel::default()
        });
    }
    let figure = Figure::new(MathText::plain("Time").with_unit("s"), panels);
    let caption = "What each output would gain if a parameter grew by its own size, were it linear: the \
                   derivative times the parameter.";
    push(&mut charts, &mut markup, "Sensitivities", &figure, &Markup::text(caption));
    SectionCharts { markup, json: charts.to_json() }
}

fn push(
    charts: &mut LiveCharts,
    markup: &mut String,
    heading: &str,
    figure: &Figure,
    caption: &Markup,
) {
    let chart = charts.chart(figure, TIME, caption);
    if !chart.is_empty() {
        markup.push_str(Markup::section(&Markup::text(heading), &[chart]).as_str());
    }
}

/// Adds the curves of another figure for the same quantities.
fn lay_beside(figure: &mut Figure, other: &Figure, number: u32) {
    for panel in &mut figure.panels {
        let is_same = |one: &&Panel| one.title == panel.title && one.y_label == panel.y_label;
        let Some(same) = other.panels.iter().find(is_same) else { continue };
        let curves = same.series.iter().filter(|series| {
            matches!(series.meaning, SeriesMeaning::Simulated | SeriesMeaning::Residual)
        });
        let added = curves.map(|series| PlotSeries {
            name: MathText::plain(&format!("kept {number}")),
            // The first colour of several is that of simulated values.
            meaning: SeriesMeaning::Variant(number as usize),
            style: SeriesStyle::Line,
            ..series.clone()
        });
        panel.series.extend(added.collect::<Vec<_>>());
    }
}
