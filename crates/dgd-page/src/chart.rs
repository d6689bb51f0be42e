//! A figure in a page: as a picture to read and print, and as data for zooming.

use std::collections::BTreeSet;
use std::fmt::Write;

use dgd_plot::{
    Envelope, Figure, HeatMap, MathText, Panel, PlotSeries, SeriesStyle, render_svg,
    scale_of_colours,
};

use dgd_signature::number::short;

use crate::columns::StoredColumns;
use crate::markup::{Markup, escaped};

/// Which figures of a page share zoom and cursor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChartLink<'a> {
    /// Those with one name, whose abscissas have the same meaning.
    With(&'a str),
    /// Only its own panels.
    Alone,
}

/// Figures of a live page, which need not be sent data that the page already has.
#[derive(Debug)]
pub struct LiveCharts {
    charts: PageCharts,
}

impl LiveCharts {
    /// No figures yet, for a page that has the columns with these keys.
    pub fn new(known: BTreeSet<String>) -> Self {
        LiveCharts {
            charts: PageCharts { columns: StoredColumns::beside(known), ..PageCharts::default() },
        }
    }

    /// A figure under its caption: elements that the script fills.
    #[must_use]
    pub fn chart(&mut self, figure: &Figure, link: ChartLink<'_>, caption: &Markup) -> Markup {
        if figure.panels.is_empty() {
            return Markup::default();
        }
        self.charts.add_with(figure, link, caption, false)
    }

    /// The argument of `dgdPage.mount`, once columns that are `null` are filled in by their `keys`.
    pub fn to_json(&self) -> String {
        format!("{{\"keys\":{},\n{}}}", self.charts.columns.keys_to_json(), self.charts.fields())
    }
}

/// Figures of a page, and their numbers.
#[derive(Debug, Default)]
pub(crate) struct PageCharts {
    columns: StoredColumns,
    figures: Vec<String>,
    has_maps: bool,
}

impl PageCharts {
    /// A figure under its caption.
    pub(crate) fn add(&mut self, figure: &Figure, link: ChartLink<'_>, caption: &Markup) -> Markup {
        self.add_with(figure, link, caption, true)
    }

    /// [`Self::add`], optionally without the picture for readers without scripts.
    fn add_with(
        &mut self,
        figure: &Figure,
        link: ChartLink<'_>,
        caption: &Markup,
        has_picture: bool,
    ) -> Markup {
        let number = self.figures.len();
        let json = self.json(figure, number, link);
        self.figures.push(json);
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = write_figure(&mut text, figure, number, caption, has_picture);
        Markup::trusted(text)
    }

    /// The data for the script, safe inside its element whatever the names are.
    pub(crate) fn to_json(&self) -> String {
        format!("{{{}}}", self.fields())
    }

    fn fields(&self) -> String {
        let colours = if self.has_maps { scale_of_colours() } else { Vec::new() };
        let colours: Vec<String> =
            colours.into_iter().map(|colour| json_string(&hex(colour))).collect();
        format!(
            "\"columns\":{},\n\"scale\":[{}],\n\"figures\":[{}]",
            self.columns.to_json(),
            colours.join(","),
            self.figures.join(",\n")
        )
    }

    fn json(&mut self, figure: &Figure, number: usize, link: ChartLink<'_>) -> String {
        let panels: Vec<String> = figure.panels.iter().map(|panel| self.panel(panel)).collect();
        let link = match link {
            ChartLink::With(name) => format!("with {name}"),
            ChartLink::Alone => format!("alone {number}"),
        };
        format!(
            "{{\"link\":{},\"x\":{},\"panels\":[{}]}}",
            json_string(&link),
            json_string(&plain(&figure.x_label)),
            panels.join(",")
        )
    }

