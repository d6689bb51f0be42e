//! One step along the Taylor series of the solution, for the unknowns alone or with their
//! sensitivities.
//!
//! The coefficients at (t, y) are computed once, for a step h₀ about as long as the one to be tried, and serve any step
//! size:
//!
//! ```text
//!   y(t + h) = Σₖ yₖ θᵏ,   θ = h/h₀,   k = 0 … p
//! ```
//!
//! between step ends as well. The local error is estimated from the last two terms: the last one is the error of the
//! series without it, but may vanish if the series is even or odd.
//!
//! The order that needs least work for a tolerance ε is
//!
//! ```text
//!   p = 1 − ln(ε)/2
//! ```
//!
//! since terms then shrink by e² from one to the next, and the work of a step grows like p².
//!
//! # Source
//!
//! Jorba and Zou, A software package for the numerical integration of ODEs by means of high-order
//! Taylor methods, Experimental Mathematics 14 (2005) 99–117, §3.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use crate::codegen::taylor::{MOST_ORDER, SeriesTerms};
use crate::error::IntegrateError;
use crate::integrate::controller::ControlLaw;
use crate::integrate::drive::InputCursor;
use crate::integrate::enclosure::PolynomialCoefficients;
use crate::integrate::methods::family::{
    EndEquations, FamilyMemory, FamilyNeeds, FamilyTraits, MethodFamily,
};
use crate::integrate::methods::non_finite::NonFinite;
use crate::integrate::methods::stepper::{
    SensitivityWorkspace, StepBase, StepFailure, StepTrial, Stepper,
};
use crate::linalg::norm::larger;
use crate::problem::Problem;
use crate::solution::Statistics;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Interpolation};

/// The lowest order used for a tolerance.
pub(crate) const LEAST_ORDER: usize = 2;
/// Weight of the last term but one in the error: if terms shrink by e², its share is about as large as the last term.
const BUT_ONE: f64 = 0.1;

/// The requested order, or the one for a relative tolerance.
pub(crate) fn order(asked: Option<usize>, rtol: f64) -> usize {
    // A tolerance is positive; above 1 it requires no accuracy.
    let order = asked.unwrap_or_else(|| (1.0 - 0.5 * rtol.ln()).ceil().max(0.0) as usize);
    order.clamp(LEAST_ORDER, MOST_ORDER)
}

/// Series of a solution, and the work space to compute them.
#[derive(Debug, Default)]
pub(crate) struct TaylorExpansion {
    order: usize,
    /// h₀.
    h: f64,
    has_branches: bool,
    kept: Vec<SeriesTerms>,
    /// yₖ, order by order.
    y: Vec<f64>,
    /// Sₖ, order by order, row by row.
    s: Vec<f64>,
    /// A sum of S, row by row.
    rows: Vec<f64>,
}

/// A quantity of the unknowns, and of their sensitivities if these are wanted.
pub(in crate::integrate) struct YAndS<'a> {
    pub(in crate::integrate) y: &'a mut [f64],
    pub(in crate::integrate) s: &'a mut [f64],
}

impl TaylorExpansion {
    /// Work space for a system that has series, and for n_s directions.
    pub(crate) fn new<S: SolvableSystem>(system: &S, order: usize, n_s: usize) -> Self {
        let Ok(kept) = system.taylor_series() else { return Self::default() };
        let n = system.signature().unknowns.len();
        Self {
            order,
            h: 1.0,
            has_branches: kept.has_branches,
            kept: vec![[0.0; MOST_ORDER + 1]; kept.unknowns.max(kept.sensitivities)],
            y: vec![0.0; (order + 1) * n],
            s: vec![0.0; (order + 1) * n * n_s],
            rows: vec![0.0; n * n_s],
        }
    }

    /// Adds to errors at h₀θ the difference between the slopes there, g, and those of the series: the series does not
    /// follow a solution that has left its branch.
    fn add_defect(
        &self,
        series: &[f64],
        theta: f64,
        slopes: impl Fn(usize) -> f64,
        error: &mut [f64],
    ) {
        let len = error.len();
        for (i, error) in error.iter_mut().enumerate() {
            let (mut power, mut slope) = (theta, 0.0);
            for k in 1..=self.order {
                slope += k as f64 * power * series[k * len + i];
                power *= theta;
            }
            *error = larger(*error, (self.h * theta * slopes(i) - slope).abs());
        }
    }

