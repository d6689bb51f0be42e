//! The result of a regression, with its uncertainty.

use dgd_runtime::Direction;
use nalgebra::DMatrix;

use crate::noise::NoiseSource;
use crate::regression::RegressionMethod;
use crate::regression::error::RegressionError;
use crate::regression::least_squares::{UNSEEN, spectrum};
use crate::regression::prepare::PreparedRegression;
use crate::regression::rows::{RegressionRows, RowOf, RowsLeftOut};
use crate::regression::separable::{SeparableEnd, triangle};
use crate::uncertainty::{ParameterEstimate, Uncertainty, UndeterminedDirection};
use crate::variables::BoundReached;

/// Noise below this fraction of a row's magnitude is rounding error.
const ROUNDING: f64 = 1e-14;

/// The quality of fit of an equation or output.
#[derive(Debug, Clone, PartialEq)]
pub struct RowQuality {
    /// The equation or output.
    pub of: RowOf,
    /// Its name.
    pub name: String,
    /// Samples.
    pub samples: usize,
    /// Mean square of predicted − target, SI.
    pub mean_squared_error: f64,
    /// 1 − Σ(predicted − target)²/Σ(target − mean)²; `None` if the target is constant.
    pub r_squared: Option<f64>,
    /// σ of the residuals as weighted by the fit, SI.
    pub sigma: f64,
    /// The parameter by which the equation was multiplied to become linear.
    pub multiplied_by: Option<String>,
}

/// Estimated parameters, with their uncertainty.
#[derive(Debug, Clone)]
pub struct RegressionFit {
    /// The method.
    pub method: RegressionMethod,
    /// All parameters, SI.
    pub p: Vec<f64>,
    /// The free parameters.
    pub estimates: Vec<ParameterEstimate>,
    /// Which of them were found by linear least squares.
    pub linear: Vec<bool>,
    /// The linear ones without bounds, given the others, SI; `None` if no bound was reached.
    pub unbounded: Option<Vec<f64>>,
    /// Number of linearly independent columns of derivatives.
    pub rank: usize,
    /// Condition number of the weighted derivatives with respect to all free parameters, with columns of length 1.
    pub condition_number: f64,
    /// Changes of the estimates that affect no row.
    pub undetermined: Vec<UndeterminedDirection>,
    /// Quality of fit of equations and outputs.
    pub rows: Vec<RowQuality>,
    /// Σ (residual/σ)², including priors.
    pub cost: f64,
    /// Rows of all equations and outputs.
    pub samples: usize,
    /// Samples without rows.
    pub left_out: RowsLeftOut,
    /// Accepted steps of the outer search.
    pub iterations: usize,
    /// Evaluations of all rows.
    pub evaluations: usize,
    /// Whether it was cancelled before it converged; the values are the best so far.
    pub is_stopped: bool,
    /// Whether a minimum was reached; otherwise the values are the best found.
    pub is_converged: bool,
    /// Whether it ended on a plateau, where no nonlinear parameter has influence except perhaps at bounds.
    pub is_flat: bool,
    uncertainty: Uncertainty,
    /// Scales of changes of the estimates.
    pub(super) sizes: Vec<f64>,
}

impl RegressionFit {
    /// Covariance of two estimates, SI; `None` if one of them is at a bound or not determined.
    pub fn covariance(&self, i: usize, j: usize) -> Option<f64> {
        Some(self.uncertainty.covariance(i, j)? * self.sizes[i] * self.sizes[j])
    }

    /// Drops the standard errors.
    pub fn forget_uncertainty(&mut self) {
        self.uncertainty.forget(&mut self.estimates);
    }

    /// Correlation of the errors of two estimates.
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let covariance = |i, j| self.uncertainty.covariance(i, j);
        Some(covariance(i, j)? / (covariance(i, i)? * covariance(j, j)?).sqrt())
    }
}

/// The end of a round of a fit.
#[derive(Debug, Clone)]
pub(crate) struct RegressionRound {
    pub p: Vec<f64>,
    /// The linear parameters without bounds.
    pub unbounded: Vec<f64>,
    /// σ of each kind of rows.
    pub sigma: Vec<f64>,
    /// The smallest significant σ.
    least: Vec<f64>,
    pub iterations: usize,
    pub evaluations: usize,
    /// Whether the search of nonlinear parameters reached a minimum.
    pub is_converged: bool,
    /// Whether it ended on a plateau.
    pub is_flat: bool,
}

