//! Panels of result figures.

use dgd_plot::{Envelope, Figure, Meaning, Panel, Series, Style, Text};

/// Content of one panel.
#[derive(Debug, Clone)]
pub(crate) struct Subject {
    pub title: Text,
    /// Unit of its axis.
    pub unit: String,
    pub lines: Vec<Line>,
}

/// One line of a panel, in the panel's unit.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub name: Text,
    pub times: Vec<f64>,
    pub values: Vec<f64>,
    /// Its meaning; measurements and residuals are drawn thin.
    pub meaning: Meaning,
}

/// A figure with one panel for each subject over a common time axis.
pub(crate) fn panels(subjects: &[Subject]) -> Figure {
    let panels = subjects
        .iter()
        .map(|subject| Panel {
            title: subject.title.clone(),
            y_label: Text::default().with_unit(&subject.unit),
            series: subject
                .lines
                .iter()
                .map(|line| Series {
                    name: line.name.clone(),
                    style: match line.meaning {
                        Meaning::Measured | Meaning::Residual => Style::ThinLine,
                        _ => Style::Line,
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
    Figure::new(Text::plain("Time").with_unit("s"), panels)
}

/// Differences as dots, with the band of ± 2 standard deviations that contains 95 % of them.
pub(crate) fn differences(
    title: Text,
    unit: &str,
    times: &[f64],
    values: Vec<f64>,
    std: &[f64],
) -> Panel {
    let edge = |k: f64| std.iter().map(|std| k * std).collect();
    Panel {
        title,
        y_label: Text::default().with_unit(unit),
        series: vec![Series {
            meaning: Meaning::Residual,
            ..Series::new(Text::default(), Style::Dots, times.to_vec(), values)
        }],
        envelopes: vec![Envelope {
            name: Text::default(),
            around: Some(0),
            x: times.to_vec(),
            low: edge(-2.0),
            high: edge(2.0),
        }],
        ..Panel::default()
    }
}

/// Panels of computed and recorded values, with their differences at the side.
pub(crate) fn beside(subjects: &[Subject], differences: Vec<Panel>, x_label: Text) -> Figure {
    let panels = panels(subjects).panels.into_iter().zip(differences);
    let panels: Vec<Panel> = panels.flat_map(|(signals, rest)| [signals, rest]).collect();
    Figure { columns: 2, ..Figure::new(x_label, panels) }
}
