//! A page: its header, its pieces, and its origin.

use std::fmt::Write;

use base64::prelude::{BASE64_STANDARD, Engine as _};
use dgd_plot::Figure;
use sha2::{Digest, Sha256};

use crate::assets;
use crate::chart::{ChartLink, PageCharts};
use crate::markup::{Markup, escaped};

/// The tone of a headline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeadlineTone {
    /// All is well.
    Good,
    /// Something is wrong or unknown.
    Doubt,
    /// There is nothing to judge.
    Plain,
}

/// The inputs of a page, and the program that made it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PageOrigin {
    /// The command line that reproduces it.
    pub command: String,
    /// Version of dgd.
    pub version: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Digests of the models, each with its name if there are several.
    pub models: Vec<(String, String)>,
    /// The data files with their digests.
    pub data: Vec<(String, Option<String>)>,
}

/// A page that grows from top to bottom.
#[derive(Debug)]
pub struct Page {
    title: String,
    body: String,
    charts: PageCharts,
}

impl Page {
    /// An empty page with this window title.
    pub fn new(title: &str) -> Page {
        Page { title: title.to_owned(), body: String::new(), charts: PageCharts::default() }
    }

    /// Adds the subject of the page, its headline, and the rest of the first screen.
    pub fn push_header(
        &mut self,
        kind: &Markup,
        headline: &Markup,
        tone: HeadlineTone,
        more: &[Markup],
    ) {
        let tone = match tone {
            HeadlineTone::Good => "good",
            HeadlineTone::Doubt => "doubt",
            HeadlineTone::Plain => "plain",
        };
        let more: String = more.iter().map(Markup::as_str).collect();
        // Writing to a string cannot fail.
        let _ = write!(
            self.body,
            "<div class=\"lead\">\n<p class=\"kind\">{kind}</p>\n<h1 class=\"{tone}\">{headline}</h1>\n{more}</div>\n"
        );
    }

    /// Adds a piece.
    pub fn push(&mut self, piece: &Markup) {
        self.body.push_str(piece.as_str());
    }

    /// Adds a section under a heading, unless it is empty.
    pub fn push_section(&mut self, heading: &str, body: &[Markup]) {
        if body.iter().any(|piece| !piece.is_empty()) {
            let section = Markup::section(&Markup::prose(heading), body);
            self.push(&section);
        }
    }

    /// A figure as a piece of this page, with zoom and cursors.
    #[must_use]
    pub fn chart(&mut self, figure: &Figure, link: ChartLink<'_>, caption: &Markup) -> Markup {
        if figure.panels.is_empty() {
            return Markup::default();
        }
        self.charts.add(figure, link, caption)
    }

    /// The document.
    pub fn finish(self, origin: &PageOrigin) -> String {
        let (style, script) = (assets::style(), assets::script());
        let hash =
            |text: &str| format!("'sha256-{}'", BASE64_STANDARD.encode(Sha256::digest(text)));
        let policy = format!(
            "default-src 'none'; script-src {}; style-src {}; base-uri 'none'; form-action 'none'",
            hash(&script),
            hash(&style)
        );
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"generator\" content=\"dgd {}\">\n\
             <title>{}</title>\n<style>{style}</style>\n</head>\n<body>\n<main>\n{}{}</main>\n\
             <script type=\"application/json\" id=\"data\">{}</script>\n<script>{script}</script>\n\
             </body>\n</html>\n",
            escaped(&origin.version),
            escaped(&self.title),
            self.body,
            origin.to_markup(),
            self.charts.to_json()
        );
        text
    }
}

impl PageOrigin {
    fn to_markup(&self) -> Markup {
        let row = |name: &str, value: Markup| (Markup::text(name), value);
        let mut rows = vec![
            row("dgd", Markup::text(&self.version)),
            row("seed", Markup::text(&self.seed.to_string())),
        ];
        for (name, digest) in &self.models {
            let name = if name.is_empty() {
                Markup::default()
            } else {
                Markup::code(name).then(&Markup::text(" "))
            };
            rows.push(row("model", name.then(&Markup::code(digest))));
        }
        for (file, digest) in &self.data {
            let digest = digest.as_ref().map(|one| Markup::text(" ").then(&Markup::code(one)));
            rows.push(row("data", Markup::code(file).then(&digest.unwrap_or_default())));
        }
        let command = if self.command.is_empty() {
            String::new()
        } else {
            format!("<pre tabindex=\"0\">{}</pre>\n", escaped(&self.command))
        };
        let body = [Markup::trusted(command), Markup::definitions(&rows)];
        Markup::section(&Markup::text("To do it again"), &body)
    }
}

#[cfg(test)]
mod tests {
    use dgd_plot::{MathText, Panel, PlotSeries, SeriesStyle};

    use super::*;

    fn hostile() -> String {
        let name = "</script><script>alert(1)</script><img src=x onerror=alert(2)>";
        let series = PlotSeries {
            name: MathText::plain(name),
            style: SeriesStyle::Dots,
            x: vec![0.0, 1.0, 2.0],
            y: vec![1.0, 2.0, 3.0],
            ..PlotSeries::default()
        };
        let panel = Panel { title: MathText::name(name), series: vec![series], ..Panel::default() };
        let mut page = Page::new(name);
        let name = Markup::code(name);
        page.push_header(&name, &name, HeadlineTone::Good, &[name.paragraph()]);
        let chart =
            page.chart(&Figure::new(MathText::plain("x"), vec![panel]), ChartLink::Alone, &name);
        page.push_section("Curves of `<b>`", &[chart]);
        page.push_section("Nothing", &[Markup::default()]);
        let name = name.to_string();
        page.finish(&PageOrigin {
            command: "dgd simulate '</script><script>'".to_owned(),
            version: "0.1.0".to_owned(),
            models: vec![(name.clone(), name.clone())],
            data: vec![(name, None)],
            ..PageOrigin::default()
        })
    }

    #[test]
    fn a_page_has_two_scripts_whatever_the_names_are() {
        let page = hostile();
        assert_eq!(page.matches("<script").count(), 2, "one of data, one of code");
        assert_eq!(page.matches("</script>").count(), 2);
        assert!(!page.contains("<img") && !page.contains("Nothing</h2>"));
        assert!(page.contains("<h2>Curves of <code>&lt;b&gt;</code></h2>"));
    }

    /// The text between the first occurrences of two texts.
    fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
        let rest = text.split_once(from).map_or("", |(_, rest)| rest);
        rest.split_once(to).map_or("", |(inner, _)| inner)
    }

    #[test]
    fn the_policy_allows_what_is_in_the_page_and_nothing_else() {
        let page = hostile();
        let policy = between(&page, "Content-Security-Policy\" content=\"", "\"");
        for (element, end) in [("<script>", "</script>"), ("<style>", "</style>")] {
            let hash = BASE64_STANDARD.encode(Sha256::digest(between(&page, element, end)));
            assert!(policy.contains(&format!("'sha256-{hash}'")), "{element} {policy}");
        }
        assert!(policy.starts_with("default-src 'none';") && !policy.contains("unsafe"));
        // Nothing is fetched, and no attribute contains a style or a script, which the policy would refuse.
        let body = between(&page, "<body>", "<script>");
        let tags = body.split('<').filter_map(|piece| piece.split_once('>'));
        for (tag, _) in tags {
            // Everything between quotes is text.
            let names: Vec<&str> = tag.split('"').step_by(2).collect();
            for refused in [" style=", " on", " src=", " href="] {
                assert!(!names.concat().contains(refused), "{tag}");
            }
        }
    }
}
