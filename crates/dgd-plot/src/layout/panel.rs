//! One pair of axes with its curves, its labels and its header.

use super::labels;
use super::map::PlacedMap;
use super::style::{
    AXIS, BAND, DESCENT, GRID, HALF_DIGIT, HEADER_GAP, INK, LABEL_GAP, LABEL_SIZE, LINE_HEIGHT,
    MUTED, POINT_BUDGET, TEXT_GAP, TICK_GAP, TICK_LENGTH, TICK_SIZE, TITLE_SIZE, Y_ROOM,
    Y_TICK_DISTANCE, range, text,
};
use crate::figure::{Envelope, Panel, PlotSeries, SeriesStyle};
use crate::font::Font;
use crate::legend::{self, LegendEntry};
use crate::scene::{Pen, Rectangle, SceneMark, ScenePoint, TextAnchor, TextDirection};
use crate::text::MathText;
use crate::ticks::PlotAxis;
use crate::wrap::wrap;
use crate::{curve, envelope, palette};

/// A panel during layout; curves are relative to the upper left corner of the axes.
pub(super) struct PlacedPanel<'a> {
    pub(super) panel: &'a Panel,
    pub(super) y: PlotAxis,
    pub(super) label: Vec<MathText>,
    pub(super) map: Option<PlacedMap<'a>>,
    surfaces: Vec<SceneMark>,
    curves: Vec<SceneMark>,
    labels: Vec<SceneMark>,
    pub(super) header: PanelHeader,
    inset: Option<legend::LegendInset>,
}

/// The lines above the axes, from top to bottom.
#[derive(Default)]
pub(super) struct PanelHeader {
    title: Vec<MathText>,
    legend: Option<legend::LegendRows>,
    /// Gap between title and legend.
    between: f64,
    pub(super) height: f64,
    /// Free space above the axes: the power of ten may need a line of its own.
    lift: f64,
}

