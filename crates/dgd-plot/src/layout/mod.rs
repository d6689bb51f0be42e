//! Lays out a figure as marks in pixels.
//!
//! Sizes follow from each other in one pass, because each needs only those before it:
//!
//! ```text
//!   height of the axes ─► y ticks ─► width left of the axes ─► width of the axes ─► x ticks
//!     ─► curves ─► legend: in a free corner, or above ─► lines above the axes ─► rows
//! ```
//!
//! All panels of a column share their left and right edge and the x ticks, all panels of a row
//! their upper and lower edge.

mod footer;
mod grid;
mod labels;
mod map;
mod panel;
mod style;

use self::footer::Footer;
use self::grid::{GridColumns, PanelGrid};
use self::panel::PlacedPanel;
use self::style::{
    DESCENT, FIGURE_TITLE_SIZE, LINE_HEIGHT, MARGIN, NARROWEST_COLUMN, ROW_GAP, TEXT_GAP,
    X_TICK_DISTANCE, label_width, range, text,
};
use crate::figure::Figure;
use crate::font::Font;
use crate::legend;
use crate::scene::{Scene, TextAnchor};
use crate::ticks::PlotAxis;
use crate::wrap::wrap;

/// Places everything a figure shows.
pub(crate) fn scene(figure: &Figure) -> Scene {
    let font = Font::embedded();
    let grid = PanelGrid::new(figure);
    let width = if figure.width.is_finite() { figure.width } else { Figure::WIDTH };
    let width = width.max(NARROWEST_COLUMN * grid.columns as f64).round();
    let common_legend = legend::common(&figure.panels);

    let height = axes_height(width, &grid);
    let mut panels: Vec<PlacedPanel> =
        figure.panels.iter().map(|panel| PlacedPanel::new(panel, &font, height)).collect();
    let columns = GridColumns::new(&panels, &grid, &font, width);
    let x = x_axis(figure, &font, columns.axes_width);
    let size = (columns.axes_width, height);
    for panel in &mut panels {
        panel.draw_curves(&font, &x, size);
        panel.place_header(&font, size, common_legend.is_none());
    }

    let mut marks = Vec::new();
    let mut top = MARGIN;
    let middle = 0.5 * width;
    for line in wrap(&figure.title, &font, FIGURE_TITLE_SIZE, width - 2.0 * MARGIN) {
        top += LINE_HEIGHT * FIGURE_TITLE_SIZE;
        let position = (middle, top - DESCENT * FIGURE_TITLE_SIZE);
        marks.push(text(line, position, TextAnchor::Middle, FIGURE_TITLE_SIZE));
    }
    if let Some(entries) = common_legend {
        let rows = legend::LegendRows::new(&entries, &font, width - 2.0 * MARGIN);
        top += 0.5 * TEXT_GAP;
        rows.draw(&font, middle, top, &mut marks);
        top += rows.height() + 0.5 * TEXT_GAP;
    }
    let footer = Footer::new(figure, &font, &x, columns.axes_width);
    for row in 0..grid.rows {
        let members = || grid.row(row).map(|index| (index, &panels[index]));
        let header = members().map(|(_, panel)| panel.header.height).fold(0.0, f64::max);
        top = (top + header).round();
        let mut below = 0.0_f64;
        for (index, panel) in members() {
            let column = grid.place(index).1;
            let origin = (columns.lefts[column], top);
            panel.draw(&font, origin, size, columns.tick_widths[column], &x, &mut marks);
            if grid.is_lowest(index) {
                footer.draw(&x, (origin.0, top + height), &mut marks);
                below = footer.height;
            }
        }
        top += height + below + ROW_GAP;
    }
    let bottom = if grid.rows > 0 { top - ROW_GAP } else { top };
    Scene { width, height: (bottom + MARGIN).round(), marks }
}

/// A single row may be taller than rows that share a page.
fn axes_height(width: f64, grid: &PanelGrid) -> f64 {
    let column = width / grid.columns as f64;
    let height = match grid.rows {
        1 => (0.5 * column).clamp(150.0, 400.0),
        _ => (0.42 * column).clamp(125.0, 160.0),
    };
    height.round()
}

