//! Figures over all wells: each parameter over wells and over time, and distances between wells.

use dgd_page::{ChartLink, Markup, Page};
use dgd_plot::{Envelope, Figure, MathText, Panel, PlotSeries, SeriesStyle};

use super::super::first::TriageReason;
use super::super::reading::FleetEstimate;
use super::super::{AssetResults, Fleet};
use super::time::TimeAxis;

/// Wells drawn individually in a figure over time, the most urgent.
const SHOWN: usize = 5;

/// Number of intervals for quantiles over time.
const STRETCHES: usize = 24;

/// `c0, m`.
pub(super) fn title(fleet: &Fleet, parameter: usize) -> MathText {
    MathText::name(&fleet.parameters[parameter].0)
}

/// The unit for an axis.
pub(super) fn unit(fleet: &Fleet, parameter: usize) -> MathText {
    MathText::unit(&fleet.parameters[parameter].1)
}

/// The last estimate of a well.
fn latest<'a>(well: &'a AssetResults, name: &str) -> Option<&'a FleetEstimate> {
    well.latest()?.estimate(name)
}

/// Estimates of all wells in ascending order, with their bands.
pub(super) fn over_wells(page: &mut Page, fleet: &Fleet) -> Markup {
    let panel = |parameter: usize| {
        let name = &fleet.parameters[parameter].0;
        let mut estimates: Vec<&FleetEstimate> =
            fleet.wells.iter().filter_map(|well| latest(well, name)).collect();
        estimates.sort_by(|a, b| a.value.total_cmp(&b.value));
        let x: Vec<f64> = (1..=estimates.len()).map(|k| k as f64).collect();
        let y = estimates.iter().map(|estimate| estimate.value).collect();
        let end = |high: bool| {
            let end = |one: &&FleetEstimate| {
                one.band.map_or(f64::NAN, |band| if high { band.1 } else { band.0 })
            };
            estimates.iter().map(end).collect()
        };
        let band = Envelope {
            name: MathText::plain("95 %"),
            around: Some(0),
            x: x.clone(),
            low: end(false),
            high: end(true),
        };
        Panel {
            title: title(fleet, parameter),
            y_label: unit(fleet, parameter),
            series: vec![PlotSeries::new(MathText::plain("estimates"), SeriesStyle::Dots, x, y)],
            envelopes: vec![band],
            ..Panel::default()
        }
    };
    let panels = (0..fleet.parameters.len()).map(panel).collect();
    let figure = Figure::new(MathText::plain("Wells, by the estimate"), panels);
    page.chart(&figure, ChartLink::Alone, &Markup::default())
}

/// The 50 % and 90 % bands of the wells over time, and the most urgent wells individually.
pub(super) fn over_time(page: &mut Page, fleet: &Fleet, axis: &TimeAxis) -> Markup {
    if fleet.wells.iter().all(|well| well.occasions.len() < 2) {
        return Markup::default();
    }
    let mut chosen: Vec<usize> = Vec::new();
    for (well, reason) in &fleet.first {
        let is_of_numbers = matches!(reason, TriageReason::Moved(..) | TriageReason::Unlike(..));
        if is_of_numbers && chosen.len() < SHOWN && !chosen.contains(well) {
            chosen.push(*well);
        }
    }
    let panels = (0..fleet.parameters.len()).map(|parameter| {
        let name = &fleet.parameters[parameter].0;
        let points = fleet.wells.iter().flat_map(|well| of_well(well, name, axis));
        let [x, low, quarter, middle, above, high] =
            stretches(points.map(|(t, e)| (t, e.value)).collect());
        let mut series =
            vec![PlotSeries::new(MathText::plain("median"), SeriesStyle::Line, x.clone(), middle)];
        let band = |name: &str, low, high| Envelope {
            name: MathText::plain(name),
            around: Some(0),
            x: x.clone(),
            low,
            high,
        };
        let envelopes =
            vec![band("nine tenths of the wells", low, high), band("half of them", quarter, above)];
        for well in &chosen {
            let well = &fleet.wells[*well];
            let (t, y): (Vec<f64>, Vec<f64>) =
                of_well(well, name, axis).map(|(t, estimate)| (t, estimate.value)).unzip();
            series.push(PlotSeries::new(MathText::plain(&well.name), SeriesStyle::ThinLine, t, y));
        }
        Panel {
            title: title(fleet, parameter),
            y_label: unit(fleet, parameter),
            series,
            envelopes,
            ..Panel::default()
        }
    });
    let figure = Figure::new(MathText::plain(axis.label()), panels.collect());
    let note = if chosen.is_empty() {
        "Where half and nine tenths of the wells are."
    } else {
        "Where half and nine tenths of the wells are, and the wells whose numbers are to be looked at first. The pages of the \
         wells have all."
    };
    page.chart(&figure, ChartLink::With("time"), &Markup::text(note))
}

