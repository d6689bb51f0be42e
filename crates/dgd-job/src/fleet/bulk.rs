//! Robust centre and covariance of the bulk of some points, of which up to half may be outliers.
//!
//! Orthogonalised pairwise estimates, then the covariance of the points near the centre by those. A direction in which
//! the bulk has no extent, for example because most points are equal, gets the width of the points' uncertainty, by
//! which even equal points differ by chance.

use dgd_screen::distribution::chi_square_tail;
use nalgebra::{DMatrix, DVector};

use super::tail::f_tail;

/// Factor from a median deviation to the standard deviation of a normal distribution: 1/Φ⁻¹(3/4).
const OF_NORMAL: f64 = 1.482_602_218_505_602;

/// Probability of a normal distribution within the region near the centre.
const NEAR: f64 = 0.9;

/// Points that differ by less than this share of their uncertainty are equal; independent ones never are.
const SAME: f64 = 1e-3;

/// Centre and covariance of the bulk.
pub(super) struct BulkDistribution {
    centre: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Number of wells behind the estimates.
    wells: usize,
}

impl BulkDistribution {
    /// From scaled parameters with these variances; `None` if the bulk has no extent and no uncertainty in some
    /// direction.
    pub(super) fn estimate(x: &[&DVector<f64>], known: &DVector<f64>) -> Option<BulkDistribution> {
        let p = x[0].len();
        let raw = orthogonalised(x, known)?;
        let distances: Vec<f64> = x
            .iter()
            .map(|x| Some(raw.distance(x, &DVector::zeros(p))?.0))
            .collect::<Option<_>>()?;
        let limit = quantile(NEAR, p);
        // The median distance sets the scale of the raw covariance.
        let scale = median(&mut distances.clone()) / quantile(0.5, p);
        // If most points are equal, the covariance is their uncertainty, which is already scaled.
        let scale = if scale < SAME * SAME { 1.0 } else { scale };
        let near = |(_, d): &(&&DVector<f64>, &f64)| **d <= limit * scale;
        let near: Vec<&DVector<f64>> =
            x.iter().zip(&distances).filter(near).map(|(x, _)| *x).collect();
        let n = near.len();
        if n < p + 2 {
            return None;
        }
        let centre = near.iter().fold(DVector::zeros(p), |sum, x| sum + *x) / n as f64;
        let mut covariance = DMatrix::zeros(p, p);
        for x in &near {
            let e = *x - &centre;
            covariance += &e * e.transpose();
        }
        // A normal distribution truncated at the limit has a smaller covariance.
        let within = 1.0 - chi_square_tail(limit, (p + 2) as f64);
        covariance *= NEAR / within / (n - 1) as f64;
        let covariance = widened(covariance, known)?;
        Some(BulkDistribution { centre, covariance, wells: n })
    }

    /// d², and the parameter that contributes most to it. `more` is added to the variances.
    pub(super) fn distance(&self, x: &DVector<f64>, more: &DVector<f64>) -> Option<(f64, usize)> {
        let covariance = &self.covariance + DMatrix::from_diagonal(more);
        let inverse = covariance.cholesky()?.inverse();
        let e = x - &self.centre;
        let pull = &inverse * &e;
        let squared = e.dot(&pull);
        // Contribution of parameter j to d².
        let part = |j: usize| pull[j] * pull[j] / inverse[(j, j)];
        let most = (0..x.len()).max_by(|a, b| part(*a).total_cmp(&part(*b)))?;
        squared.is_finite().then_some((squared.max(0.0), most))
    }

    /// Probability of a larger d².
    pub(super) fn tail(&self, squared: f64) -> f64 {
        let (n, p) = (self.wells as f64, self.centre.len() as f64);
        f_tail(squared * n * (n - p) / (p * (n * n - 1.0)), p, n - p)
    }
}

