//! Figures of the residuals of the training recordings: correlations, dependence on inputs, and distribution.

use dgd_page::{ChartLink, Markup, Page};
use dgd_plot::{Envelope, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle};
use dgd_runtime::Signature;
use dgd_screen::normality::{histogram, normal_quantiles};

use super::diagnosis::{Diagnosis, OutputTests};
use super::grid;
use super::traces::PageTrace;

/// The unit of residuals over their standard deviations.
pub(super) const UNIT: &str = "σ";

/// The normal distribution drawn with residuals.
const LAW: SeriesMeaning = SeriesMeaning::Variant(1);

/// Points of a QQ plot.
const QUANTILES: usize = 400;

/// Half width of the normal curve in standard deviations, and its points.
const REACH: f64 = 4.0;
const POINTS: usize = 121;

/// Adds all sections.
pub(super) fn push(
    page: &mut Page,
    signature: &Signature,
    traces: &[PageTrace],
    diagnosis: &Diagnosis,
) {
    let outputs = || signature.outputs.iter().zip(&diagnosis.outputs);
    let whiteness = outputs().filter_map(|(output, tested)| {
        let test = tested.whiteness.as_ref()?;
        Some(lags(
            MathText::name(&output.name),
            &test.autocorrelation,
            1,
            test.limit,
            tested.spacing,
        ))
    });
    let figure = grid(MathText::plain("Lag").with_unit("s"), whiteness.collect());
    let note = "Training recordings. Shaded: where 95 % of the values of white noise lie.";
    let chart = page.chart(&figure, ChartLink::With("lag"), &Markup::text(note));
    page.push_section("Residuals: autocorrelation", &[chart]);

    let inputs: Vec<Panel> =
        outputs().flat_map(|(output, tested)| by_input(signature, &output.name, tested)).collect();
    let figure = grid(MathText::plain("Lag").with_unit("s"), inputs);
    let note = "How residuals follow an input that came so much earlier. Shaded: where 95 % lie where they do not \
                depend on it.";
    let chart = page.chart(&figure, ChartLink::With("lag"), &Markup::text(note));
    page.push_section("Residuals: cross-correlation with the inputs", &[chart]);

    let charts: Vec<Markup> =
        (0..signature.inputs.len()).map(|i| against(page, signature, traces, i)).collect();
    page.push_section("Residuals against each input", &charts);
    push_distribution(page, signature, traces);
}

/// Correlations by lag; the first lag is `first` samples.
fn lags(title: MathText, values: &[f64], first: usize, limit: f64, spacing: f64) -> Panel {
    let x: Vec<f64> = (0..values.len()).map(|k| (k + first) as f64 * spacing).collect();
    let ends: Vec<f64> = x.first().into_iter().chain(x.last()).copied().collect();
    let name = MathText::plain("correlation");
    let line = PlotSeries::new(name, SeriesStyle::Line, x.clone(), values.to_vec());
    let series = PlotSeries { meaning: SeriesMeaning::Residual, ..line };
    Panel {
        title,
        y_label: MathText::default(),
        envelopes: vec![Envelope {
            name: MathText::plain("95 %"),
            around: None,
            low: vec![-limit; ends.len()],
            high: vec![limit; ends.len()],
            x: ends,
        }],
        series: vec![series],
        ..Panel::default()
    }
}

fn by_input(signature: &Signature, output: &str, tested: &OutputTests) -> Vec<Panel> {
    let inputs = signature.inputs.iter().zip(&tested.inputs);
    let panels = inputs.filter_map(|(input, test)| {
        let test = test.as_ref()?;
        let title =
            MathText::name(output).then(MathText::plain(" and ")).then(MathText::name(&input.name));
        Some(lags(title, &test.correlation, 0, test.limit, tested.spacing))
    });
    panels.collect()
}

