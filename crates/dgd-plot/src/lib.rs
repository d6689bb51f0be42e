//! Figures: panels on a grid that share one axis, as SVG text, PDF or PNG bytes.
//!
//! ```text
//!                                                                     ┌── svg ──► String
//!   Figure ── layout ──► Scene (lines, dots, areas, text in pixels) ──┼── pdf ──► bytes
//!             │ ticks, curve, legend                                  └── png ──► bytes
//! ```
//!
//! Everything is placed with the metrics of one embedded font, so nothing overlaps and the PNG is the same on every
//! machine; SVG and PDF name families of the same widths. Numbers that are not finite are gaps, two points at one x are
//! drawn as a vertical jump, and a series with more points than pixels is reduced to its visible points. Equal figures
//! give equal bytes.
//!
//! Knows names and units only as text, and needs neither the compiler nor the solvers. Writing the file is the caller's
//! business.

mod curve;
mod envelope;
mod figure;
mod font;
mod layout;
mod legend;
mod palette;
mod pdf;
mod png;
mod scene;
mod svg;
mod text;
mod ticks;
mod wrap;

pub use figure::{
    Envelope, Figure, HeatMap, Panel, PlotSeries, PointLabel, SeriesStyle, ShadedBand, columns_for,
};
pub use palette::{SeriesLook, SeriesMeaning, scale_of_colours};
pub use png::RasterError;
pub use text::MathText;

/// The figure as an SVG document.
pub fn render_svg(figure: &Figure) -> String {
    svg::write(&layout::scene(figure))
}

/// The figure as a PDF document of one page, with the size of the SVG at 96 pixels per inch.
pub fn render_pdf(figure: &Figure) -> Vec<u8> {
    pdf::write(&layout::scene(figure))
}

/// The figure as a PNG image with two pixels for each pixel of the SVG.
///
/// # Errors
///
/// [`RasterError`] if the image would be too large for common programs; an SVG has no such limit.
pub fn render_png(figure: &Figure) -> Result<Vec<u8>, RasterError> {
    png::encode(&layout::scene(figure))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(panels: usize, points: u32) -> Figure {
        let x: Vec<f64> = (0..points).map(f64::from).collect();
        // Noise, so that no points are left out because of smoothness.
        let noise = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 8);
        let y: Vec<f64> = (0..points).map(noise).collect();
        let series = |style| PlotSeries::new("x".into(), style, x.clone(), y.clone());
        let styles = [SeriesStyle::Line, SeriesStyle::Dots, SeriesStyle::ThinLine];
        let high = y.iter().map(|y| y + 1e6).collect();
        let envelope =
            Envelope { x: x.clone(), low: y.clone(), high, around: Some(0), ..Envelope::default() };
        let panel = Panel {
            series: styles.map(series).to_vec(),
            envelopes: vec![envelope],
            ..Panel::default()
        };
        Figure::new("x".into(), vec![panel; panels])
    }

    #[test]
    fn a_panel_with_many_points_stays_small() {
        let svg = render_svg(&figure(1, 200_000));
        assert!(svg.len() < 300_000, "{}", svg.len());
    }

    #[test]
    fn equal_figures_give_equal_bytes() {
        let figure = figure(3, 500);
        assert_eq!(render_svg(&figure), render_svg(&figure.clone()));
        assert_eq!(render_png(&figure), render_png(&figure.clone()));
        assert_eq!(render_pdf(&figure), render_pdf(&figure.clone()));
    }

    #[test]
    fn an_image_has_two_pixels_to_one_and_a_limit() {
        let png = render_png(&figure(1, 10)).unwrap_or_default();
        // Signature, then the header chunk with the width as its first number.
        assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
        assert_eq!(&png[16..20], &1600_u32.to_be_bytes());
        let wide = Figure { width: 1e6, ..figure(1, 10) };
        assert!(matches!(render_png(&wide), Err(RasterError::TooLarge { .. })));
    }

    #[test]
    fn the_grid_suits_the_number_of_panels() {
        let columns: Vec<usize> = (0..10).map(columns_for).collect();
        assert_eq!(columns, [1, 1, 1, 1, 2, 2, 2, 2, 2, 3]);
    }
}