/// The common x axis, with as many ticks as fit with their labels.
fn x_axis(figure: &Figure, font: &Font, width: f64) -> PlotAxis {
    let series = figure.panels.iter().flat_map(|panel| &panel.series);
    let maps = figure.panels.iter().filter_map(|panel| panel.map.as_ref());
    let (low, high) = range(series.flat_map(|series| &series.x).chain(maps.flat_map(|map| &map.x)));
    let mut intervals = (width / X_TICK_DISTANCE) as u32;
    loop {
        let axis = PlotAxis::new(low, high, 0.0, intervals);
        let distance = match axis.ticks.as_slice() {
            [first, second, ..] => width * (second.fraction - first.fraction),
            _ => width,
        };
        if intervals <= 1 || label_width(&axis, font) + TEXT_GAP <= distance {
            return axis;
        }
        intervals -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::style::BAND;
    use crate::scene::{Rectangle, SceneMark, TextDirection};
    use crate::text::MathText;
    use crate::{Envelope, Panel, PlotSeries, SeriesStyle, ShadedBand};

    fn series(name: &str, style: SeriesStyle, y: impl Fn(f64) -> f64) -> PlotSeries {
        let x: Vec<f64> = (0..=400).map(f64::from).collect();
        let y = x.iter().map(|&x| y(x)).collect();
        PlotSeries::new(MathText::name(name), style, x, y)
    }

    /// Panels with ever longer names, larger numbers and more series.
    fn figure(panels: i32) -> Figure {
        let panel = |i: i32| {
            let size = 10.0_f64.powi(3 * i - 12);
            let repeated = |text: &str| text.repeat(i.unsigned_abs() as usize);
            let names = (0..=i).map(|k| format!("a_rather_long_name_{k}"));
            Panel {
                title: MathText::plain(repeated("pressure behind the valve ").trim()),
                y_label: MathText::name(&repeated("pump.")).with_unit("kg^2*m^(3/2)/(Pa^2*s^3)"),
                series: names
                    .map(|name| series(&name, SeriesStyle::Line, |x| size * (x / 30.0).sin()))
                    .collect(),
                bands: vec![ShadedBand { from: 100.0, to: f64::INFINITY }],
                envelopes: vec![Envelope {
                    name: MathText::plain("a band around the first of them"),
                    around: Some(0),
                    x: vec![0.0, 200.0],
                    low: vec![-size; 2],
                    high: vec![size; 2],
                }],
                map: None,
            }
        };
        let panels = (0..panels).map(panel).collect();
        let title = "A title of the figure that is longer than one line of the page would be \
                     if the page were not much wider than it is";
        Figure {
            title: MathText::plain(title),
            ..Figure::new(MathText::plain("Time").with_unit("s"), panels)
        }
    }

    /// The box around a text from its highest to its lowest sign.
    fn box_of(mark: &SceneMark, font: &Font) -> Option<Rectangle> {
        let SceneMark::Text { text, at, anchor, direction, size, .. } = mark else {
            return None;
        };
        let width = font.width(text, *size);
        let before = match anchor {
            TextAnchor::Start => 0.0,
            TextAnchor::Middle => 0.5 * width,
            TextAnchor::End => width,
        };
        let (above, height) = (0.75 * size, 0.95 * size);
        Some(match direction {
            TextDirection::Rightwards => {
                Rectangle { left: at.0 - before, top: at.1 - above, width, height }
            }
            TextDirection::Upwards => Rectangle {
                left: at.0 - above,
                top: at.1 + before - width,
                width: height,
                height: width,
            },
        })
    }

    fn overlap(a: Rectangle, b: Rectangle) -> bool {
        a.left < b.right() && b.left < a.right() && a.top < b.bottom() && b.top < a.bottom()
    }

    #[test]
    fn no_text_overlaps_another_or_leaves_the_page() {
        let font = Font::embedded();
        for (panels, columns) in [(1, 1), (4, 1), (5, 2), (7, 3), (4, 3)] {
            for stretch in [1.0, 3e5] {
                let mut figure = Figure { columns, ..figure(panels) };
                for series in figure.panels.iter_mut().flat_map(|panel| &mut panel.series) {
                    series.x.iter_mut().for_each(|x| *x *= stretch);
                }
                let scene = scene(&figure);
                let boxes: Vec<_> =
                    scene.marks.iter().filter_map(|mark| box_of(mark, &font)).collect();
                for (i, a) in boxes.iter().enumerate() {
                    assert!(a.left >= 0.0 && a.right() <= scene.width, "{panels}: {a:?}");
                    assert!(a.top >= 0.0 && a.bottom() <= scene.height, "{panels}: {a:?}");
                    for b in &boxes[..i] {
                        assert!(!overlap(*a, *b), "{panels} in {columns}: {a:?} {b:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn panels_of_a_column_share_their_edges() {
        let scene = scene(&Figure { columns: 2, ..figure(6) });
        let edges = scene.marks.iter().filter_map(|mark| match mark {
            SceneMark::Area { rectangle, colour: BAND } => {
                Some((rectangle.left, rectangle.right()))
            }
            _ => None,
        });
        let edges: Vec<_> = edges.collect();
        assert_eq!(edges.len(), 6);
        assert!(edges.iter().zip(&edges[2..]).all(|(above, below)| above == below));
    }

    #[test]
    fn a_legend_for_all_panels_stands_once_and_only_where_it_is_true() {
        let panel = |names: &[&str]| Panel {
            series: names.iter().map(|name| series(name, SeriesStyle::Line, f64::sqrt)).collect(),
            ..Panel::default()
        };
        let (both, x, z) = (panel(&["x", "y"]), panel(&["x"]), panel(&["z"]));
        let entries = legend::common(&[both.clone(), x, both.clone()]);
        assert_eq!(entries.map(|entries| entries.len()), Some(2));
        assert!(legend::common(&[both.clone(), panel(&["x", "z"])]).is_none());
        assert!(legend::common(&[both.clone(), both.clone(), z]).is_none());
        assert!(legend::common(&[both]).is_none());
    }

    #[test]
    fn an_envelope_is_drawn_under_the_lines_and_within_the_axes() {
        let envelope = Envelope {
            x: vec![0.0, 1.0],
            low: vec![-3.0; 2],
            high: vec![5.0; 2],
            ..Envelope::default()
        };
        let panel = Panel {
            series: vec![series("x", SeriesStyle::Line, |x| x / 100.0)],
            envelopes: vec![envelope],
            ..Panel::default()
        };
        let pen = crate::palette::pens(&panel)[0];
        let scene = scene(&Figure::new(MathText::default(), vec![panel]));
        let marks = || scene.marks.iter();
        let surface = marks().position(|mark| matches!(mark, SceneMark::Surface { .. }));
        let line =
            marks().position(|mark| matches!(mark, SceneMark::Lines { pen: p, .. } if *p == pen));
        assert!(surface.is_some() && surface < line, "{surface:?} {line:?}");
        let Some(SceneMark::Surface { outlines, .. }) = surface.map(|at| &scene.marks[at]) else {
            unreachable!("it is at its position");
        };
        let heights = outlines[0].iter().map(|point| point.1);
        assert!(heights.clone().all(|y| 0.0 < y && y < scene.height));
        // 8 of the panel's 8.8 units: the axes have 5 % room at both ends.
        let high = heights.clone().fold(f64::NEG_INFINITY, f64::max);
        let tall = high - heights.fold(f64::INFINITY, f64::min);
        assert!(
            (tall
                - axes_height(
                    800.0,
                    &PanelGrid::new(&Figure::new(MathText::default(), vec![Panel::default()]))
                ) / 1.1)
                .abs()
                < 1e-9,
            "{tall}"
        );
    }

    #[test]
    fn odd_figures_are_drawn_too() {
        let lonely = PlotSeries { x: vec![1.0], ..series("x", SeriesStyle::Line, |_| 2.0) };
        let undefined = series("x", SeriesStyle::Dots, |_| f64::NAN);
        let bands = vec![ShadedBand { from: f64::NAN, to: f64::NAN }];
        let both = vec![lonely.clone(), undefined.clone()];
        for series in [vec![], vec![lonely], vec![undefined], both] {
            let (x, low, high) = (vec![f64::NAN, 1.0], vec![f64::INFINITY; 3], vec![0.0]);
            let envelopes = vec![Envelope { x, low, high, ..Envelope::default() }];
            let panel = Panel { series, bands: bands.clone(), envelopes, ..Panel::default() };
            for width in [f64::NAN, -1.0, 0.0, 300.0, f64::INFINITY] {
                let figure = Figure::new(MathText::default(), vec![panel.clone(); 3]);
                let scene = scene(&Figure { width, columns: 0, ..figure });
                assert!(scene.width >= NARROWEST_COLUMN && scene.height > 100.0);
            }
        }
        assert!(scene(&Figure::new(MathText::default(), Vec::new())).height > 0.0);
    }
}
