//! Projects the fitted directions out of long columns.

/// An orthonormal basis of the span of some columns.
///
/// Modified Gram–Schmidt, twice: the columns differ in size by many orders of magnitude and are nearly parallel for
/// parameters that are hardly distinguishable (Giraud, Langou, Rozložník, Comput. Math. Appl. 50 (2005) 1069: twice is
/// enough).
#[derive(Debug, Clone, Default)]
pub(crate) struct OrthonormalBasis {
    columns: Vec<Vec<f64>>,
}

/// A column that keeps less than this fraction of its length lies in the span: the rest is rounding and solver error,
/// not information.
const IN_SPAN: f64 = 1e-5;

impl OrthonormalBasis {
    /// The span of the columns.
    pub(crate) fn new(columns: &[Vec<f64>]) -> OrthonormalBasis {
        let mut basis = OrthonormalBasis::default();
        for column in columns {
            if let Some(rest) = basis.project_out(column) {
                basis.extend(&rest);
            }
        }
        basis
    }

    /// Its columns, orthonormal.
    pub(crate) fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    /// Adds a column that is orthogonal to the span.
    pub(crate) fn extend(&mut self, rest: &[f64]) {
        let length = dot(rest, rest).sqrt();
        self.columns.push(rest.iter().map(|value| value / length).collect());
    }

    /// The part of a column that is orthogonal to the span; `None` if there is none, or if the column is not finite.
    pub(crate) fn project_out(&self, column: &[f64]) -> Option<Vec<f64>> {
        let before = dot(column, column);
        let mut rest = column.to_vec();
        for _ in 0..2 {
            for q in &self.columns {
                let along = dot(q, &rest);
                rest.iter_mut().zip(q).for_each(|(value, q)| *value -= along * q);
            }
        }
        let after = dot(&rest, &rest);
        (after.is_finite() && after > IN_SPAN * IN_SPAN * before && after > 0.0).then_some(rest)
    }
}

/// Σ aᵢ bᵢ.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Eight sums at once: the compiler may not reorder one.
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 8];
    for (a, b) in a8.zip(b8) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_orthogonal_to_the_span() {
        let n = 501;
        let t = |k: usize| k as f64 / n as f64;
        let column = |f: &dyn Fn(f64) -> f64| (0..n).map(|k| f(t(k))).collect::<Vec<f64>>();
        // Sizes and directions typical of parameters: 1e8 apart, nearly parallel.
        let fitted = [column(&|_| 1.0), column(&|t| 1e8 * t), column(&|t| 1e8 * t + 1e4 * t * t)];
        let basis = OrthonormalBasis::new(&fitted);
        let rest = basis.project_out(&column(&|t| t.powi(3))).unwrap();
        for column in &fitted {
            let cosine = dot(column, &rest) / (dot(column, column) * dot(&rest, &rest)).sqrt();
            assert!(cosine.abs() < 1e-12, "{cosine}");
        }
        assert!(basis.project_out(&column(&|t| 2.0 - 3.0 * t + t * t)).is_none());
        assert!(basis.project_out(&column(&|_| f64::NAN)).is_none());
    }

    #[test]
    fn the_cubic_keeps_what_a_legendre_polynomial_says() {
        // ‖x³ − its best quadratic‖² on [0, 1] is 1/2800.
        let n = 20_000;
        let at = |k: usize| (k as f64 + 0.5) / f64::from(n);
        let power = |p: i32| (0..n as usize).map(|k| at(k).powi(p)).collect::<Vec<f64>>();
        let rest =
            OrthonormalBasis::new(&[power(0), power(1), power(2)]).project_out(&power(3)).unwrap();
        let square = dot(&rest, &rest) / f64::from(n);
        assert!((square * 2800.0 - 1.0).abs() < 1e-6, "{square}");
    }
}
