//! The figure of a comparison: each output as measured and by each contender, and the residuals.

use dgd_plot::{Figure, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle};

use super::FitComparison;
use crate::fit::page::traces::PageTrace;
use crate::output::figure::{PanelLine, PanelSubject, beside};

/// The figure of the first validation recording, or of the first training recording if there is none.
pub(super) fn figure(all: &FitComparison) -> Figure {
    let traces = &all.contenders[0].fitted.traces;
    let shown = traces.iter().position(|trace| trace.is_valid).unwrap_or(0);
    let Some(trace) = traces.get(shown) else {
        return Figure::new(MathText::default(), Vec::new());
    };
    let title = format!("Measured and contenders, {}", trace.name);
    Figure { title: MathText::plain(&title), ..of_recording(all, shown) }
}

/// The figure of one recording, with a line for each contender at the index of its label.
pub(super) fn of_recording(all: &FitComparison, recording: usize) -> Figure {
    let (mut subjects, mut errors) = (Vec::new(), Vec::new());
    for output in &all.common.outputs {
        let trace = |k: usize| -> Option<(&PageTrace, usize, f64)> {
            let (i, factor) = output.places[k];
            Some((all.contenders[k].fitted.traces.get(recording)?, i, factor))
        };
        let Some((first, i, _)) = trace(0) else { continue };
        let Some(measured) = &first.measured[i] else { continue };
        let unit_of_errors = noise(first, i);
        let errors_of_contender =
            |k: usize| trace(k).map(|(own, i, factor)| errors_of(own, i, factor, unit_of_errors));
        let residuals: Vec<Vec<f64>> =
            (0..all.contenders.len()).map(|k| errors_of_contender(k).unwrap_or_default()).collect();
        let line = |name: &str, values: Vec<f64>, meaning| PanelLine {
            name: MathText::plain(name),
            times: first.times.clone(),
            values,
            meaning,
        };
        let unit = |k: usize, i: usize| &all.contenders[k].fitted.signature.outputs[i].unit;
        let declared = unit(0, i);
        let mut lines: Vec<PanelLine> = Vec::with_capacity(all.contenders.len() + 1);
        for (k, one) in all.contenders.iter().enumerate() {
            let Some((errors_of_contender, i, _)) = trace(k) else { continue };
            let in_first = |w: &f64| declared.from_si(w * unit(k, i).factor + unit(k, i).offset);
            let values = errors_of_contender.simulated[i].iter().map(in_first).collect();
            lines.push(line(&one.label, values, SeriesMeaning::Variant(k)));
        }
        lines.push(line("measured", measured.clone(), SeriesMeaning::Measured));
        subjects.push(PanelSubject {
            title: MathText::name(&output.name),
            unit: declared.symbol.to_string(),
            lines,
        });
        let numbered = all.contenders.iter().zip(residuals).enumerate();
        let series = numbered.map(|(k, (one, y))| PlotSeries {
            meaning: SeriesMeaning::Variant(k),
            ..PlotSeries::new(
                MathText::plain(&one.label),
                SeriesStyle::ThinLine,
                first.times.clone(),
                y,
            )
        });
        errors.push(Panel {
            title: MathText::name(&output.name).then(MathText::plain(", measured less simulated")),
            y_label: MathText::default().with_unit("σ"),
            series: series.collect(),
            ..Panel::default()
        });
    }
    beside(&subjects, errors, MathText::plain("Time").with_unit("s"))
}

/// The standard deviation of an output's readings, if they have one.
fn noise(trace: &PageTrace, output: usize) -> Option<f64> {
    let changes = trace.deviances[output].is_some();
    let (raw, standard) = (trace.residuals[output].as_ref()?, trace.standard[output].as_ref()?);
    let mut pairs = raw.iter().zip(standard).map(|(e, z)| (e / z).abs());
    pairs.find(|sigma| sigma.is_finite() && *sigma > 0.0).filter(|_| !changes)
}

/// Residuals over their own standard deviations if those vary, and otherwise over that of the first contender, `sigma`,
/// so that contenders can be compared.
fn errors_of(own: &PageTrace, output: usize, factor: f64, sigma: Option<f64>) -> Vec<f64> {
    match sigma.filter(|_| own.deviances[output].is_none()) {
        Some(sigma) => own.residuals[output].iter().flatten().map(|e| e * factor / sigma).collect(),
        None => own.standard[output].clone().unwrap_or_default(),
    }
}
