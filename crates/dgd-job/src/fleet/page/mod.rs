//! Pages over all wells: a first page with the most urgent wells and the distributions of parameters, and pages with a
//! hundred wells each.

mod charts;
mod time;
mod wells;

use dgd_page::{HeadlineTone, Markup, Page, PageCell, PageOrigin, PageTable};

use super::table::{comparison, headline, missing, progress};
use super::{FILES, Fleet};

/// Wells on a page: as many as a figure can show legibly.
const EACH: usize = 100;

/// Reasons listed on the first page; the pages of the wells have all.
const MOST_LISTED: usize = 100;

/// Wells listed by name for a missing term.
const MOST_NAMED: usize = 12;

/// Number of pages of wells.
pub(super) fn count(fleet: &Fleet) -> usize {
    fleet.wells.len().div_ceil(EACH)
}

/// The file of a page of wells, counted from 1.
pub(super) fn name(page: usize) -> String {
    format!("wells_{page}.html")
}

/// All pages.
pub(super) fn all(fleet: &Fleet, command: &str) -> Vec<(String, Vec<u8>)> {
    let origin = origin(fleet, command);
    let axis = time::TimeAxis::from_fleet(fleet);
    let mut pages = vec![(FILES[0].to_owned(), index(fleet, &axis, &origin).into_bytes())];
    for page in 1..=count(fleet) {
        let wells = (page - 1) * EACH..(page * EACH).min(fleet.wells.len());
        pages.push((name(page), wells::page(fleet, page, wells, &axis, &origin).into_bytes()));
    }
    pages
}

fn origin(fleet: &Fleet, command: &str) -> PageOrigin {
    let row = |(model, wells): &(String, usize)| (model.clone(), format!("{wells} wells"));
    PageOrigin {
        command: command.to_owned(),
        version: format!("{} ({})", fleet.identity.version, fleet.identity.build),
        seed: fleet.seed,
        models: fleet.models.iter().map(row).collect(),
        data: Vec::new(),
    }
}

/// A link to the page with a well.
fn link_to(fleet: &Fleet, well: usize) -> Markup {
    Markup::text(&fleet.wells[well].name).linked(&name(well / EACH + 1))
}

fn index(fleet: &Fleet, axis: &time::TimeAxis, origin: &PageOrigin) -> String {
    let mut page = Page::new("Fleet");
    let tone = if fleet.first.is_empty() { HeadlineTone::Good } else { HeadlineTone::Doubt };
    let more = [Markup::text(&progress(fleet)).then(&Markup::text(".")).paragraph(), first(fleet)];
    page.push_header(&Markup::text("Fleet"), &Markup::text(&headline(fleet)), tone, &more);
    page.push_section("What is missing", &[missing_table(fleet)]);
    let pages: Vec<Markup> = (1..=count(fleet)).map(|number| link_to_page(fleet, number)).collect();
    page.push_section("Wells, page by page", &[Markup::list(&pages)]);
    let over_wells = charts::over_wells(&mut page, fleet);
    let note = "The last estimate of each well with the band that holds the truth in 95 of 100 cases, in the order of the \
                estimates.";
    page.push_section("Parameters over wells", &[over_wells, Markup::text(note).caption()]);
    let over_time = charts::over_time(&mut page, fleet, axis);
    page.push_section("Parameters over time", &[over_time]);
    let compared = Markup::prose(&comparison(fleet)).then(&Markup::text(".")).paragraph();
    let distances = charts::distances(&mut page, fleet);
    page.push_section("How far wells are from the others", &[compared, distances]);
    page.finish(origin)
}

fn link_to_page(fleet: &Fleet, number: usize) -> Markup {
    let (from, until) = ((number - 1) * EACH, (number * EACH).min(fleet.wells.len()) - 1);
    let (from, until) = (&fleet.wells[from].name, &fleet.wells[until].name);
    let names = if from == until { from.clone() } else { format!("{from} to {until}") };
    Markup::text(&names).linked(&name(number))
}

/// The table of what to look at first.
fn first(fleet: &Fleet) -> Markup {
    let mut table = PageTable::new("What to look at first", &["", "well", "why"]);
    for (k, (well, reason)) in fleet.first.iter().take(MOST_LISTED).enumerate() {
        table.rows.push(vec![
            PageCell::number(&(k + 1).to_string(), Some((k + 1) as f64)),
            PageCell::text(link_to(fleet, *well)),
            PageCell::text(Markup::prose(&reason.words())),
        ]);
    }
    let table = table.to_markup();
    match fleet.first.len().checked_sub(MOST_LISTED) {
        Some(more @ 1..) => table
            .then(&Markup::text(&format!("{more} more are on the pages of the wells.")).caption()),
        _ => table,
    }
}

