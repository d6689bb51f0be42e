//! A scene as a PNG image.

use std::error::Error;
use std::fmt;

use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, StrokeDash,
    Transform,
};
use ttf_parser::OutlineBuilder;

use crate::font::Font;
use crate::scene::{Colour, Pen, Scene, SceneMark, ScenePoint, TextAnchor, TextDirection};

/// Pixels of the image per pixel of the scene.
const SCALE: f32 = 2.0;

/// Largest width or height that common viewers and drawing libraries open.
const LARGEST_SIDE: f64 = 32_767.0;

/// Why a figure cannot be rendered as a PNG image.
#[derive(Debug, Clone, PartialEq)]
pub enum RasterError {
    /// Common programs could not open an image of this size.
    TooLarge {
        /// Pixels from left to right.
        width: f64,
        /// Pixels from top to bottom.
        height: f64,
    },
    /// The image could not be encoded.
    Encoding(String),
}

impl fmt::Display for RasterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RasterError::TooLarge { width, height } => write!(
                f,
                "a PNG of {width} × {height} pixels is too large: draw fewer panels or write SVG"
            ),
            RasterError::Encoding(reason) => write!(f, "the image cannot be encoded: {reason}"),
        }
    }
}

impl Error for RasterError {}

pub(crate) fn encode(scene: &Scene) -> Result<Vec<u8>, RasterError> {
    let (width, height) =
        ((scene.width * f64::from(SCALE)).ceil(), (scene.height * f64::from(SCALE)).ceil());
    let too_large = RasterError::TooLarge { width, height };
    if width > LARGEST_SIDE || height > LARGEST_SIDE {
        return Err(too_large);
    }
    let mut image = Pixmap::new(width as u32, height as u32).ok_or(too_large)?;
    image.fill(Color::WHITE);
    let font = Font::embedded();
    for mark in &scene.marks {
        draw(mark, &font, &mut image);
    }
    image.encode_png().map_err(|error| RasterError::Encoding(error.to_string()))
}

fn draw(mark: &SceneMark, font: &Font, image: &mut Pixmap) {
    let scale = Transform::from_scale(SCALE, SCALE);
    match mark {
        SceneMark::Area { rectangle, colour } => {
            let (left, top) = (rectangle.left as f32, rectangle.top as f32);
            let (width, height) = (rectangle.width as f32, rectangle.height as f32);
            if let Some(area) = Rect::from_xywh(left, top, width, height) {
                image.fill_rect(area, &paint(*colour), scale, None);
            }
        }
        SceneMark::Surface { outlines, colour } => {
            // Filling closes each outline.
            if let Some(path) = joined(outlines) {
                image.fill_path(&path, &paint(*colour), FillRule::Winding, scale, None);
            }
        }
        SceneMark::Lines { lines, pen } => {
            if let Some(path) = joined(lines) {
                image.stroke_path(&path, &paint(pen.colour), &stroke(*pen), scale, None);
            }
        }
        SceneMark::Dots { centres, diameter, colour } => {
            fill_dots(centres, *diameter, *colour, image);
        }
        SceneMark::Text { text, at, anchor, direction, size, colour } => {
            let mut outline = PngOutline(PathBuilder::new());
            font.draw(text, *size, &mut outline);
            let Some(path) = outline.0.finish() else {
                return;
            };
            let before = match anchor {
                TextAnchor::Start => 0.0,
                TextAnchor::Middle => 0.5,
                TextAnchor::End => 1.0,
            };
            let start = -before * font.width(text, *size);
            let turn = match direction {
                TextDirection::Rightwards => 0.0,
                TextDirection::Upwards => -90.0,
            };
            let place = scale
                .pre_translate(at.0 as f32, at.1 as f32)
                .pre_rotate(turn)
                .pre_translate(start as f32, 0.0);
            image.fill_path(&path, &paint(*colour), FillRule::Winding, place, None);
        }
    }
}

fn joined(lines: &[Vec<ScenePoint>]) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for line in lines {
        for (i, &(x, y)) in line.iter().enumerate() {
            match i {
                0 => builder.move_to(x as f32, y as f32),
                _ => builder.line_to(x as f32, y as f32),
            }
        }
    }
    builder.finish()
}

fn fill_dots(centres: &[ScenePoint], diameter: f64, colour: Colour, image: &mut Pixmap) {
    let mut builder = PathBuilder::new();
    for &(x, y) in centres {
        builder.push_circle(x as f32, y as f32, 0.5 * diameter as f32);
    }
    if let Some(path) = builder.finish() {
        let scale = Transform::from_scale(SCALE, SCALE);
        image.fill_path(&path, &paint(colour), FillRule::Winding, scale, None);
    }
}

fn paint(Colour(red, green, blue): Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, 0xff);
    paint
}

fn stroke(pen: Pen) -> Stroke {
    Stroke {
        width: pen.width as f32,
        line_cap: LineCap::Butt,
        line_join: LineJoin::Round,
        dash: StrokeDash::new(pen.dashes.to_vec(), 0.0),
        ..Stroke::default()
    }
}

/// Copies the outlines of glyphs into a path.
struct PngOutline(PathBuilder);

impl OutlineBuilder for PngOutline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.0.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.0.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.0.close();
    }
}