/// Sums over the rows of one kind.
#[derive(Debug, Clone, Default)]
struct RowTally {
    samples: usize,
    /// Σ residual².
    residuals: f64,
    /// Σ (predicted − target)².
    errors: f64,
    /// Mean and Σ (target − mean)², by Welford's update.
    mean: f64,
    variation: f64,
    /// Largest of the residual's two terms.
    largest: f64,
    /// Σ (difference of neighbours)², for a first guess.
    differences: f64,
    last: Option<f64>,
}

fn tallies(rows: &mut RegressionRows<'_>, p: &[f64]) -> Result<Vec<RowTally>, RegressionError> {
    let mut tallies = vec![RowTally::default(); rows.kinds.len()];
    rows.visit(p, &mut |row| {
        let tally = &mut tallies[row.kind];
        tally.samples += 1;
        let error = row.predicted - row.target;
        tally.residuals += row.residual * row.residual;
        tally.errors += error * error;
        let off = row.target - tally.mean;
        tally.mean += off / tally.samples as f64;
        tally.variation += off * (row.target - tally.mean);
        let factor = if error == 0.0 { 1.0 } else { row.residual / error };
        let terms = row.predicted.abs().max(row.target.abs());
        tally.largest = tally.largest.max((factor * terms).abs());
        if let Some(last) = tally.last.replace(row.residual) {
            tally.differences += (row.residual - last).powi(2);
        }
    })?;
    Ok(tallies)
}

impl RegressionRound {
    /// First guesses: σ from the scatter of the residuals from one sample to the next.
    pub(crate) fn first(
        prepared: &PreparedRegression<'_>,
        rows: &mut RegressionRows<'_>,
    ) -> Result<Self, RegressionError> {
        let tallies = tallies(rows, &prepared.p)?;
        let least = tallies.iter().map(|tally| match ROUNDING * tally.largest {
            0.0 => f64::MIN_POSITIVE.sqrt(),
            least => least,
        });
        let least: Vec<f64> = least.collect();
        let sigma = tallies.iter().enumerate().map(|(kind, tally)| {
            let pairs = tally.samples.saturating_sub(1).max(1) as f64;
            let scatter = (tally.differences / (2.0 * pairs)).sqrt();
            known(prepared, rows, kind).unwrap_or(scatter.max(least[kind]))
        });
        let sigma = sigma.collect();
        let p = prepared.p.clone();
        Ok(Self {
            unbounded: p.clone(),
            p,
            sigma,
            least,
            iterations: 0,
            evaluations: 1,
            is_converged: true,
            is_flat: false,
        })
    }

    /// The end of a round, with σ estimated from its residuals.
    pub(crate) fn new(
        prepared: &PreparedRegression<'_>,
        rows: &mut RegressionRows<'_>,
        last: &Self,
        p: Vec<f64>,
        unbounded: Vec<f64>,
        bounds: &[(f64, f64)],
        searched: &SeparableEnd,
    ) -> Result<Self, RegressionError> {
        let tallies = tallies(rows, &p)?;
        let samples: usize = tallies.iter().map(|tally| tally.samples).sum();
        // Every kind loses degrees of freedom in proportion to its rows; parameters at a bound use none.
        let is_unheld = |(i, (low, high)): &(&usize, &(f64, f64))| p[**i] > *low && p[**i] < *high;
        let unheld = prepared.free.iter().zip(bounds).filter(is_unheld).count();
        let left = samples.saturating_sub(unheld).max(1);
        let spread = samples as f64 / left as f64;
        let sigma = tallies.iter().enumerate().map(|(kind, tally)| {
            let estimated = (tally.residuals / tally.samples.max(1) as f64 * spread).sqrt();
            known(prepared, rows, kind).unwrap_or(estimated.max(last.least[kind]))
        });
        let sigma = sigma.collect();
        let SeparableEnd { evaluations, iterations, is_converged, is_flat, .. } = *searched;
        let least = last.least.clone();
        Ok(Self { p, unbounded, sigma, least, iterations, evaluations, is_converged, is_flat })
    }

