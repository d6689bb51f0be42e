//! The grid of panels, and the positions of its columns.

use super::labels;
use super::panel::PlacedPanel;
use super::style::label_width;
use super::style::{COLUMN_GAP, LABEL_GAP, LABEL_SIZE, LINE_HEIGHT, MARGIN, TICK_GAP, TICK_LENGTH};
use crate::figure::Figure;
use crate::font::Font;

/// The grid of panels.
pub(super) struct PanelGrid {
    pub(super) rows: usize,
    pub(super) columns: usize,
    panels: usize,
}

impl PanelGrid {
    pub(super) fn new(figure: &Figure) -> PanelGrid {
        let panels = figure.panels.len();
        let columns = figure.columns.clamp(1, panels.max(1));
        let rows = panels.div_ceil(columns);
        PanelGrid { rows, columns, panels }
    }

    /// Row and column of a panel.
    pub(super) fn place(&self, index: usize) -> (usize, usize) {
        (index / self.columns, index % self.columns)
    }

    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = usize> {
        (0..self.panels).filter(move |&index| self.place(index).0 == row)
    }

    pub(super) fn column(&self, column: usize) -> impl Iterator<Item = usize> {
        (0..self.panels).filter(move |&index| self.place(index).1 == column)
    }

    pub(super) fn is_lowest(&self, index: usize) -> bool {
        self.column(self.place(index).1).last() == Some(index)
    }
}

/// Horizontal positions of the columns.
pub(super) struct GridColumns {
    pub(super) lefts: Vec<f64>,
    pub(super) axes_width: f64,
    /// Width of the widest y tick label of each column.
    pub(super) tick_widths: Vec<f64>,
}

impl GridColumns {
    pub(super) fn new(
        panels: &[PlacedPanel],
        grid: &PanelGrid,
        font: &Font,
        width: f64,
    ) -> GridColumns {
        let in_column = |column: usize| grid.column(column).map(|index| &panels[index]);
        let widest = |widths: &mut dyn Iterator<Item = f64>| widths.fold(0.0, f64::max);
        let tick_widths: Vec<f64> = (0..grid.columns)
            .map(|c| widest(&mut in_column(c).map(|panel| label_width(&panel.y, font))))
            .collect();
        let left_of_axes: Vec<f64> = (0..grid.columns)
            .map(|c| {
                let label = widest(&mut in_column(c).map(|panel| panel.label.len() as f64));
                let label_gap = if label > 0.0 { LABEL_GAP } else { 0.0 };
                let label = label * LINE_HEIGHT * LABEL_SIZE + label_gap;
                (label + tick_widths[c] + TICK_GAP + TICK_LENGTH).ceil()
            })
            .collect();
        // Width of the labels of curves that end at the right edge, and of colour scales.
        let beside = |panel: &PlacedPanel, font: &Font| {
            let scale = panel.map.as_ref().map_or(0.0, |map| map.width(font));
            scale.max(labels::width(panel.panel, font))
        };
        let right_of_axes: Vec<f64> = (0..grid.columns)
            .map(|c| widest(&mut in_column(c).map(|panel| beside(panel, font))).ceil())
            .collect();
        // Room for half of the last x tick label right of the axes.
        let gaps = COLUMN_GAP * (grid.columns - 1) as f64;
        let sides = left_of_axes.iter().chain(&right_of_axes).sum::<f64>();
        let taken = 2.0 * MARGIN + COLUMN_GAP / 2.0 + gaps + sides;
        let axes_width = ((width - taken) / grid.columns as f64).floor().max(40.0);

        let mut lefts = Vec::with_capacity(grid.columns);
        let mut right = MARGIN;
        for (left, beside) in left_of_axes.into_iter().zip(right_of_axes) {
            lefts.push(right + left);
            right += left + axes_width + beside + COLUMN_GAP;
        }
        GridColumns { lefts, axes_width, tick_widths }
    }
}
