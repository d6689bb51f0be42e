//! The outcomes of fits from several starting points: a waterfall, and the minima side by side.

use dgd_page::{ChartLink, Markup, Page, PageTable};
use dgd_plot::{Figure, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle};

use crate::output::page::{count, name, number, told, unit};
use crate::result::fit::{FitDocument, MinimumEntry, MultiStartResult, StartEntry};

/// Minima with a column; `result.json` has all.
const MOST_MINIMA: usize = 6;

/// The section on several starting points, if there were several.
pub(super) fn push(page: &mut Page, result: &FitDocument) {
    let Some(several) = &result.multi_start else { return };
    let note = "Each point is a fit, the best first. Those on one step have reached one minimum; steps above the first are \
                other minima. Fits that did not converge stand where they ended.";
    let chart = page.chart(&waterfall(&several.ends), ChartLink::Alone, &Markup::text(note));
    let words = sentence(several).map(|words| Markup::prose(&words).caption());
    page.push_section("Starting points", &[words.unwrap_or_default(), chart, minima(several)]);
}

/// Deviances above the best, ascending, on a scale that shows both 0 and thousands.
fn waterfall(ends: &[StartEntry]) -> Figure {
    let mut fits: Vec<(f64, StartOutcome)> = ends
        .iter()
        .filter_map(|end| {
            let kind = match end.minimum {
                Some(0) => StartOutcome::Best,
                Some(_) => StartOutcome::Other,
                None => StartOutcome::Lost,
            };
            Some((end.deviance_above?, kind))
        })
        .collect();
    fits.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let series = [
        (StartOutcome::Best, "the best minimum", SeriesMeaning::Variant(0)),
        (StartOutcome::Other, "another minimum", SeriesMeaning::Variant(1)),
        (StartOutcome::Lost, "not converged", SeriesMeaning::Variant(2)),
    ]
    .into_iter()
    .filter_map(|(kind, words, meaning)| {
        let of_kind = fits.iter().enumerate().filter(|(_, (_, own))| *own == kind);
        let (x, y): (Vec<f64>, Vec<f64>) = of_kind
            .map(|(rank, (above, _))| ((rank + 1) as f64, (1.0 + above.max(0.0)).log10()))
            .unzip();
        let series = PlotSeries::new(MathText::plain(words), SeriesStyle::Marks, x, y);
        (!series.x.is_empty()).then_some(PlotSeries { meaning, ..series })
    });
    let panel = Panel {
        y_label: MathText::plain("log10(1 + deviance above the best)"),
        series: series.collect(),
        ..Panel::default()
    };
    Figure::new(MathText::plain("Fits, the best first"), vec![panel])
}

/// The outcome of a fit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum StartOutcome {
    Best,
    Other,
    Lost,
}

/// The number of starting points, and the smallest basin of attraction that they would have hit with 95 % confidence.
fn sentence(several: &MultiStartResult) -> Option<String> {
    let volume = several.found_volume?;
    let draws = match several.failed_draws {
        0 => String::new(),
        n => format!(" {n} draws could not be simulated, and were drawn again nearby."),
    };
    Some(format!(
        "{} starting points, {} of them without a minimum. A minimum that is reached from more than {} % of the volume \
         the points were drawn from would have been found, at 95 %.{draws}",
        several.points,
        several.failed + several.without_minimum + several.left_out,
        told(100.0 * volume)
    ))
}

/// The estimates at each minimum.
fn minima(several: &MultiStartResult) -> Markup {
    let shown = &several.minima[..several.minima.len().min(MOST_MINIMA)];
    let Some(first) = shown.first() else { return Markup::default() };
    let mut table = PageTable::new("The minima beside each other", &["", "unit"]);
    let heads = (1..=shown.len()).map(|k| Markup::text(&format!("minimum {k}")));
    table.head.extend(heads);
    let row = |words: &str, value: &dyn Fn(&MinimumEntry) -> Option<f64>| {
        let mut row = vec![dgd_page::PageCell::text(Markup::text(words)), unit("")];
        row.extend(shown.iter().map(|minimum| number(value(minimum), 5)));
        row
    };
    let points = |minimum: &MinimumEntry| count(minimum.points.len());
    let mut led = vec![dgd_page::PageCell::text(Markup::text("starting points")), unit("")];
    led.extend(shown.iter().map(points));
    table.rows.push(led);
    table.rows.push(row("deviance above the best", &|minimum| minimum.deviance_above));
    for (called, entry) in &first.estimates {
        let mut row = vec![name(called), unit(&entry.unit)];
        let value = |minimum: &MinimumEntry| minimum.estimates.get(called)?.value;
        row.extend(shown.iter().map(|minimum| number(value(minimum), 5)));
        table.rows.push(row);
    }
    table.to_markup()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::fit::StartSpread;

    #[test]
    fn a_waterfall_has_a_step_for_each_minimum_in_order() {
        let end = |deviance_above: Option<f64>, minimum: Option<usize>| StartEntry {
            end: "reduction".to_owned(),
            deviance_above,
            minimum,
        };
        let ends = [
            end(Some(99.0), Some(1)),
            end(Some(0.0), Some(0)),
            end(None, None),
            end(Some(999.0), None),
            end(Some(1e-9), Some(0)),
        ];
        let figure = waterfall(&ends);
        let [best, other, lost] = figure.panels[0].series.as_slice() else { panic!("three kinds") };
        assert_eq!((best.x.as_slice(), other.x.as_slice()), (&[1.0, 2.0][..], &[3.0][..]));
        assert!(best.y[1] < 1e-9 && (other.y[0] - 2.0).abs() < 1e-12);
        assert_eq!((lost.x.as_slice(), lost.y.as_slice()), (&[4.0][..], &[3.0][..]));
    }

    #[test]
    fn the_sentence_says_what_was_drawn_and_lost() {
        let several = |found_volume| MultiStartResult {
            points: 50,
            spread: StartSpread::Values,
            ends: Vec::new(),
            found_volume,
            failed_draws: 4,
            best: 0,
            minima: Vec::new(),
            failed: 1,
            without_minimum: 2,
            left_out: 0,
        };
        let words = sentence(&several(Some(3.0 / 46.0))).expect("46 of 49 led somewhere");
        assert!(words.starts_with("50 starting points, 3 of them without a minimum."), "{words}");
        assert!(words.contains("more than 6.522 % of the volume"), "{words}");
        assert!(words.ends_with("4 draws could not be simulated, and were drawn again nearby."));
        assert_eq!(sentence(&several(None)), None);
    }
}
