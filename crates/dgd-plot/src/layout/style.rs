//! Sizes, distances and colours of a figure, and the placement of its texts.

use crate::font::Font;
use crate::scene::{Colour, Pen, SceneMark, ScenePoint, TextAnchor, TextDirection};
use crate::text::MathText;
use crate::ticks::PlotAxis;

pub(super) const TICK_SIZE: f64 = 12.0;
pub(super) const LABEL_SIZE: f64 = 13.0;
pub(super) const TITLE_SIZE: f64 = 14.0;
pub(super) const FIGURE_TITLE_SIZE: f64 = 16.0;
/// Distance of baselines, relative to the size.
pub(super) const LINE_HEIGHT: f64 = 1.45;
/// Distance from the baseline to half the height of a digit, and to the lowest descender.
pub(super) const HALF_DIGIT: f64 = 0.36;
pub(super) const DESCENT: f64 = 0.25;

/// Margin around the figure.
pub(super) const MARGIN: f64 = 10.0;
/// Gap between the axes of one column and the labels of the next, and between rows.
pub(super) const COLUMN_GAP: f64 = 24.0;
pub(super) const ROW_GAP: f64 = 16.0;
/// Gap above the axes.
pub(super) const HEADER_GAP: f64 = 7.0;
pub(super) const TICK_LENGTH: f64 = 4.0;
pub(super) const TICK_GAP: f64 = 3.0;
pub(super) const LABEL_GAP: f64 = 6.0;
/// Gap between two texts on one line.
pub(super) const TEXT_GAP: f64 = 10.0;

/// Free space at both ends of a y axis, relative to the range of the data.
pub(super) const Y_ROOM: f64 = 0.05;
/// Minimum distance between ticks, in pixels.
pub(super) const X_TICK_DISTANCE: f64 = 45.0;
pub(super) const Y_TICK_DISTANCE: f64 = 30.0;
/// Minimum width per column that leaves room for axes.
pub(super) const NARROWEST_COLUMN: f64 = 180.0;
/// Points per panel: about ten bytes each in an SVG.
pub(super) const POINT_BUDGET: f64 = 20_000.0;

pub(super) const INK: Colour = Colour(0x22, 0x22, 0x22);
pub(super) const MUTED: Colour = Colour(0x77, 0x77, 0x77);
pub(super) const AXIS: Pen = Pen { colour: Colour(0x33, 0x33, 0x33), width: 1.0, dashes: &[] };
pub(super) const GRID: Pen = Pen { colour: Colour(0xe2, 0xe2, 0xe2), width: 1.0, dashes: &[] };
pub(crate) const BAND: Colour = Colour(0xf1, 0xf1, 0xf1);

pub(super) fn range<'a>(values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
}

pub(super) fn label_width(axis: &PlotAxis, font: &Font) -> f64 {
    axis.ticks.iter().map(|tick| font.width(&tick.label, TICK_SIZE)).fold(0.0, f64::max)
}

pub(super) fn text(text: MathText, at: ScenePoint, anchor: TextAnchor, size: f64) -> SceneMark {
    SceneMark::Text { text, at, anchor, direction: TextDirection::Rightwards, size, colour: INK }
}
