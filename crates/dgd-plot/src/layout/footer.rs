//! Labels of the common x axis.

use super::style::{
    DESCENT, LABEL_SIZE, LINE_HEIGHT, TEXT_GAP, TICK_GAP, TICK_LENGTH, TICK_SIZE, text,
};
use crate::figure::Figure;
use crate::font::Font;
use crate::scene::{SceneMark, ScenePoint, TextAnchor};
use crate::text::MathText;
use crate::ticks::PlotAxis;
use crate::wrap::wrap;

/// The labels under the lowest axes of a column.
pub(super) struct Footer {
    /// Lines of the label, then its position below the axes.
    label: Vec<MathText>,
    common_line: f64,
    axes_width: f64,
    pub(super) height: f64,
}

impl Footer {
    pub(super) fn new(figure: &Figure, font: &Font, x: &PlotAxis, axes_width: f64) -> Footer {
        let label = wrap(&figure.x_label, font, LABEL_SIZE, axes_width);
        let ticks = TICK_LENGTH + TICK_GAP + LINE_HEIGHT * TICK_SIZE;
        let line = LINE_HEIGHT * LABEL_SIZE;
        let first_width = label.first().map_or(0.0, |first| font.width(first, LABEL_SIZE));
        let common_width = font.width(&x.common, TICK_SIZE);
        // The power of ten of the x axis is at its end, on the first line of the label or, if that is too long, below.
        let is_beside = 0.5 * first_width + TEXT_GAP + common_width <= 0.5 * axes_width;
        let common_lines = if x.common.is_empty() {
            0
        } else if is_beside {
            1
        } else {
            label.len() + 1
        };
        let lines = label.len().max(common_lines);
        Footer {
            height: (ticks + lines as f64 * line + 2.0).round(),
            common_line: ticks + common_lines as f64 * line,
            label,
            axes_width,
        }
    }

    /// Draws below axes whose lower left corner is `corner`.
    pub(super) fn draw(&self, x: &PlotAxis, corner: ScenePoint, marks: &mut Vec<SceneMark>) {
        let tick_base = corner.1 + TICK_LENGTH + TICK_GAP + 0.8 * TICK_SIZE;
        for tick in &x.ticks {
            let position = (corner.0 + tick.fraction * self.axes_width, tick_base);
            marks.push(text(tick.label.clone(), position, TextAnchor::Middle, TICK_SIZE));
        }
        let mut base = corner.1 + TICK_LENGTH + TICK_GAP + LINE_HEIGHT * TICK_SIZE;
        for line in &self.label {
            base += LINE_HEIGHT * LABEL_SIZE;
            let position = (corner.0 + 0.5 * self.axes_width, base - DESCENT * LABEL_SIZE);
            marks.push(text(line.clone(), position, TextAnchor::Middle, LABEL_SIZE));
        }
        if !x.common.is_empty() {
            let base = corner.1 + self.common_line - DESCENT * LABEL_SIZE;
            let position = (corner.0 + self.axes_width, base);
            marks.push(text(x.common.clone(), position, TextAnchor::End, TICK_SIZE));
        }
    }
}
