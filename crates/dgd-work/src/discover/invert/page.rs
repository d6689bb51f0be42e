//! The page of an inversion: the figure and its provenance.

use dgd_page::{ChartLink, HeadlineTone, Markup, Page};

use super::InvertedReport;
use crate::output::page::origin;

impl InvertedReport {
    /// Its page, with the command that reproduces it.
    pub fn page(&self, command: &str) -> String {
        let InvertedReport { model, equation, .. } = self;
        let mut page = Page::new(&format!("{model}: what {equation} lacks"));
        let kind = Markup::text("Inversion of ").then(&Markup::code(model));
        let headline = format!("What equation `{equation}` lacks, from what was measured");
        page.push_header(&kind, &Markup::prose(&headline), HeadlineTone::Plain, &[]);
        let chart = page.chart(&self.figure(), ChartLink::With("inversion"), &Markup::default());
        page.push_section("What is missing", &[chart]);
        // The first line is the headline.
        let text = self.to_text();
        let (_, more) = text.split_once("\n\n").unwrap_or(("", &text));
        let lines = more.lines().filter(|line| !line.trim().is_empty());
        let lines: Vec<Markup> = lines.map(|line| Markup::prose(line).paragraph()).collect();
        page.push_section("How it was found", &lines);
        page.finish(&origin(&self.provenance, command))
    }
}
