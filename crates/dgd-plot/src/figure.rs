//! Elements of a figure: panels, series, bands, envelopes and heat maps.

use crate::palette::SeriesMeaning;
use crate::text::MathText;

/// Panels on a grid with a common x axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Title above all panels; may be empty.
    pub title: MathText,
    /// Width in pixels (of an SVG at its natural size; a PNG has twice as many). The height
    /// follows from the panels.
    pub width: f64,
    /// Panels side by side; at least one and at most the number of panels is used.
    pub columns: usize,
    /// The panels: left to right, then down.
    pub panels: Vec<Panel>,
    /// Label of the common axis, drawn under the lowest panel of each column.
    pub x_label: MathText,
}

impl Figure {
    /// Width of a figure that fills the text width of a page.
    pub const WIDTH: f64 = 800.0;

    /// A figure without a title, with the default width and grid.
    pub fn new(x_label: MathText, panels: Vec<Panel>) -> Figure {
        Figure {
            title: MathText::default(),
            width: Figure::WIDTH,
            columns: columns_for(panels.len()),
            panels,
            x_label,
        }
    }
}

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Title above the axes; may be empty.
    pub title: MathText,
    /// Label left of the axes, rotated; may be empty.
    pub y_label: MathText,
    /// The series. Two or more get a legend.
    pub series: Vec<PlotSeries>,
    /// Shaded windows of x.
    pub bands: Vec<ShadedBand>,
    /// Shaded areas between two curves, under the series.
    pub envelopes: Vec<Envelope>,
    /// Heat map under everything else; the y axis then shows its places.
    pub map: Option<HeatMap>,
}

/// A quantity over x and over places, as cells coloured by their values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeatMap {
    /// Abscissas, ascending.
    pub x: Vec<f64>,
    /// Ordinates, ascending: the centres of the cells.
    pub places: Vec<f64>,
    /// For each place, the values at `x`; a value that is not finite has no cell.
    pub values: Vec<Vec<f64>>,
}

/// A named sequence of points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlotSeries {
    /// Name in the legend.
    pub name: MathText,
    /// How the points are drawn.
    pub style: SeriesStyle,
    /// Its meaning, which gives its colour.
    pub meaning: SeriesMeaning,
    /// Abscissas; where `x` and `y` differ in length, the shorter one counts.
    pub x: Vec<f64>,
    /// Ordinates; a value that is not finite is a gap.
    pub y: Vec<f64>,
    /// Labels beside some of its points, in its colour, for instance at the ends of several curves.
    pub labels: Vec<PointLabel>,
}

impl PlotSeries {
    /// One of several similar series, without labels.
    pub fn new(name: MathText, style: SeriesStyle, x: Vec<f64>, y: Vec<f64>) -> PlotSeries {
        PlotSeries { name, style, x, y, ..PlotSeries::default() }
    }
}

/// A text to the right of a point; drawn if both coordinates are finite.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLabel {
    /// Abscissa of the point.
    pub x: f64,
    /// Its ordinate.
    pub y: f64,
    /// The text.
    pub text: MathText,
}

/// How the points of a series are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SeriesStyle {
    /// Joined by straight lines.
    #[default]
    Line,
    /// Joined by thin straight lines, under the other lines: a recorded signal.
    ThinLine,
    /// Single points, under the lines.
    Dots,
    /// Prominent single points, over the lines: events.
    Marks,
}

/// A shaded window of x; drawn where it overlaps the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadedBand {
    /// One edge.
    pub from: f64,
    /// The other edge.
    pub to: f64,
}

/// The area between two curves: the uncertainty around a line, the noise around zero.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Envelope {
    /// Name in the legend; without a name it is not in the legend.
    pub name: MathText,
    /// The series of the panel whose colour it has, lightened; grey for `None`.
    pub around: Option<usize>,
    /// Abscissas; of lists that differ in length, the shortest counts.
    pub x: Vec<f64>,
    /// One edge; where either edge is not finite there is a gap.
    pub low: Vec<f64>,
    /// The other edge.
    pub high: Vec<f64>,
}

/// Number of columns for a number of panels: one up to three panels, two up to eight, then three.
pub fn columns_for(panels: usize) -> usize {
    match panels {
        0..=3 => 1,
        4..=8 => 2,
        _ => 3,
    }
}
