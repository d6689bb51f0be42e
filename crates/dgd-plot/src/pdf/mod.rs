//! A scene as a PDF document of one page.
//!
//! Text stays text: Latin letters in Helvetica, Greek ones and operators in Symbol, which every PDF reader has, so the
//! file contains no fonts. Characters that neither has are drawn as outlines of the embedded font.
//!
//! Source: ISO 32000-1:2008, sections 7.5, 8.4, 8.5 and 9.4, annex D.

mod encoding;
mod text;

use std::fmt::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::font::Font;
use crate::scene::{Colour, Pen, Rectangle, Scene, SceneMark, ScenePoint};

/// Points of the page per pixel of the scene: 96 pixels are an inch.
const POINTS: f64 = 0.75;

/// Deflate's default compression level.
const LEVEL: u32 = 6;

pub(crate) fn write(scene: &Scene) -> Vec<u8> {
    let mut content = String::new();
    // Writing to a string cannot fail.
    let _ = write_content(&mut content, scene);
    let content = deflated(content.as_bytes());
    let (width, height) = (number(scene.width * POINTS), number(scene.height * POINTS));
    let page = format!(
        "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width} {height}] /Contents 4 0 R \
         /Resources << /Font << /{} 5 0 R /{} 6 0 R >> >> >>",
        text::LATIN,
        text::SYMBOL
    );
    let stream = format!("<< /Length {} /Filter /FlateDecode >>\nstream\n", content.len());
    let stream = [stream.as_bytes(), &content, b"\nendstream"].concat();
    let font = |name: &str, more: &str| {
        format!("<< /Type /Font /Subtype /Type1 /BaseFont /{name}{more} >>").into_bytes()
    };
    document(&[
        b"<< /Type /Catalog /Pages 2 0 R >>".to_vec(),
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_vec(),
        page.into_bytes(),
        stream,
        font("Helvetica", " /Encoding /WinAnsiEncoding"),
        font("Symbol", ""),
    ])
}

/// Objects numbered from 1, of which the first is the catalogue, with the table of their offsets.
fn document(objects: &[Vec<u8>]) -> Vec<u8> {
    // Bytes above 127 in the second line mark the file as binary for transfer programs.
    let mut file = b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n".to_vec();
    let mut places = Vec::with_capacity(objects.len());
    for (i, object) in objects.iter().enumerate() {
        places.push(file.len());
        file.extend_from_slice(format!("{} 0 obj\n", i + 1).as_bytes());
        file.extend_from_slice(object);
        file.extend_from_slice(b"\nendobj\n");
    }
    let (start, count) = (file.len(), objects.len() + 1);
    let mut end = format!("xref\n0 {count}\n0000000000 65535 f \n");
    for place in places {
        // Writing to a string cannot fail.
        let _ = writeln!(end, "{place:010} 00000 n ");
    }
    let _ = write!(end, "trailer\n<< /Size {count} /Root 1 0 R >>\nstartxref\n{start}\n%%EOF\n");
    file.extend_from_slice(end.as_bytes());
    file
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write as _;
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(LEVEL));
    // Writing to memory cannot fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}

fn write_content(out: &mut String, scene: &Scene) -> fmt::Result {
    // From here on coordinates are those of the scene: pixels from the upper left corner, y downwards.
    let height = number(scene.height * POINTS);
    writeln!(out, "{POINTS} 0 0 -{POINTS} 0 {height} cm 1 j")?;
    let font = Font::embedded();
    for mark in &scene.marks {
        match mark {
            SceneMark::Area { rectangle, colour } => write_area(out, *rectangle, *colour)?,
            SceneMark::Surface { outlines, colour } => {
                if outlines.is_empty() {
                    continue;
                }
                writeln!(out, "{} rg", shares(*colour))?;
                outlines.iter().try_for_each(|line| write_line(out, line))?;
                // Filling closes each outline.
                writeln!(out, "f")?;
            }
            SceneMark::Lines { lines, pen } => write_lines(out, lines, *pen)?,
            SceneMark::Dots { centres, diameter, colour } => {
                write_dots(out, centres, *diameter, *colour)?;
            }
            SceneMark::Text { text, at, anchor, direction, size, colour } => {
                writeln!(out, "{} rg", shares(*colour))?;
                let placed =
                    text::TextPlacement { at: *at, anchor: *anchor, direction: *direction };
                text::write(out, text, *size, &placed, &font)?;
            }
        }
    }
    Ok(())
}

fn write_area(out: &mut String, rectangle: Rectangle, colour: Colour) -> fmt::Result {
    let Rectangle { left, top, width, height } = rectangle;
    let place = [left, top, width, height].map(number).join(" ");
    writeln!(out, "{} rg {place} re f", shares(colour))
}

fn write_lines(out: &mut String, lines: &[Vec<ScenePoint>], pen: Pen) -> fmt::Result {
    if lines.is_empty() {
        return Ok(());
    }
    let dashes: Vec<String> = pen.dashes.iter().map(|&d| number(f64::from(d))).collect();
    let (dashes, width) = (dashes.join(" "), number(pen.width));
    writeln!(out, "{} RG {width} w [{dashes}] 0 d", shares(pen.colour))?;
    lines.iter().try_for_each(|line| write_line(out, line))?;
    writeln!(out, "S")
}

fn write_line(out: &mut String, line: &[ScenePoint]) -> fmt::Result {
    for (i, point) in line.iter().enumerate() {
        let operator = if i == 0 { 'm' } else { 'l' };
        writeln!(out, "{} {operator}", pair(*point))?;
    }
    Ok(())
}

/// A line of zero length with round ends is a dot.
fn write_dots(
    out: &mut String,
    centres: &[ScenePoint],
    diameter: f64,
    colour: Colour,
) -> fmt::Result {
    if centres.is_empty() {
        return Ok(());
    }
    writeln!(out, "q 1 J {} RG {} w [] 0 d", shares(colour), number(diameter))?;
    for centre in centres {
        let centre = pair(*centre);
        writeln!(out, "{centre} m {centre} l")?;
    }
    writeln!(out, "S Q")
}

/// Red, green and blue from 0 to 1.
fn shares(Colour(red, green, blue): Colour) -> String {
    [red, green, blue].map(|part| thousandths(f64::from(part) / 255.0)).join(" ")
}

fn pair(point: ScenePoint) -> String {
    format!("{} {}", number(point.0), number(point.1))
}

/// A number to a hundredth, without trailing zeros.
fn number(x: f64) -> String {
    trimmed(&format!("{x:.2}"))
}

fn thousandths(x: f64) -> String {
    trimmed(&format!("{x:.3}"))
}

fn trimmed(text: &str) -> String {
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if matches!(short, "-0" | "") { "0".to_owned() } else { short.to_owned() }
}

#[cfg(test)]
mod tests;
