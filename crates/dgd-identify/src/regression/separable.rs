//! Linear parameters inside, the others outside.
//!
//! ```text
//!   residuals:  r = Φ(α) c − z(α),  σ-weighted
//!   inner:      c(α) = argmin ‖r‖,  within the bounds of c
//!   outer:      minimise ‖r(α, c(α))‖²,  within the bounds of α
//!
//!   [Φ_free | ∂r/∂α | −r] = Q [R₁ R₁₂ ζ₁]
//!                             [    R₂  ζ₂]         J = R₂, of residuals −ζ₂
//!                             [        ρ ]
//! ```
//!
//! J is the component of ∂r/∂α outside of the span of Φ: Kaufman's Jacobian of the projected residuals. So a step only
//! needs one triangle of the rows. Linear parameters at a bound are not projected out.
//!
//! Golub, Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; Kaufman, BIT 15 (1975) 49.

use dgd_runtime::Direction;
use nalgebra::DVector;

use crate::minimise::nelder_mead::nelder_mead;
use crate::minimise::trust_region::{
    NormalEquations, Termination, VariableRegion, is_flat, minimise_watched,
};
use crate::progress::{Progress, Total};
use crate::regression::RegressionMethod;
use crate::regression::error::RegressionError;
use crate::regression::finish::RegressionRound;
use crate::regression::least_squares;
use crate::regression::least_squares::triangle::RowTriangle;
use crate::regression::prepare::PreparedRegression;
use crate::regression::rows::RegressionRows;
use crate::variables::{FitVariable, FitVariables};

/// A linear parameter that becomes smaller by this factor is solved for once more.
const CANCELLED: f64 = 100.0;
const MOST_PASSES: usize = 6;

/// The triangle of the weighted rows at p: derivatives with respect to `columns` of the free parameters, each times a
/// factor, and −r.
pub(crate) fn triangle(
    prepared: &PreparedRegression<'_>,
    rows: &mut RegressionRows<'_>,
    sigma: &[f64],
    p: &[f64],
    columns: &[(usize, f64)],
) -> Result<RowTriangle, RegressionError> {
    let mut triangle = RowTriangle::new(columns.len());
    let mut phi = vec![0.0; columns.len()];
    rows.visit(p, &mut |row| {
        for (phi, (j, factor)) in phi.iter_mut().zip(columns) {
            *phi = row.slopes[*j] * factor;
        }
        triangle.push(&phi, -row.residual, 1.0 / sigma[row.kind]);
    })?;
    for prior in &prepared.problem.priors {
        if !prior.concerns(|i| prepared.free.contains(&i)) {
            continue;
        }
        for (phi, (j, factor)) in phi.iter_mut().zip(columns) {
            *phi = prior.weight(prepared.free[*j]) * factor;
        }
        let Some((mean, std)) = prior.as_normal() else {
            unreachable!("others are refused when rows are prepared")
        };
        triangle.push(&phi, mean - prior.value(p), 1.0 / std);
    }
    triangle.reduce();
    Ok(triangle)
}

/// Solves with given weights, from the end of the last round, within bounds of the free parameters.
pub(crate) fn solve(
    prepared: &PreparedRegression<'_>,
    rows: &mut RegressionRows<'_>,
    linear: &[bool],
    last: &RegressionRound,
    method: RegressionMethod,
    bounds: &[(f64, f64)],
) -> Result<RegressionRound, RegressionError> {
    let inner = LinearSubproblem {
        prepared,
        columns: (0..linear.len()).filter(|j| linear[*j]).collect(),
        sigma: &last.sigma,
        bounds,
    };
    let outer = NonlinearParameters::new(prepared, linear)?;
    let (mut p, mut evaluations) = (last.p.clone(), last.evaluations);
    let (mut iterations, mut is_converged, mut is_flat) = (last.iterations, true, false);
    if outer.variables.len() > 0 {
        let z = outer.variables_at(&p);
        let bounds = outer.bounds(bounds);
        let z = if method == RegressionMethod::NelderMead {
            let rule = prepared.problem.simplex;
            let watch = prepared.problem.watch;
            let simplex = nelder_mead(&z, &bounds, &rule, watch, |z| {
                let mut trial = outer.parameters(&p, z);
                inner.solve(rows, &mut trial).ok()
            });
            evaluations += simplex.evaluations;
            is_flat =
                simplex.is_converged && outer.is_flat(rows, &inner, &p, &z, &simplex.x, &bounds)?;
            is_converged = simplex.is_converged && !is_flat;
            simplex.x
        } else {
            let searched = outer.search(rows, &inner, &p, z, &bounds)?;
            evaluations += searched.evaluations;
            iterations += searched.iterations;
            (is_converged, is_flat) = (searched.is_converged, searched.is_flat);
            searched.x
        };
        p = outer.parameters(&p, &z);
    }
    let unbounded = inner.unbounded(rows, &p)?;
    inner.solve(rows, &mut p)?;
    let searched = SeparableEnd {
        x: Vec::new(),
        evaluations: evaluations + 1,
        iterations,
        is_converged,
        is_flat,
    };
    RegressionRound::new(prepared, rows, last, p, unbounded, bounds, &searched)
}