/// The residuals of all outputs over one input.
fn against(page: &mut Page, signature: &Signature, traces: &[PageTrace], input: usize) -> Markup {
    let declared = &signature.inputs[input];
    let outputs = signature.outputs.iter().enumerate();
    let panels = outputs.filter_map(|(i, output)| {
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for trace in traces.iter().filter(|trace| !trace.is_valid) {
            let Some(residuals) = &trace.standard[i] else { continue };
            let counted = residuals.iter().zip(&trace.inputs[input]).filter(|(e, _)| e.is_finite());
            for (e, u) in counted {
                x.push(*u);
                y.push(*e);
            }
        }
        let changes = x.iter().any(|u| *u != x[0]);
        changes.then(|| Panel {
            title: MathText::name(&output.name),
            y_label: MathText::default().with_unit(UNIT),
            series: vec![PlotSeries {
                meaning: SeriesMeaning::Residual,
                ..PlotSeries::new(MathText::plain("residual"), SeriesStyle::Dots, x, y)
            }],
            ..Panel::default()
        })
    });
    let x_label = MathText::name(&declared.name).with_unit(&declared.unit.symbol);
    let figure = grid(x_label, panels.collect());
    page.chart(&figure, ChartLink::Alone, &Markup::default())
}

/// Histograms with the normal density, and QQ plots.
fn push_distribution(page: &mut Page, signature: &Signature, traces: &[PageTrace]) {
    let (mut histograms, mut quantiles) = (Vec::new(), Vec::new());
    for (i, output) in signature.outputs.iter().enumerate() {
        let Some(scaled) = scaled(traces, i) else { continue };
        histograms.extend(histogram_panel(MathText::name(&output.name), &scaled));
        quantiles.push(quantile_panel(MathText::name(&output.name), &scaled));
    }
    let label = MathText::plain("Residual, in its standard deviations");
    let histogram =
        page.chart(&grid(label, histograms), ChartLink::With("std"), &Markup::default());
    let label = MathText::plain("Quantile of the normal distribution");
    let note =
        "Dots on the line are normally distributed; dots that leave it at the ends are outliers.";
    let figure = grid(label, quantiles);
    let quantiles = page.chart(&figure, ChartLink::With("quantile"), &Markup::text(note));
    page.push_section("Residuals: distribution", &[histogram, quantiles]);
}

/// Residuals of an output over their own standard deviations, shifted to zero mean and scaled to unit variance.
fn scaled(traces: &[PageTrace], output: usize) -> Option<Vec<f64>> {
    let training = traces.iter().filter(|trace| !trace.is_valid);
    let values: Vec<f64> = training
        .filter_map(|trace| trace.standard[output].as_ref())
        .flatten()
        .copied()
        .filter(|e| e.is_finite())
        .collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let std = (values.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
    (std > 0.0).then(|| values.iter().map(|e| (e - mean) / std).collect())
}

fn histogram_panel(title: MathText, scaled: &[f64]) -> Option<Panel> {
    let bars = histogram(scaled)?;
    let bins = bars.edges.windows(2).zip(&bars.density);
    let (mut x, mut y) = (vec![bars.edges[0]], vec![0.0]);
    for (edges, density) in bins {
        x.extend_from_slice(edges);
        y.extend([*density; 2]);
    }
    x.extend(bars.edges.last());
    y.push(0.0);
    let normal_x: Vec<f64> =
        (0..POINTS).map(|k| REACH * (2.0 * k as f64 / (POINTS - 1) as f64 - 1.0)).collect();
    let law = |z: &f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let normal = normal_x.iter().map(law).collect();
    let line = |name: &str, meaning, x, y| PlotSeries {
        meaning,
        ..PlotSeries::new(MathText::plain(name), SeriesStyle::Line, x, y)
    };
    Some(Panel {
        title,
        y_label: MathText::plain("Density"),
        series: vec![
            line("residuals", SeriesMeaning::Residual, x, y),
            line("normal", LAW, normal_x, normal),
        ],
        ..Panel::default()
    })
}

fn quantile_panel(title: MathText, scaled: &[f64]) -> Panel {
    let (x, y): (Vec<f64>, Vec<f64>) = normal_quantiles(scaled, QUANTILES).into_iter().unzip();
    let ends: Vec<f64> = x.first().into_iter().chain(x.last()).copied().collect();
    let dots = PlotSeries::new(MathText::plain("residuals"), SeriesStyle::Dots, x, y);
    let dots = PlotSeries { meaning: SeriesMeaning::Residual, ..dots };
    let line = PlotSeries::new(MathText::plain("normal"), SeriesStyle::Line, ends.clone(), ends);
    let line = PlotSeries { meaning: LAW, ..line };
    Panel {
        title,
        y_label: MathText::plain("Residual"),
        series: vec![dots, line],
        ..Panel::default()
    }
}
