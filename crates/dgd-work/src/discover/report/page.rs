//! `report.html`: the result, in the design of all pages.

use std::path::Path;

use askama::Template;
use dgd_discover::{
    Discovery, FoundEffect, ParameterValue, RankedStructure, RecordingTrace, WindowCondition,
};
use dgd_page::{ChartLink, Markup, Page, PageOrigin};
use dgd_plot::{Figure, MathText};

use super::diff::{self, ChangedLine};
use super::equations::{self, TypesetEquation};
use super::figures::{self, CorrectionState};
use super::{DiscoverySubject, UNEXPLAINED, condition, guess, law, summary, together, verdict};
use crate::error::{UnusableFile, WorkError};
use crate::output;
use crate::output::quantity::{UncertainValue, moment, percent, rounded, stretches};

/// Screened candidates listed on the page.
const SCREENED: usize = 15;

/// Data of the template, which escapes all text except the fields marked `safe`.
#[derive(Template)]
#[template(path = "report.html")]
struct DiscoveryPage<'a> {
    model: String,
    discovery: &'a Discovery,
    reservations: &'a [String],
    verdict: &'static str,
    /// As markup.
    sentence: String,
    /// The next step, as markup.
    next: String,
    /// The condition outside which the model holds, as markup.
    regime: Option<String>,
    /// Effects that the recordings resemble: names and notes.
    described: Vec<(String, String)>,
    effects: Vec<EffectRow<'a>>,
    /// Constants of a law, the ranges in which it holds and near forms, as markup.
    law: Vec<[String; 2]>,
    /// The same for each of several laws that explain the recordings equally well.
    rivals: Vec<Vec<[String; 2]>>,
    left_over: Vec<LeftOverRow<'a>>,
    gap: Vec<[String; 8]>,
    /// Outputs, and when the base model is off there, as markup.
    off: Vec<[String; 2]>,
    figures: Vec<FigureSection>,
    /// The last field of each row is markup.
    ranking: Vec<[String; 5]>,
    screened: Vec<[String; 2]>,
    unlisted: usize,
    /// The second field of each row is markup.
    not_tried: Vec<[String; 2]>,
    equations: Vec<ChangedLine<TypesetEquation>>,
    changes: Vec<ChangedLine<&'a str>>,
    parameters: Vec<CorrectedParameter<'a>>,
    has_std_model: bool,
    recordings: Vec<[String; 2]>,
    trace: &'static str,
}

struct EffectRow<'a> {
    found: &'a FoundEffect,
    place: String,
    doc: String,
    parameters: Vec<CorrectedParameter<'a>>,
    onset: Option<String>,
    windows: String,
    /// As markup.
    condition: Option<String>,
    alternatives: Vec<[String; 2]>,
    other_forms: Option<String>,
    /// As markup.
    told_apart_by: Option<String>,
    evidence: String,
}

struct LeftOverRow<'a> {
    target: &'a str,
    /// As markup.
    description: String,
    /// The share it explains, evidence against it, and experiments that would settle it, as markup.
    rows: Vec<[String; 2]>,
    windows: String,
    /// As markup.
    condition: Option<String>,
    /// As markup.
    together: Option<String>,
    /// As markup; `None` if something has a name.
    guess: Option<String>,
}

/// A parameter before and after the correction; empty in a model without it.
struct CorrectedParameter<'a> {
    name: &'a str,
    /// As markup.
    unit: String,
    before: String,
    after: String,
}

/// Figures under one heading.
struct FigureSection {
    title: &'static str,
    /// As markup.
    charts: Vec<String>,
}

