//! The page of a comparison: the best contender, then tables and curves.

use dgd_page::{ChartLink, HeadlineTone, Markup, Page, PageCell, PageTable};

use super::{Contender, FitComparison, figure, summary};
use crate::output::page::{count, name, number, origin, unit, words};

pub(super) fn write(all: &FitComparison) -> String {
    let mut page = Page::new("Comparison");
    let kind = Markup::text("Contenders, fitted to the same recordings");
    let ratios: Vec<Markup> = summary::ratios(all).iter().map(|line| Markup::prose(line)).collect();
    let ratios = if ratios.is_empty() { Markup::default() } else { Markup::list(&ratios) };
    let sentence = Markup::prose(&summary::sentence(all));
    page.push_header(&kind, &sentence, HeadlineTone::Plain, &[criteria(all), ratios]);
    page.push_section("Errors of each output", &[outputs(all)]);
    page.push_section("Parameters", &[parameters(all)]);
    for (k, trace) in all.contenders[0].fitted.traces.iter().enumerate() {
        let role = if trace.is_valid { "validation" } else { "training" };
        let link = ChartLink::With(&trace.name);
        let chart = page.chart(&figure::of_recording(all, k), link, &Markup::default());
        page.push_section(&format!("`{}`, {role}", trace.name), &[chart]);
    }
    let digest = |contender: &Contender| {
        let digest = contender.fitted.provenance.model.clone()?;
        Some((contender.name.clone(), digest))
    };
    let mut origin = origin(&all.provenance, &all.command);
    origin.models = all.contenders.iter().filter_map(digest).collect();
    page.finish(&origin)
}

fn criteria(all: &FitComparison) -> Markup {
    let head = [
        "",
        "contender",
        "estimates",
        "−2 ln L",
        "AIC above least",
        "BIC above least",
        "errors, training",
        "errors, validation",
        "ended",
    ];
    let mut table = PageTable::new("Contenders", &head);
    table.head[0] = Markup::text("label");
    for (k, contender) in all.contenders.iter().enumerate() {
        let entry = summary::entry(all, k);
        let score = |value: Option<f64>| {
            let shown = value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"));
            PageCell::number(&shown.replace('-', "−"), value)
        };
        table.rows.push(vec![
            words(&contender.label),
            name(&contender.name),
            count(contender.score.estimates),
            score(entry.deviance),
            score(entry.aic_above_least),
            score(entry.bic_above_least),
            number(all.relative_error(k, false), 3),
            number(all.relative_error(k, true), 3),
            words(entry.status.name()),
        ]);
    }
    for one in &all.failed {
        let missing = || PageCell::number("–", None);
        let mut row = vec![words(&one.label), name(&one.name)];
        row.extend(std::iter::repeat_with(missing).take(6));
        row.push(PageCell::text(Markup::prose(&format!("failed: {}", one.reason))));
        table.rows.push(row);
    }
    let first = &all.contenders[0].label;
    let note = format!(
        "Estimates: parameters, start values, and a noise for each output. Errors: geometric mean over the outputs \
         of root-mean-square errors over those of {first}."
    );
    table.to_markup().then(&Markup::text(&note).caption())
}

fn outputs(all: &FitComparison) -> Markup {
    let head = [
        "output",
        "contender",
        "unit",
        "rms, training",
        "fit, training, %",
        "rms, validation",
        "fit, validation, %",
    ];
    let mut table = PageTable::new("Errors of each output", &head);
    for (i, (output, symbol)) in all.outputs().enumerate() {
        for (k, contender) in all.contenders.iter().enumerate() {
            let mut row = vec![name(output), words(&contender.label), unit(symbol)];
            for is_valid in [false, true] {
                let agreement = all.agreement(k, i, is_valid);
                row.push(number(agreement.map(|one| one.rms), 3));
                row.push(number(agreement.and_then(|one| one.fit_percent), 4));
            }
            table.rows.push(row);
        }
    }
    table.to_markup()
}

fn parameters(all: &FitComparison) -> Markup {
    let mut table = PageTable::new("Parameters", &["parameter", "unit"]);
    table.head.extend(all.contenders.iter().map(|one| Markup::text(&one.label)));
    for row in summary::parameters(all) {
        let cell = |value: &Option<crate::output::quantity::UncertainValue>| match value {
            Some(value) => PageCell::number(&value.to_string(), Some(value.value())),
            None => PageCell::number("–", None),
        };
        let first = [name(&row.name), unit(&row.unit)];
        table.rows.push(first.into_iter().chain(row.values.iter().map(cell)).collect());
    }
    table.to_markup()
}
