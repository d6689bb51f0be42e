//! Common parts of all result pages.

use dgd_page::{ChartLink, HeadlineTone, Markup, Page, PageCell, PageOrigin, PageTable};
use dgd_plot::{Figure, MathText};

use super::agreement::Agreement;
use super::provenance::Provenance;
use super::quantity::{rounded, short};

/// Links figures over the time of one recording.
pub(crate) const TIME: ChartLink<'static> = ChartLink::With("time");

/// The origin of a result.
pub(crate) fn origin(provenance: &Provenance, command: &str) -> PageOrigin {
    PageOrigin {
        command: command.to_owned(),
        version: provenance.version.clone(),
        seed: provenance.seed,
        models: provenance.model.iter().map(|digest| (String::new(), digest.clone())).collect(),
        data: provenance.data.iter().map(|one| (one.file.clone(), one.digest.clone())).collect(),
    }
}

/// A cell with a number to this many significant digits; a dash without a number.
pub(crate) fn number(value: Option<f64>, digits: i32) -> PageCell {
    let shown = value.map_or_else(|| "–".to_owned(), |value| shown(value, digits));
    PageCell::number(&shown, value)
}

/// A cell with a count.
pub(crate) fn count(n: usize) -> PageCell {
    PageCell::number(&n.to_string(), Some(n as f64))
}

/// Rounds to this many digits, and zero to `0`.
fn shown(value: f64, digits: i32) -> String {
    if value == 0.0 { "0".to_owned() } else { rounded(value, digits) }
}

/// A number for a sentence.
pub(crate) fn told(value: f64) -> String {
    short(value, 4)
}

/// A cell with a name of the model.
pub(crate) fn name(name: &str) -> PageCell {
    PageCell::text(Markup::code(name))
}

/// A cell with a typeset unit.
pub(crate) fn unit(symbol: &str) -> PageCell {
    PageCell::text(Markup::from(&MathText::unit(symbol)))
}

/// A cell with words.
pub(crate) fn words(words: &str) -> PageCell {
    PageCell::text(Markup::text(words))
}

/// A table of the agreement of outputs with measurements.
pub(crate) fn agreement_table<'a>(
    caption: &str,
    rows: impl IntoIterator<Item = (&'a str, &'a str, Agreement)>,
) -> Markup {
    let mut table =
        PageTable::new(caption, &["output", "unit", "samples", "rms", "bias", "fit, %"]);
    for (output, symbol, agreement) in rows {
        table.rows.push(vec![
            name(output),
            unit(symbol),
            count(agreement.samples),
            number(Some(agreement.rms), 3),
            number(Some(agreement.bias), 3),
            number(agreement.fit_percent, 4),
        ]);
    }
    let note = "rms and bias of measured less simulated. Fit: 100 % less the part of the scatter of what was measured that \
                the simulation leaves, as a root of squares; 0 % is a simulation as good as the mean.";
    let table = table.to_markup();
    if table.is_empty() { table } else { table.then(&Markup::text(note).caption()) }
}

/// A page of one figure.
pub(crate) fn of_figure(
    title: &str,
    kind: &Markup,
    headline: &str,
    more: &[Markup],
    figure: &Figure,
    origin: &PageOrigin,
) -> String {
    let mut page = Page::new(title);
    page.push_header(kind, &Markup::prose(headline), HeadlineTone::Plain, more);
    let chart = page.chart(figure, TIME, &Markup::default());
    page.push_section("Over time", &[chart]);
    page.finish(origin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_sentences_have_no_zeros_at_their_end() {
        for (value, text) in
            [(60.0, "60"), (0.0, "0"), (3600.0, "3600"), (0.25, "0.25"), (1.5e8, "1.5·10⁸")]
        {
            assert_eq!(told(value), text);
        }
        assert_eq!(shown(0.0, 5), "0");
    }
}
