//! Solves the equations of an implicit stage or step, for y and then for S.
//!
//! ```text
//!   0 = f(t, Y) − c M (Y − Ȳ),      W Δ = f − c M (Y − Ȳ),   Y ← Y + Δ,   W = c M − J
//!   0 = g(t, Y, S) − c M (S − S̄)    with the same W, once Y is known
//! ```
//!
//! Ȳ collects the known terms. W was computed at another point, so corrections fall by about the same factor ρ each
//! time, and the remaining error is ρ/(1 − ρ) of the last one. The equations for S are linear, with the matrix at this
//! point: if iteration with an older W does not converge, one with the current W takes a single step.
//!
//! Equations that are satisfied to the rounding of their terms count as solved, even if corrections exceed the
//! tolerance: the residual of 0 = 1 − y₁ − y₂ − y₃ has the rounding error of one, whatever the size of y₃.
//!
//! # Source
//!
//! Hairer and Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), §IV.8. Sensitivities
//! after the unknowns: Caracotsios and Stewart, Computers & Chemical Engineering 9 (1985) 359–365.

use crate::algebraic::{self, add_terms};
use crate::integrate::drive::InputCursor;
use crate::integrate::methods::non_finite::NonFinite;
use crate::integrate::methods::stepper::{SensitivityWorkspace, StepFailure, StepTrial, Stepper};
use crate::linalg::norm::Tolerances;
use crate::linalg::norm::largest_block;
use crate::linalg::{Factorisation, KeptSum, Singular};
use crate::solution::Statistics;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern};

/// Maximum number of iterations for linear equations, with a matrix that may be from an earlier step.
const MOST_LINEAR_ITERATIONS: i32 = 10;

/// Largest remaining error, in units of the tolerance, and largest error by rounding: corrections that are smaller than
/// this and do not shrink are rounding of the equations.
const MOST_LEFT: f64 = 0.03;
const ROUNDING: f64 = 0.03;
/// Fastest convergence rate assumed at first.
const LEAST_EXPECTED: f64 = 0.1;

/// Monitors the corrections of one iteration.
struct Convergence {
    /// Permitted remaining error, in units of the tolerance.
    target: f64,
    previous: f64,
    left: i32,
    /// ρ/(1 − ρ)
    eta: f64,
}

/// Verdict on a correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CorrectionVerdict {
    Converged,
    GoOn,
    Diverges,
}

impl Convergence {
    /// `eta` is that of the previous iteration with a similar matrix.
    fn new(tolerances: Tolerances, eta: f64, most: i32) -> Self {
        let rounding = f64::EPSILON / tolerances.rtol;
        Self {
            target: tolerances.rtol.sqrt().min(MOST_LEFT).max(10.0 * rounding),
            previous: f64::INFINITY,
            left: most,
            eta: eta.powf(0.8).max(LEAST_EXPECTED),
        }
    }

    /// Judges a correction of this size, in units of the tolerance.
    fn judge(&mut self, norm: f64) -> CorrectionVerdict {
        self.left -= 1;
        let mut shrinks = true;
        if self.previous.is_finite() {
            let rate = norm / self.previous;
            self.eta = if rate < 1.0 { rate / (1.0 - rate) } else { f64::INFINITY };
            // The error that would remain after the iterations left
            shrinks = rate.powi(self.left) * self.eta * norm <= self.target;
        }
        self.previous = norm;
        if norm == 0.0 || self.eta * norm <= self.target {
            CorrectionVerdict::Converged
        } else if norm.is_finite() && shrinks && self.left > 0 {
            CorrectionVerdict::GoOn
        } else if norm <= ROUNDING {
            CorrectionVerdict::Converged
        } else {
            CorrectionVerdict::Diverges
        }
    }
}

impl<S: SolvableSystem> Stepper<S> {
    /// Factorises W = c M − J with J as it is.
    pub(in crate::integrate) fn factorise_iteration(
        &mut self,
        trial: &StepTrial<'_, S>,
        c: f64,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        let mass = trial.base.mass.as_ref();
        let pattern = &trial.base.system.signature().jacobian;
        statistics.factorisations += 1;
        let factorised = self.factorise_step(c, |i| mass[i] != 0.0, pattern, trial.sizes);
        let jacobian = self.jacobian.as_ref();
        factorised.map_err(|singular| failed(singular, trial.base.t, pattern, jacobian))
    }

