//! Labels beside points of a panel's series.

use super::style::{HALF_DIGIT, TICK_SIZE};
use crate::figure::{Panel, PointLabel};
use crate::font::Font;
use crate::scene::{Pen, SceneMark, ScenePoint, TextAnchor, TextDirection};

/// Gap between a point and its text.
const GAP: f64 = 6.0;

/// Minimum distance of the baselines of two texts that would overlap.
const DISTANCE: f64 = 1.15 * TICK_SIZE;

/// Room right of the axes for the labels of curves that end at their right edge.
pub(super) fn width(panel: &Panel, font: &Font) -> f64 {
    let labels = panel.series.iter().flat_map(|series| &series.labels);
    let widest = labels.map(|label| font.width(&label.text, TICK_SIZE)).fold(0.0, f64::max);
    if widest > 0.0 { widest + GAP } else { 0.0 }
}

/// Maximum number of rounds of moving texts apart; with enough room a few suffice.
const ROUNDS: usize = 20;

/// The labels of a panel whose axes go from (0, 0) to `size`, each right of its point; texts that
/// would overlap move apart, up and down.
pub(super) fn placed(
    panel: &Panel,
    pens: &[Pen],
    place: impl Fn(f64, f64) -> ScenePoint,
    font: &Font,
    size: ScenePoint,
) -> Vec<SceneMark> {
    let mut labels: Vec<(ScenePoint, &PointLabel, Pen)> = Vec::new();
    for (series, pen) in panel.series.iter().zip(pens) {
        let placed = series.labels.iter().map(|label| (place(label.x, label.y), label));
        let visible = placed.filter(|((x, y), _)| x.is_finite() && y.is_finite());
        labels.extend(visible.map(|((x, y), label)| ((x + GAP, y), label, *pen)));
    }
    labels.sort_by(|((_, a), ..), ((_, b), ..)| a.total_cmp(b));
    let ends = |at: f64, label: &PointLabel| (at, at + font.width(&label.text, TICK_SIZE));
    for _ in 0..ROUNDS {
        for j in 1..labels.len() {
            for i in 0..j {
                let (above, below) = (&labels[i], &labels[j]);
                let (a, b) = (ends(above.0.0, above.1), ends(below.0.0, below.1));
                let missing = DISTANCE - (below.0.1 - above.0.1);
                if missing > 1e-9 && a.0 < b.1 && b.0 < a.1 {
                    labels[i].0.1 -= 0.5 * missing;
                    labels[j].0.1 += 0.5 * missing;
                }
            }
        }
    }
    let half = 0.5 * TICK_SIZE;
    let text = |((x, y), label, pen): (ScenePoint, &PointLabel, Pen)| SceneMark::Text {
        text: label.text.clone(),
        at: (x, y.clamp(half, size.1 - half) + HALF_DIGIT * TICK_SIZE),
        anchor: TextAnchor::Start,
        direction: TextDirection::Rightwards,
        size: TICK_SIZE,
        colour: pen.colour,
    };
    labels.into_iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::PlotSeries;
    use crate::palette::pens;
    use crate::text::MathText;

    fn position(mark: &SceneMark) -> ScenePoint {
        match mark {
            SceneMark::Text { at, .. } => *at,
            _ => unreachable!("labels are texts"),
        }
    }

    #[test]
    fn labels_stand_right_of_their_points_and_apart() {
        let label = |x: f64, y: f64| PointLabel { x, y, text: MathText::plain("2000 rpm") };
        let labels = vec![label(100.0, 50.0), label(100.0, 52.0), label(10.0, 51.0)];
        let lost = label(f64::NAN, 1.0);
        let series = PlotSeries { labels: [labels, vec![lost]].concat(), ..PlotSeries::default() };
        let panel = Panel { series: vec![series], ..Panel::default() };
        let font = Font::embedded();
        let marks = placed(&panel, &pens(&panel), |x, y| (x, y), &font, (100.0, 100.0));
        assert_eq!(marks.len(), 3);
        let mut at_edge: Vec<ScenePoint> =
            marks.iter().map(position).filter(|at| at.0 > 100.0).collect();
        at_edge.sort_by(|a, b| a.1.total_cmp(&b.1));
        assert!(at_edge[1].1 - at_edge[0].1 >= DISTANCE - 1e-6, "{at_edge:?}");
        // Both are within the room reserved for them, and near their points.
        assert!(font.width(&MathText::plain("2000 rpm"), TICK_SIZE) + GAP <= width(&panel, &font));
        let middle = 0.5 * (at_edge[0].1 + at_edge[1].1) - HALF_DIGIT * TICK_SIZE;
        assert!((middle - 51.0).abs() < 1e-6, "{middle}");
        // The one elsewhere stays where it is.
        let elsewhere = marks.iter().map(position).find(|at| at.0 < 50.0).expect("the third");
        assert!((elsewhere.1 - HALF_DIGIT * TICK_SIZE - 51.0).abs() < 1e-9);
    }
}