/// The page's text.
pub(super) fn write(subject: &DiscoverySubject<'_>, patch: &str) -> Result<String, WorkError> {
    let discovery = subject.discovery;
    let title = format!("{}: {}", subject.model_name(), discovery.verdict.word());
    let mut page = Page::new(&title);
    let figures = sections(discovery, &mut page);
    let body = DiscoveryPage {
        model: subject.model_name(),
        discovery,
        reservations: subject.reservations,
        verdict: discovery.verdict.word(),
        sentence: prose(&verdict::sentence(discovery)),
        next: prose(&verdict::next(discovery)),
        regime: discovery.regime.as_ref().map(|regime| prose(&condition::regime(regime))),
        described: (discovery.described.iter())
            .map(|one| {
                let rows = summary::described_rows(one);
                let rows = rows.into_iter().map(|[name, value]| format!("{name}: {value}"));
                (one.name.clone(), rows.collect::<Vec<_>>().join("; "))
            })
            .collect(),
        effects: discovery.effects.iter().map(effect).collect(),
        law: (discovery.law.iter().flat_map(law::rows))
            .map(|row| row.map(|cell| prose(&cell)))
            .collect(),
        rivals: (discovery.rivals.iter()).map(|rival| marked_up(law::rival_rows(rival))).collect(),
        left_over: discovery
            .unexplained
            .iter()
            .map(|left| LeftOverRow {
                target: &left.target,
                description: prose(&left.description),
                rows: marked_up(summary::place_rows(left)),
                windows: stretches(left.windows.iter().copied()),
                condition: left.condition.as_ref().map(told_condition),
                together: together::words(&left.together).map(|words| prose(&words)),
                guess: guess::is_told(discovery).then(|| prose(&guess::words(left))),
            })
            .collect(),
        gap: discovery.gap.iter().map(summary::gap_row).collect(),
        off: (discovery.gap.iter())
            .filter_map(|gap| Some([gap.output.clone(), told_condition(gap.condition.as_ref()?)]))
            .collect(),
        figures,
        ranking: discovery.ranking.iter().map(ranking_row).collect(),
        screened: discovery
            .screened
            .iter()
            .take(SCREENED)
            .map(|candidate| [candidate.name.clone(), percent(candidate.share)])
            .collect(),
        unlisted: discovery.screened.len().saturating_sub(SCREENED),
        not_tried: summary::not_tried(discovery, usize::MAX)
            .into_iter()
            .map(|[names, why]| [names, prose(&why)])
            .collect(),
        equations: equations::changed(subject, &discovery.corrected)?,
        changes: diff::lines(patch),
        parameters: parameters(&discovery.base_parameters, &discovery.corrected_parameters),
        has_std_model: (discovery.base_parameters.iter())
            .chain(&discovery.corrected_parameters)
            .any(|parameter| parameter.std_model.is_some()),
        recordings: recordings(subject),
        trace: UNEXPLAINED,
    };
    let body = body.render().map_err(UnusableFile::Report)?;
    page.push(&Markup::trusted(body));
    Ok(page.finish(&origin(subject)))
}

/// Turns the values of rows into markup.
fn marked_up(rows: Vec<[String; 2]>) -> Vec<[String; 2]> {
    rows.into_iter().map(|[name, value]| [name, prose(&value)]).collect()
}

fn origin(subject: &DiscoverySubject<'_>) -> PageOrigin {
    match subject.provenance {
        Some(provenance) => output::page::origin(provenance, subject.command),
        None => PageOrigin { command: subject.command.to_owned(), ..PageOrigin::default() },
    }
}

/// A condition as markup.
fn told_condition(condition: &WindowCondition) -> String {
    prose(&condition::words(condition))
}

fn effect(found: &FoundEffect) -> EffectRow<'_> {
    EffectRow {
        found,
        place: verdict::place(found),
        doc: found.doc.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" "),
        parameters: parameters(&[], &found.parameters),
        onset: found.onset.map(moment),
        windows: stretches(found.windows.iter().copied()),
        condition: found.condition.as_ref().map(told_condition),
        alternatives: found
            .alternatives
            .iter()
            .map(|other| [other.name.clone(), rounded(other.valid_ratio, 3)])
            .collect(),
        other_forms: summary::other_forms(found),
        told_apart_by: found.told_apart_by.as_deref().map(prose),
        evidence: summary::evidence(found),
    }
}