    /// Computes J at (t, y_new), if f is finite there.
    pub(in crate::integrate) fn renew_jacobian(
        &mut self,
        trial: &StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        t: f64,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        let (u, udot) = drive.with_slope(t, self.y_new.as_ref());
        let point =
            EvaluationPoint { t, y: self.y_new.as_ref(), u, p: trial.base.p, z: trial.base.z };
        let (f, jacobian, dfdt) = (self.f.as_mut(), self.jacobian.as_mut(), self.dfdt.as_mut());
        trial.base.system.linearize(point, udot, f, jacobian, dfdt);
        statistics.linearizations += 1;
        self.moved = true;
        match f.iter().position(|f| !f.is_finite()) {
            None => Ok(()),
            Some(row) => Err(StepFailure::NotFinite { t, what: NonFinite::Equation(row) }),
        }
    }

    /// Solves for Y in `y_new`, which holds a guess, with Ȳ in `stage`, in at most `most` iterations.
    pub(in crate::integrate) fn solve_unknowns(
        &mut self,
        trial: &StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        t: f64,
        c: f64,
        most: i32,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        let StepTrial { base, y, sizes, tolerances, .. } = *trial;
        let y = y.as_ref();
        let mut convergence = Convergence::new(tolerances, self.eta, most);
        loop {
            let point = EvaluationPoint {
                t,
                y: self.y_new.as_ref(),
                u: drive.evaluate(t, self.y_new.as_ref()),
                p: base.p,
                z: base.z,
            };
            let r = self.rhs.as_mut();
            base.system.rhs(point, r);
            statistics.evaluations += 1;
            if let Some(row) = r.iter().position(|r| !r.is_finite()) {
                return Err(StepFailure::NotFinite { t, what: NonFinite::Equation(row) });
            }
            subtract(r, c, base.mass.as_ref(), self.y_new.as_ref(), self.stage.as_ref());
            if S::FEATURES.conserved && self.keeps_sums {
                keep_sums(&self.sums, r, c, self.y_new.as_ref(), self.stage.as_ref());
            }
            self.factorisation.solve(r);
            let norm = tolerances.mean_square(r, y, self.y_new.as_ref(), sizes).sqrt();
            let progress = convergence.judge(norm);
            if progress == CorrectionVerdict::Diverges {
                let relative = |i: usize| r[i].abs() / tolerances.weight(y[i], sizes[i]);
                let unknown =
                    (0..y.len()).max_by(|&i, &j| relative(i).total_cmp(&relative(j))).unwrap_or(0);
                if self.is_solved(trial, drive, t, c, statistics) {
                    return Ok(());
                }
                return Err(StepFailure::NotConverged { unknown });
            }
            for (y_new, r) in self.y_new.as_mut().iter_mut().zip(r) {
                *y_new += *r;
            }
            if progress == CorrectionVerdict::Converged {
                self.eta = convergence.eta;
                return Ok(());
            }
        }
    }

    /// Whether the residual of each equation at `y_new` is rounding of its terms. Overwrites `rhs`, and `error`, which
    /// is not in use yet.
    #[cold]
    fn is_solved(
        &mut self,
        trial: &StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        t: f64,
        c: f64,
        statistics: &mut Statistics,
    ) -> bool {
        let StepTrial { base, .. } = *trial;
        let (y, known, mass) = (self.y_new.as_ref(), self.stage.as_ref(), base.mass.as_ref());
        let (left, terms) = (self.rhs.as_mut(), self.error.as_mut());
        base.system
            .rhs(EvaluationPoint { t, y, u: drive.evaluate(t, y), p: base.p, z: base.z }, left);
        statistics.evaluations += 1;
        subtract(left, c, mass, y, known);
        for (((terms, mass), y), known) in terms.iter_mut().zip(mass).zip(y).zip(known) {
            *terms = mass * c * (y.abs() + known.abs());
        }
        add_terms(terms, &base.system.signature().jacobian, self.jacobian.as_ref(), y);
        left.iter().zip(terms).all(|(left, terms)| left.abs() <= algebraic::ROUNDING * *terms)
    }

