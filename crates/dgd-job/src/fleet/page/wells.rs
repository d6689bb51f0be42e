//! A page of a hundred wells: missing terms of each, parameters over time with bands, and a row for each occasion.

use std::ops::Range;

use dgd_page::{ChartLink, HeadlineTone, Markup, Page, PageCell, PageOrigin, PageTable};
use dgd_plot::{Envelope, Figure, MathText, Panel, PlotSeries, SeriesStyle};

use super::super::reading::{FleetEstimate, IntervalSource, PeriodResults};
use super::super::{AssetResults, FILES, Fleet};
use super::charts::{of_well, title, unit};
use super::time::TimeAxis;
use super::{count, name, said};

/// Share of its slot on the axis that a well takes, so that neighbours stay separate.
const TAKEN: f64 = 0.7;

pub(super) fn page(
    fleet: &Fleet,
    number: usize,
    wells: Range<usize>,
    axis: &TimeAxis,
    origin: &PageOrigin,
) -> String {
    let (first, last) = (&fleet.wells[wells.start].name, &fleet.wells[wells.end - 1].name);
    let heading = if first == last { first.clone() } else { format!("{first} to {last}") };
    let mut page = Page::new(&heading);
    let kind = Markup::text(&format!("Wells, page {number} of {}", count(fleet)));
    let more = [links(fleet, number)];
    let has_reason = fleet.first.iter().any(|(well, _)| wells.contains(well));
    let tone = if has_reason { HeadlineTone::Doubt } else { HeadlineTone::Good };
    page.push_header(&kind, &Markup::text(&heading), tone, &more);
    let figure = figure(fleet, wells.clone(), axis);
    let note = "Each well has a place, in which its occasions run from left to right; bars hold the truth in 95 of 100 cases. \
                Shaded: where nine tenths of all wells are.";
    let chart = page.chart(&figure, ChartLink::Alone, &Markup::text(note));
    page.push_section("Parameters over wells and time", &[chart]);
    page.push_section("What they lack, and why to look at them", &[summary(fleet, wells.clone())]);
    page.push_section("All occasions", &[occasions(fleet, wells)]);
    page.finish(origin)
}

/// Links to the adjacent pages, and to the first.
fn links(fleet: &Fleet, number: usize) -> Markup {
    let mut links = Markup::text("All wells").linked(FILES[0]);
    let sides = [
        (number > 1, number.wrapping_sub(1), "Before"),
        (number < count(fleet), number + 1, "Next"),
    ];
    for (is_there, page, words) in sides {
        if is_there {
            links = links.then(&Markup::text(" · ")).then(&Markup::text(words).linked(&name(page)));
        }
    }
    links.paragraph()
}

/// A row for each well: its missing terms since when, its distance from the others, and the reasons to look at it.
fn summary(fleet: &Fleet, wells: Range<usize>) -> Markup {
    let mut table =
        PageTable::new("Wells", &["", "well", "lacks", "since", "distance", "why to look at it"]);
    for w in wells {
        let well = &fleet.wells[w];
        let is_searched = well.occasions.iter().any(|found| found.search.is_some());
        let lacks = well.lacks.iter().map(|lack| said(&lack.name)).collect::<Vec<_>>().join(", ");
        let since = well.lacks.iter().map(|lack| match lack.onset {
            Some(onset) => format!("{} ({} s)", lack.since, dgd_work::shown(onset, None)),
            None => lack.since.clone(),
        });
        let lacks = match (is_searched, lacks.is_empty()) {
            (false, _) => "–".to_owned(),
            (true, true) => "nothing".to_owned(),
            (true, false) => lacks,
        };
        let distance = fleet.compared.distances[w].map(|distance| distance.value);
        let shown = distance.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"));
        let why = fleet.first.iter().filter(|(of, _)| *of == w).map(|(_, reason)| reason.words());
        table.rows.push(vec![
            PageCell::number(&(w + 1).to_string(), Some((w + 1) as f64)),
            PageCell::text(Markup::text(&well.name)),
            PageCell::text(Markup::prose(&lacks)),
            PageCell::text(Markup::text(&since.collect::<Vec<_>>().join(", "))),
            PageCell::number(&shown, distance),
            PageCell::text(Markup::prose(&why.collect::<Vec<_>>().join("; "))),
        ]);
    }
    table.to_markup()
}

