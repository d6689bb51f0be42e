//! The page of sensitivities: their sizes and times, curves, and undefined intervals.

use dgd_page::{HeadlineTone, Markup, Page, PageCell, PageTable};

use super::Sensitivities;
use super::verify::VerificationReport;
use crate::output::page::{TIME, number, origin, unit};
use crate::output::quantity::short;

pub(super) fn write(found: &Sensitivities, command: &str) -> String {
    let mut page = Page::new(&format!("{}: sensitivities", found.model));
    let kind = Markup::text("Sensitivities of the model ").then(&Markup::code(&found.model));
    let (headline, tone) = headline(found);
    page.push_header(&kind, &Markup::prose(&headline), tone, &[sizes(found)]);
    let chart = page.chart(&found.figure(), TIME, &Markup::default());
    page.push_section("Over time", &[chart]);
    page.push_section("Where a derivative is not defined", &[undefined(found)]);
    let verified = found.verification.as_ref().map(VerificationReport::to_text);
    let verified = verified.map(|text| {
        Markup::trusted(format!("<pre tabindex=\"0\">{}</pre>\n", Markup::text(&text)))
    });
    page.push_section("Against differences of runs", verified.as_slice());
    page.finish(&origin(&found.provenance, command))
}

fn headline(found: &Sensitivities) -> (String, HeadlineTone) {
    if let Some(error) = &found.stopped {
        return (format!("The run stopped: {error}"), HeadlineTone::Doubt);
    }
    if let Some(wrong) = found.verification.as_ref().and_then(VerificationReport::wrong) {
        return (wrong, HeadlineTone::Doubt);
    }
    let names: Vec<String> =
        found.trajectories.iter().map(|one| format!("`{}`", one.name)).collect();
    let n = found.table.columns.len();
    let noun = if n == 1 { "derivative" } else { "derivatives" };
    let checked = if found.verification.is_some() { ", equal to differences of runs" } else { "" };
    (format!("{n} {noun} of {}{checked}", names.join(", ")), HeadlineTone::Plain)
}

/// The largest value of each derivative, and its time.
fn sizes(found: &Sensitivities) -> Markup {
    let head = ["derivative", "unit", "largest", "at, s", "root mean square", "at the end"];
    let mut table = PageTable::new("How large the derivatives are", &head);
    for (column, title) in found.table.columns.iter().zip(&found.titles) {
        let values = column.in_unit();
        let finite = || values.iter().enumerate().filter(|(_, value)| value.is_finite());
        let largest = finite().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let count = finite().count().max(1) as f64;
        let rms = (finite().map(|(_, value)| value * value).sum::<f64>() / count).sqrt();
        table.rows.push(vec![
            PageCell::text(Markup::from(title)),
            unit(&column.unit.symbol),
            number(largest.map(|(_, value)| *value), 4),
            number(largest.and_then(|(k, _)| found.table.times.get(k).copied()), 4),
            number(Some(rms), 4),
            number(values.last().copied(), 4),
        ]);
    }
    table.to_markup()
}

fn undefined(found: &Sensitivities) -> Markup {
    let mut table =
        PageTable::new("Where a derivative is not defined", &["from, s", "until, s", "because of"]);
    for stretch in &found.undefined {
        let cells = [stretch.from, stretch.until].map(|t| PageCell::number(&short(t, 6), Some(t)));
        let because = PageCell::text(Markup::code(&stretch.equation));
        table.rows.push(cells.into_iter().chain([because]).collect());
    }
    table.to_markup()
}
