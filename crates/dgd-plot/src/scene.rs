//! The scene to draw, in pixels from the upper left corner: the last stage shared by all formats.

use crate::text::MathText;

/// A page of marks; later marks cover earlier ones.
pub(crate) struct Scene {
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) marks: Vec<SceneMark>,
}

pub(crate) type ScenePoint = (f64, f64);

pub(crate) enum SceneMark {
    Area {
        rectangle: Rectangle,
        colour: Colour,
    },
    /// Interiors of closed outlines.
    Surface {
        outlines: Vec<Vec<ScenePoint>>,
        colour: Colour,
    },
    /// Lines of one pen, each of two points or more.
    Lines {
        lines: Vec<Vec<ScenePoint>>,
        pen: Pen,
    },
    Dots {
        centres: Vec<ScenePoint>,
        diameter: f64,
        colour: Colour,
    },
    Text {
        text: MathText,
        /// A point of the baseline.
        at: ScenePoint,
        anchor: TextAnchor,
        direction: TextDirection,
        size: f64,
        colour: Colour,
    },
}

impl SceneMark {
    /// The same mark, moved to the right and down.
    pub(crate) fn shifted(&self, by: ScenePoint) -> SceneMark {
        let shift = |point: &ScenePoint| (point.0 + by.0, point.1 + by.1);
        match self {
            SceneMark::Area { rectangle, colour } => {
                let (left, top) = shift(&(rectangle.left, rectangle.top));
                SceneMark::Area {
                    rectangle: Rectangle { left, top, ..*rectangle },
                    colour: *colour,
                }
            }
            SceneMark::Surface { outlines, colour } => SceneMark::Surface {
                outlines: outlines.iter().map(|line| line.iter().map(shift).collect()).collect(),
                colour: *colour,
            },
            SceneMark::Lines { lines, pen } => SceneMark::Lines {
                lines: lines.iter().map(|line| line.iter().map(shift).collect()).collect(),
                pen: *pen,
            },
            SceneMark::Dots { centres, diameter, colour } => SceneMark::Dots {
                centres: centres.iter().map(shift).collect(),
                diameter: *diameter,
                colour: *colour,
            },
            SceneMark::Text { text, at, anchor, direction, size, colour } => SceneMark::Text {
                text: text.clone(),
                at: shift(at),
                anchor: *anchor,
                direction: *direction,
                size: *size,
                colour: *colour,
            },
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rectangle {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Rectangle {
    pub(crate) fn right(self) -> f64 {
        self.left + self.width
    }

    pub(crate) fn bottom(self) -> f64 {
        self.top + self.height
    }

    /// Whether any part of the segment from `a` to `b` lies in the rectangle.
    pub(crate) fn meets(self, a: ScenePoint, b: ScenePoint) -> bool {
        // Liang–Barsky: the part of a + s (b − a), 0 ≤ s ≤ 1, inside all four half-planes.
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (direction, distance) in [
            (-dx, a.0 - self.left),
            (dx, self.right() - a.0),
            (-dy, a.1 - self.top),
            (dy, self.bottom() - a.1),
        ] {
            if direction == 0.0 {
                if distance < 0.0 {
                    return false;
                }
            } else if direction < 0.0 {
                enter = enter.max(distance / direction);
            } else {
                leave = leave.min(distance / direction);
            }
        }
        enter <= leave
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pen {
    pub(crate) colour: Colour,
    pub(crate) width: f64,
    /// Alternating lengths of dashes and gaps; empty for a solid line.
    pub(crate) dashes: &'static [f32],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Colour(pub(crate) u8, pub(crate) u8, pub(crate) u8);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TextAnchor {
    Start,
    Middle,
    End,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TextDirection {
    Rightwards,
    Upwards,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_meets_a_rectangle_by_crossing_touching_or_lying_in_it() {
        let r = Rectangle { left: 1.0, top: 1.0, width: 2.0, height: 1.0 };
        assert!(r.meets((0.0, 0.0), (4.0, 3.0)));
        assert!(r.meets((1.5, 1.5), (1.5, 1.5)));
        assert!(r.meets((2.0, -5.0), (2.0, 5.0)));
        assert!(!r.meets((0.0, 0.0), (4.0, 0.9)));
        assert!(!r.meets((0.0, 2.0), (0.9, 9.0)));
        assert!(!r.meets((0.5, 0.5), (0.5, 0.5)));
    }
}
