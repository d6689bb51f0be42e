//! The columns of a recording, with findings shaded.

use dgd_plot::{Figure, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle, ShadedBand};
use dgd_screen::Severity;

use super::notice::unit_of;
use super::{ScreenedRecording, apart};

/// Columns with the same unit share a panel if they measure the same quantity.
pub(crate) fn figure(one: &ScreenedRecording) -> Figure {
    let times = one.times();
    let groups = groups(one);
    let panel = |group: &Vec<usize>| {
        let columns = || group.iter().map(|i| &one.table.columns[*i]);
        let faults = one.notices.iter().filter(|notice| {
            notice.weight == Severity::Fault
                && columns().any(|column| notice.channels.contains(&column.name))
        });
        let least = times.last().copied().unwrap_or(0.0) / 400.0;
        let bands = faults
            .flat_map(|notice| &notice.stretches)
            .map(|stretch| {
                // Keeps a single sample visible.
                let spare = 0.5 * (least - (stretch.until - stretch.from)).max(0.0);
                ShadedBand { from: stretch.from - spare, to: stretch.until + spare }
            })
            .collect();
        let is_alone = group.len() == 1;
        let series: Vec<PlotSeries> = columns()
            .enumerate()
            .map(|(place, column)| {
                let (x, y) = (times.to_vec(), column.values.clone());
                let meaning =
                    if is_alone { SeriesMeaning::Measured } else { SeriesMeaning::Variant(place) };
                let line =
                    PlotSeries::new(MathText::name(&column.name), SeriesStyle::ThinLine, x, y);
                PlotSeries { meaning, ..line }
            })
            .collect();
        let title = match group.as_slice() {
            [only] => MathText::name(&one.table.columns[*only].name),
            _ => MathText::default(),
        };
        let unit = unit_of(one.table.columns[group[0]].unit.as_ref());
        let marks = marks(one, group);
        Panel {
            title,
            y_label: MathText::default().with_unit(&unit),
            series: series.into_iter().chain(marks).collect(),
            bands,
            ..Panel::default()
        }
    };
    let mut panels: Vec<Panel> = Vec::with_capacity(groups.len());
    for group in &groups {
        panels.push(panel(group));
        panels.extend(differences(one, group));
    }
    Figure { columns: 1, ..Figure::new(MathText::plain("Time").with_unit("s"), panels) }
}

/// Differences of columns of one quantity from the first of them.
fn differences(one: &ScreenedRecording, group: &[usize]) -> Option<Panel> {
    let (&first, others) = group.split_first()?;
    let columns = &one.table.columns;
    // In the colours of the panel above.
    let series = others.iter().enumerate().map(|(place, &other)| {
        let pairs = columns[other].values.iter().zip(&columns[first].values);
        let apart = pairs.map(|(other, first)| other - first).collect();
        let name = MathText::name(&columns[other].name);
        let line = PlotSeries::new(name, SeriesStyle::ThinLine, one.times().to_vec(), apart);
        PlotSeries { meaning: SeriesMeaning::Variant(place + 1), ..line }
    });
    let title = match others {
        [] => return None,
        [other] => format!("{} less {}", columns[*other].name, columns[first].name),
        _ => format!("less {}", columns[first].name),
    };
    Some(Panel {
        title: MathText::plain(&title),
        y_label: MathText::default().with_unit(&apart(&one.table, first)),
        series: series.collect(),
        ..Panel::default()
    })
}

/// Dots on outliers.
fn marks(one: &ScreenedRecording, group: &[usize]) -> Option<PlotSeries> {
    let times = one.times();
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for &column in group {
        let column = &one.table.columns[column];
        let spikes = one
            .notices
            .iter()
            .filter(|notice| notice.kind == "spikes" && notice.channels.contains(&column.name));
        for stretch in spikes.flat_map(|notice| &notice.stretches) {
            let first = times.partition_point(|t| *t < stretch.from);
            let end = times.partition_point(|t| *t <= stretch.until);
            x.extend_from_slice(&times[first..end]);
            y.extend_from_slice(&column.values[first..end]);
        }
    }
    let meaning = SeriesMeaning::Variant(group.len());
    if x.is_empty() {
        return None;
    }
    Some(PlotSeries {
        meaning,
        ..PlotSeries::new(MathText::plain("spikes"), SeriesStyle::Dots, x, y)
    })
}

/// Columns of the same quantity together, the others alone; columns without values are left out.
fn groups(one: &ScreenedRecording) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for column in 0..one.table.columns.len() {
        if one.screening.channels[column].samples == 0 {
            continue;
        }
        let related = |group: &&mut Vec<usize>| {
            one.screening
                .comparisons
                .iter()
                .any(|pair| pair.channels[1] == column && group.contains(&pair.channels[0]))
        };
        match groups.iter_mut().find(related) {
            Some(group) => group.push(column),
            None => groups.push(vec![column]),
        }
    }
    groups
}
