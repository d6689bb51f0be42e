//! Reduces the points of a series to the visible ones.
//!
//! A pixel column keeps, in order, the first, lowest, highest and last point of each run of points: the drawn line
//! covers the same pixels as the full one, including jumps and single extremes. Of dots, one per raster cell is kept.

use crate::scene::ScenePoint;

/// Joins points by lines; a point that is not finite ends a line.
///
/// `columns` is the number of columns per pixel.
pub(crate) fn lines(
    points: impl Iterator<Item = ScenePoint>,
    columns: f64,
) -> Vec<Vec<ScenePoint>> {
    let mut lines = Vec::new();
    let mut line = Vec::new();
    let mut column: Option<PointColumn> = None;
    for point in points {
        if !(point.0.is_finite() && point.1.is_finite()) {
            end(&mut lines, &mut line, &mut column);
            continue;
        }
        let place = (point.0 * columns).floor();
        match &mut column {
            Some(column) if column.place == place => column.take_in(point),
            _ => {
                if let Some(column) = column.replace(PointColumn::new(place, point)) {
                    column.append_to(&mut line);
                }
            }
        }
    }
    end(&mut lines, &mut line, &mut column);
    lines
}

fn end(
    lines: &mut Vec<Vec<ScenePoint>>,
    line: &mut Vec<ScenePoint>,
    column: &mut Option<PointColumn>,
) {
    if let Some(column) = column.take() {
        column.append_to(line);
    }
    if !line.is_empty() {
        lines.push(std::mem::take(line));
    }
}

/// The points of a run inside one column, each with its position in the run.
struct PointColumn {
    place: f64,
    count: usize,
    first: ScenePoint,
    lowest: (usize, ScenePoint),
    highest: (usize, ScenePoint),
    last: ScenePoint,
}

impl PointColumn {
    fn new(place: f64, point: ScenePoint) -> PointColumn {
        let extreme = (0, point);
        PointColumn {
            place,
            count: 1,
            first: point,
            lowest: extreme,
            highest: extreme,
            last: point,
        }
    }

    fn take_in(&mut self, point: ScenePoint) {
        if point.1 < self.lowest.1.1 {
            self.lowest = (self.count, point);
        }
        if point.1 > self.highest.1.1 {
            self.highest = (self.count, point);
        }
        self.last = point;
        self.count += 1;
    }

    fn append_to(self, line: &mut Vec<ScenePoint>) {
        let mut kept = [(0, self.first), self.lowest, self.highest, (self.count - 1, self.last)];
        kept.sort_by_key(|(order, _)| *order);
        let mut drawn = None;
        for (order, point) in kept {
            if drawn != Some(order) {
                line.push(point);
                drawn = Some(order);
            }
        }
    }
}

/// One dot per cell of a raster, at most about `limit` of them: the cells grow until they fit.
pub(crate) fn dots(points: impl Iterator<Item = ScenePoint>, limit: usize) -> Vec<ScenePoint> {
    let mut dots: Vec<ScenePoint> = points.filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
    let mut cell = 0.5;
    while dots.len() > limit && cell < 64.0 {
        let place = |p: &ScenePoint| ((p.0 / cell).floor() as i64, (p.1 / cell).floor() as i64);
        let mut taken = std::collections::HashSet::new();
        dots.retain(|dot| taken.insert(place(dot)));
        cell *= 2.0;
    }
    dots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_keeps_first_lowest_highest_and_last_in_order() {
        let y = [1.0, 5.0, 3.0, -2.0, 0.0, 0.5];
        let points = y.iter().enumerate().map(|(i, &y)| (f64::from(i as u32) * 0.1, y));
        let drawn = lines(points, 1.0);
        assert_eq!(drawn.len(), 1);
        let kept: Vec<f64> = drawn[0].iter().map(|p| p.1).collect();
        assert_eq!(kept, [1.0, 5.0, -2.0, 0.5]);
    }

    #[test]
    fn what_is_not_finite_is_a_gap_and_a_lone_point_stays() {
        let points = [(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (3.0, 1.0), (4.0, f64::INFINITY)];
        let drawn = lines(points.into_iter(), 1.0);
        assert_eq!(drawn, [vec![(0.0, 1.0), (1.0, 2.0)], vec![(3.0, 1.0)]]);
        assert!(lines([(0.0, f64::NAN)].into_iter(), 1.0).is_empty());
    }

    #[test]
    fn a_million_points_become_four_per_column_and_keep_a_spike() {
        let n = 1_000_000;
        let y = |i: usize| if i == 123_456 { 99.0 } else { (i % 17) as f64 };
        let points = (0..n).map(|i| (300.0 * i as f64 / n as f64, y(i)));
        let drawn = lines(points, 2.0);
        assert_eq!(drawn.len(), 1);
        assert!(drawn[0].len() <= 4 * 601);
        assert!(drawn[0].iter().any(|p| p.1 == 99.0));
    }

    #[test]
    fn dots_thin_out_only_where_they_are_too_many() {
        let few = [(0.0, 0.0), (0.1, 0.1), (f64::NAN, 0.0)];
        assert_eq!(dots(few.into_iter(), 10).len(), 2);
        let many = (0..100_000).map(|i| (f64::from(i % 331), f64::from(i % 151)));
        let kept = dots(many, 5000);
        assert!((1000..=5000).contains(&kept.len()), "{}", kept.len());
    }
}