    /// Solves for S in `s_new`, which holds a guess, with S̄ in `stage` and Y in `y_new`.
    pub(in crate::integrate) fn solve_sensitivities(
        &mut self,
        trial: &StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        t: f64,
        c: f64,
        d: &mut SensitivityWorkspace<S>,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        let mut outcome = self.iterate_sensitivities(trial, drive, t, c, d, statistics);
        if let Err(StepFailure::NotConverged { .. }) = outcome {
            self.renew_jacobian(trial, drive, t, statistics)?;
            self.factorise_iteration(trial, c, statistics)?;
            outcome = self.iterate_sensitivities(trial, drive, t, c, d, statistics);
        }
        outcome
    }

    fn iterate_sensitivities(
        &mut self,
        trial: &StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        t: f64,
        c: f64,
        d: &mut SensitivityWorkspace<S>,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        let StepTrial { base, tolerances, y, .. } = *trial;
        let y = y.as_ref();
        let n = y.len().max(1);
        let mut convergence = Convergence::new(tolerances, 1.0, MOST_LINEAR_ITERATIONS);
        loop {
            let point = EvaluationPoint {
                t,
                y: self.y_new.as_ref(),
                u: drive.evaluate(t, self.y_new.as_ref()),
                p: base.p,
                z: base.z,
            };
            let r = d.rhs.as_mut();
            base.system.sensitivity_rhs(point, d.s_new.as_ref(), self.rhs.as_mut(), r);
            statistics.evaluations += 1;
            if let Some(row) = r.iter().position(|r| !r.is_finite()) {
                return Err(StepFailure::NotFinite { t, what: NonFinite::Derivative(row % n) });
            }
            let columns = r.chunks_exact_mut(n).zip(d.s_new.as_ref().chunks_exact(n));
            for ((r, s), known) in columns.zip(d.stage.as_ref().chunks_exact(n)) {
                subtract(r, c, base.mass.as_ref(), s, known);
                if S::FEATURES.conserved && self.keeps_sums {
                    keep_sums(&self.sums, r, c, s, known);
                }
            }
            self.factorisation.solve(r);
            let (s, s_new) = (d.s.as_ref(), d.s_new.as_ref());
            let norm = largest_block(tolerances, n, r, s, s_new, d.sizes.as_ref()).sqrt();
            let progress = convergence.judge(norm);
            if progress == CorrectionVerdict::Diverges {
                let sizes = d.sizes.as_ref();
                let relative = |i: usize| r[i].abs() / tolerances.weight(s[i], sizes[i]);
                let worst = (0..r.len()).max_by(|&i, &j| relative(i).total_cmp(&relative(j)));
                return Err(StepFailure::NotConverged { unknown: worst.unwrap_or(0) % n });
            }
            for (s_new, r) in d.s_new.as_mut().iter_mut().zip(r) {
                *s_new += *r;
            }
            if progress == CorrectionVerdict::Converged {
                return Ok(());
            }
        }
    }
}

/// Why a matrix with this Jacobian at `t` could not be factorised: it is singular if its entries are finite.
#[cold]
pub(in crate::integrate) fn failed(
    singular: Singular,
    t: f64,
    pattern: &Pattern,
    jacobian: &[f64],
) -> StepFailure {
    match jacobian.iter().position(|j| !j.is_finite()) {
        None => singular.into(),
        Some(k) => StepFailure::NotFinite { t, what: NonFinite::Derivative(pattern.position(k).0) },
    }
}

/// The residuals of conserved sums, in which f cancels: −c Σ cₖ (Yₖ − Ȳₖ).
fn keep_sums(sums: &[KeptSum], r: &mut [f64], c: f64, y: &[f64], known: &[f64]) {
    for sum in sums {
        let terms = sum.shares.iter().zip(y.iter().zip(known));
        r[sum.row] = -c * terms.map(|(share, (y, known))| share * (y - known)).sum::<f64>();
    }
}

/// r ← r − c M (Y − Ȳ).
fn subtract(r: &mut [f64], c: f64, mass: &[f64], y: &[f64], known: &[f64]) {
    for (((r, mass), y), known) in r.iter_mut().zip(mass).zip(y).zip(known) {
        if *mass != 0.0 {
            *r -= c * (y - known);
        }
    }
}
