//! Projects recorded rows onto the algebraic equations.
//!
//! The dense output of a step is a polynomial in time that ignores 0 = f_a: if an algebraic unknown bends within a
//! step, it is off by far more than the tolerance, and so are its sensitivities. Recorded rows are therefore moved onto
//! the equations, with differential unknowns unchanged:
//!
//! ```text
//!   −∂f_a/∂y_a δ = f_a(t, y_d, y_a),  y_a ← y_a + δ      with one matrix for all rows of a step,
//! ```
//!
//! and likewise for the sensitivities. If that does not converge, because the row is on another branch, Newton's method
//! starts from the row itself.

use crate::algebraic::{AlgebraicPoint, AlgebraicSystem};
use crate::integrate::drive::{InputCursor, InstantInputs};
use crate::linalg::Factorisation;
use crate::linalg::norm::{Tolerances, larger};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern, Storage};

/// Permitted remaining error, in units of the tolerance; a correction of this size leaves less.
const LEFT: f64 = 1e-2;
/// Corrections that converge more slowly than this rate are left to Newton's method.
const SLOW: f64 = 0.3;
const MOST_CORRECTIONS: usize = 6;
/// Later rows of a step are further from the point of its matrix than the first, and their corrections shrink less by
/// up to this factor.
const FURTHER: f64 = 16.0;

/// Moves rows of a solution onto the algebraic equations.
pub(crate) struct Projection<S: SolvableSystem> {
    /// Used if that of the step does not suffice; otherwise work space.
    pub(crate) jacobian: S::Jacobian,
    f: S::Vector,
    /// The row before projection.
    kept: S::Vector,
    kept_s: Vec<f64>,
    /// Whether a matrix is factorised.
    is_factorised: bool,
    /// Convergence rate with it, from earlier rows of this step.
    rate: f64,
}

/// Data shared by all rows of a step.
pub(crate) struct StepRows<'a, S: SolvableSystem> {
    pub(crate) system: &'a S,
    pub(crate) p: &'a [f64],
    pub(crate) z: &'a [f64],
    pub(crate) sizes: &'a [f64],
    pub(crate) tolerances: Tolerances,
}

/// Corrections of one row with one matrix.
struct Corrections {
    previous: f64,
    rate: f64,
    left: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum ProjectionVerdict {
    Solved,
    GoOn,
    Fails,
}

impl Corrections {
    fn new(rate: f64) -> Self {
        Self { previous: f64::INFINITY, rate: SLOW.min(FURTHER * rate), left: MOST_CORRECTIONS }
    }

    /// Their convergence rate, if there was more than one.
    fn measured(&self) -> Option<f64> {
        (self.left + 1 < MOST_CORRECTIONS).then_some(self.rate)
    }

    /// Judges a correction of this size, in units of the tolerance, after it was applied.
    fn judge(&mut self, norm: f64) -> ProjectionVerdict {
        self.left -= 1;
        if self.previous.is_finite() {
            self.rate = norm / self.previous;
        } else if norm > 1.0 {
            // The rate of other rows is trusted if little depends on it.
            self.rate = SLOW;
        }
        let rate = self.rate;
        self.previous = norm;
        if norm <= LEFT || rate * norm <= LEFT * (1.0 - rate) {
            ProjectionVerdict::Solved
        } else if rate <= SLOW && norm.is_finite() && self.left > 0 {
            ProjectionVerdict::GoOn
        } else {
            // NaN compares false.
            ProjectionVerdict::Fails
        }
    }
}

/// Sensitivities at one time.
pub(crate) struct SensitivityRow<'a> {
    /// S, column by column.
    pub(crate) s: &'a mut [f64],
    /// Their sizes.
    pub(crate) sizes: &'a [f64],
    /// Work space of the same size.
    pub(crate) work: &'a mut [f64],
}