    /// The end of a fit, to continue with its weights.
    pub(crate) fn from_fit(fit: &RegressionFit) -> Self {
        let sigma: Vec<f64> = fit.rows.iter().map(|row| row.sigma).collect();
        Self {
            p: fit.p.clone(),
            unbounded: fit.p.clone(),
            least: sigma.clone(),
            sigma,
            iterations: 0,
            evaluations: 0,
            is_converged: true,
            is_flat: false,
        }
    }

    /// Whether the weights have changed by less than a fraction, so that another round is unnecessary.
    pub(crate) fn is_stable(&self, last: &Self, part: f64) -> bool {
        let near = |(next, last): (&f64, &f64)| (next / last - 1.0).abs() <= part;
        self.sigma.iter().zip(&last.sigma).all(near)
    }
}

/// σ of a kind of rows, if it is given.
fn known(prepared: &PreparedRegression<'_>, rows: &RegressionRows<'_>, kind: usize) -> Option<f64> {
    match rows.kinds[kind].of {
        RowOf::Equation(_) => None,
        RowOf::Output(i) => match prepared.problem.noise[i] {
            Some(NoiseSource::Known(sigma)) => Some(sigma),
            Some(_) | None => None,
        },
    }
}

/// The regression that ended at this point.
pub(crate) fn finish(
    prepared: &PreparedRegression<'_>,
    rows: &mut RegressionRows<'_>,
    linear: &[bool],
    found: RegressionRound,
    method: RegressionMethod,
) -> Result<RegressionFit, RegressionError> {
    let signature = prepared.problem.system.signature();
    let free = &prepared.free;
    let columns: Vec<(usize, f64)> = prepared.sizes.iter().copied().enumerate().collect();
    let triangle = triangle(prepared, rows, &found.sigma, &found.p, &columns)?;
    let r: DMatrix<f64> = triangle.r();
    let bounds: Vec<Option<BoundReached>> = free
        .iter()
        .map(|i| {
            let parameter = &signature.parameters[*i];
            match found.p[*i] {
                _ if !method.has_bounds() => None,
                value if value <= parameter.lower => Some(BoundReached::Lower),
                value if value >= parameter.upper => Some(BoundReached::Upper),
                _ => None,
            }
        })
        .collect();
    let is_fixed: Vec<bool> = bounds.iter().map(Option::is_some).collect();
    let uncertainty = Uncertainty::of_triangle(&r, &is_fixed, UNSEEN);
    let spectrum = spectrum(&r);
    let tallies = tallies(rows, &found.p)?;
    let estimates = free.iter().enumerate().map(|(j, i)| ParameterEstimate {
        name: signature.parameters[*i].name.to_string(),
        of: Direction::Parameter(*i),
        recording: None,
        value: found.p[*i],
        std: uncertainty.covariance(j, j).map(|variance| variance.sqrt() * prepared.sizes[j]),
        at_bound: bounds[j],
    });
    let qualities =
        rows.kinds.iter().zip(&tallies).zip(&found.sigma).map(|((kind, tally), sigma)| {
            RowQuality {
                of: kind.of,
                name: kind.name.clone(),
                samples: tally.samples,
                mean_squared_error: tally.errors / tally.samples as f64,
                r_squared: (tally.variation > 0.0).then(|| 1.0 - tally.errors / tally.variation),
                sigma: *sigma,
                multiplied_by: kind
                    .multiplier
                    .map(|j| signature.parameters[free[j]].name.to_string()),
            }
        });
    let estimates: Vec<ParameterEstimate> = estimates.collect();
    Ok(RegressionFit {
        method,
        estimates,
        linear: linear.to_vec(),
        unbounded: is_fixed.contains(&true).then_some(found.unbounded),
        rank: spectrum.rank,
        condition_number: spectrum.condition_number,
        undetermined: uncertainty.undetermined.clone(),
        rows: qualities.collect(),
        cost: triangle.zeta().norm_squared() + triangle.remainder(),
        samples: tallies.iter().map(|tally| tally.samples).sum(),
        left_out: rows.left_out(),
        iterations: found.iterations,
        evaluations: found.evaluations,
        is_stopped: false,
        is_converged: found.is_converged,
        is_flat: found.is_flat,
        sizes: prepared.sizes.clone(),
        p: found.p,
        uncertainty,
    })
}