    fn panel(&mut self, panel: &Panel) -> String {
        let mut series = Vec::with_capacity(panel.series.len());
        for (one, look) in panel.series.iter().zip(panel.looks()) {
            let style = match one.style {
                SeriesStyle::Line => "line",
                SeriesStyle::ThinLine => "thin",
                SeriesStyle::Dots | SeriesStyle::Marks => "dots",
            };
            let length = one.x.len().min(one.y.len());
            let x = self.columns.add(&one.x[..length], true);
            let y = self.columns.add(&one.y[..length], false);
            let name = json_string(&one.name.to_plain());
            let (light, dark) = (hex(look.colour), hex(on_dark(look.colour)));
            let dashes: Vec<String> = look.dashes.iter().map(ToString::to_string).collect();
            let dashes = dashes.join(",");
            series.push(format!(
                "{{\"name\":{name},\"style\":\"{style}\",\"colours\":[\"{light}\",\"{dark}\"],\"dashes\":[{dashes}],\"x\":{x},\"y\":{y}}}"
            ));
        }
        let envelopes: Vec<String> =
            panel.envelopes.iter().map(|envelope| self.envelope(envelope)).collect();
        let bands: Vec<String> = (panel.bands.iter())
            .map(|band| format!("[{},{}]", finite(band.from), finite(band.to)))
            .collect();
        let map = panel.map.as_ref().map(|map| self.map(map));
        // In a map, the y axis shows places, and the title names the quantity.
        let measure = if map.is_some() { &panel.title } else { &panel.y_label };
        format!(
            "{{\"title\":{},\"unit\":{},\"series\":[{}],\"envelopes\":[{}],\"bands\":[{}],\"map\":{}}}",
            json_string(&panel.title.to_plain()),
            json_string(&unit(measure)),
            series.join(","),
            envelopes.join(","),
            bands.join(","),
            map.unwrap_or_else(|| "null".to_owned())
        )
    }

    fn map(&mut self, map: &HeatMap) -> String {
        self.has_maps = true;
        let (x, places) = (self.columns.add(&map.x, true), self.columns.add(&map.places, true));
        let rows: Vec<String> =
            map.values.iter().map(|row| self.columns.add(row, false).to_string()).collect();
        let range = range(map.values.iter().flatten());
        let (low, high) = range.unwrap_or((f64::NAN, f64::NAN));
        let (low, high) = (finite(low), finite(high));
        let rows = rows.join(",");
        format!("{{\"x\":{x},\"places\":{places},\"rows\":[{rows}],\"low\":{low},\"high\":{high}}}")
    }

    fn envelope(&mut self, envelope: &Envelope) -> String {
        let length = envelope.x.len().min(envelope.low.len()).min(envelope.high.len());
        let x = self.columns.add(&envelope.x[..length], true);
        let low = self.columns.add(&envelope.low[..length], false);
        let high = self.columns.add(&envelope.high[..length], false);
        let around = envelope.around.map_or_else(|| "null".to_owned(), |i| i.to_string());
        format!("{{\"x\":{x},\"low\":{low},\"high\":{high},\"around\":{around}}}")
    }
}

/// The picture, and the elements that the script fills: titles, curves, and their values at the cursor.
fn write_figure(
    text: &mut String,
    figure: &Figure,
    number: usize,
    caption: &Markup,
    has_picture: bool,
) -> std::fmt::Result {
    writeln!(text, "<figure class=\"chart\" data-figure=\"{number}\">")?;
    if !caption.is_empty() {
        writeln!(text, "<figcaption class=\"caption\">{caption}</figcaption>")?;
    }
    if has_picture {
        writeln!(
            text,
            "<div class=\"picture\" role=\"img\" aria-label=\"{}\">\n{}</div>",
            escaped(&in_words(figure)),
            render_svg(figure)
        )?;
    }
    let class = if figure.columns > 1 { "panels" } else { "panels one" };
    writeln!(text, "<div class=\"{class}\" hidden>")?;
    for panel in &figure.panels {
        let title = Markup::from(&panel.title);
        let over = if panel.map.is_some() { Markup::text("over ") } else { Markup::default() };
        let unit = over.then(&Markup::from(&panel.y_label));
        let description = escaped(&panel_in_words(panel));
        writeln!(text, "<div class=\"panel\" role=\"group\" aria-label=\"{description}\">")?;
        writeln!(text, "<p class=\"title\">{title} <span class=\"unit\">{unit}</span></p>")?;
        writeln!(text, "<div class=\"plot\"></div>\n<ul class=\"keys\">")?;
        for series in &panel.series {
            let name = Markup::from(&series.name);
            writeln!(text, "<li class=\"key\"><i></i><span>{name}</span> <output></output></li>")?;
        }
        for envelope in &panel.envelopes {
            if !envelope.name.is_empty() {
                let name = Markup::from(&envelope.name);
                writeln!(text, "<li class=\"key area\"><i></i><span>{name}</span></li>")?;
            }
        }
        if panel.map.is_some() {
            writeln!(text, "<li class=\"key scale\"><i></i><span></span> <output></output></li>")?;
        }
        writeln!(text, "</ul>\n</div>")?;
    }
    writeln!(text, "</div>\n</figure>")
}

