//! Curves through points, implemented from the literature, independent of the compiler.

/// A curve through points: a cubic in the distance from the left end of each interval.
pub(super) struct Curve {
    x: Vec<f64>,
    cubics: Vec<[f64; 4]>,
}

impl Curve {
    /// The piecewise linear curve.
    pub(super) fn linear(points: &[(f64, f64)]) -> Self {
        Self::of(points, |k, x, y| [y[k], (y[k + 1] - y[k]) / (x[k + 1] - x[k]), 0.0, 0.0])
    }

    /// Piecewise cubics with these slopes at the points.
    fn with_slopes(points: &[(f64, f64)], slopes: &[f64]) -> Self {
        Self::of(points, |k, x, y| {
            let h = x[k + 1] - x[k];
            let secant = (y[k + 1] - y[k]) / h;
            let bend = (3.0 * secant - 2.0 * slopes[k] - slopes[k + 1]) / h;
            [y[k], slopes[k], bend, (slopes[k] + slopes[k + 1] - 2.0 * secant) / (h * h)]
        })
    }

    /// The monotone curve of Fritsch and Butland (1984), for points that are level at both ends.
    pub(super) fn monotone(points: &[(f64, f64)]) -> Self {
        let secant = |k: usize| (points[k + 1].1 - points[k].1) / (points[k + 1].0 - points[k].0);
        let mut slopes = vec![0.0; points.len()];
        for (k, slope) in slopes.iter_mut().enumerate().take(points.len() - 1).skip(1) {
            let (left, right) = (secant(k - 1), secant(k));
            let widths = [points[k].0 - points[k - 1].0, points[k + 1].0 - points[k].0];
            if left * right > 0.0 {
                let share = (1.0 + widths[1] / (widths[0] + widths[1])) / 3.0;
                *slope = left * right / (share * right + (1.0 - share) * left);
            }
        }
        Self::with_slopes(points, &slopes)
    }

    /// The natural spline: its second derivatives by elimination.
    pub(super) fn natural(points: &[(f64, f64)]) -> Self {
        let n = points.len();
        let h = |k: usize| points[k + 1].0 - points[k].0;
        let secant = |k: usize| (points[k + 1].1 - points[k].1) / h(k);
        // At the inner points, h₋ m₋ + 2 (h₋ + h₊) m + h₊ m₊ = 6 (δ₊ − δ₋).
        let mut moments = vec![0.0; n];
        let (mut upper, mut right) = (vec![0.0; n], vec![0.0; n]);
        for k in 1..n - 1 {
            let pivot = 2.0 * (h(k - 1) + h(k)) - h(k - 1) * upper[k - 1];
            upper[k] = h(k) / pivot;
            right[k] = (6.0 * (secant(k) - secant(k - 1)) - h(k - 1) * right[k - 1]) / pivot;
        }
        for k in (1..n - 1).rev() {
            moments[k] = right[k] - upper[k] * moments[k + 1];
        }
        Self::of(points, |k, x, y| {
            let h = x[k + 1] - x[k];
            let slope = (y[k + 1] - y[k]) / h - h * (2.0 * moments[k] + moments[k + 1]) / 6.0;
            [y[k], slope, moments[k] / 2.0, (moments[k + 1] - moments[k]) / (6.0 * h)]
        })
    }

    fn of(points: &[(f64, f64)], cubic: impl Fn(usize, &[f64], &[f64]) -> [f64; 4]) -> Self {
        let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
        let cubics = (0..x.len() - 1).map(|k| cubic(k, &x, &y)).collect();
        Self { x, cubics }
    }

    /// The value; constant beyond the ends.
    pub(super) fn value(&self, x: f64) -> f64 {
        let x = x.clamp(self.x[0], self.x[self.x.len() - 1]);
        let k = self.x.partition_point(|knot| *knot <= x).clamp(1, self.cubics.len()) - 1;
        let s = x - self.x[k];
        let [a, b, c, d] = self.cubics[k];
        a + s * (b + s * (c + s * d))
    }

    /// The integral from the first point to x.
    pub(super) fn integral(&self, x: f64) -> f64 {
        let mut sum = 0.0;
        for (k, [a, b, c, d]) in self.cubics.iter().enumerate() {
            let s = (x - self.x[k]).clamp(0.0, self.x[k + 1] - self.x[k]);
            sum += s * (a + s * (b / 2.0 + s * (c / 3.0 + s * d / 4.0)));
        }
        let last = self.x.len() - 1;
        sum + (x - self.x[last]).max(0.0) * self.value(self.x[last])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_go_through_their_points_and_are_what_they_are_called() {
        let points = [(0.0, 0.0), (1.0, 0.0), (1.5, 2.0), (4.0, 3.0), (5.0, 3.0)];
        for curve in [Curve::linear(&points), Curve::monotone(&points), Curve::natural(&points)] {
            for (x, y) in points {
                assert!((curve.value(x) - y).abs() < 1e-12);
            }
            // Simpson's rule is exact for cubics.
            let mut sum = 0.0;
            for pair in points.windows(2) {
                let (a, b) = (pair[0].0, pair[1].0);
                let middle = curve.value(0.5 * (a + b));
                sum += (b - a) / 6.0 * (pair[0].1 + 4.0 * middle + pair[1].1);
            }
            assert!((curve.integral(5.0) - sum).abs() < 1e-12);
            assert!((curve.integral(7.0) - sum - 6.0).abs() < 1e-12);
        }
        // A straight line is reproduced by each.
        let line: Vec<(f64, f64)> = [0.0, 0.3, 2.0, 3.0].map(|x| (x, 2.0 * x - 1.0)).to_vec();
        assert!((Curve::natural(&line).value(1.1) - 1.2).abs() < 1e-12);
        // Curvature is continuous.
        let curve = Curve::natural(&points);
        for k in 1..curve.cubics.len() {
            let h = curve.x[k] - curve.x[k - 1];
            let [_, _, c, d] = curve.cubics[k - 1];
            assert!((c + 3.0 * d * h - curve.cubics[k][2]).abs() < 1e-12);
        }
    }
}