    /// Adds the defects of y⁺ and S⁺, at the end of a step by h₀θ, to their errors.
    pub(in crate::integrate) fn add_defects<S: SolvableSystem>(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        theta: f64,
        s: &[f64],
        slopes: YAndS<'_>,
        errors: YAndS<'_>,
    ) {
        let (YAndS { y: f, s: g }, YAndS { y: error, s: error_of_s }) = (slopes, errors);
        if !self.has_branches {
            return;
        }
        if s.is_empty() {
            system.rhs(at, f);
        } else {
            system.sensitivity_rhs(at, s, f, g);
            let n = f.len();
            let n_s = s.len() / n.max(1);
            let mut rows = std::mem::take(&mut self.rows);
            transpose(error_of_s, n, &mut rows, n_s);
            self.add_defect(&self.s, theta, |at| g[at % n_s * n + at / n_s], &mut rows);
            transpose(&rows, n_s, error_of_s, n);
            self.rows = rows;
        }
        self.add_defect(&self.y, theta, |i| f[i], error);
    }

    /// The order of the series.
    pub(in crate::integrate) fn order(&self) -> usize {
        self.order
    }

    /// Computes the series at a point, for steps of about the size h; S is that at the start, or empty if it is not
    /// wanted.
    #[inline(always)]
    pub(in crate::integrate) fn compute<S: SolvableSystem>(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        h: f64,
        given: &[f64],
    ) {
        let Self { order, h: own, kept, y, s, .. } = self;
        *own = h;
        if given.is_empty() {
            system.taylor(at, udot, h, *order, kept, y);
            return;
        }
        let n = at.y.len();
        let n_s = given.len() / n.max(1);
        transpose(given, n, &mut s[..given.len()], n_s);
        system.sensitivity_taylor(at, udot, h, *order, kept, y, s);
    }

    /// y at h₀θ, from its series.
    #[inline(always)]
    pub(in crate::integrate) fn sum(&self, theta: f64, y: &[f64], out: &mut [f64]) {
        add_terms(&self.y, self.order, theta, out);
        // The increment is small relative to y: only this sum rounds.
        for (out, y) in out.iter_mut().zip(y) {
            *out += y;
        }
    }

    /// S at h₀θ.
    #[inline(always)]
    pub(in crate::integrate) fn sum_sensitivities(
        &mut self,
        theta: f64,
        s: &[f64],
        n: usize,
        out: &mut [f64],
    ) {
        let rows = &mut self.rows[..out.len()];
        add_terms(&self.s, self.order, theta, rows);
        transpose(rows, s.len() / n.max(1), out, n);
        for (out, s) in out.iter_mut().zip(s) {
            *out += s;
        }
    }

    /// Error of y at h₀θ.
    #[inline(always)]
    pub(in crate::integrate) fn error(&self, theta: f64, error: &mut [f64]) {
        last_terms(&self.y, self.order, theta, error);
    }

    /// Error of S at h₀θ.
    #[inline(always)]
    pub(in crate::integrate) fn sensitivity_error(
        &mut self,
        theta: f64,
        n: usize,
        error: &mut [f64],
    ) {
        let rows = &mut self.rows[..error.len()];
        last_terms(&self.s, self.order, theta, rows);
        transpose(rows, error.len() / n.max(1), error, n);
    }
}

/// The terms of series except those of order 0.
#[inline(always)]
fn add_terms(series: &[f64], order: usize, theta: f64, out: &mut [f64]) {
    let len = out.len();
    out.fill(0.0);
    let terms = series[len..(order + 1) * len].chunks_exact(len.max(1));
    // The step size of the series: the same without factors of 1.
    if theta == 1.0 {
        for row in terms {
            for (out, term) in out.iter_mut().zip(row) {
                *out += term;
            }
        }
        return;
    }
    let mut power = 1.0;
    for row in terms {
        power *= theta;
        for (out, term) in out.iter_mut().zip(row) {
            *out += power * term;
        }
    }
}

