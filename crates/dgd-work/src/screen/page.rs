//! `report.html`: the findings of all recordings, with a figure of each.

use askama::Template;
use dgd_page::{ChartLink, HeadlineTone, Markup, Page};
use dgd_screen::Severity;

use super::notice::{reading, unit_of};
use super::{ScreenedRecording, ScreeningResults, figure, summary};
use crate::error::{UnusableFile, WorkError};
use crate::output::page::origin;
use crate::output::quantity::{short, with_unit};

/// Intervals listed in a cell.
const LISTED: usize = 8;

/// Data of the template, which escapes all text except the figures.
#[derive(Template)]
#[template(path = "screen.html")]
struct ScreenPage {
    recordings: Vec<PageRecording>,
}

struct PageRecording {
    file: String,
    verdict: String,
    /// Kind of row, subject, text, time, significance, advice.
    findings: Vec<[String; 6]>,
    columns: Vec<[String; 8]>,
    points: Vec<Vec<String>>,
    transients: Vec<[String; 2]>,
    /// As markup.
    chart: String,
}

/// The page's text.
pub(super) fn write(all: &ScreeningResults) -> Result<String, WorkError> {
    let faults: usize = all.recordings.iter().map(|one| one.count(Severity::Fault)).sum();
    let (headline, tone) = match faults {
        0 => ("No fault was found".to_owned(), HeadlineTone::Good),
        1 => ("One fault was found".to_owned(), HeadlineTone::Doubt),
        n => (format!("{n} faults were found"), HeadlineTone::Doubt),
    };
    let mut page = Page::new("Recordings, screened");
    let kind = Markup::text("Recordings, screened");
    page.push_header(&kind, &Markup::text(&headline), tone, &[]);
    let recordings = all.recordings.iter().map(|one| recording(one, &mut page)).collect();
    let body = ScreenPage { recordings };
    let body = body.render().map_err(UnusableFile::Report)?;
    page.push(&Markup::trusted(body));
    Ok(page.finish(&origin(&all.provenance, &all.command)))
}

fn recording(one: &ScreenedRecording, page: &mut Page) -> PageRecording {
    let mut findings = Vec::new();
    for weight in [Severity::Fault, Severity::Remark] {
        for notice in one.notices.iter().filter(|notice| notice.weight == weight) {
            findings.push([
                match weight {
                    Severity::Fault => "fault".to_owned(),
                    Severity::Remark => "remark".to_owned(),
                },
                summary::subject(&notice.channels).replace('`', ""),
                notice.text.replace('`', ""),
                notice.when(LISTED),
                notice.certainty(),
                notice.advice.replace('`', ""),
            ]);
        }
    }
    let columns = summary::columns(one).into_iter().skip(1).collect();
    let moved: Vec<usize> = one.screening.motion.rests.iter().map(|rest| rest.channel).collect();
    let head = moved.iter().map(|&i| {
        let column = &one.table.columns[i];
        format!("{} {}", column.name, unit_of(column.unit.as_ref())).trim_end().to_owned()
    });
    let mut points =
        vec![["stretches".to_owned(), "s".to_owned()].into_iter().chain(head).collect()];
    for point in &one.screening.points {
        let means = moved.iter().map(|&i| match point.means[i] {
            mean if mean.is_finite() => short(mean, 4),
            _ => "–".to_owned(),
        });
        let first = [point.stretches.len().to_string(), reading(point.seconds)];
        points.push(first.into_iter().chain(means).collect());
    }
    let transients = one
        .screening
        .motion
        .transients
        .iter()
        .map(|transient| {
            let window = transient.stretch;
            let when = format!("{}–{}", reading(window.from), reading(window.until));
            let changes: Vec<String> = transient
                .changes
                .iter()
                .map(|(i, before, after)| {
                    let column = &one.table.columns[*i];
                    let unit = unit_of(column.unit.as_ref());
                    let (before, after) = (short(*before, 4), short(*after, 4));
                    with_unit(format!("{} {before} → {after}", column.name), &unit)
                })
                .collect();
            [when, changes.join(", ")]
        })
        .collect();
    let file = one.path.display().to_string();
    let caption = Markup::text("All columns; stretches with a fault are shaded.");
    PageRecording {
        verdict: summary::verdict(one),
        findings,
        columns,
        points,
        transients,
        chart: page.chart(&figure::figure(one), ChartLink::With(&file), &caption).to_string(),
        file,
    }
}