/// Centre and covariance in axes with uncorrelated pairs of parameters, after two passes.
fn orthogonalised(x: &[&DVector<f64>], known: &DVector<f64>) -> Option<BulkDistribution> {
    let p = x[0].len();
    let mut axes = DMatrix::<f64>::identity(p, p);
    let mut to_axes = axes.clone();
    let mut points: Vec<DVector<f64>> = x.iter().map(|x| (*x).clone()).collect();
    for _ in 0..2 {
        let scales = (0..p).map(|j| {
            let known = to_axes.row(j).iter().zip(known).map(|(a, v)| a * a * v).sum::<f64>();
            extent(scale_of(points.iter().map(|x| x[j])), known.sqrt())
        });
        let scales: Vec<f64> = scales.collect::<Option<_>>()?;
        let to_scaled = DMatrix::from_diagonal(&DVector::from_column_slice(&scales));
        let mut u = DMatrix::<f64>::identity(p, p);
        for j in 0..p {
            for k in 0..j {
                let [sum, difference] = [1.0, -1.0].map(|sign| {
                    scale_of(points.iter().map(|x| x[j] / scales[j] + sign * x[k] / scales[k]))
                });
                let correlation = 0.25 * (sum * sum - difference * difference);
                (u[(j, k)], u[(k, j)]) = (correlation, correlation);
            }
        }
        let vectors = u.symmetric_eigen().eigenvectors;
        let back = to_scaled * vectors;
        let inverse = back.clone().try_inverse()?;
        for x in &mut points {
            *x = &inverse * &*x;
        }
        axes *= back;
        to_axes = inverse * to_axes;
    }
    let both = (0..p).map(|j| {
        let known = to_axes.row(j).iter().zip(known).map(|(a, v)| a * a * v).sum::<f64>();
        let (centre, scale) =
            centre_and_scale(&mut points.iter().map(|x| x[j]).collect::<Vec<f64>>());
        Some((centre, extent(scale, known.sqrt())?))
    });
    let both: Vec<(f64, f64)> = both.collect::<Option<_>>()?;
    let centre = &axes * DVector::from_iterator(p, both.iter().map(|(centre, _)| *centre));
    let variances = DVector::from_iterator(p, both.iter().map(|(_, scale)| scale * scale));
    let covariance = &axes * DMatrix::from_diagonal(&variances) * axes.transpose();
    Some(BulkDistribution { centre, covariance, wells: x.len() })
}

/// The covariance, widened where it has no extent.
fn widened(covariance: DMatrix<f64>, known: &DVector<f64>) -> Option<DMatrix<f64>> {
    let is_wide = |one: f64, known: f64| one > 0.0 && one >= SAME * SAME * known;
    let eigen = covariance.clone().symmetric_eigen();
    let along = |j: usize| eigen.eigenvectors.column(j).map(|e| e * e).dot(known);
    let p = known.len();
    let rounding = f64::EPSILON * p as f64 * eigen.eigenvalues.amax();
    let width = |j: usize| eigen.eigenvalues[j];
    if (0..p).all(|j| width(j) > rounding && is_wide(width(j), along(j))) {
        return Some(covariance);
    }
    let widths = (0..p).map(|j| {
        if width(j) > rounding && is_wide(width(j), along(j)) {
            Some(width(j))
        } else {
            Some(along(j)).filter(|v| *v > 0.0)
        }
    });
    let widths = DVector::from_vec(widths.collect::<Option<Vec<f64>>>()?);
    let vectors = &eigen.eigenvectors;
    Some(vectors * DMatrix::from_diagonal(&widths) * vectors.transpose())
}

/// Extent of the bulk, or the uncertainty of its points if most of them are equal.
pub(super) fn extent(scale: f64, known: f64) -> Option<f64> {
    let extent = if scale > 0.0 && scale >= SAME * known { scale } else { known };
    Some(extent).filter(|extent| *extent > 0.0)
}

fn scale_of(values: impl Iterator<Item = f64>) -> f64 {
    centre_and_scale(&mut values.collect::<Vec<f64>>()).1
}

/// The median, and the median deviation scaled to a standard deviation.
pub(super) fn centre_and_scale(values: &mut [f64]) -> (f64, f64) {
    let centre = median(values);
    let mut deviations: Vec<f64> = values.iter().map(|value| (value - centre).abs()).collect();
    (centre, OF_NORMAL * median(&mut deviations))
}

/// The median; zero without values.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => 0.0,
        _ if n % 2 == 1 => values[n / 2],
        _ => f64::midpoint(values[n / 2 - 1], values[n / 2]),
    }
}

/// Quantile of χ² with p degrees of freedom.
fn quantile(probability: f64, p: usize) -> f64 {
    let p = p as f64;
    let (mut low, mut high) = (0.0, p + 40.0 * (p + 1.0).sqrt() + 40.0);
    while high - low > 1e-10 * high {
        let middle = f64::midpoint(low, high);
        if 1.0 - chi_square_tail(middle, p) < probability { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        for (probability, p, value) in [(0.9, 1, 2.706), (0.5, 4, 3.357), (0.9, 10, 15.987)] {
            assert!((quantile(probability, p) - value).abs() < 1e-3);
        }
    }
}
