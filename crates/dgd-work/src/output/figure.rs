//! Panels of result figures.

use dgd_plot::{Envelope, Figure, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle};

/// Content of one panel.
#[derive(Debug, Clone)]
pub(crate) struct PanelSubject {
    pub title: MathText,
    /// Unit of its axis.
    pub unit: String,
    pub lines: Vec<PanelLine>,
}

/// One line of a panel, in the panel's unit.
#[derive(Debug, Clone)]
pub(crate) struct PanelLine {
    pub name: MathText,
    pub times: Vec<f64>,
    pub values: Vec<f64>,
    /// Its meaning; measurements and residuals are drawn thin.
    pub meaning: SeriesMeaning,
}

/// A figure with one panel for each subject over a common time axis.
pub(crate) fn panels(subjects: &[PanelSubject]) -> Figure {
    let panels = subjects
        .iter()
        .map(|subject| Panel {
            title: subject.title.clone(),
            y_label: MathText::default().with_unit(&subject.unit),
            series: subject
                .lines
                .iter()
                .map(|line| PlotSeries {
                    name: line.name.clone(),
                    style: match line.meaning {
                        SeriesMeaning::Measured | SeriesMeaning::Residual => SeriesStyle::ThinLine,
                        _ => SeriesStyle::Line,
                    },
                    meaning: line.meaning,
                    x: line.times.clone(),
                    y: line.values.clone(),
                    labels: Vec::new(),
                })
                .collect(),
            ..Panel::default()
        })
        .collect();
    Figure::new(MathText::plain("Time").with_unit("s"), panels)
}

/// Differences as dots, with the band of ± 2 standard deviations that contains 95 % of them.
pub(crate) fn differences(
    title: MathText,
    unit: &str,
    times: &[f64],
    values: Vec<f64>,
    std: &[f64],
) -> Panel {
    let edge = |k: f64| std.iter().map(|std| k * std).collect();
    Panel {
        title,
        y_label: MathText::default().with_unit(unit),
        series: vec![PlotSeries {
            meaning: SeriesMeaning::Residual,
            ..PlotSeries::new(MathText::default(), SeriesStyle::Dots, times.to_vec(), values)
        }],
        envelopes: vec![Envelope {
            name: MathText::default(),
            around: Some(0),
            x: times.to_vec(),
            low: edge(-2.0),
            high: edge(2.0),
        }],
        ..Panel::default()
    }
}

/// Panels of computed and recorded values, with their differences at the side.
pub(crate) fn beside(
    subjects: &[PanelSubject],
    differences: Vec<Panel>,
    x_label: MathText,
) -> Figure {
    let panels = panels(subjects).panels.into_iter().zip(differences);
    let panels: Vec<Panel> = panels.flat_map(|(signals, rest)| [signals, rest]).collect();
    Figure { columns: 2, ..Figure::new(x_label, panels) }
}
