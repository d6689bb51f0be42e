//! Legends: their entries, and their placement.

use crate::figure::{Panel, SeriesStyle};
use crate::font::Font;
use crate::palette;
use crate::scene::{Colour, Pen, Rectangle, SceneMark, ScenePoint, TextAnchor, TextDirection};
use crate::text::MathText;
use crate::wrap::wrap;

pub(crate) const ROW_HEIGHT: f64 = 16.0;
const SIZE: f64 = 12.0;
const TEXT_COLOUR: Colour = Colour(0x22, 0x22, 0x22);
pub(crate) const PAPER: Colour = Colour(0xff, 0xff, 0xff);
/// Length of the line sample before a name, and the space after it.
const KEY: f64 = 22.0;
const KEY_GAP: f64 = 6.0;
/// Gap between two names in one row.
const ENTRY_GAP: f64 = 18.0;
/// Upper bound on the average width of a letter relative to its size.
const WIDE: f64 = 0.6;
/// Padding around a legend inside the axes.
const PADDING: f64 = 6.0;
const INSET: f64 = 5.0;

/// Height of the surface sample before a name.
const SWATCH: f64 = 9.0;

/// An entry: a name with its sample.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LegendEntry {
    name: MathText,
    key: LegendKey,
}

/// The sample before a name.
#[derive(Debug, Clone, PartialEq)]
enum LegendKey {
    Series(SeriesStyle, Pen),
    Surface(Colour),
}

impl LegendEntry {
    fn width(&self, font: &Font) -> f64 {
        KEY + KEY_GAP + font.width(&self.name, SIZE)
    }

    fn draw(&self, left: f64, middle: f64, marks: &mut Vec<SceneMark>) {
        let place = |part: f64| (left + part * KEY, middle);
        marks.push(match self.key {
            LegendKey::Series(SeriesStyle::Marks, pen) => SceneMark::Dots {
                centres: vec![place(0.5)],
                diameter: pen.width,
                colour: pen.colour,
            },
            LegendKey::Series(SeriesStyle::Dots, pen) => SceneMark::Dots {
                centres: vec![place(0.2), place(0.5), place(0.8)],
                diameter: pen.width,
                colour: pen.colour,
            },
            LegendKey::Series(SeriesStyle::Line | SeriesStyle::ThinLine, pen) => {
                SceneMark::Lines { lines: vec![vec![place(0.0), place(1.0)]], pen }
            }
            LegendKey::Surface(colour) => {
                let top = middle - 0.5 * SWATCH;
                let rectangle = Rectangle { left, top, width: KEY, height: SWATCH };
                SceneMark::Area { rectangle, colour }
            }
        });
        marks.push(SceneMark::Text {
            text: self.name.clone(),
            at: (left + KEY + KEY_GAP, middle + 0.36 * SIZE),
            anchor: TextAnchor::Start,
            direction: TextDirection::Rightwards,
            size: SIZE,
            colour: TEXT_COLOUR,
        });
    }
}

/// The entries of a panel: of its series, then of its envelopes.
pub(crate) fn entries(panel: &Panel) -> Vec<LegendEntry> {
    let series = panel.series.iter().zip(palette::pens(panel)).map(|(series, pen)| LegendEntry {
        name: series.name.clone(),
        key: LegendKey::Series(series.style, pen),
    });
    let envelopes = panel.envelopes.iter().map(|envelope| LegendEntry {
        name: envelope.name.clone(),
        key: LegendKey::Surface(palette::surface(panel, envelope.around)),
    });
    series.chain(envelopes).filter(|entry| !entry.name.is_empty()).collect()
}

/// Whether a panel has more than one element to distinguish.
pub(crate) fn has_several(panel: &Panel) -> bool {
    let envelopes = panel.envelopes.iter().filter(|envelope| !envelope.name.is_empty());
    panel.series.len() + envelopes.count() > 1
}

/// The common legend of all panels, if two or more would have the same, and no panel has a line that is not in it.
pub(crate) fn common(panels: &[Panel]) -> Option<Vec<LegendEntry>> {
    let mut several = panels.iter().filter(|panel| has_several(panel)).map(entries);
    let first = several.next()?;
    let is_repeated = several.next().is_some_and(|next| next == first);
    let serves_all = panels.iter().all(|panel| {
        let lines = entries(panel);
        if has_several(panel) {
            lines == first
        } else if panel.series.is_empty() && panel.envelopes.is_empty() {
            true
        } else {
            lines.first().is_some_and(|entry| first.contains(entry))
        }
    });
    (is_repeated && serves_all && !first.is_empty()).then_some(first)
}

/// Entries in rows of limited width.
pub(crate) struct LegendRows {
    rows: Vec<Vec<LegendEntry>>,
}

impl LegendRows {
    pub(crate) fn new(entries: &[LegendEntry], font: &Font, width: f64) -> LegendRows {
        let mut rows: Vec<Vec<LegendEntry>> = Vec::new();
        let mut used = f64::INFINITY;
        for entry in entries.iter().filter_map(|entry| fitted(entry, font, width)) {
            let needed = ENTRY_GAP + entry.width(font);
            if used + needed > width {
                used = needed - ENTRY_GAP;
                rows.push(vec![entry]);
            } else if let Some(row) = rows.last_mut() {
                used += needed;
                row.push(entry);
            }
        }
        LegendRows { rows }
    }

