//! The page of a simulation: agreement with measurements, curves, events.

use dgd_page::{ChartLink, HeadlineTone, Markup, Page, PageCell, PageTable};
use dgd_plot::{Figure, MathText, SeriesMeaning};

use super::SimulationResult;
use super::over::measured_at;
use crate::output::agreement::Agreement;
use crate::output::columns::in_unit;
use crate::output::figure::{self, PanelLine, PanelSubject};
use crate::output::page::{TIME, agreement_table, number, origin, told, words};
use crate::output::quantity::{of_differences, short};
use crate::output::{ColumnKind, NamedColumn};
use crate::result::simulate::EventEntry;

/// An output with its measurements at the rows of the result, in its unit.
pub(super) struct ComparedOutput<'a> {
    output: &'a NamedColumn,
    measured: Vec<f64>,
    simulated: Vec<f64>,
}

pub(super) fn write(simulated: &SimulationResult, command: &str) -> String {
    let mut page = Page::new(&format!("{}: simulation", simulated.model));
    let kind = Markup::text("Simulation of the model ").then(&Markup::code(&simulated.model));
    let compared = compared(simulated);
    let (headline, agreement) = in_words(simulated, &compared);
    let (headline, more) = (Markup::prose(&headline), [solved(simulated), agreement]);
    page.push_header(&kind, &headline, HeadlineTone::Plain, &more);
    // A plot over another quantity does not pan with the other figures.
    let link = if simulated.sweep.is_some() { ChartLink::Alone } else { TIME };
    let chart = page.chart(&simulated.figure(), link, &Markup::default());
    page.push_section("Inputs, states and outputs", &[chart]);
    if let Some(residuals) = residuals(simulated, &compared) {
        let chart = page.chart(&residuals, TIME, &Markup::default());
        page.push_section("Measured less simulated", &[chart]);
    }
    page.push_section("Events", &[events(&simulated.solution.events)]);
    page.finish(&origin(&simulated.provenance, command))
}

/// An output, its unit, and its agreement with measurements.
type OutputAgreement<'a> = Vec<(&'a str, &'a str, Agreement)>;

fn agreements<'a>(compared: &[ComparedOutput<'a>]) -> OutputAgreement<'a> {
    let one = |ComparedOutput { output, measured, simulated }: &ComparedOutput<'a>| {
        let pairs = measured.iter().copied().zip(simulated.iter().copied());
        Some((&*output.name, &*output.unit.symbol, Agreement::measure(pairs)?))
    };
    compared.iter().filter_map(one).collect()
}

/// The headline, and the table of all measured outputs.
pub(super) fn in_words(
    simulated: &SimulationResult,
    compared: &[ComparedOutput<'_>],
) -> (String, Markup) {
    let agreements = agreements(compared);
    let headline = headline(simulated, &agreements);
    (headline, agreement_table("How far simulated and measured agree", agreements))
}

/// The output that fits worst, if any was measured.
fn headline(simulated: &SimulationResult, agreements: &[(&str, &str, Agreement)]) -> String {
    let times = &simulated.table.times;
    let time = |t: Option<&f64>| told(t.copied().unwrap_or(0.0));
    let span = format!("{} s to {} s", time(times.first()), time(times.last()));
    if let Some(error) = &simulated.stopped {
        return format!("The run stopped: {error}");
    }
    let fits = agreements.iter().filter_map(|(name, _, one)| Some((*name, one.fit_percent?)));
    let fits: Vec<(&str, f64)> = fits.collect();
    let worst = fits.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let percent = |fit: f64| short(fit, 3);
    match (worst, fits.len()) {
        (None, _) => format!("Simulated from {span}"),
        (Some((name, fit)), 1) => format!("Fits `{name}` to {} %, from {span}", percent(*fit)),
        (Some((name, fit)), n) => {
            format!("Fits {n} outputs to {} % (`{name}`) or better, from {span}", percent(*fit))
        }
    }
}

fn solved(simulated: &SimulationResult) -> Markup {
    let facts = &simulated.solution;
    let steps = match facts.steps_per_sample {
        Some(n) => format!("{n} equal steps for each sample"),
        None if facts.rejected == 0 => format!("{} steps", facts.steps),
        None => format!("{} steps, {} tried again with a smaller one", facts.steps, facts.rejected),
    };
    Markup::prose(&format!("{} rows by `{}` in {steps}.", facts.rows, simulated.method)).paragraph()
}

/// The measurements, with the simulated values at the same times.
pub(super) fn compared(simulated: &SimulationResult) -> Vec<ComparedOutput<'_>> {
    let outputs = simulated.of_kind(ColumnKind::Output).enumerate();
    let compared = outputs.filter_map(|(i, output)| {
        let samples = simulated.measured.outputs.get(i)?.as_ref()?;
        let measured = measured_at(&simulated.table.times, &simulated.measured.times, samples);
        let measured = in_unit(&measured, &output.unit);
        Some(ComparedOutput { output, measured, simulated: output.in_unit() })
    });
    compared.collect()
}

/// The residuals, if anything was measured.
pub(super) fn residuals(
    simulated: &SimulationResult,
    compared: &[ComparedOutput<'_>],
) -> Option<Figure> {
    let subject = |one: &ComparedOutput<'_>| PanelSubject {
        title: MathText::name(&one.output.name),
        unit: of_differences(&one.output.unit).symbol.to_string(),
        lines: vec![PanelLine {
            name: MathText::plain("measured − simulated"),
            times: simulated.table.times.clone(),
            values: one.measured.iter().zip(&one.simulated).map(|(y, w)| y - w).collect(),
            meaning: SeriesMeaning::Residual,
        }],
    };
    let subjects: Vec<PanelSubject> = compared.iter().map(subject).collect();
    (!subjects.is_empty()).then(|| figure::panels(&subjects))
}

/// The events by time.
fn events(events: &[EventEntry]) -> Markup {
    let mut table = PageTable::new("Events", &["time, s", "what", "from", "to"]);
    for event in events {
        let modes = PageCell::text(Markup::code(&event.modes));
        table.rows.push(vec![
            number(Some(event.t), 6),
            modes,
            words(&event.from),
            words(&event.to),
        ]);
    }
    table.to_markup()
}