/// A description of the figure for readers who cannot see it.
fn in_words(figure: &Figure) -> String {
    let title = plain(&figure.title);
    let panels: Vec<String> = figure.panels.iter().map(panel_in_words).collect();
    let series = figure.panels.iter().flat_map(|panel| &panel.series);
    let maps = figure.panels.iter().filter_map(|panel| panel.map.as_ref());
    let abscissas = series.flat_map(|series| &series.x).chain(maps.flat_map(|map| &map.x));
    let over = match range(abscissas) {
        Some((low, high)) => {
            format!("over {} from {} to {}", plain(&figure.x_label), short(low, 4), short(high, 4))
        }
        None => format!("over {}", plain(&figure.x_label)),
    };
    let first = if title.is_empty() { String::new() } else { format!("{title}: ") };
    format!("{first}{over}. {}", panels.join(" "))
}

fn panel_in_words(panel: &Panel) -> String {
    let series: Vec<String> = panel.series.iter().map(series_in_words).collect();
    let subject = format!("{} {}", plain(&panel.title), plain(&panel.y_label));
    let subject = subject.trim();
    if let Some(map) = &panel.map {
        let title = plain(&panel.title);
        let values = match range(map.values.iter().flatten()) {
            Some((low, high)) => format!("values between {} and {}", short(low, 4), short(high, 4)),
            None => "no values".to_owned(),
        };
        return format!("{title}: a heat map of {} places, {values}.", map.places.len());
    }
    match series.as_slice() {
        [] => format!("{subject}: no curves."),
        _ => format!("{subject}: {}.", series.join("; ")),
    }
}

fn series_in_words(series: &PlotSeries) -> String {
    let name = plain(&series.name);
    let name = if name.is_empty() { "values".to_owned() } else { name };
    match range(series.y.iter()) {
        Some((low, high)) => format!("{name} between {} and {}", short(low, 4), short(high, 4)),
        None => format!("{name} without values"),
    }
}