impl<S: SolvableSystem> Projection<S> {
    pub(crate) fn new(system: &S, n_s: usize) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        Self {
            jacobian: S::Jacobian::zeros(signature.jacobian.len()),
            f: S::Vector::zeros(n),
            kept: S::Vector::zeros(n),
            kept_s: vec![0.0; n * n_s],
            is_factorised: false,
            rate: SLOW,
        }
    }

    /// Begins rows close to the point of `jacobian`.
    pub(crate) fn begin(
        &mut self,
        algebraic: &mut AlgebraicSystem<S>,
        pattern: &Pattern,
        jacobian: &[f64],
        sizes: &[f64],
    ) {
        self.is_factorised = algebraic.factorise(pattern, jacobian, sizes).is_ok();
        self.rate = SLOW;
    }

    /// Begins a row with a matrix from a point that may be far away.
    pub(crate) fn begin_far_row(&mut self) {
        self.rate = SLOW;
    }

    /// Begins a row without a matrix.
    pub(crate) fn begin_anew(&mut self) {
        self.is_factorised = false;
    }

    /// Moves the algebraic unknowns of the row at `t` onto their equations; leaves them unchanged if that fails.
    pub(crate) fn project(
        &mut self,
        algebraic: &mut AlgebraicSystem<S>,
        rows: &StepRows<'_, S>,
        drive: &mut InputCursor<'_, S>,
        t: f64,
        y: &mut [f64],
    ) {
        self.kept.as_mut().copy_from_slice(y);
        if self.is_factorised && self.correct(algebraic, rows, drive, t, y) {
            return;
        }
        y.copy_from_slice(self.kept.as_ref());
        let StepRows { system, p, z, sizes, tolerances } = *rows;
        let point = AlgebraicPoint { t, u: InstantInputs { drive, t }, p, z };
        let jacobian = self.jacobian.as_mut();
        let solved = algebraic.solve_nearby(system, point, y, jacobian, sizes, tolerances).is_ok();
        // An iteration that finds zero residuals does not factorise.
        let pattern = &system.signature().jacobian;
        self.is_factorised = solved && algebraic.factorise(pattern, jacobian, sizes).is_ok();
        self.rate = SLOW;
        if !solved {
            y.copy_from_slice(self.kept.as_ref());
        }
    }

    /// Corrects with the factorised matrix. Returns whether that solves the equations.
    fn correct(
        &mut self,
        algebraic: &mut AlgebraicSystem<S>,
        rows: &StepRows<'_, S>,
        drive: &mut InputCursor<'_, S>,
        t: f64,
        y: &mut [f64],
    ) -> bool {
        let StepRows { system, p, z, sizes, tolerances } = *rows;
        let mut corrections = Corrections::new(self.rate);
        loop {
            let f = self.f.as_mut();
            system.rhs(EvaluationPoint { t, y, u: drive.evaluate(t, y), p, z }, f);
            algebraic.keep_algebraic(f);
            algebraic.factorisation.solve(f);
            let mut norm = 0.0;
            for (i, mass) in algebraic.mass.as_ref().iter().enumerate() {
                if *mass == 0.0 {
                    norm = larger(norm, f[i].abs() / tolerances.weight(y[i], sizes[i]));
                    y[i] += f[i];
                }
            }
            match corrections.judge(norm) {
                ProjectionVerdict::Solved => {
                    self.rate = corrections.measured().unwrap_or(self.rate);
                    return true;
                }
                ProjectionVerdict::GoOn => {}
                ProjectionVerdict::Fails => return false,
            }
        }
    }

    /// Moves the sensitivities of algebraic unknowns at (t, y), which [`Projection::project`] has moved.
    pub(crate) fn project_sensitivities(
        &mut self,
        algebraic: &mut AlgebraicSystem<S>,
        rows: &StepRows<'_, S>,
        drive: &mut InputCursor<'_, S>,
        t: f64,
        y: &[f64],
        mut row: SensitivityRow<'_>,
    ) {
        let StepRows { system, p, z, sizes, tolerances } = *rows;
        let (u, udot) = drive.with_slope(t, y);
        let point = EvaluationPoint { t, y, u, p, z };
        self.kept_s.copy_from_slice(row.s);
        if self.is_factorised
            && self.correct_sensitivities(algebraic, system, tolerances, point, &mut row)
        {
            return;
        }
        let SensitivityRow { s, work, .. } = row;
        s.copy_from_slice(&self.kept_s);
        // The equations are linear, with the matrix at this row.
        let jacobian = self.jacobian.as_mut();
        system.linearize(point, udot, self.f.as_mut(), jacobian, self.kept.as_mut());
        let pattern = &system.signature().jacobian;
        self.is_factorised = algebraic.factorise(pattern, jacobian, sizes).is_ok();
        if self.is_factorised {
            algebraic.make_sensitivities_consistent(system, point, s, work);
        }
        if !self.is_factorised || s.iter().any(|s| !s.is_finite()) {
            self.is_factorised = false;
            s.copy_from_slice(&self.kept_s);
        }
    }

    /// Corrects with the factorised matrix. Returns whether that solves their equations.
    fn correct_sensitivities(
        &mut self,
        algebraic: &mut AlgebraicSystem<S>,
        system: &S,
        tolerances: Tolerances,
        at: EvaluationPoint<'_>,
        row: &mut SensitivityRow<'_>,
    ) -> bool {
        let SensitivityRow { s, sizes, work } = row;
        let n = at.y.len();
        let mut corrections = Corrections::new(self.rate);
        loop {
            algebraic.correct_sensitivities(system, at, s, work);
            let mut norm = 0.0;
            let directions = work.chunks_exact(n).zip(s.chunks_exact(n)).zip(sizes.chunks_exact(n));
            for ((correction, s), sizes) in directions {
                for (i, mass) in algebraic.mass.as_ref().iter().enumerate() {
                    if *mass == 0.0 {
                        norm =
                            larger(norm, correction[i].abs() / tolerances.weight(s[i], sizes[i]));
                    }
                }
            }
            match corrections.judge(norm) {
                ProjectionVerdict::Solved => {
                    self.rate = corrections.measured().unwrap_or(self.rate);
                    return true;
                }
                ProjectionVerdict::GoOn => {}
                ProjectionVerdict::Fails => return false,
            }
        }
    }
}