/// A panel for each parameter, with a slot on the axis for each well.
fn figure(fleet: &Fleet, wells: Range<usize>, axis: &TimeAxis) -> Figure {
    let times = || {
        fleet.wells.iter().flat_map(|well| &well.occasions).map(|found| axis.position(&found.when))
    };
    let first = times().fold(f64::INFINITY, f64::min);
    let span = times().fold(f64::NEG_INFINITY, f64::max) - first;
    let position = |w: usize, t: f64| {
        let within = if span > 0.0 { (t - first) / span - 0.5 } else { 0.0 };
        w as f64 + 1.0 + TAKEN * within
    };
    let panel = |parameter: usize| {
        let name = &fleet.parameters[parameter].0;
        let (mut x, mut y, mut bars_x, mut bars_y) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for w in wells.clone() {
            for (t, estimate) in of_well(&fleet.wells[w], name, axis) {
                let place = position(w, t);
                x.push(place);
                y.push(estimate.value);
                let (low, high) = estimate.band.unwrap_or((f64::NAN, f64::NAN));
                bars_x.extend([place, place, place]);
                bars_y.extend([low, high, f64::NAN]);
            }
        }
        let ends = vec![wells.start as f64 + 0.5, wells.end as f64 + 0.5];
        let (low, high) = bulk(fleet, name);
        let envelope =
            Envelope { x: ends, low: vec![low; 2], high: vec![high; 2], ..Envelope::default() };
        Panel {
            title: title(fleet, parameter),
            y_label: unit(fleet, parameter),
            series: vec![
                PlotSeries::new(MathText::plain("estimates"), SeriesStyle::Dots, x, y),
                PlotSeries::new(MathText::plain("95 %"), SeriesStyle::ThinLine, bars_x, bars_y),
            ],
            envelopes: vec![envelope],
            ..Panel::default()
        }
    };
    let mut figure = Figure::new(
        MathText::plain("Wells, by number"),
        (0..fleet.parameters.len()).map(panel).collect(),
    );
    figure.columns = 1;
    figure
}

/// The 90 % range of all last estimates.
fn bulk(fleet: &Fleet, name: &str) -> (f64, f64) {
    let value = |well: &AssetResults| well.latest()?.estimate(name).map(|estimate| estimate.value);
    let mut values: Vec<f64> = fleet.wells.iter().filter_map(value).collect();
    values.sort_by(f64::total_cmp);
    let quantile = |share: f64| values.get((share * values.len() as f64) as usize).copied();
    (quantile(0.05).unwrap_or(f64::NAN), quantile(0.95).unwrap_or(f64::NAN))
}

/// A row for each occasion of each well.
fn occasions(fleet: &Fleet, wells: Range<usize>) -> Markup {
    let mut table = PageTable::new("All occasions", &["well", "when", "lacks", "fit"]);
    for (name, unit) in &fleet.parameters {
        let unit =
            if unit == "1" { Markup::default() } else { Markup::from(&MathText::unit(unit)) };
        table.head.push(Markup::code(name).then(&Markup::text(" ")).then(&unit));
    }
    for well in &fleet.wells[wells] {
        for found in &well.occasions {
            let lacks = found.search.as_ref().map(|search| {
                let names: Vec<String> =
                    search.missing.iter().map(|(name, _)| said(name)).collect();
                if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
            });
            let mut row = vec![
                PageCell::text(Markup::text(&well.name)),
                PageCell::text(Markup::text(&found.when)),
                PageCell::text(Markup::prose(&lacks.unwrap_or_else(|| "–".to_owned()))),
                PageCell::text(Markup::prose(&fit(found))),
            ];
            row.extend(fleet.parameters.iter().map(|(name, _)| number(found.estimate(name))));
            table.rows.push(row);
        }
    }
    table.to_markup()
}

/// Remarks on a fit.
fn fit(found: &PeriodResults) -> String {
    let mut remarks = Vec::new();
    match &found.fit {
        None => {}
        Some(Ok(())) => remarks.push("converged".to_owned()),
        Some(Err(why)) => remarks.push(format!("not converged: {why}")),
    }
    if let Some((led, of)) = found.starts {
        remarks.push(format!("{led} of {of} starting points led there"));
    }
    remarks.extend(found.failures.iter().map(|(what, why)| format!("{what} failed: {why}")));
    match found.open {
        0 => {}
        1 => remarks.push("1 piece has no result yet".to_owned()),
        n => remarks.push(format!("{n} pieces have no result yet")),
    }
    if remarks.is_empty() { "–".to_owned() } else { remarks.join("; ") }
}

/// An estimate with its deviation, or with its confidence interval if that comes from another method.
fn number(estimate: Option<&FleetEstimate>) -> PageCell {
    let Some(estimate) = estimate else { return PageCell::number("–", None) };
    let shown = match (estimate.by, estimate.band) {
        (IntervalSource::Profile | IntervalSource::Replicates(_), Some((low, high))) => {
            let std = 0.25 * (high - low);
            let [low, value, high] =
                [low, estimate.value, high].map(|value| dgd_work::shown_like(value, std));
            format!("{value} ({low} to {high})")
        }
        _ => dgd_work::shown(estimate.value, estimate.std),
    };
    PageCell::number(&shown, Some(estimate.value))
}