    pub(crate) fn height(&self) -> f64 {
        ROW_HEIGHT * self.rows.len() as f64
    }

    /// Width of the lowest row.
    pub(crate) fn last_width(&self, font: &Font) -> Option<f64> {
        self.rows.last().map(|row| row_width(row, font))
    }

    /// Draws the rows centred at `middle`, from `top` down.
    pub(crate) fn draw(&self, font: &Font, middle: f64, top: f64, marks: &mut Vec<SceneMark>) {
        for (i, row) in self.rows.iter().enumerate() {
            let mut left = middle - 0.5 * row_width(row, font);
            for entry in row {
                entry.draw(left, top + (i as f64 + 0.5) * ROW_HEIGHT, marks);
                left += entry.width(font) + ENTRY_GAP;
            }
        }
    }
}

fn row_width(row: &[LegendEntry], font: &Font) -> f64 {
    row.iter().map(|entry| entry.width(font) + ENTRY_GAP).sum::<f64>() - ENTRY_GAP
}

/// Shortens an entry with a name that is too long, which then ends in an ellipsis.
fn fitted(entry: &LegendEntry, font: &Font, width: f64) -> Option<LegendEntry> {
    let room = width - KEY - KEY_GAP;
    if font.width(&entry.name, SIZE) <= room {
        return Some(entry.clone());
    }
    let dots = MathText::plain("…");
    let start = wrap(&entry.name, font, SIZE, room - font.width(&dots, SIZE));
    let name = start.into_iter().next()?.then(dots);
    Some(LegendEntry { name, ..entry.clone() })
}

/// Entries below each other in a corner of the axes.
pub(crate) struct LegendInset {
    entries: Vec<LegendEntry>,
    place: Rectangle,
}

impl LegendInset {
    /// Finds a corner of a rectangle from (0, 0) to `size` that no mark touches.
    pub(crate) fn find<'a, Marks: Iterator<Item = &'a SceneMark>>(
        entries: &[LegendEntry],
        font: &Font,
        size: ScenePoint,
        marks: impl Fn() -> Marks,
    ) -> Option<LegendInset> {
        let widths = entries.iter().map(|entry| entry.width(font));
        let width = widths.fold(0.0, f64::max) + 2.0 * PADDING;
        let height = entries.len() as f64 * ROW_HEIGHT + PADDING;
        if width > 0.6 * size.0 || height > 0.6 * size.1 {
            return None;
        }
        let (right, bottom) = (size.0 - width - INSET, size.1 - height - INSET);
        let corners = [(right, INSET), (right, bottom), (INSET, INSET), (INSET, bottom)];
        corners
            .into_iter()
            .map(|(left, top)| Rectangle { left, top, width, height })
            .find(|place| !marks().any(|mark| touches(mark, *place)))
            .map(|place| LegendInset { entries: entries.to_vec(), place })
    }

    pub(crate) fn draw(&self, origin: ScenePoint, marks: &mut Vec<SceneMark>) {
        let left = origin.0 + self.place.left;
        let top = origin.1 + self.place.top;
        marks.push(SceneMark::Area {
            rectangle: Rectangle { left, top, ..self.place },
            colour: PAPER,
        });
        for (i, entry) in self.entries.iter().enumerate() {
            let middle = top + 0.5 * PADDING + (i as f64 + 0.5) * ROW_HEIGHT;
            entry.draw(left + PADDING, middle, marks);
        }
    }
}

fn touches(mark: &SceneMark, place: Rectangle) -> bool {
    match mark {
        SceneMark::Lines { lines, .. } => {
            lines.iter().any(|line| line.windows(2).any(|pair| place.meets(pair[0], pair[1])))
        }
        SceneMark::Surface { outlines, .. } => {
            outlines.iter().any(|outline| covers(outline, place))
        }
        SceneMark::Dots { centres, .. } => {
            centres.iter().any(|&centre| place.meets(centre, centre))
        }
        // A label to the right of its point.
        SceneMark::Text { text, at, size, .. } => {
            let letters: usize = text.runs().iter().map(|run| run.text.chars().count()).sum();
            place.meets(*at, (at.0 + letters as f64 * WIDE * size, at.1))
        }
        SceneMark::Area { .. } => false,
    }
}

/// Whether a closed outline crosses or encloses a rectangle.
fn covers(outline: &[ScenePoint], place: Rectangle) -> bool {
    let (x, y) = (place.left, place.top);
    let mut is_inside = false;
    for (i, &b) in outline.iter().enumerate() {
        let a = outline[(i + outline.len() - 1) % outline.len()];
        if place.meets(a, b) {
            return true;
        }
        // A ray to the right from a corner crosses the edges around it an odd number of times.
        if (a.1 > y) != (b.1 > y) && x < a.0 + (y - a.1) / (b.1 - a.1) * (b.0 - a.0) {
            is_inside = !is_inside;
        }
    }
    is_inside
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_covers_what_it_crosses_and_what_it_goes_around() {
        let outline = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)];
        let at = |left, top| Rectangle { left, top, width: 2.0, height: 1.0 };
        assert!(covers(&outline, at(9.0, 5.0)));
        assert!(covers(&outline, at(4.0, 4.0)));
        assert!(!covers(&outline, at(11.0, 4.0)));
        assert!(!covers(&outline, at(-3.0, 4.0)));
        assert!(!covers(&[], at(0.0, 0.0)));
    }
}
