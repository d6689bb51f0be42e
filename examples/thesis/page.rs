//! The folder of pictures and its index.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use dgd_plot::{Figure, Panel, Series, Style, Text, render_svg};

use crate::chapters::Fallible;

/// A figure of the thesis, drawn from the recordings.
pub(crate) struct Finding {
    /// Its number in the thesis.
    pub(crate) number: &'static str,
    pub(crate) title: &'static str,
    /// What the thesis found.
    pub(crate) thesis: &'static str,
    /// What is found here.
    pub(crate) here: String,
    /// What must come out, and whether it does.
    pub(crate) claims: Vec<Claim>,
    pub(crate) figure: Figure,
}

/// A finding of the thesis that must come out.
pub(crate) struct Claim {
    pub(crate) text: String,
    pub(crate) holds: bool,
}

/// What must come out, with the numbers that say so.
pub(crate) fn claim(holds: bool, text: String) -> Claim {
    Claim { text, holds }
}

/// A part of the thesis.
pub(crate) struct Section {
    pub(crate) title: &'static str,
    pub(crate) findings: Vec<Finding>,
}

/// Writes each figure and the index.
pub(crate) fn write(folder: &Path, sections: &[Section]) -> Fallible<()> {
    fs::create_dir_all(folder)?;
    let mut body = String::new();
    for section in sections {
        writeln!(body, "<h2>{}</h2>", escaped(section.title))?;
        for finding in &section.findings {
            let file = format!("fig_{}.svg", finding.number.replace('.', "_"));
            fs::write(folder.join(&file), render_svg(&finding.figure))?;
            writeln!(
                body,
                "<figure id=\"fig_{number}\">\n<figcaption><b>Fig {number}</b> {title}</figcaption>\n\
                 <img src=\"{file}\" alt=\"{title}\">\n\
                 <dl><dt>The thesis</dt><dd>{thesis}</dd><dt>Here</dt><dd>{here}</dd>{claims}</dl>\n</figure>",
                number = finding.number,
                title = escaped(finding.title),
                thesis = escaped(finding.thesis),
                here = escaped(&finding.here),
                claims = claims(&finding.claims),
            )?;
        }
    }
    fs::write(folder.join("index.html"), format!("{HEAD}{body}</body>\n</html>\n"))?;
    Ok(())
}

/// What must come out, as terms of the list.
fn claims(claims: &[Claim]) -> String {
    let line = |claim: &Claim| {
        let word = if claim.holds { "Comes out" } else { "Does not come out" };
        format!("<dt>{word}</dt><dd>{}</dd>", escaped(&claim.text))
    };
    claims.iter().map(line).collect()
}

const HEAD: &str = r#"<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>Haukanes 2015, chapters 3 and 4, from the recordings in data/</title>
<style>
body { font: 16px/1.45 "Liberation Sans", Arial, sans-serif; max-width: 52em; margin: 2em auto; padding: 0 1em; color: #222 }
h1 { font-size: 1.5em } h2 { font-size: 1.2em; margin-top: 2.5em; border-bottom: 1px solid #ccc }
figure { margin: 2em 0; break-inside: avoid } figcaption { margin-bottom: .5em } img { max-width: 100% }
dl { display: grid; grid-template-columns: 6.5em 1fr; gap: .3em 1em; margin: .5em 0 } dt { color: #666 } dd { margin: 0 }
</style>
</head>
<body>
<h1>State and parameter identification for dual gradient drilling</h1>
<p>The data figures of chapters 3 and 4 and of appendix B of Haukanes 2015, drawn from the recordings in
<code>data/</code>. The field data of the thesis is confidential; these are of a simulated rig with the same
instruments, which is richer than any model that is fitted here. What was true of it is in
<code>data/truth.json</code>, which nothing on this page has read.</p>
"#;

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A panel with a title and the unit of its axis.
pub(crate) fn panel(title: &str, unit: &str, series: Vec<Series>) -> Panel {
    Panel {
        title: Text::plain(title),
        y_label: Text::default().with_unit(unit),
        series,
        ..Panel::default()
    }
}

/// What was measured, over time.
pub(crate) fn measured(name: &str, x: &[f64], y: Vec<f64>) -> Series {
    series(name, Style::ThinLine, x, y)
}

/// What was computed, over time.
pub(crate) fn computed(name: &str, x: &[f64], y: Vec<f64>) -> Series {
    series(name, Style::Line, x, y)
}

/// Single points.
pub(crate) fn dots(name: &str, x: &[f64], y: Vec<f64>) -> Series {
    series(name, Style::Dots, x, y)
}

fn series(name: &str, style: Style, x: &[f64], y: Vec<f64>) -> Series {
    Series { name: Text::plain(name), style, x: x.to_vec(), y }
}

/// Panels below each other over time.
pub(crate) fn over_time(panels: Vec<Panel>) -> Figure {
    Figure { columns: 1, ..Figure::new(Text::plain("Time").with_unit("s"), panels) }
}

/// Panels below each other over something else.
pub(crate) fn over(x: &str, unit: &str, panels: Vec<Panel>) -> Figure {
    Figure { columns: 1, ..Figure::new(Text::plain(x).with_unit(unit), panels) }
}

/// Values in another unit.
pub(crate) fn per(values: &[f64], unit: f64) -> Vec<f64> {
    values.iter().map(|value| value / unit).collect()
}

/// a − b.
pub(crate) fn less(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}
