//! The page of a linear model: its poles, the point, its matrices.

use dgd_page::{ChartLink, HeadlineTone, Markup, Page, PageCell, PageTable};
use dgd_plot::MathText;
use dgd_runtime::linearize::Stability;

use super::LinearModelReport;
use crate::output::page::{name, number, origin, unit, words};
use crate::output::quantity::short;
use crate::result::linearize::{LinearizeDocument, PointEntry};

/// Largest number of rows or columns shown.
const MOST_SHOWN: usize = 24;

impl LinearModelReport {
    /// Its page, with the command that reproduces it.
    pub fn page(&self, command: &str) -> String {
        let result = self.result();
        let mut page = Page::new(&format!("{}: linear model", result.model));
        let kind = Markup::text("Linear model of ").then(&Markup::code(&result.model));
        let (headline, tone) = self.headline(result.steady);
        page.push_header(&kind, &Markup::prose(&headline), tone, &[poles(&result)]);
        let chart = page.chart(&self.figure(), ChartLink::Alone, &Markup::default());
        page.push_section("Poles", &[chart]);
        page.push_section("The point", &[point(&result)]);
        let states = quantities(&result.states, |state| &state.quantity);
        let inputs = quantities(&result.inputs, |input| &input.quantity);
        let outputs = quantities(&result.outputs, |output| &output.quantity);
        for (matrix, about, values, rows, columns) in [
            ("A", "slopes of the states by the states", &result.a, &states, &states),
            ("B", "slopes of the states by the inputs", &result.b, &states, &inputs),
            ("C", "outputs by the states", &result.c, &outputs, &states),
            ("D", "outputs by the inputs", &result.d, &outputs, &inputs),
        ] {
            let table = table(matrix, values, rows, columns);
            page.push_section(&format!("{matrix}: {about}"), &[table]);
        }
        let more = "Delayed effects: see the result as JSON.";
        if !result.late.is_empty() {
            page.push(&Markup::prose(more).paragraph());
        }
        page.finish(&origin(&self.provenance, command))
    }

    fn headline(&self, is_steady: bool) -> (String, HeadlineTone) {
        let poles = self.poles();
        let slowest = poles.poles.iter().filter(|pole| !pole.is_on_axis());
        let slowest = slowest.map(|pole| pole.time_constant().abs()).reduce(f64::max);
        let slowest = slowest.map_or_else(String::new, |tau| {
            format!("; the slowest time constant is {} s", short(tau, 3))
        });
        let place = if is_steady { "its steady state" } else { "a point of its run" };
        let (word, tone) = match poles.stability() {
            Stability::Stable => ("Stable", HeadlineTone::Good),
            Stability::Marginal => ("On the border of stability", HeadlineTone::Doubt),
            Stability::Unstable => ("Unstable", HeadlineTone::Doubt),
            Stability::Unknown => ("No pole was found that makes it unstable", HeadlineTone::Plain),
        };
        (format!("{word} close to {place}{slowest}"), tone)
    }
}

fn quantities<T>(all: &[T], quantity: impl Fn(&T) -> &PointEntry) -> Vec<&PointEntry> {
    all.iter().map(quantity).collect()
}

fn poles(result: &LinearizeDocument) -> Markup {
    let head = ["pole, 1/s", "± i, 1/s", "time constant, s", "damping", "period, s"];
    let mut table = PageTable::new("Poles", &head);
    for pole in result.poles.iter().filter(|pole| pole.im >= 0.0) {
        let im = Some(pole.im).filter(|im| *im != 0.0);
        table.rows.push(vec![
            number(Some(pole.re), 5),
            PageCell::number(&im.map_or_else(String::new, |im| short(im, 5)), im),
            number(pole.time_constant, 5),
            number(pole.damping, 5),
            number(pole.period, 5),
        ]);
    }
    table.to_markup()
}

fn point(result: &LinearizeDocument) -> Markup {
    // At a steady state, slopes are rounding errors.
    let is_rest = result.steady;
    let head = ["name", "is", "value", "unit", "slope, unit/s"];
    let head = if is_rest { &head[..4] } else { &head[..] };
    let mut table = PageTable::new("Values at the point", head);
    let states = result.states.iter().map(|one| (&one.quantity, "state", Some(one.slope)));
    let inputs = result.inputs.iter().map(|one| (&one.quantity, "input", None));
    let outputs = result.outputs.iter().map(|one| (&one.quantity, "output", None));
    let eliminated = result.eliminated.iter().map(|one| (&one.quantity, "eliminated", None));
    for (quantity, kind, slope) in states.chain(inputs).chain(outputs).chain(eliminated) {
        let mut row = vec![
            name(&quantity.name),
            words(kind),
            number(Some(quantity.value), 6),
            unit(&quantity.unit),
        ];
        if !is_rest {
            row.push(number(slope, 3));
        }
        table.rows.push(row);
    }
    table.to_markup()
}

/// A matrix in the declared units, with the names of its rows and columns.
fn table(
    matrix: &str,
    values: &[Vec<Option<f64>>],
    rows: &[&PointEntry],
    columns: &[&PointEntry],
) -> Markup {
    if rows.is_empty() || columns.is_empty() {
        return Markup::default();
    }
    if rows.len().max(columns.len()) > MOST_SHOWN {
        let words = format!("{} × {}, too large to be shown here.", rows.len(), columns.len());
        return Markup::text(&words).paragraph();
    }
    let label = |one: &&PointEntry| {
        let unit = MathText::default().with_unit(&one.unit);
        Markup::code(&one.name).then(&Markup::text(" ")).then(&Markup::from(&unit))
    };
    let mut table = PageTable::new(matrix, &[]);
    table.head = std::iter::once(Markup::text("of")).chain(columns.iter().map(label)).collect();
    for (row, values) in rows.iter().zip(values) {
        let cells = values.iter().map(|value| number(*value, 5));
        table.rows.push(std::iter::once(PageCell::text(label(row))).chain(cells).collect());
    }
    table.to_markup()
}