/// Estimates of a well with their times.
pub(super) fn of_well<'a>(
    well: &'a AssetResults,
    name: &'a str,
    axis: &'a TimeAxis,
) -> impl Iterator<Item = (f64, &'a FleetEstimate)> {
    let one = move |found: &'a super::super::reading::PeriodResults| {
        Some((axis.position(&found.when), found.estimate(name)?))
    };
    well.occasions.iter().filter_map(one)
}

/// Times, and the quantiles 5, 25, 50, 75 and 95 % of the points in each interval.
fn stretches(mut points: Vec<(f64, f64)>) -> [Vec<f64>; 6] {
    let mut columns: [Vec<f64>; 6] = Default::default();
    points.retain(|(t, y)| t.is_finite() && y.is_finite());
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return columns };
    let width = (last.0 - first.0) / STRETCHES as f64;
    let place = |t: f64| if width > 0.0 { ((t - first.0) / width) as usize } else { 0 };
    for stretch in
        points.chunk_by(|a, b| place(a.0).min(STRETCHES - 1) == place(b.0).min(STRETCHES - 1))
    {
        let times = stretch.iter().map(|(t, _)| t).sum::<f64>();
        columns[0].push(times / stretch.len() as f64);
        let mut values: Vec<f64> = stretch.iter().map(|(_, y)| *y).collect();
        values.sort_by(f64::total_cmp);
        for (column, share) in columns[1..].iter_mut().zip([0.05, 0.25, 0.5, 0.75, 0.95]) {
            column.push(quantile(&values, share));
        }
    }
    columns
}

/// A quantile of sorted values, interpolated linearly.
fn quantile(values: &[f64], share: f64) -> f64 {
    let place = share * (values.len() - 1) as f64;
    let (below, above) = (values[place.floor() as usize], values[place.ceil() as usize]);
    below + (place - place.floor()) * (above - below)
}

/// Distances of all wells in the order of the job.
pub(super) fn distances(page: &mut Page, fleet: &Fleet) -> Markup {
    let known: Vec<(f64, f64, bool)> = (fleet.compared.distances.iter().enumerate())
        .filter_map(|(w, one)| one.map(|one| (w as f64 + 1.0, one.value, one.is_unlike)))
        .collect();
    if known.is_empty() {
        return Markup::default();
    }
    let points = |unlike: bool| -> (Vec<f64>, Vec<f64>) {
        known.iter().filter(|one| one.2 == unlike).map(|one| (one.0, one.1)).unzip()
    };
    let mut series = Vec::new();
    for (name, style, is_unlike) in
        [("like the others", SeriesStyle::Dots, false), ("unlike", SeriesStyle::Marks, true)]
    {
        let (x, y) = points(is_unlike);
        if !x.is_empty() {
            series.push(PlotSeries::new(MathText::plain(name), style, x, y));
        }
    }
    let panel = Panel {
        title: MathText::plain("Distance from the bulk"),
        y_label: MathText::plain("Standard deviations"),
        series,
        ..Panel::default()
    };
    let figure = Figure::new(MathText::plain("Wells, in the order of the job"), vec![panel]);
    let note = "How far the last estimates of a well are from those of the bulk, as correlated as these are. Unlike is what chance \
                shows in a few fleets of a hundred.";
    page.chart(&figure, ChartLink::Alone, &Markup::text(note))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_of_time_have_their_quantiles() {
        let points = (0..=100).map(|k| (0.0, f64::from(k))).chain([(10.0, 7.0), (f64::NAN, 1.0)]);
        let columns = stretches(points.collect());
        assert_eq!(columns[0], [0.0, 10.0]);
        assert_eq!(
            [columns[1][0], columns[2][0], columns[3][0], columns[4][0], columns[5][0]],
            [5.0, 25.0, 50.0, 75.0, 95.0]
        );
        assert_eq!((columns[1][1], columns[5][1]), (7.0, 7.0));
        assert!(stretches(Vec::new()).iter().all(Vec::is_empty));
    }
}