/// Least squares in the linear parameters.
struct LinearSubproblem<'a> {
    prepared: &'a PreparedRegression<'a>,
    /// Positions of the linear ones among the free parameters.
    columns: Vec<usize>,
    sigma: &'a [f64],
    /// Bounds of the free parameters.
    bounds: &'a [(f64, f64)],
}

impl LinearSubproblem<'_> {
    fn triangle(
        &self,
        rows: &mut RegressionRows<'_>,
        p: &[f64],
    ) -> Result<RowTriangle, RegressionError> {
        let columns: Vec<(usize, f64)> = self.columns.iter().map(|j| (*j, 1.0)).collect();
        triangle(self.prepared, rows, self.sigma, p, &columns)
    }

    /// Sets the linear parameters to their best values; returns the sum of squares.
    ///
    /// Starting from values that are much larger than the best ones it is repeated because the difference has lost
    /// digits.
    fn solve(&self, rows: &mut RegressionRows<'_>, p: &mut [f64]) -> Result<f64, RegressionError> {
        for _ in 1..MOST_PASSES {
            let before = p.to_vec();
            let squares = self.correct(rows, p)?;
            let has_cancelled = |j: &usize| {
                let i = self.prepared.free[*j];
                before[i].abs() > CANCELLED * p[i].abs()
            };
            if !self.columns.iter().any(has_cancelled) {
                return Ok(squares);
            }
        }
        self.correct(rows, p)
    }

    /// One pass of [`Self::solve`].
    fn correct(
        &self,
        rows: &mut RegressionRows<'_>,
        p: &mut [f64],
    ) -> Result<f64, RegressionError> {
        let triangle = self.triangle(rows, p)?;
        let (r, zeta) = (triangle.r(), triangle.zeta());
        let parameter = |j: usize| self.prepared.free[self.columns[j]];
        let bounds = |j: usize| self.bounds[self.columns[j]];
        let n = self.columns.len();
        let lower = DVector::from_fn(n, |j, _| bounds(j).0 - p[parameter(j)]);
        let upper = DVector::from_fn(n, |j, _| bounds(j).1 - p[parameter(j)]);
        let delta = least_squares::solve_bounded(&r, &zeta, &lower, &upper);
        for j in 0..n {
            // Snaps to the bound in spite of rounding errors.
            p[parameter(j)] = if delta[j] <= lower[j] {
                bounds(j).0
            } else if delta[j] >= upper[j] {
                bounds(j).1
            } else {
                p[parameter(j)] + delta[j]
            };
        }
        Ok((r * delta - zeta).norm_squared() + triangle.remainder())
    }

    /// The linear parameters without bounds.
    fn unbounded(
        &self,
        rows: &mut RegressionRows<'_>,
        p: &[f64],
    ) -> Result<Vec<f64>, RegressionError> {
        let triangle = self.triangle(rows, p)?;
        let delta = least_squares::solve(&triangle.r(), &triangle.zeta());
        let mut unbounded = p.to_vec();
        for (j, delta) in self.columns.iter().zip(delta.iter()) {
            unbounded[self.prepared.free[*j]] += delta;
        }
        Ok(unbounded)
    }

    fn is_held(&self, j: usize, p: &[f64]) -> bool {
        let (value, (lower, upper)) = (p[self.prepared.free[j]], self.bounds[j]);
        value <= lower || value >= upper
    }
}

/// The end of a search.
pub(super) struct SeparableEnd {
    x: Vec<f64>,
    pub evaluations: usize,
    pub iterations: usize,
    /// Whether it ended in a minimum.
    pub is_converged: bool,
    /// Whether it ended on a plateau.
    pub is_flat: bool,
}

impl SeparableEnd {
    /// The end of a search without variables, after this many evaluations.
    pub(super) fn without_variables(evaluations: usize) -> Self {
        Self { x: Vec::new(), evaluations, iterations: 0, is_converged: true, is_flat: false }
    }
}

/// The parameters that do not enter linearly.
struct NonlinearParameters<'a> {
    prepared: &'a PreparedRegression<'a>,
    variables: FitVariables,
    /// Their positions among the free parameters, in the order of the variables.
    positions: Vec<usize>,
}

impl<'a> NonlinearParameters<'a> {
    fn new(prepared: &'a PreparedRegression<'a>, linear: &[bool]) -> Result<Self, RegressionError> {
        let system = prepared.problem.system;
        let position = |i: usize| prepared.free.iter().position(|free| *free == i);
        let is_outer = |direction: &Direction| match direction {
            Direction::Parameter(i) => position(*i).is_some_and(|j| !linear[j]),
            Direction::Start(_) => false,
        };
        let free: Vec<bool> = system.signature().directions.iter().map(is_outer).collect();
        let (variables, _) = FitVariables::new(system, &prepared.p, &[], &free)
            .map_err(RegressionError::Variables)?;
        let positions = variables
            .all
            .iter()
            .filter_map(|variable| match variable.of {
                Direction::Parameter(i) => position(i),
                Direction::Start(_) => None,
            })
            .collect();
        Ok(Self { prepared, variables, positions })
    }