/// The larger of the last two terms of series, the last but one weighted.
#[inline(always)]
fn last_terms(series: &[f64], order: usize, theta: f64, error: &mut [f64]) {
    let len = error.len();
    let mut before = 1.0;
    for _ in 1..order {
        before *= theta;
    }
    let last = series[order * len..].iter().zip(&series[(order - 1) * len..]);
    for (error, (last, but_one)) in error.iter_mut().zip(last) {
        *error = larger((theta * before * last).abs(), (BUT_ONE * before * but_one).abs());
    }
}

/// Transposes `m` columns of n numbers to n columns of `m`.
#[inline(always)]
fn transpose(from: &[f64], n: usize, to: &mut [f64], m: usize) {
    for j in 0..m {
        for i in 0..n {
            to[i * m + j] = from[j * n + i];
        }
    }
}

/// Taylor series, of this order or, if `None`, of the one that suits the tolerance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TaylorMethod {
    pub(crate) order: Option<usize>,
}

impl MethodFamily for TaylorMethod {
    const TRAITS: FamilyTraits = FamilyTraits {
        needs: FamilyNeeds::Series,
        remembers: FamilyMemory::Nothing,
        solves: EndEquations::Nothing,
    };
    const LAW: ControlLaw = ControlLaw::Predictive;

    fn estimate_order(self, rtol: f64) -> u32 {
        order(self.order, rtol) as u32 - 1
    }

    fn verify<S: SolvableSystem>(
        self,
        problem: &Problem<'_, S>,
        name: &'static str,
    ) -> Result<(), IntegrateError> {
        verify(problem, name)
    }

    fn lay_out<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        system: &S,
        rtol: f64,
        n_s: usize,
    ) {
        stepper.expansion = TaylorExpansion::new(system, order(self.order, rtol), n_s);
    }

    #[inline]
    fn attempt<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
        _statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        stepper.attempt_taylor(trial, drive, directions);
        Ok(())
    }

    fn non_finite<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        trial: StepTrial<'_, S>,
        _drive: &mut InputCursor<S>,
        _directions: Option<&mut SensitivityWorkspace<S>>,
    ) -> Option<(f64, NonFinite)> {
        stepper.non_finite_term(trial)
    }

    #[inline]
    fn interpolate<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        y: &[f64],
        out: &mut [f64],
    ) {
        stepper.series_at(theta * stepper.h, y, out);
    }

    fn polynomial<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        i: usize,
        y: f64,
        out: &mut PolynomialCoefficients,
    ) -> usize {
        let TaylorExpansion { order, h: own, y: series, .. } = &stepper.expansion;
        let n = stepper.y_new.as_ref().len();
        let stretch = stepper.h / own;
        let mut power = 1.0;
        out[0] = y;
        for k in 1..=*order {
            power *= stretch;
            out[k] = power * series[k * n + i];
        }
        order + 1
    }

    #[inline]
    fn interpolate_sensitivities<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        directions: &SensitivityWorkspace<S>,
        out: &mut [f64],
    ) {
        stepper.sensitivity_series_at(theta * stepper.h, directions.s.as_ref(), out);
    }
}

impl<S: SolvableSystem> Stepper<S> {
    /// Computes the series at (t, y).
    #[inline]
    pub(in crate::integrate) fn expand(
        &mut self,
        base: StepBase<'_, S>,
        drive: &mut InputCursor<S>,
        y: &[f64],
        h: f64,
        directions: Option<&SensitivityWorkspace<S>>,
    ) {
        let (u, udot) = drive.with_slope(base.t, y);
        let point = EvaluationPoint { t: base.t, y, u, p: base.p, z: base.z };
        let s = directions.map_or(&[][..], |directions| directions.s.as_ref());
        self.expansion.compute(base.system, point, udot, h, s);
    }

