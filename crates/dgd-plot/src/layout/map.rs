//! Heat maps: cells coloured by their values, and the colour scale beside them.

use super::style::{AXIS, HALF_DIGIT, TICK_GAP, TICK_LENGTH, TICK_SIZE, Y_TICK_DISTANCE};
use super::style::{HEADER_GAP, label_width, range, text};
use crate::figure::HeatMap;
use crate::font::Font;
use crate::palette;
use crate::scene::{Rectangle, SceneMark, ScenePoint, TextAnchor};
use crate::ticks::PlotAxis;

/// Gap between the axes and the scale, and the width of the scale.
const GAP: f64 = 10.0;
const SCALE_WIDTH: f64 = 12.0;

/// Width of a column of cells, in pixels.
const CELL: usize = 2;

/// A heat map during layout.
pub(super) struct PlacedMap<'a> {
    map: &'a HeatMap,
    scale: PlotAxis,
}

impl<'a> PlacedMap<'a> {
    pub(super) fn new(map: &'a HeatMap, height: f64) -> PlacedMap<'a> {
        let (low, high) = range(map.values.iter().flatten());
        PlacedMap { map, scale: PlotAxis::new(low, high, 0.0, (height / Y_TICK_DISTANCE) as u32) }
    }

    /// The axis of places, which extends half a cell beyond the first and the last.
    pub(super) fn places(&self, height: f64) -> PlotAxis {
        let places = &self.map.places;
        let edges = || {
            let (first, last) = (places.first()?, places.last()?);
            let half = |a: f64, b: f64| if places.len() > 1 { 0.5 * (b - a).abs() } else { 0.5 };
            let second = places.get(1).unwrap_or(first);
            let before = places.get(places.len().wrapping_sub(2)).unwrap_or(last);
            Some((first - half(*first, *second), last + half(*before, *last)))
        };
        let (low, high) = match edges() {
            Some(edges) if !self.scale.ticks.is_empty() => edges,
            _ => (f64::INFINITY, f64::NEG_INFINITY),
        };
        PlotAxis::new(low, high, 0.0, (height / Y_TICK_DISTANCE) as u32)
    }

    /// Width reserved right of the axes.
    pub(super) fn width(&self, font: &Font) -> f64 {
        let beside = TICK_LENGTH + TICK_GAP + label_width(&self.scale, font);
        let common = font.width(&self.scale.common, TICK_SIZE);
        GAP + (SCALE_WIDTH + beside).max(common)
    }

    /// The cells, relative to the upper left corner of the axes.
    ///
    /// Each level covers everything at least as high, so that no background shows between two.
    pub(super) fn cells(&self, x: &PlotAxis, y: &PlotAxis, size: ScenePoint) -> Vec<SceneMark> {
        let columns = self.columns(x, size.0);
        let rows = self.rows(y, size.1);
        let mut levels: Vec<Vec<Vec<ScenePoint>>> = vec![Vec::new(); palette::LEVELS];
        for (row, [top, bottom]) in rows {
            let level = |column: &Option<usize>| column.and_then(|k| self.level(*row.get(k)?));
            let of_row: Vec<Option<usize>> = columns.iter().map(level).collect();
            for (at_least, outlines) in levels.iter_mut().enumerate() {
                let is_in = |level: &Option<usize>| level.is_some_and(|level| level >= at_least);
                let mut from = 0;
                while let Some(start) = of_row[from..].iter().position(is_in).map(|n| from + n) {
                    let length = of_row[start..].iter().position(|level| !is_in(level));
                    let end = length.map_or(of_row.len(), |n| start + n);
                    let (left, right) = ((start * CELL) as f64, ((end * CELL) as f64).min(size.0));
                    let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
                    outlines.push(corners.to_vec());
                    from = end;
                }
            }
        }
        let levels = levels.into_iter().enumerate().filter(|(_, outlines)| !outlines.is_empty());
        let mark =
            |(level, outlines)| SceneMark::Surface { outlines, colour: palette::of_level(level) };
        levels.map(mark).collect()
    }

    /// For each column of cells, the sample nearest to its centre; `None` beyond the first and last.
    fn columns(&self, x: &PlotAxis, width: f64) -> Vec<Option<usize>> {
        let edges: Vec<f64> = self.map.x.iter().map(|&at| x.fraction(at) * width).collect();
        let (Some(&first), Some(&last)) = (edges.first(), edges.last()) else { return Vec::new() };
        let nearest = |column: usize| {
            let middle = (column * CELL) as f64 + 0.5 * CELL as f64;
            if middle < first - CELL as f64 || middle > last + CELL as f64 {
                return None;
            }
            let next = edges.partition_point(|x| *x < middle);
            let before = next.saturating_sub(1);
            let next = next.min(edges.len() - 1);
            let is_before = (middle - edges[before]).abs() <= (edges[next] - middle).abs();
            Some(if is_before { before } else { next })
        };
        (0..(width / CELL as f64).ceil() as usize).map(nearest).collect()
    }

    /// Visible rows of values, each with its upper and lower edge in whole pixels: of several in one pixel, the first.
    fn rows(&self, y: &PlotAxis, height: f64) -> Vec<(&'a [f64], [f64; 2])> {
        let places = &self.map.places;
        let place = |value: f64| (1.0 - y.fraction(value)) * height;
        let middle = |a: f64, b: f64| place(f64::midpoint(a, b)).round();
        let mut rows = Vec::new();
        // Places ascend, and pixels count downwards.
        let mut bottom = height;
        for (i, values) in self.map.values.iter().enumerate().take(places.len()) {
            let top = places.get(i + 1).map_or(0.0, |next| middle(places[i], *next));
            if top < bottom {
                rows.push((values.as_slice(), [top, bottom]));
                bottom = top;
            }
        }
        rows
    }

    fn level(&self, value: f64) -> Option<usize> {
        let level = (self.scale.fraction(value) * palette::LEVELS as f64).floor();
        value.is_finite().then(|| (level.max(0.0) as usize).min(palette::LEVELS - 1))
    }

    /// The scale right of axes with the upper left corner `origin`.
    pub(super) fn draw_scale(
        &self,
        origin: ScenePoint,
        size: ScenePoint,
        marks: &mut Vec<SceneMark>,
    ) {
        if self.scale.ticks.is_empty() {
            return;
        }
        let (left, top) = ((origin.0 + size.0 + GAP).round(), origin.1);
        let bottom = top + size.1;
        let edge = |level: usize| (bottom - size.1 * level as f64 / palette::LEVELS as f64).round();
        for level in 0..palette::LEVELS {
            let height = edge(level) - top;
            let rectangle = Rectangle { left, top, width: SCALE_WIDTH, height };
            marks.push(SceneMark::Area { rectangle, colour: palette::of_level(level) });
        }
        let right = left + SCALE_WIDTH;
        let y = |fraction: f64| bottom - fraction * size.1;
        let ticks = self.scale.ticks.iter().map(|tick| y(tick.fraction).round());
        let lines = ticks.map(|y| vec![(right, y), (right + TICK_LENGTH, y)]).collect();
        marks.push(SceneMark::Lines { lines, pen: AXIS });
        for tick in &self.scale.ticks {
            let base = y(tick.fraction) + HALF_DIGIT * TICK_SIZE;
            let position = (right + TICK_LENGTH + TICK_GAP, base);
            marks.push(text(tick.label.clone(), position, TextAnchor::Start, TICK_SIZE));
        }
        if !self.scale.common.is_empty() {
            let position = (left, top - HEADER_GAP);
            marks.push(text(self.scale.common.clone(), position, TextAnchor::Start, TICK_SIZE));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Colour;

    /// Visible area of each colour, without parts hidden by later marks.
    fn shown(cells: &[SceneMark]) -> Vec<(Colour, f64)> {
        let area = |outline: &Vec<ScenePoint>| {
            (outline[1].0 - outline[0].0) * (outline[2].1 - outline[1].1)
        };
        let of = |mark: &SceneMark| match mark {
            SceneMark::Surface { outlines, colour } => (*colour, outlines.iter().map(area).sum()),
            _ => unreachable!("cells are surfaces"),
        };
        let all: Vec<(Colour, f64)> = cells.iter().map(of).collect();
        let next = all.iter().skip(1).map(|(_, area)| *area).chain([0.0]);
        let own = all.iter().zip(next).map(|((colour, area), above)| (*colour, area - above));
        own.filter(|(_, area)| *area > 0.0).collect()
    }

    #[test]
    fn each_cell_has_the_colour_of_its_value_and_a_gap_has_none() {
        // Two places over two times; the lower one is unknown at first.
        let map = HeatMap {
            x: vec![0.0, 1.0],
            places: vec![1.0, 2.0],
            values: vec![vec![f64::NAN, 0.0], vec![10.0, 0.0]],
        };
        let placed = PlacedMap::new(&map, 100.0);
        let (x, y) = (PlotAxis::new(0.0, 1.0, 0.0, 5), placed.places(100.0));
        assert_eq!((y.fraction(0.5), y.fraction(2.5)), (0.0, 1.0));
        let cells = placed.cells(&x, &y, (100.0, 100.0));
        let highest = palette::of_level(palette::LEVELS - 1);
        let lowest = palette::of_level(0);
        assert_eq!(shown(&cells), [(lowest, 5000.0), (highest, 2500.0)]);
        // The highest is at the upper left.
        let Some(SceneMark::Surface { outlines, colour }) = cells.last() else { unreachable!() };
        assert_eq!((outlines[0][0], outlines[0][2], *colour), ((0.0, 0.0), (50.0, 50.0), highest));
    }

    #[test]
    fn more_places_than_pixels_are_thinned_and_a_constant_has_one_colour() {
        let n = 1000;
        let places = (1..=n).map(f64::from).collect();
        let map = HeatMap { x: vec![0.0, 5.0], places, values: vec![vec![3.0; 2]; n as usize] };
        let placed = PlacedMap::new(&map, 50.0);
        let rows = placed.rows(&placed.places(50.0), 50.0);
        assert!(rows.len() <= 50, "{}", rows.len());
        let covered: f64 = rows.iter().map(|(_, [top, bottom])| bottom - top).sum();
        assert_eq!(covered, 50.0);
        let x = PlotAxis::new(0.0, 5.0, 0.0, 5);
        let cells = placed.cells(&x, &placed.places(50.0), (20.0, 50.0));
        assert_eq!(shown(&cells).len(), 1);
    }

    #[test]
    fn nothing_is_drawn_of_nothing() {
        let map = HeatMap { x: Vec::new(), places: Vec::new(), values: Vec::new() };
        let placed = PlacedMap::new(&map, 50.0);
        let mut marks =
            placed.cells(&PlotAxis::new(0.0, 1.0, 0.0, 5), &placed.places(50.0), (9.0, 9.0));
        placed.draw_scale((0.0, 0.0), (9.0, 9.0), &mut marks);
        assert!(marks.is_empty() && placed.places(50.0).ticks.is_empty());
    }
}
