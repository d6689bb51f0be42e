//! Profiles of the estimates of a regression, as in [`crate::profiles`] for simulations.
//!
//! Weights and modes of the samples are those of the fit throughout.

use std::cell::{Cell, RefCell};

use crate::intervals::along::{HeldMinimum, ProfilePath, one_by_one};
use crate::intervals::profile::{FAR, Profile};
use crate::regression::error::RegressionError;
use crate::regression::finish::{RegressionFit, RegressionRound};
use crate::regression::prepare::PreparedRegression;
use crate::regression::rows::RegressionRows;
use crate::regression::{RegressionMethod, RegressionProblem, separable, structure};

/// The profiles of some estimates of a regression of this problem, in the order of `estimates`. If cancelled, returns
/// those that are complete ([`Profile::estimate`] identifies them).
///
/// # Errors
///
/// As [`regress`](super::regress).
///
/// # Panics
///
/// If the fit does not belong to the problem, or an estimate does not belong to the fit.
pub fn regression_profiles(
    problem: &RegressionProblem<'_>,
    fit: &RegressionFit,
    estimates: &[usize],
) -> Result<Vec<Profile>, RegressionError> {
    let method = match fit.method {
        RegressionMethod::NelderMead => RegressionMethod::VariableProjection,
        method => method,
    };
    let mut prepared = PreparedRegression::new(problem)?;
    assert_eq!(prepared.free.len(), fit.estimates.len(), "the fit is that of the problem");
    // The fit has determined which parameters are linear.
    prepared.clamp(method);
    let guess = std::mem::replace(&mut prepared.p, fit.p.clone());
    let known = prepared.known()?;
    let mut rows = prepared.rows(&known)?;
    structure::find_linear(problem.system, &mut rows, &guess);
    let least = sum(&prepared, &mut rows, &RegressionRound::from_fit(fit).sigma, &fit.p)?;
    let along =
        RegressionProfile { prepared: &prepared, rows: RefCell::new(rows), fit, method, least };
    Ok(one_by_one(estimates, problem.watch, |j| along.profile(j)))
}

/// A sum of squares, and its number of rows.
#[derive(Debug, Clone, Copy)]
struct SquareSum {
    rows: usize,
    cost: f64,
}

/// Σ_rows (residual/σ)² + Σ_priors ((wᵀp − mean) / std)².
fn sum(
    prepared: &PreparedRegression<'_>,
    rows: &mut RegressionRows<'_>,
    sigma: &[f64],
    p: &[f64],
) -> Result<SquareSum, RegressionError> {
    let mut sum = SquareSum { rows: 0, cost: 0.0 };
    rows.visit(p, &mut |row| {
        sum.rows += 1;
        sum.cost += (row.residual / sigma[row.kind]).powi(2);
    })?;
    for prior in &prepared.problem.priors {
        if prior.concerns(|i| prepared.free.contains(&i)) {
            let Some((mean, std)) = prior.as_normal() else {
                unreachable!("others are refused when rows are prepared")
            };
            sum.cost += ((prior.value(p) - mean) / std).powi(2);
        }
    }
    Ok(sum)
}

/// The profile along one estimate.
struct RegressionProfile<'a> {
    prepared: &'a PreparedRegression<'a>,
    rows: RefCell<RegressionRows<'a>>,
    fit: &'a RegressionFit,
    method: RegressionMethod,
    least: SquareSum,
}

impl RegressionProfile<'_> {
    /// Variables are estimates in units of their sizes.
    fn profile(&self, j: usize) -> Profile {
        let sizes = &self.fit.sizes;
        let centre = self.fit.estimates.iter().zip(sizes);
        let centre: Vec<f64> = centre.map(|(estimate, size)| estimate.value / size).collect();
        let (lower, upper) = self.prepared.bounds(self.method)[j];
        let evaluations = Cell::new(0);
        let way = ProfilePath {
            i: j,
            bounds: (lower / sizes[j], upper / sizes[j]),
            reach: FAR * centre[j].abs().max(1.0),
            centre,
            std: self.fit.estimates[j].std.map(|std| std / sizes[j]),
            place: &|held, from, _| self.place(j, held, from, &evaluations),
            is_stopped: &|| self.prepared.problem.watch.is_stopped(),
        };
        Profile::along(&way, |i, z| z * sizes[i], sizes, &evaluations)
    }

    /// The minimal sum of squares with the estimate fixed at a value; `None` if no minimum is found, or if samples lose
    /// the rows that they have at the fit.
    fn place(
        &self,
        j: usize,
        held: f64,
        from: &HeldMinimum,
        evaluations: &Cell<usize>,
    ) -> Option<HeldMinimum> {
        let Self { prepared, fit, .. } = self;
        let free = &prepared.free;
        let mut bounds = prepared.bounds(self.method);
        let value = held * fit.sizes[j];
        bounds[j] = (value, value);
        let mut start = RegressionRound::from_fit(fit);
        for ((i, z), size) in free.iter().zip(&from.z).zip(&fit.sizes) {
            start.p[*i] = z * size;
        }
        start.p[free[j]] = value;
        let mut rows = self.rows.borrow_mut();
        let searched =
            separable::solve(prepared, &mut rows, &fit.linear, &start, self.method, &bounds)
                .ok()?;
        evaluations.set(evaluations.get() + searched.evaluations);
        if !searched.is_converged {
            return None;
        }
        let sum = sum(prepared, &mut rows, &start.sigma, &searched.p).ok()?;
        if sum.rows != self.least.rows {
            return None;
        }
        let z = free.iter().zip(&fit.sizes).map(|(i, size)| searched.p[*i] / size);
        Some(HeldMinimum { z: z.collect(), deviance: sum.cost - self.least.cost })
    }
}
