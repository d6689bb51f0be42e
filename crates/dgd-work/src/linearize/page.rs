//! The page of a linear model: its poles, the point, its matrices.

use dgd_page::{ChartLink, HeadlineTone, Markup, Page, PageCell, PageTable};
use dgd_plot::MathText;
use dgd_runtime::linearize::Stability;
use serde_json::Value;

use super::LinearModelReport;
use crate::output::page::{name, number, origin, unit, words};
use crate::output::quantity::short;

/// Matrices of a linear model, and the keys of their rows and columns in its result.
const MATRICES: [(&str, &str, &str, &str); 4] = [
    ("A", "slopes of the states by the states", "states", "states"),
    ("B", "slopes of the states by the inputs", "states", "inputs"),
    ("C", "outputs by the states", "outputs", "states"),
    ("D", "outputs by the inputs", "outputs", "inputs"),
];

/// Largest number of rows or columns shown.
const MOST_SHOWN: usize = 24;

impl LinearModelReport {
    /// Its page, with the command that reproduces it.
    pub fn page(&self, command: &str) -> String {
        let json = self.to_json();
        let model = json["model"].as_str().unwrap_or_default();
        let mut page = Page::new(&format!("{model}: linear model"));
        let kind = Markup::text("Linear model of ").then(&Markup::code(model));
        let (headline, tone) = self.headline(&json);
        page.push_header(&kind, &Markup::prose(&headline), tone, &[poles(&json)]);
        let chart = page.chart(&self.figure(), ChartLink::Alone, &Markup::default());
        page.push_section("Poles", &[chart]);
        page.push_section("The point", &[point(&json)]);
        for (matrix, about, rows, columns) in MATRICES {
            let table = table(&json, matrix, rows, columns);
            page.push_section(&format!("{matrix}: {about}"), &[table]);
        }
        let more = "Acting late: see the result for programs, `--format json`.";
        if json["late"].as_array().is_some_and(|late| !late.is_empty()) {
            page.push(&Markup::prose(more).paragraph());
        }
        page.finish(&origin(&self.provenance, command))
    }

    fn headline(&self, json: &Value) -> (String, HeadlineTone) {
        let poles = self.poles();
        let slowest = poles.poles.iter().filter(|pole| !pole.is_on_axis());
        let slowest = slowest.map(|pole| pole.time_constant().abs()).reduce(f64::max);
        let slowest = slowest.map_or_else(String::new, |tau| {
            format!("; the slowest time constant is {} s", short(tau, 3))
        });
        let place = if json["steady"] == true { "its steady state" } else { "a point of its run" };
        let (word, tone) = match poles.stability() {
            Stability::Stable => ("Stable", HeadlineTone::Good),
            Stability::Marginal => ("On the border of stability", HeadlineTone::Doubt),
            Stability::Unstable => ("Unstable", HeadlineTone::Doubt),
            Stability::Unknown => ("No pole was found that makes it unstable", HeadlineTone::Plain),
        };
        (format!("{word} close to {place}{slowest}"), tone)
    }
}

fn list<'a>(json: &'a Value, key: &str) -> &'a [Value] {
    json[key].as_array().map_or(&[], Vec::as_slice)
}

fn poles(json: &Value) -> Markup {
    let head = ["pole, 1/s", "± i, 1/s", "time constant, s", "damping", "period, s"];
    let mut table = PageTable::new("Poles", &head);
    for pole in list(json, "poles").iter().filter(|pole| pole["im"].as_f64() >= Some(0.0)) {
        let number = |key: &str| number(pole[key].as_f64(), 5);
        let im = pole["im"].as_f64().filter(|im| *im != 0.0);
        table.rows.push(vec![
            number("re"),
            PageCell::number(&im.map_or_else(String::new, |im| short(im, 5)), im),
            number("time_constant"),
            number("damping"),
            number("period"),
        ]);
    }
    table.to_markup()
}

fn point(json: &Value) -> Markup {
    // At a steady state, slopes are rounding errors.
    let is_rest = json["steady"] == true;
    let head = ["name", "is", "value", "unit", "slope, unit/s"];
    let head = if is_rest { &head[..4] } else { &head[..] };
    let mut table = PageTable::new("Values at the point", head);
    for (key, what) in [
        ("states", "state"),
        ("inputs", "input"),
        ("outputs", "output"),
        ("eliminated", "eliminated"),
    ] {
        for one in list(json, key) {
            let mut row = vec![
                name(one["name"].as_str().unwrap_or_default()),
                words(what),
                number(one["value"].as_f64(), 6),
                unit(one["unit"].as_str().unwrap_or_default()),
            ];
            if !is_rest {
                row.push(number(one["slope"].as_f64(), 3));
            }
            table.rows.push(row);
        }
    }
    table.to_markup()
}

/// A matrix in the declared units, with the names of its rows and columns.
fn table(json: &Value, matrix: &str, rows: &str, columns: &str) -> Markup {
    let (rows, columns) = (list(json, rows), list(json, columns));
    if rows.is_empty() || columns.is_empty() {
        return Markup::default();
    }
    if rows.len().max(columns.len()) > MOST_SHOWN {
        let words = format!("{} × {}, too large to be shown here.", rows.len(), columns.len());
        return Markup::text(&words).paragraph();
    }
    let label = |one: &Value| {
        let unit = MathText::default().with_unit(one["unit"].as_str().unwrap_or_default());
        Markup::code(one["name"].as_str().unwrap_or_default())
            .then(&Markup::text(" "))
            .then(&Markup::from(&unit))
    };
    let mut table = PageTable::new(matrix, &[]);
    table.head = std::iter::once(Markup::text("of")).chain(columns.iter().map(label)).collect();
    for (row, values) in rows.iter().zip(list(json, matrix)) {
        let values = values.as_array().map_or(&[][..], Vec::as_slice);
        let cells = values.iter().map(|value| number(value.as_f64(), 5));
        table.rows.push(std::iter::once(PageCell::text(label(row))).chain(cells).collect());
    }
    table.to_markup()
}