fn parameters<'a>(
    before: &'a [ParameterValue],
    after: &'a [ParameterValue],
) -> Vec<CorrectedParameter<'a>> {
    let shown = |list: &[ParameterValue], name: &str| {
        let parameter = list.iter().find(|parameter| parameter.name == name);
        parameter.map_or_else(String::new, |parameter| {
            UncertainValue::from_parameter(parameter).to_string()
        })
    };
    let gone = before.iter().filter(|old| after.iter().all(|new| new.name != old.name));
    after
        .iter()
        .chain(gone)
        .map(|parameter| CorrectedParameter {
            name: &parameter.name,
            unit: match &*parameter.unit.symbol {
                "1" => String::new(),
                symbol => MathText::unit(symbol).to_html(),
            },
            before: shown(before, &parameter.name),
            after: shown(after, &parameter.name),
        })
        .collect()
}

fn ranking_row(ranked: &RankedStructure) -> [String; 5] {
    let effects = match ranked.effects.as_slice() {
        [] => "base model".to_owned(),
        effects => effects.join(" + "),
    };
    let valid = ranked.valid.map_or_else(|| "–".to_owned(), |valid| rounded(valid, 3));
    let bic = rounded(ranked.bic, 3);
    [effects, rounded(ranked.train, 3), valid, bic, prose(&ranked.note)]
}

/// A sentence as markup: text between backticks is code.
fn prose(sentence: &str) -> String {
    Markup::prose(sentence).to_string()
}

fn recordings(subject: &DiscoverySubject<'_>) -> Vec<[String; 2]> {
    let row = |role: &str, path: &Path| [role.to_owned(), path.display().to_string()];
    let training = subject.training.iter().map(|path| row("training", path));
    training.chain(subject.held_out.iter().map(|path| row("validation", path))).collect()
}

/// The figures in order of interest, unexplained terms first. Figures of one recording zoom together.
fn sections(discovery: &Discovery, page: &mut Page) -> Vec<FigureSection> {
    let correction = CorrectionState::from_discovery(discovery);
    let held_out = discovery.traces.iter().find(|trace| trace.held_out);
    let training = discovery.traces.iter().find(|trace| !trace.held_out);
    let first = training.map_or("time", |trace| trace.name.as_str());
    let shown = || held_out.into_iter().chain(training);
    let mut sections = vec![FigureSection {
        title: "What is missing, without a name",
        charts: charts(
            page,
            &figures::missing(discovery.unexplained.iter().map(|left| &left.trace)),
            first,
            "The term on the right-hand side that no effect explains, with its uncertainty. \
             Shaded: where it differs from nothing.",
        ),
    }];
    for trace in shown() {
        let caption = format!(
            "{} Shaded: where the base model’s misfit stands out from the noise.",
            told(trace)
        );
        let figures = figures::fit(trace, correction);
        let charts = charts(page, &figures, &trace.name, &caption);
        sections.push(FigureSection { title: "Measured and simulated", charts });
    }
    for trace in shown() {
        let caption =
            format!("{} Measured less simulated. Shaded: as above, and the noise.", told(trace));
        let figures = figures::errors(trace, correction);
        let charts = charts(page, &figures, &trace.name, &caption);
        sections.push(FigureSection { title: "Simulation errors", charts });
    }
    sections.push(FigureSection {
        title: "What each equation would have needed",
        charts: charts(
            page,
            &figures::missing(&discovery.missing),
            first,
            "A term on the right-hand side of the base model’s equations that would let it \
             follow the first training recording, with its uncertainty. Shaded: where it \
             differs from nothing.",
        ),
    });
    sections.retain(|section| !section.charts.is_empty());
    sections
}

fn told(trace: &RecordingTrace) -> String {
    let role = if trace.held_out { "Validation" } else { "Training" };
    format!("{role} recording {}.", trace.name)
}

/// Figures over the time of one recording; the first carries the caption.
fn charts(page: &mut Page, figures: &[Figure], recording: &str, caption: &str) -> Vec<String> {
    let chart = |(k, figure): (usize, &Figure)| {
        let caption = if k == 0 { Markup::text(caption) } else { Markup::default() };
        page.chart(figure, ChartLink::With(recording), &caption).to_string()
    };
    figures.iter().enumerate().map(chart).collect()
}