    fn variables_at(&self, p: &[f64]) -> Vec<f64> {
        let value = |(variable, j): (&FitVariable, &usize)| {
            let (low, high) = variable.bounds();
            variable.variable(p[self.prepared.free[*j]]).clamp(low, high)
        };
        self.variables.all.iter().zip(&self.positions).map(value).collect()
    }

    /// Bounds of the variables; one may be fixed.
    fn bounds(&self, bounds: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let bounds_of = |(variable, j): (&FitVariable, &usize)| match bounds[*j] {
            (low, high) if low == high => (variable.variable(low), variable.variable(high)),
            _ => variable.bounds(),
        };
        self.variables.all.iter().zip(&self.positions).map(bounds_of).collect()
    }

    fn parameters(&self, p: &[f64], z: &[f64]) -> Vec<f64> {
        self.variables.parameters(p, z)
    }

    /// Gauss–Newton steps within a trust region on the projected problem. If no step, however small, helps, it restarts
    /// because its scales still contain steep regions that it has passed.
    fn search(
        &self,
        rows: &mut RegressionRows<'_>,
        inner: &LinearSubproblem<'_>,
        p: &[f64],
        mut z: Vec<f64>,
        bounds: &[(f64, f64)],
    ) -> Result<SeparableEnd, RegressionError> {
        let mut rule = self.prepared.problem.stopping;
        // Linear parameters are solved for: if the others change by more than their sizes in one step, a linear model
        // is useless.
        let largest = self.variables.reach().into_iter().zip(&z);
        let reach: Vec<f64> = largest.map(|(reach, z)| reach.min(z.abs().max(1.0))).collect();
        let region = VariableRegion { bounds, reach: &reach, leading: reach.len() };
        let mut near = p.to_vec();
        let mut projected = self.project(rows, inner, &mut near, &z)?;
        let (mut evaluations, mut iterations) = (1, 0);
        loop {
            let watch = self.prepared.problem.watch;
            let mut done = evaluations;
            let minimum = minimise_watched(z, projected, region, &rule, watch, |z| {
                done += 1;
                let limit = Total::AtMost(self.prepared.problem.stopping.evaluations);
                watch.advanced(Progress { what: "evaluations", done, of: limit });
                self.project(rows, inner, &mut near, z)
            });
            evaluations += minimum.evaluations;
            iterations += minimum.iterations;
            rule.evaluations = rule.evaluations.saturating_sub(minimum.evaluations);
            if minimum.termination == Termination::Stalled && minimum.iterations > 0 {
                (z, projected) = (minimum.x, minimum.at);
                continue;
            }
            let is_converged = minimum.termination.is_converged();
            let is_flat = minimum.termination == Termination::Flat;
            return Ok(SeparableEnd {
                x: minimum.x,
                evaluations,
                iterations,
                is_converged,
                is_flat,
            });
        }
    }

    /// Whether a search without derivatives went from one point to another on a plateau.
    fn is_flat(
        &self,
        rows: &mut RegressionRows<'_>,
        inner: &LinearSubproblem<'_>,
        p: &[f64],
        first: &[f64],
        last: &[f64],
        bounds: &[(f64, f64)],
    ) -> Result<bool, RegressionError> {
        let reach = self.variables.reach();
        let region = VariableRegion { bounds, reach: &reach, leading: reach.len() };
        let normal = self.project(rows, inner, &mut p.to_vec(), last)?;
        Ok(is_flat(&normal, self.prepared.problem.stopping.flat, region, last, first))
    }

    /// The projected problem at z. Linear parameters are solved for, starting from those of the previous problem.
    fn project(
        &self,
        rows: &mut RegressionRows<'_>,
        inner: &LinearSubproblem<'_>,
        near: &mut Vec<f64>,
        z: &[f64],
    ) -> Result<NormalEquations, RegressionError> {
        let mut p = self.parameters(near, z);
        inner.solve(rows, &mut p)?;
        let unheld = inner.columns.iter().filter(|j| !inner.is_held(**j, &p));
        let mut columns: Vec<(usize, f64)> = unheld.map(|j| (*j, 1.0)).collect();
        let projected = columns.len();
        let slopes = self.variables.all.iter().zip(z).map(|(variable, z)| variable.slope(*z));
        columns.extend(self.positions.iter().copied().zip(slopes));
        let triangle = triangle(inner.prepared, rows, inner.sigma, &p, &columns)?;
        *near = p;
        let n = self.positions.len();
        let j = triangle.r().view((projected, projected), (n, n)).into_owned();
        let zeta = triangle.zeta().rows(projected, n).into_owned();
        Ok(NormalEquations {
            cost: zeta.norm_squared() + triangle.remainder(),
            logarithms: 0.0,
            gradient: -(j.transpose() * zeta),
            information: j.transpose() * j,
            is_whole: true,
        })
    }
}