fn missing_table(fleet: &Fleet) -> Markup {
    let mut table = PageTable::new(
        "What is missing",
        &["missing", "wells", "only since the last search", "which"],
    );
    for one in missing(fleet) {
        let number = |n: usize| PageCell::number(&n.to_string(), Some(n as f64));
        let mut which = Markup::default();
        for (k, well) in one.wells.iter().take(MOST_NAMED).enumerate() {
            let comma = Markup::text(if k == 0 { "" } else { ", " });
            which = which.then(&comma).then(&link_to(fleet, *well));
        }
        if one.wells.len() > MOST_NAMED {
            which =
                which.then(&Markup::text(&format!(" and {} more", one.wells.len() - MOST_NAMED)));
        }
        table.rows.push(vec![
            PageCell::text(Markup::prose(&said(one.name))),
            number(one.wells.len()),
            number(one.new),
            PageCell::text(which),
        ]);
    }
    table.to_markup()
}

/// Quotes the name of an effect, but not the description of an unknown term.
fn said(name: &str) -> String {
    if name.contains(' ') { name.to_owned() } else { format!("`{name}`") }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::reading::{FleetEstimate, IntervalSource, PeriodResults};
    use super::super::{AssetResults, FleetCounts, changes, first, unlike};
    use super::*;
    use crate::identity::BuildIdentity;

    /// Bytes of the largest page of wells that a browser opens at once.
    const MOST_BYTES: usize = 4_000_000;

    /// Wells at two occasions with two parameters, all different but similar, except one outlier.
    fn fleet(n: usize, odd: usize) -> Fleet {
        let parameters = [("tau", "s"), ("gain", "K/W")].map(|(a, b)| (a.to_owned(), b.to_owned()));
        let estimate = |value: f64, std: f64, unit: &str| {
            let band = Some((value - 2.0 * std, value + 2.0 * std));
            FleetEstimate {
                value,
                std: Some(std),
                band,
                by: IntervalSource::Std,
                unit: unit.to_owned(),
            }
        };
        let findings = |w: usize, when: &str, later: f64| {
            // Two low-discrepancy sequences.
            let [a, b] = [0.754_877_666, 0.569_840_291].map(|step| (step * w as f64).fract());
            let gain = if w == odd { 9.0 } else { 0.5 + 0.1 * b };
            let estimates = vec![
                ("tau".to_owned(), estimate(100.0 + 10.0 * a + later, 0.5, "s")),
                ("gain".to_owned(), estimate(gain, 0.001, "K/W")),
            ];
            let (fit, degrees_of_freedom) = (Some(Ok(())), Some(500.0));
            PeriodResults {
                when: when.to_owned(),
                estimates,
                fit,
                degrees_of_freedom,
                ..PeriodResults::default()
            }
        };
        let well = |w: usize| AssetResults {
            name: format!("W-{w}"),
            occasions: vec![findings(w, "2024-03", 0.0), findings(w, "2025-03", 0.1)],
            lacks: Vec::new(),
            changes: Vec::new(),
        };
        let mut wells: Vec<AssetResults> = (0..n).map(well).collect();
        changes::find(&mut wells);
        let compared = unlike::compare(&wells, &parameters);
        let first = first::order(&wells, &compared, &parameters);
        let text = |text: &str| text.to_owned();
        let identity = BuildIdentity {
            version: text("1"),
            build: text("b"),
            platform: text("p"),
            arithmetic: text("a"),
        };
        let counts = FleetCounts { pieces: 2 * n, done: 2 * n, failed: 0 };
        let models = vec![("m.dgd".to_owned(), n)];
        let parameters = parameters.to_vec();
        Fleet { counts, parameters, wells, compared, first, identity, seed: 0, models }
    }

    #[test]
    fn ten_thousand_wells_are_a_hundred_pages_and_the_first_leads_to_the_odd_one() {
        let (n, odd) = (10_000, 7_777);
        let fleet = fleet(n, odd);
        let files: Vec<(String, String)> = (fleet.files("dgd job report").into_iter())
            .map(|(name, bytes)| (name, String::from_utf8(bytes).expect("text")))
            .collect();
        assert_eq!(files.len(), 1 + n / EACH + 2);
        let text = |name: &str| &files.iter().find(|file| file.0 == name).expect("it is there").1;
        let index = text("index.html");
        let numbers = 1..=n / EACH;
        assert!(numbers.clone().all(|k| index.contains(&format!("href=\"{}\"", name(k)))));
        assert!(index.contains(&format!("href=\"wells_78.html\">W-{odd}</a>")), "the odd one");
        let mut known = BTreeSet::new();
        for k in numbers {
            let page = text(&name(k));
            let on_page = (k - 1) * EACH..k * EACH;
            // A well appears in the figure, the table and the rows of its page, and on no other page.
            let is_there = |w: usize| page.contains(&format!(">W-{w}<"));
            assert!(on_page.clone().all(is_there), "page {k}");
            assert!(!is_there(on_page.start.wrapping_sub(1)) && !is_there(on_page.end), "page {k}");
            known.extend(on_page);
        }
        assert_eq!(known.len(), n);
        for (name, text) in files.iter().filter(|file| !FILES[1..].contains(&file.0.as_str())) {
            assert!(text.len() < MOST_BYTES, "{name} has {} bytes", text.len());
        }
        assert_eq!(text("wells.csv").lines().count(), 1 + 2 * n);
        assert_eq!(fleet.first.len(), 1, "one is odd, and none has moved");
    }
}
