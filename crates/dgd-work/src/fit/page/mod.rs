//! `report.html` of a fit: what to trust, measured against simulated, residuals, parameters.
//!
//! ```text
//!   result.json ──► headline, tables of outputs and parameters
//!   traces ───────► curves of each recording, residuals: over time, against inputs, correlations, distribution
//! ```

mod diagnosis;
mod headline;
mod parameters;
mod residuals;
mod starts;
pub(crate) mod traces;

use dgd_page::{ChartLink, Markup, Page, PageCell, PageTable};
use dgd_plot::{Figure, MathText, SeriesMeaning};
use dgd_runtime::Signature;

use super::FitResult;
use crate::output::agreement::Agreement;
use crate::output::figure::{self, PanelLine, PanelSubject};
use crate::output::page::{name, number, origin, unit};
use crate::output::quantity::of_differences;
use crate::result::fit::NoiseEntry;
use diagnosis::Diagnosis;
use traces::PageTrace;

/// The page's text.
pub(super) fn write(fitted: &FitResult) -> String {
    let (result, signature) = (&fitted.result, &fitted.signature);
    let diagnosis = Diagnosis::test(signature, &fitted.traces);
    let mut page = Page::new(&format!("{}: fit", signature.name));
    let kind = Markup::text("Fit of the model ").then(&Markup::code(&signature.name));
    let headline = headline::headline(result, signature, &diagnosis);
    let more = [headline.doubts, outputs(fitted), headline.end];
    page.push_header(&kind, &headline.sentence, headline.tone, &more);
    page.push_section("Parameters", &[parameters::table(result), parameters::starts(result)]);
    page.push_section("Correlation of the estimates", &[parameters::correlation(result)]);
    starts::push(&mut page, result);
    for trace in &fitted.traces {
        push_recording(&mut page, signature, trace);
    }
    residuals::push(&mut page, signature, &fitted.traces, &diagnosis);
    for (heading, figures) in [
        (
            "Profiles",
            fitted.figures.iter().filter(|figure| figure.of.is_some()).collect::<Vec<_>>(),
        ),
        // For estimators that simulate, the figures above already show this.
        (
            "By rows, as the estimator sees them",
            fitted
                .figures
                .iter()
                .filter(|f| f.of.is_none() && !fitted.estimator.simulates())
                .collect(),
        ),
    ] {
        let charts: Vec<Markup> = figures
            .into_iter()
            .map(|one| page.chart(&one.figure, ChartLink::Alone, &Markup::default()))
            .collect();
        page.push_section(heading, &charts);
    }
    page.push_section("Which data determines the parameters", &[parameters::information(result)]);
    page.push_section("Operating points", &[parameters::operating_points(result)]);
    let text = Markup::text(&fitted.text);
    let text = format!(
        "<details>\n<summary>Tables and remarks as a terminal shows them</summary>\n\
         <pre tabindex=\"0\">{text}</pre>\n</details>\n"
    );
    page.push_section("In words", &[Markup::trusted(text)]);
    page.finish(&origin(&fitted.provenance, &fitted.command))
}

/// The agreement of each output with measurements, in training and in validation.
fn outputs(fitted: &FitResult) -> Markup {
    let head = [
        "output",
        "unit",
        "noise",
        "rms, training",
        "fit, training, %",
        "rms, validation",
        "fit, validation, %",
    ];
    let mut table = PageTable::new("How each output agrees with what was measured", &head);
    for (i, output) in fitted.signature.outputs.iter().enumerate() {
        let sets = [false, true].map(|is_valid| agreement(&fitted.traces, i, is_valid));
        if sets.iter().all(Option::is_none) {
            continue;
        }
        let entry = fitted.result.outputs.get(&*output.name);
        // The noise of innovations is no standard deviation of the residuals.
        let noise = entry.and_then(|entry| match &entry.noise {
            Some(NoiseEntry::Std(std)) => Some(*std),
            Some(NoiseEntry::Estimate(_)) | None => None,
        });
        let mut row =
            vec![name(&output.name), unit(&of_differences(&output.unit).symbol), number(noise, 3)];
        for set in sets {
            row.push(number(set.map(|set| set.rms), 3));
            row.push(number(set.and_then(|set| set.fit_percent), 4));
        }
        table.rows.push(row);
    }
    let note = "Fit: 100 % less the part of the scatter of what was measured that the simulation leaves, as a root of \
                squares; 0 % is a simulation as good as the mean. rms: of measured less simulated.";
    let table = table.to_markup();
    if table.is_empty() { table } else { table.then(&Markup::text(note).caption()) }
}

/// The agreement of an output with all recordings of a set, over the samples that count.
pub(super) fn agreement(traces: &[PageTrace], output: usize, is_valid: bool) -> Option<Agreement> {
    let mut pairs = Vec::new();
    for trace in traces.iter().filter(|trace| trace.is_valid == is_valid) {
        let (Some(measured), Some(residuals)) = (&trace.measured[output], &trace.residuals[output])
        else {
            continue;
        };
        pairs.extend(measured.iter().zip(residuals).map(|(y, e)| (*y, y - e)));
    }
    Agreement::measure(pairs.into_iter())
}

/// One recording: its inputs, each output measured and simulated, and the residuals.
fn push_recording(page: &mut Page, signature: &Signature, trace: &PageTrace) {
    let role = if trace.is_valid { "validation" } else { "training" };
    let line = |name: &str, values: &[f64], meaning| PanelLine {
        name: MathText::plain(name),
        times: trace.times.clone(),
        values: values.to_vec(),
        meaning,
    };
    let (mut curves, mut errors) = (Vec::new(), Vec::new());
    let outputs = signature.outputs.iter().enumerate();
    for (i, output) in outputs {
        let (Some(measured), Some(standard)) = (&trace.measured[i], &trace.standard[i]) else {
            continue;
        };
        curves.push(PanelSubject {
            title: MathText::name(&output.name),
            unit: output.unit.symbol.to_string(),
            lines: vec![
                line("fitted", &trace.simulated[i], SeriesMeaning::Simulated),
                line("measured", measured, SeriesMeaning::Measured),
            ],
        });
        errors.push(PanelSubject {
            title: MathText::name(&output.name),
            unit: residuals::UNIT.to_owned(),
            lines: vec![line("measured − fitted", standard, SeriesMeaning::Residual)],
        });
    }
    let inputs = signature.inputs.iter().zip(&trace.inputs).enumerate();
    let inputs = inputs.map(|(k, (input, values))| PanelSubject {
        title: MathText::name(&input.name),
        unit: input.unit.symbol.to_string(),
        lines: vec![line("input", values, SeriesMeaning::Input(k))],
    });
    curves.extend(inputs);
    let link = ChartLink::With(&trace.name);
    let mut chart = |subjects: &[PanelSubject], caption: &str| {
        let figure = figure::panels(subjects);
        page.chart(&figure, link, &Markup::text(caption))
    };
    let curves = chart(&curves, "Measured and fitted, then the inputs.");
    let note = "Measured less fitted, over the standard deviation σ of each sample; samples that do not count are left \
                out.";
    let errors = chart(&errors, note);
    page.push_section(&format!("`{}`, {role}", trace.name), &[curves, errors]);
}

/// A figure of panels.
fn grid(x_label: MathText, panels: Vec<dgd_plot::Panel>) -> Figure {
    Figure::new(x_label, panels)
}

/// A cell for a remark, which may be long.
fn remark(words: &str) -> PageCell {
    PageCell::text(Markup::prose(words))
}