    /// Tries a step along the series at (t, y).
    #[inline]
    fn attempt_taylor(
        &mut self,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        let Self { expansion, y_new, error, rhs, .. } = self;
        let theta = trial.h / expansion.h;
        let n = trial.y.as_ref().len();
        expansion.sum(theta, trial.y.as_ref(), y_new.as_mut());
        expansion.error(theta, error.as_mut());
        if let Some(d) = directions {
            expansion.sum_sensitivities(theta, d.s.as_ref(), n, d.s_new.as_mut());
            expansion.sensitivity_error(theta, n, d.error.as_mut());
            let point = end(trial, drive, y_new.as_ref());
            let slopes = YAndS { y: rhs.as_mut(), s: d.rhs.as_mut() };
            let errors = YAndS { y: error.as_mut(), s: d.error.as_mut() };
            expansion.add_defects(
                trial.base.system,
                point,
                theta,
                d.s_new.as_ref(),
                slopes,
                errors,
            );
        } else {
            let point = end(trial, drive, y_new.as_ref());
            let slopes = YAndS { y: rhs.as_mut(), s: &mut [] };
            let errors = YAndS { y: error.as_mut(), s: &mut [] };
            expansion.add_defects(trial.base.system, point, theta, &[], slopes, errors);
        }
    }

    /// y at a time h after the start of the last tried step.
    fn series_at(&self, h: f64, y: &[f64], out: &mut [f64]) {
        self.expansion.sum(h / self.expansion.h, y, out);
    }

    /// S at a time h after the start of the last tried step.
    fn sensitivity_series_at(&self, h: f64, s: &[f64], out: &mut [f64]) {
        let TaylorExpansion { order, h: own, s: series, .. } = &self.expansion;
        let n = self.y_new.as_ref().len().max(1);
        let (theta, n_s) = (h / own, s.len() / n);
        out.fill(0.0);
        let mut power = 1.0;
        for rows in series.chunks_exact(s.len().max(1)).skip(1).take(*order) {
            power *= theta;
            for (i, row) in rows.chunks_exact(n_s).enumerate() {
                for (j, term) in row.iter().enumerate() {
                    out[j * n + i] += power * term;
                }
            }
        }
        for (out, s) in out.iter_mut().zip(s) {
            *out += s;
        }
    }

    /// The first coefficient, or slope at the end of the step, that is not finite.
    fn non_finite_term(&self, trial: StepTrial<'_, S>) -> Option<(f64, NonFinite)> {
        let n = trial.y.as_ref().len().max(1);
        let bad = |numbers: &[f64]| numbers.iter().position(|number| !number.is_finite());
        let TaylorExpansion { y, s, has_branches, .. } = &self.expansion;
        let of_y = bad(y).map(|at| match at / n {
            0 | 1 => NonFinite::Equation(at % n),
            _ => NonFinite::Derivative(at % n),
        });
        let n_s = s.len() / y.len().max(1);
        let of_s = || bad(s).map(|at| NonFinite::Derivative(at / n_s % n));
        if let Some(what) = of_y.or_else(of_s) {
            return Some((trial.base.t, what));
        }
        // The slopes at the end, which are checked for models with branches.
        let of_end = bad(self.rhs.as_ref()).filter(|_| *has_branches);
        of_end.map(|at| (trial.base.t + trial.h, NonFinite::Equation(at)))
    }
}

/// The end of a step.
fn end<'a, S: SolvableSystem>(
    trial: StepTrial<'a, S>,
    drive: &'a mut InputCursor<S>,
    y: &'a [f64],
) -> EvaluationPoint<'a> {
    let StepBase { p, z, t, .. } = trial.base;
    let t = t + trial.h;
    EvaluationPoint { t, y, u: drive.evaluate(t, y), p, z }
}

/// Checks that a problem can be solved with Taylor series.
pub(crate) fn verify<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    method: &'static str,
) -> Result<(), IntegrateError> {
    let Problem { system, inputs, .. } = problem;
    system.taylor_series().map_err(|why| IntegrateError::NoTaylorSeries { method, why })?;
    // Series assume that inputs behave between samples as the model declares.
    let declared = system.signature().inputs.iter().enumerate();
    let mut held_inputs = declared.filter(|(_, input)| input.interpolation == Interpolation::Hold);
    match held_inputs.find(|(position, _)| inputs.has_slopes(*position)) {
        None => Ok(()),
        Some((_, input)) => {
            Err(IntegrateError::HeldInputMoves { method, input: input.name.to_string() })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::order;

    #[test]
    fn the_order_follows_the_tolerance() {
        // 1 − ln(1e-6)/2 = 7.9, 1 − ln(1e-12)/2 = 14.8.
        assert_eq!([1e-6, 1e-12, 1e6, 1e-40].map(|rtol| order(None, rtol)), [8, 15, 2, 31]);
    }
}