fn range<'a>(values: impl Iterator<Item = &'a f64>) -> Option<(f64, f64)> {
    values.filter(|value| value.is_finite()).fold(None, |range, &value| {
        let (low, high) = range.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

fn plain(text: &MathText) -> String {
    text.to_plain().trim().to_owned()
}

/// The unit in the brackets of a label.
fn unit(label: &MathText) -> String {
    let label = plain(label);
    let unit = label.rsplit_once('[').map_or("", |(_, unit)| unit.trim_end_matches(']'));
    if unit == "–" { String::new() } else { unit.to_owned() }
}

fn finite(value: f64) -> String {
    if value.is_finite() { format!("{value:e}") } else { "null".to_owned() }
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// The colour on a dark page: colours that would be too dark are lightened.
fn on_dark(colour: [u8; 3]) -> [u8; 3] {
    let [red, green, blue] = colour.map(f64::from);
    // Luma of ITU-R BT.601, 0 … 255.
    let luma = 0.299 * red + 0.587 * green + 0.114 * blue;
    let white = ((150.0 - luma) / (255.0 - luma).max(1.0)).clamp(0.0, 0.85);
    colour.map(|part| (f64::from(part) + white * (255.0 - f64::from(part))).round() as u8)
}

/// A JSON string that cannot end the element around it.
pub(crate) fn json_string(text: &str) -> String {
    let mut json = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => json.push_str("\\\""),
            '\\' => json.push_str("\\\\"),
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' | '\u{0}'..='\u{1f}' => {
                // Writing to a string cannot fail.
                let _ = write!(json, "\\u{:04x}", u32::from(c));
            }
            _ => json.push(c),
        }
    }
    json.push('"');
    json
}

#[cfg(test)]
mod tests {
    use dgd_plot::SeriesMeaning;

    use super::*;

    fn figure(name: &str) -> Figure {
        let series = PlotSeries {
            name: MathText::plain(name),
            style: SeriesStyle::Line,
            x: vec![0.0, 1.0],
            y: vec![2.0, f64::NAN],
            ..PlotSeries::default()
        };
        let panel = Panel {
            title: MathText::plain(name),
            y_label: MathText::default().with_unit("m^3/s"),
            series: vec![series],
            ..Panel::default()
        };
        Figure::new(MathText::plain("Time").with_unit("s"), vec![panel])
    }

    #[test]
    fn names_are_data_and_never_markup() {
        let hostile = "</script><script>alert(1)</script>\u{2028}\"'";
        let mut charts = PageCharts::default();
        let markup = charts.add(&figure(hostile), ChartLink::With(hostile), &Markup::default());
        let json = charts.to_json();
        assert!(!json.contains('<') && !json.contains('\u{2028}'), "{json}");
        assert!(json.contains("\\u003c/script\\u003e\\u003cscript\\u003ealert(1)"), "{json}");
        assert!(!markup.as_str().contains("<script"), "{markup}");
        assert!(markup.as_str().contains("&lt;/script&gt;"), "{markup}");
    }

    #[test]
    fn a_live_figure_has_no_picture_and_its_columns_have_keys() {
        let mut charts = LiveCharts::new(BTreeSet::new());
        let markup = charts.chart(&figure("q"), ChartLink::With("time"), &Markup::default());
        assert!(markup.as_str().contains("class=\"plot\"") && !markup.as_str().contains("<svg"));
        let json = charts.to_json();
        let keys = json.split('"').filter(|word| word.len() == 16);
        let keys: BTreeSet<String> = keys.map(str::to_owned).collect();
        assert_eq!(keys.len(), 2, "{json}");
        let mut again = LiveCharts::new(keys);
        let _ = again.chart(&figure("q"), ChartLink::With("time"), &Markup::default());
        assert!(again.to_json().contains("\"columns\":[null,\nnull]"), "{}", again.to_json());
        assert!(
            charts
                .chart(
                    &Figure::new(MathText::default(), Vec::new()),
                    ChartLink::Alone,
                    &Markup::default()
                )
                .is_empty()
        );
    }

    #[test]
    fn a_figure_is_told_in_words_with_its_units() {
        let words = in_words(&figure("q"));
        assert_eq!(words, "over Time [s] from 0 to 1. q [m³/s]: q between 2 and 2.");
        let json = PageCharts::default().json(&figure("q"), 3, ChartLink::Alone);
        assert!(json.contains("\"unit\":\"m³/s\"") && json.contains("\"alone 3\""), "{json}");
    }

    #[test]
    fn a_heat_map_has_its_rows_and_its_colours() {
        let map = HeatMap {
            x: vec![0.0, 1.0],
            places: vec![1.0, 2.0],
            values: vec![vec![3.0, f64::NAN], vec![4.0, 5.0]],
        };
        let title = MathText::name("p").with_unit("bar");
        let y_label = MathText::plain("cell");
        let panel = Panel { title, y_label, map: Some(map), ..Panel::default() };
        let figure = Figure::new(MathText::plain("Time").with_unit("s"), vec![panel]);
        assert_eq!(
            in_words(&figure),
            "over Time [s] from 0 to 1. p [bar]: a heat map of 2 places, values between 3 and 5."
        );
        let mut charts = PageCharts::default();
        let markup = charts.add(&figure, ChartLink::Alone, &Markup::default());
        assert!(markup.as_str().contains("<span class=\"unit\">over cell</span>"), "{markup}");
        let json = charts.to_json();
        assert!(json.contains("\"rows\":[2,3],\"low\":3e0,\"high\":5e0}"), "{json}");
        assert!(json.contains("\"unit\":\"bar\"") && json.contains("\"scale\":[\"#00204d\""));
    }

    #[test]
    fn colours_on_dark_stay_apart_and_can_be_seen() {
        let own = figure("x").panels[0].series[0].clone();
        let measured = PlotSeries { meaning: SeriesMeaning::Measured, ..own.clone() };
        // As many similar series as there are colours; further ones are dashed.
        let series = [vec![own; 5], vec![measured]].concat();
        let panel = Panel { series, ..Panel::default() };
        let dark: Vec<[u8; 3]> =
            panel.looks().into_iter().map(|look| on_dark(look.colour)).collect();
        for (i, colour) in dark.iter().enumerate() {
            let [red, green, blue] = colour.map(f64::from);
            assert!(0.299 * red + 0.587 * green + 0.114 * blue > 145.0, "{colour:?}");
            assert!(dark[..i].iter().all(|other| other != colour), "{colour:?}");
        }
    }
}
