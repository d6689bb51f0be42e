//! Lines of text: pieces of one font each, and outlines of characters that no font has.

use std::fmt::{self, Write};

use ttf_parser::OutlineBuilder;

use super::encoding::{CharCode, code};
use super::{number, pair};
use crate::font::Font;
use crate::scene::{ScenePoint, TextAnchor, TextDirection};
use crate::text::MathText;

/// Resource names of Helvetica and Symbol in the page.
pub(super) const LATIN: &str = "H";
pub(super) const SYMBOL: &str = "S";

/// Position and direction of a line of text.
pub(super) struct TextPlacement {
    pub(super) at: ScenePoint,
    pub(super) anchor: TextAnchor,
    pub(super) direction: TextDirection,
}

impl TextPlacement {
    /// The point of the scene at a distance along the line and below it.
    fn point(&self, along: f64, below: f64) -> ScenePoint {
        match self.direction {
            TextDirection::Rightwards => (self.at.0 + along, self.at.1 + below),
            TextDirection::Upwards => (self.at.0 + below, self.at.1 - along),
        }
    }

    /// Directions of the axes of text: y upwards from the line.
    fn axes(&self) -> &'static str {
        match self.direction {
            TextDirection::Rightwards => "1 0 0 -1",
            TextDirection::Upwards => "0 -1 -1 0",
        }
    }

    /// Directions of the axes of outlines: y downwards from the line.
    fn outline_axes(&self) -> &'static str {
        match self.direction {
            TextDirection::Rightwards => "1 0 0 1",
            TextDirection::Upwards => "0 -1 1 0",
        }
    }
}

pub(super) fn write(
    out: &mut String,
    text: &MathText,
    size: f64,
    placed: &TextPlacement,
    font: &Font,
) -> fmt::Result {
    let before = match placed.anchor {
        TextAnchor::Start => 0.0,
        TextAnchor::Middle => 0.5,
        TextAnchor::End => 1.0,
    };
    let mut along = -before * font.width(text, size);
    for run in text.runs() {
        let em = size * run.script.scale();
        let below = size * run.script.shift();
        let mut rest = run.text.as_str();
        while let Some(first) = rest.chars().next() {
            let kind = code(first);
            let is_latin = |c: char| matches!(code(c), Some(CharCode::Latin(_)));
            let length = match kind {
                Some(CharCode::Latin(_)) => rest.find(|c| !is_latin(c)).unwrap_or(rest.len()),
                _ => first.len_utf8(),
            };
            let (piece, next) = rest.split_at(length);
            let point = placed.point(along, below);
            match kind {
                Some(CharCode::Latin(_)) => write_latin(out, piece, em, point, placed)?,
                Some(CharCode::Symbol(code, width)) => {
                    // Stretched to the width in the embedded font, with which everything is placed.
                    let stretch = 100.0 * font.advance(first) / (width / 1000.0);
                    let (axes, point) = (placed.axes(), pair(point));
                    write!(out, "BT /{SYMBOL} {} Tf {} Tz ", number(em), number(stretch))?;
                    writeln!(out, "{axes} {point} Tm <{code:02x}> Tj 100 Tz ET")?;
                }
                None => {
                    let (axes, point) = (placed.outline_axes(), pair(point));
                    write!(out, "q {axes} {point} cm ")?;
                    let mut outline = PdfOutline { out: &mut *out, last: (0.0, 0.0) };
                    font.draw(&MathText::plain(piece), em, &mut outline);
                    writeln!(out, "f Q")?;
                }
            }
            along += piece.chars().map(|c| em * font.advance(c)).sum::<f64>();
            rest = next;
        }
    }
    Ok(())
}

fn write_latin(
    out: &mut String,
    piece: &str,
    em: f64,
    at: ScenePoint,
    placed: &TextPlacement,
) -> fmt::Result {
    let (axes, at) = (placed.axes(), pair(at));
    write!(out, "BT /{LATIN} {} Tf {axes} {at} Tm (", number(em))?;
    for character in piece.chars() {
        match code(character) {
            Some(CharCode::Latin(byte @ (b'(' | b')' | b'\\'))) => {
                write!(out, "\\{}", char::from(byte))?;
            }
            Some(CharCode::Latin(byte @ 0x20..=0x7e)) => out.push(char::from(byte)),
            Some(CharCode::Latin(byte)) => write!(out, "\\{byte:03o}")?,
            Some(CharCode::Symbol(..)) | None => {}
        }
    }
    writeln!(out, ") Tj ET")
}

/// Copies the outlines of glyphs into a path.
struct PdfOutline<'a> {
    out: &'a mut String,
    last: (f64, f64),
}

impl PdfOutline<'_> {
    /// Writes points and their operator; the pen is then at the last point.
    fn push(&mut self, points: &[(f64, f64)], operator: &str) {
        for point in points {
            self.out.push_str(&pair(*point));
            self.out.push(' ');
        }
        self.out.push_str(operator);
        self.out.push(' ');
        self.last = points.last().copied().unwrap_or(self.last);
    }
}

fn wide(x: f32, y: f32) -> (f64, f64) {
    (f64::from(x), f64::from(y))
}

impl OutlineBuilder for PdfOutline<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.push(&[wide(x, y)], "m");
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.push(&[wide(x, y)], "l");
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        // The same curve as a cubic: its control points are two thirds of the way to the quadratic's.
        let (handle, end) = (wide(x1, y1), wide(x, y));
        let toward = |from: (f64, f64)| {
            (from.0 + 2.0 / 3.0 * (handle.0 - from.0), from.1 + 2.0 / 3.0 * (handle.1 - from.1))
        };
        self.push(&[toward(self.last), toward(end), end], "c");
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.push(&[wide(x1, y1), wide(x2, y2), wide(x, y)], "c");
    }

    fn close(&mut self) {
        self.out.push_str("h ");
    }
}
