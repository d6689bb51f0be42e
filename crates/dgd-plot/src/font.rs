//! The embedded font: widths of texts, and outlines of glyphs.

use ttf_parser::{Face, GlyphId, OutlineBuilder};

use crate::text::MathText;
use crate::text::Script;

/// A subset of a sans serif font with the widths of Arial and Helvetica.
static FIGURE_SANS: &[u8] = include_bytes!("../assets/fonts/figure-sans.ttf");

pub(crate) struct Font {
    face: Face<'static>,
}

impl Font {
    /// The font that is part of the program.
    pub(crate) fn embedded() -> Font {
        Font { face: Face::parse(FIGURE_SANS, 0).expect("the embedded font is well formed") }
    }

    /// Width of one character of size 1.
    pub(crate) fn advance(&self, character: char) -> f64 {
        // If the viewer must substitute another font, the width is unknown: a square for East Asian scripts, an average
        // letter otherwise.
        let Some(glyph) = self.face.glyph_index(character) else {
            return if character >= '\u{1100}' { 1.0 } else { 0.6 };
        };
        f64::from(self.face.glyph_hor_advance(glyph).unwrap_or(0))
            / f64::from(self.face.units_per_em())
    }

    /// Width of a line of text.
    pub(crate) fn width(&self, text: &MathText, size: f64) -> f64 {
        let runs = text.runs().iter();
        runs.map(|run| {
            let em = size * run.script.scale();
            run.text.chars().map(|c| em * self.advance(c)).sum::<f64>()
        })
        .sum()
    }

    /// Draws a line of text from the origin to the right, y downwards.
    pub(crate) fn draw(&self, text: &MathText, size: f64, pen: &mut dyn OutlineBuilder) {
        let mut x = 0.0;
        for run in text.runs() {
            let em = size * run.script.scale();
            for character in run.text.chars() {
                let glyph = self.face.glyph_index(character).unwrap_or(GlyphId(0));
                let unit = em / f64::from(self.face.units_per_em());
                let y = size * run.script.shift();
                self.face.outline_glyph(glyph, &mut GlyphPlacement { pen: &mut *pen, x, y, unit });
                x += em * self.advance(character);
            }
        }
    }
}

/// Moves and scales a glyph: (x, y) of the font, y upwards, maps to (x₀ + x·unit, y₀ − y·unit).
struct GlyphPlacement<'a> {
    pen: &'a mut dyn OutlineBuilder,
    x: f64,
    y: f64,
    unit: f64,
}

impl GlyphPlacement<'_> {
    fn transform(&self, x: f32, y: f32) -> (f32, f32) {
        ((self.x + f64::from(x) * self.unit) as f32, (self.y - f64::from(y) * self.unit) as f32)
    }
}

impl OutlineBuilder for GlyphPlacement<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.transform(x, y);
        self.pen.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.transform(x, y);
        self.pen.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.transform(x1, y1), self.transform(x, y));
        self.pen.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) =
            (self.transform(x1, y1), self.transform(x2, y2), self.transform(x, y));
        self.pen.curve_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.pen.close();
    }
}

impl Script {
    /// Size, relative to that of the line.
    pub(crate) fn scale(self) -> f64 {
        match self {
            Script::Base => 1.0,
            Script::Subscript | Script::Superscript => 0.72,
        }
    }

    /// Downward shift of the baseline, relative to the size of the line.
    pub(crate) fn shift(self) -> f64 {
        match self {
            Script::Base => 0.0,
            Script::Subscript => 0.2,
            Script::Superscript => -0.36,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_has_every_sign_that_figures_use() {
        let font = Font::embedded();
        for character in "azAZ09αωΓΩ∂×·°−±√²³µ…–[](){}_^*/.,'".chars() {
            assert!(font.face.glyph_index(character).is_some(), "{character}");
        }
    }

    #[test]
    fn widths_are_those_of_the_digits() {
        // Digits of the families with Arial's widths are 1139/2048 wide.
        let width = Font::embedded().width(&MathText::plain("00"), 10.0);
        assert!((width - 20.0 * 1139.0 / 2048.0).abs() < 1e-12);
    }
}