impl<'a> PlacedPanel<'a> {
    pub(super) fn new(panel: &'a Panel, font: &Font, height: f64) -> PlacedPanel<'a> {
        // Values without a finite abscissa are not drawn.
        let points = panel.series.iter().flat_map(|series| series.x.iter().zip(&series.y));
        let edges = panel.envelopes.iter().flat_map(|envelope| {
            let edge = |values| envelope.x.iter().zip(values);
            edge(&envelope.low).chain(edge(&envelope.high))
        });
        let drawn = points.chain(edges).filter(|(x, _)| x.is_finite());
        let (low, high) = range(drawn.map(|(_, y)| y));
        let map = panel.map.as_ref().map(|map| PlacedMap::new(map, height));
        let y = match &map {
            Some(map) => map.places(height),
            None => PlotAxis::new(low, high, Y_ROOM, (height / Y_TICK_DISTANCE) as u32),
        };
        PlacedPanel {
            panel,
            y,
            map,
            label: wrap(&panel.y_label, font, LABEL_SIZE, height),
            surfaces: Vec::new(),
            curves: Vec::new(),
            labels: Vec::new(),
            header: PanelHeader::default(),
            inset: None,
        }
    }

    pub(super) fn draw_curves(&mut self, font: &Font, x: &PlotAxis, size: ScenePoint) {
        // An envelope takes as many points as a line.
        let drawn = self.panel.series.len() + self.panel.envelopes.len();
        let budget = POINT_BUDGET / drawn as f64;
        let columns = (budget / (4.0 * size.0)).clamp(0.1, 2.0);
        let place = |at: f64, value: f64| {
            (x.fraction(at) * size.0, (1.0 - self.y.fraction(value)) * size.1)
        };
        let curve = |pen: Pen, series: &PlotSeries| {
            let points = series.x.iter().zip(&series.y).map(|(&at, &value)| place(at, value));
            let lines = match series.style {
                SeriesStyle::Dots => {
                    let centres = curve::dots(points, budget as usize);
                    return vec![dots(centres, pen)];
                }
                SeriesStyle::Marks => return marked(curve::dots(points, budget as usize), pen),
                SeriesStyle::Line | SeriesStyle::ThinLine => curve::lines(points, columns),
            };
            // A point between two gaps is not on any line, and is drawn as a dot.
            let (alone, lines): (Vec<_>, Vec<_>) =
                lines.into_iter().partition(|line| line.len() == 1);
            vec![SceneMark::Lines { lines, pen }, dots(alone.into_iter().flatten().collect(), pen)]
        };
        let surface = |shaded: &Envelope| {
            let edges = shaded.low.iter().zip(&shaded.high);
            let slices = shaded.x.iter().zip(edges).map(|(&at, (&low, &high))| {
                // Pixels count downwards.
                let ((x, top), (_, bottom)) = (place(at, high), place(at, low));
                envelope::EnvelopeSlice { x, low: top, high: bottom }
            });
            let outlines = envelope::outlines(slices, columns);
            SceneMark::Surface { outlines, colour: palette::surface(self.panel, shaded.around) }
        };
        let surfaces: Vec<SceneMark> = self.panel.envelopes.iter().map(surface).collect();
        // Measured below simulated, so that both stay visible.
        let is_below =
            |series: &PlotSeries| matches!(series.style, SeriesStyle::Dots | SeriesStyle::ThinLine);
        let pens = palette::pens(self.panel);
        let penned = || pens.iter().copied().zip(&self.panel.series);
        let is_above = |series: &PlotSeries| series.style == SeriesStyle::Marks;
        let below = penned().filter(|(_, series)| is_below(series));
        let between = penned().filter(|(_, series)| !is_below(series) && !is_above(series));
        let above = penned().filter(|(_, series)| is_above(series));
        self.curves = below
            .chain(between)
            .chain(above)
            .flat_map(|(pen, series)| curve(pen, series))
            .collect();
        self.labels = labels::placed(self.panel, &pens, place, font, size);
        let cells = self.map.as_ref().map(|map| map.cells(x, &self.y, size));
        self.surfaces = cells.into_iter().flatten().chain(surfaces).collect();
    }

    pub(super) fn place_header(&mut self, font: &Font, size: ScenePoint, has_legend: bool) {
        let entries: Vec<LegendEntry> = if has_legend && legend::has_several(self.panel) {
            legend::entries(self.panel)
        } else {
            Vec::new()
        };
        if !entries.is_empty() {
            let drawn = || self.surfaces.iter().chain(&self.curves).chain(&self.labels);
            self.inset = legend::LegendInset::find(&entries, font, size, drawn);
        }
        let above = !entries.is_empty() && self.inset.is_none();
        let rows = above.then(|| legend::LegendRows::new(&entries, font, size.0));
        let title = wrap(&self.panel.title, font, TITLE_SIZE, size.0);

        // The power of ten is at the upper left of the axes, on the lowest line if there is room.
        let lowest = match (&rows, title.last()) {
            (Some(rows), _) => rows.last_width(font),
            (None, Some(line)) => Some(font.width(line, TITLE_SIZE)),
            (None, None) => None,
        };
        let common = font.width(&self.y.common, TICK_SIZE);
        let is_beside = lowest.is_some_and(|width| common + TEXT_GAP <= 0.5 * (size.0 - width));
        let lift = if common > 0.0 && !is_beside { LINE_HEIGHT * TICK_SIZE } else { 0.0 };
        // Subscripts of the title reach down to the legend.
        let between = if rows.is_some() && !title.is_empty() { HEADER_GAP } else { 0.0 };
        let lines = title.len() as f64 * LINE_HEIGHT * TITLE_SIZE
            + between
            + rows.as_ref().map_or(0.0, legend::LegendRows::height);
        let height = lines + lift + HEADER_GAP;
        self.header = PanelHeader { height, title, legend: rows, between, lift };
    }

    /// Draws the panel with the upper left corner of its axes at `origin`.
    pub(super) fn draw(
        &self,
        font: &Font,
        origin: ScenePoint,
        size: ScenePoint,
        tick_width: f64,
        x: &PlotAxis,
        marks: &mut Vec<SceneMark>,
    ) {
        let (left, top) = origin;
        let (right, bottom) = (left + size.0, top + size.1);
        self.draw_bands(origin, size, x, marks);
        marks.extend(self.surfaces.iter().map(|surface| surface.shifted(origin)));

        // Whole pixels, so that lines of one pixel are sharp.
        let x_ticks = x.ticks.iter().map(|tick| (left + tick.fraction * size.0).round());
        let y_place = |fraction: f64| bottom - fraction * size.1;
        let y_ticks = self.y.ticks.iter().map(|tick| y_place(tick.fraction).round());
        // Grid lines would hide cells.
        if !self.y.ticks.is_empty() && self.map.is_none() {
            let verticals = x_ticks.clone().map(|x| vec![(x, top), (x, bottom)]);
            let horizontals = y_ticks.clone().map(|y| vec![(left, y), (right, y)]);
            marks.push(SceneMark::Lines {
                lines: verticals.chain(horizontals).collect(),
                pen: GRID,
            });
        }

        marks.extend(self.curves.iter().map(|curve| curve.shifted(origin)));

        let frame = [(left, top), (left, bottom), (right, bottom), (right, top), (left, top)];
        let below = x_ticks.map(|x| vec![(x, bottom), (x, bottom + TICK_LENGTH)]);
        let beside = y_ticks.map(|y| vec![(left - TICK_LENGTH, y), (left, y)]);
        let lines = below.chain(beside).chain([frame.to_vec()]).collect();
        marks.push(SceneMark::Lines { lines, pen: AXIS });

        for tick in &self.y.ticks {
            let base = y_place(tick.fraction) + HALF_DIGIT * TICK_SIZE;
            let position = (left - TICK_LENGTH - TICK_GAP, base);
            marks.push(text(tick.label.clone(), position, TextAnchor::End, TICK_SIZE));
        }
        let label_right = left - TICK_LENGTH - TICK_GAP - tick_width - LABEL_GAP;
        for (i, line) in self.label.iter().rev().enumerate() {
            let base = label_right - (i as f64 * LINE_HEIGHT + DESCENT) * LABEL_SIZE;
            marks.push(SceneMark::Text {
                text: line.clone(),
                at: (base, top + 0.5 * size.1),
                anchor: TextAnchor::Middle,
                direction: TextDirection::Upwards,
                size: LABEL_SIZE,
                colour: INK,
            });
        }
        marks.extend(self.labels.iter().map(|label| label.shifted(origin)));
        self.draw_header(font, origin, size, marks);
        if let Some(map) = &self.map {
            map.draw_scale(origin, size, marks);
        }
        if self.y.ticks.is_empty() {
            marks.push(SceneMark::Text {
                text: MathText::plain("no finite values"),
                at: (left + 0.5 * size.0, top + 0.5 * size.1),
                anchor: TextAnchor::Middle,
                direction: TextDirection::Rightwards,
                size: LABEL_SIZE,
                colour: MUTED,
            });
        }
        if let Some(inset) = &self.inset {
            inset.draw(origin, marks);
        }
    }

    fn draw_bands(
        &self,
        origin: ScenePoint,
        size: ScenePoint,
        x: &PlotAxis,
        marks: &mut Vec<SceneMark>,
    ) {
        for band in &self.panel.bands {
            let edge = |at: f64| origin.0 + x.fraction(at).clamp(0.0, 1.0) * size.0;
            let (from, to) = (edge(band.from.min(band.to)), edge(band.from.max(band.to)));
            if to > from {
                let rectangle =
                    Rectangle { left: from, top: origin.1, width: to - from, height: size.1 };
                marks.push(SceneMark::Area { rectangle, colour: BAND });
            }
        }
    }

    fn draw_header(
        &self,
        font: &Font,
        origin: ScenePoint,
        size: ScenePoint,
        marks: &mut Vec<SceneMark>,
    ) {
        let PanelHeader { title, legend, between, height: _, lift } = &self.header;
        let middle = origin.0 + 0.5 * size.0;
        let mut base = origin.1 - HEADER_GAP - lift;
        if let Some(rows) = legend {
            base -= rows.height();
            rows.draw(font, middle, base, marks);
        }
        base -= between;
        for line in title.iter().rev() {
            marks.push(text(line.clone(), (middle, base), TextAnchor::Middle, TITLE_SIZE));
            base -= LINE_HEIGHT * TITLE_SIZE;
        }
        if !self.y.common.is_empty() {
            let position = (origin.0, origin.1 - HEADER_GAP);
            marks.push(text(self.y.common.clone(), position, TextAnchor::Start, TICK_SIZE));
        }
    }
}

fn dots(centres: Vec<ScenePoint>, pen: Pen) -> SceneMark {
    SceneMark::Dots { centres, diameter: palette::DOT_DIAMETER, colour: pen.colour }
}

/// Large points with a white border.
fn marked(centres: Vec<ScenePoint>, pen: Pen) -> Vec<SceneMark> {
    let paper = legend::PAPER;
    let halo = SceneMark::Dots {
        centres: centres.clone(),
        diameter: palette::HALO_DIAMETER,
        colour: paper,
    };
    vec![halo, SceneMark::Dots { centres, diameter: palette::MARK_DIAMETER, colour: pen.colour }]
}
