//! The stepper, shared by all families: work space, the linearisation, and the interface of a step.
//!
//! A stepper tries a step from (t, y) and gives y⁺ and S⁺, their local errors, and the dense output between (t, y) and
//! (t + h, y⁺). The caller accepts or rejects it.
//!
//! Remembered values are valid only along a smooth solution: [`Stepper::restart`] discards them.

use crate::integrate::controller::Controller;
use crate::integrate::drive::InputCursor;
use crate::integrate::enclosure::PolynomialCoefficients;
use crate::integrate::methods::catalogue::MethodKind;
use crate::integrate::methods::family::{
    ErrorScale, FamilyTraits, JudgedStep, MethodFamily, RequestedTimes, by_family,
};
use crate::integrate::methods::multistep::BdfHistory;
use crate::integrate::methods::non_finite::NonFinite;
use crate::integrate::methods::tableaux::{MAX_STAGES, RungeKuttaTableau};
use crate::integrate::methods::taylor::TaylorExpansion;
use crate::linalg::norm::Tolerances;
use crate::linalg::{Factorisation, KeptSum, Singular};
use crate::solution::Statistics;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern, Storage};

/// Work space of the unknowns.
#[allow(clippy::struct_excessive_bools)] // Flags are independent of each other.
pub(crate) struct Stepper<S: SolvableSystem> {
    kind: MethodKind,
    pub(crate) traits: FamilyTraits,
    pub(in crate::integrate) factorisation: S::Factorisation,
    /// f, ∂f/∂y and df/dt at the start of the step, those that the family needs.
    pub(crate) f: S::Vector,
    pub(crate) jacobian: S::Jacobian,
    pub(crate) dfdt: S::Vector,
    /// Yᵢ, or the known terms of its equation.
    pub(in crate::integrate) stage: S::Vector,
    /// f there.
    pub(crate) rhs: S::Vector,
    /// Increments, slopes or differences, by family.
    pub(in crate::integrate) k: [S::Vector; MAX_STAGES],
    pub(crate) y_new: S::Vector,
    /// Local error, if it is not one of the vectors in `k`.
    pub(in crate::integrate) error: S::Vector,
    /// Vectors of the dense output of Rosenbrock methods.
    pub(super) dense: [S::Vector; 4],
    /// Size of the last tried step, and whether it has been shortened since.
    pub(super) h: f64,
    pub(super) is_cut: bool,
    /// Whether nothing is known of the solution before (t, y).
    fresh: bool,
    /// Whether `jacobian` was computed at a point other than the start of the step.
    pub(in crate::integrate) moved: bool,
    /// How fast Newton's method converged last.
    pub(in crate::integrate) eta: f64,
    /// Number of steps in a row limited by stability, and of those since then that were not.
    pub(in crate::integrate) stiff_steps: (u32, u32),
    pub(in crate::integrate) history: BdfHistory,
    /// Sums that the equations conserve, and whether the factors have their rows.
    pub(in crate::integrate) sums: Vec<KeptSum>,
    pub(in crate::integrate) keeps_sums: bool,
    /// Taylor series at the start of the step.
    pub(in crate::integrate) expansion: TaylorExpansion,
}

/// Work space of the sensitivities.
pub(crate) struct SensitivityWorkspace<S: SolvableSystem> {
    /// S at the start of the step.
    pub(crate) s: S::Sensitivity,
    pub(crate) s_new: S::Sensitivity,
    /// Sizes for tolerances: nominal of the unknown over nominal of the parameter.
    pub(crate) sizes: S::Sensitivity,
    /// g, ∂g/∂y and dg/dt at the start of the step.
    pub(crate) g: S::Sensitivity,
    pub(in crate::integrate) dgdy: S::SensitivityJacobian,
    pub(in crate::integrate) dgdt: S::Sensitivity,
    pub(in crate::integrate) stage: S::Sensitivity,
    pub(in crate::integrate) rhs: S::Sensitivity,
    /// The counterpart of `k` for sensitivities.
    pub(in crate::integrate) v: [S::Sensitivity; MAX_STAGES],
    pub(in crate::integrate) error: S::Sensitivity,
    pub(super) dense: [S::Sensitivity; 4],
}

impl<S: SolvableSystem> SensitivityWorkspace<S> {
    pub(crate) fn new(system: &S) -> Self {
        let signature = system.signature();
        let len = signature.unknowns.len() * signature.directions.len();
        let zeros = || S::Sensitivity::zeros(len);
        Self {
            s: zeros(),
            s_new: zeros(),
            sizes: zeros(),
            g: zeros(),
            dgdy: S::SensitivityJacobian::zeros(signature.sensitivity_jacobian.len()),
            dgdt: zeros(),
            stage: zeros(),
            rhs: zeros(),
            v: std::array::from_fn(|_| zeros()),
            error: zeros(),
            dense: std::array::from_fn(|_| zeros()),
        }
    }
}

/// The start of a step.
pub(crate) struct StepBase<'a, S: SolvableSystem> {
    pub(crate) system: &'a S,
    pub(crate) p: &'a [f64],
    pub(crate) z: &'a [f64],
    /// 1 for a differential unknown, 0 for an algebraic one.
    pub(crate) mass: &'a S::Vector,
    pub(crate) t: f64,
}

impl<S: SolvableSystem> Clone for StepBase<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: SolvableSystem> Copy for StepBase<'_, S> {}

/// A step to try: from (t, y) by h, with the tolerances of its equations.
pub(crate) struct StepTrial<'a, S: SolvableSystem> {
    pub(crate) base: StepBase<'a, S>,
    pub(crate) y: &'a S::Vector,
    pub(crate) h: f64,
    pub(crate) sizes: &'a [f64],
    pub(crate) tolerances: Tolerances,
}

impl<S: SolvableSystem> Clone for StepTrial<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: SolvableSystem> Copy for StepTrial<'_, S> {}

/// Why a step failed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StepFailure {
    /// The matrix of the stages is singular.
    Singular { row: usize },
    /// Newton's method does not converge; the unknown has the largest correction relative to its size.
    NotConverged { unknown: usize },
    /// An equation that is not finite, and the time.
    NotFinite { t: f64, what: NonFinite },
    /// A step that reads itself does not become consistent.
    Unsettled,
}

impl From<Singular> for StepFailure {
    fn from(Singular { row }: Singular) -> Self {
        Self::Singular { row }
    }
}

/// End of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StepEnd {
    Start,
    End,
}

impl<S: SolvableSystem> Stepper<S> {
    pub(crate) fn new(system: &S, kind: MethodKind) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let zeros = || S::Vector::zeros(n);
        Self {
            kind,
            traits: kind.traits(),
            factorisation: S::Factorisation::new(n, &signature.jacobian),
            f: zeros(),
            jacobian: S::Jacobian::zeros(signature.jacobian.len()),
            dfdt: zeros(),
            stage: zeros(),
            rhs: zeros(),
            k: std::array::from_fn(|_| zeros()),
            y_new: zeros(),
            error: zeros(),
            dense: std::array::from_fn(|_| zeros()),
            h: 0.0,
            is_cut: false,
            fresh: true,
            moved: false,
            eta: 1.0,
            stiff_steps: (0, 0),
            history: BdfHistory::default(),
            sums: Vec::new(),
            keeps_sums: false,
            expansion: TaylorExpansion::default(),
        }
    }

    /// Factorises c M − J of a step, with the rows of conserved sums.
    #[inline]
    pub(in crate::integrate) fn factorise_step(
        &mut self,
        c: f64,
        differential: impl Fn(usize) -> bool,
        pattern: &Pattern,
        sizes: &[f64],
    ) -> Result<(), Singular> {
        let (lu, jacobian) = (&mut self.factorisation, self.jacobian.as_ref());
        if S::FEATURES.conserved && !self.sums.is_empty() {
            let sums = &self.sums;
            let kept = lu.factorise_keeping(c, differential, pattern, jacobian, sizes, sums);
            self.keeps_sums = kept?;
            return Ok(());
        }
        lu.factorise(c, differential, pattern, jacobian, Some(sizes))
    }

    /// Discards information about the solution before (t, y), which is not smooth here.
    #[inline]
    pub(crate) fn restart(&mut self) {
        self.fresh = true;
        self.history.is_resumed = false;
    }

    /// Allocates work space that only some families need, for n_s directions.
    pub(crate) fn lay_out(&mut self, system: &S, rtol: f64, n_s: usize) {
        by_family!(self.kind, |family| family.lay_out(self, system, rtol, n_s));
    }

    /// Whether [`Stepper::begin`] must provide slopes before a step is tried.
    #[inline]
    pub(crate) fn wants_slopes(&self) -> bool {
        self.fresh && self.traits.wants_slopes()
    }

    /// Evaluates everything that the stages of a step from (t, y) share.
    #[inline]
    pub(crate) fn linearize(
        &mut self,
        base: StepBase<'_, S>,
        drive: &mut InputCursor<S>,
        y: &[f64],
        directions: Option<(&mut SensitivityWorkspace<S>, StepEnd)>,
    ) {
        let (u, udot) = drive.with_slope(base.t, y);
        let point = EvaluationPoint { t: base.t, y, u, p: base.p, z: base.z };
        let (f, jacobian, dfdt) = (self.f.as_mut(), self.jacobian.as_mut(), self.dfdt.as_mut());
        match directions {
            None => base.system.linearize(point, udot, f, jacobian, dfdt),
            Some((directions, place)) => {
                let s = match place {
                    StepEnd::Start => &directions.s,
                    StepEnd::End => &directions.s_new,
                };
                base.system.sensitivity_linearize(
                    point,
                    udot,
                    s.as_ref(),
                    f,
                    jacobian,
                    dfdt,
                    directions.g.as_mut(),
                    directions.dgdy.as_mut(),
                    directions.dgdt.as_mut(),
                );
            }
        }
    }

    /// Uses the slopes in `f` and `g` of a solution that begins at (t, y), for one step of size h.
    pub(crate) fn begin(&mut self, h: f64, directions: Option<&mut SensitivityWorkspace<S>>) {
        self.fresh = false;
        self.eta = 1.0;
        self.stiff_steps = (0, 0);
        let (slot, scale) = if self.traits.is_multistep() { (1, h) } else { (0, 1.0) };
        self.history = BdfHistory::beginning(h, self.history.is_resumed);
        let scaled = |out: &mut [f64], slopes: &[f64]| {
            for (out, slope) in out.iter_mut().zip(slopes) {
                *out = scale * slope;
            }
        };
        scaled(self.k[slot].as_mut(), self.f.as_ref());
        for k in &mut self.k[slot + 1..] {
            k.as_mut().fill(0.0);
        }
        if let Some(d) = directions {
            scaled(d.v[slot].as_mut(), d.g.as_ref());
            for v in &mut d.v[slot + 1..] {
                v.as_mut().fill(0.0);
            }
        }
    }

    /// Tries a step; leaves y⁺ in `y_new` and S⁺ in `s_new`.
    #[inline]
    pub(crate) fn attempt(
        &mut self,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        self.h = trial.h;
        self.is_cut = false;
        by_family!(self.kind, |family| family.attempt(self, trial, drive, directions, statistics))
    }

    /// Records that the last tried step, of size h, is accepted.
    #[inline]
    pub(crate) fn advance(
        &mut self,
        h: f64,
        mass: &S::Vector,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        by_family!(self.kind, |family| family.advance(self, h, mass, directions));
    }

    /// Keeps the slopes at the end of an accepted Runge–Kutta step for the next one.
    #[inline]
    pub(super) fn advance_slopes(
        &mut self,
        tableau: &RungeKuttaTableau,
        mass: &S::Vector,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        tableau.advance(mass.as_ref(), &mut self.k);
        if let Some(d) = directions {
            tableau.advance(mass.as_ref(), &mut d.v);
        }
    }

    /// Chooses the next step after an accepted one.
    #[inline]
    pub(crate) fn adapt_to_acceptance(
        &mut self,
        judged: JudgedStep,
        scale: &ErrorScale<'_, S>,
        controller: &mut Controller,
    ) {
        by_family!(self.kind, |family| family.adapt_to_acceptance(self, judged, scale, controller));
    }

    /// Chooses the next step after a rejected one. Returns whether (t, y) itself may be the cause.
    pub(crate) fn adapt_to_rejection(
        &mut self,
        judged: JudgedStep,
        controller: &mut Controller,
    ) -> bool {
        by_family!(self.kind, |family| family.adapt_to_rejection(self, judged, controller))
    }

    /// Shortens the last tried step to size h, for a method that remembers earlier values: its solution within the step
    /// is its dense output, which has the same order.
    pub(in crate::integrate) fn shorten(
        &mut self,
        h: f64,
        y: &[f64],
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        self.h = h;
        self.is_cut = true;
        let Self { history, k, stage, y_new, .. } = self;
        history.interpolate(h, y, k, stage.as_ref(), y_new.as_mut());
        if let Some(d) = directions {
            history.interpolate(h, d.s.as_ref(), &d.v, d.stage.as_ref(), d.s_new.as_mut());
        }
    }

    /// Local error of the last tried step.
    #[inline]
    pub(crate) fn local_error(&self) -> &[f64] {
        by_family!(self.kind, |family| family.local_error(self))
    }

    /// Local error of the sensitivities of the last tried step.
    #[inline]
    pub(crate) fn sensitivity_error<'a>(
        &self,
        directions: &'a SensitivityWorkspace<S>,
    ) -> &'a [f64] {
        by_family!(self.kind, |family| family.sensitivity_error(directions))
    }

    /// The first evaluation of the last tried step that is not finite, and its time.
    pub(crate) fn non_finite(
        &mut self,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) -> Option<(f64, NonFinite)> {
        by_family!(self.kind, |family| family.non_finite(self, trial, drive, directions))
    }

    /// Prepares [`Stepper::interpolate`] for the last tried step.
    #[inline]
    pub(crate) fn prepare_dense(
        &mut self,
        y: &[f64],
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        by_family!(self.kind, |family| family.prepare_dense(self, y, directions));
    }

    /// y at the fraction θ of the last tried step.
    #[inline]
    pub(crate) fn interpolate(&self, theta: f64, y: &[f64], out: &mut [f64]) {
        by_family!(self.kind, |family| family.interpolate(self, theta, y, out));
    }

    /// The same for the i-th unknown, as coefficients in powers of θ. Returns their number.
    pub(crate) fn polynomial(&self, i: usize, y: f64, out: &mut PolynomialCoefficients) -> usize {
        by_family!(self.kind, |family| family.polynomial(self, i, y, out))
    }

    /// S at the fraction θ of the last tried step.
    #[inline]
    pub(crate) fn interpolate_sensitivities(
        &self,
        theta: f64,
        directions: &SensitivityWorkspace<S>,
        out: &mut [f64],
    ) {
        by_family!(self.kind, |family| {
            family.interpolate_sensitivities(self, theta, directions, out);
        });
    }

    /// Appends y at each of the `asked` times within the last tried step; `row` is work space.
    #[inline]
    pub(crate) fn interpolate_all(
        &self,
        asked: RequestedTimes<'_>,
        y: &S::Vector,
        row: &mut S::Vector,
        out: &mut Vec<f64>,
    ) {
        by_family!(self.kind, |family| family.interpolate_all(self, asked, y, row, out));
    }

    /// Appends S at each of the `asked` times within the last tried step; `row` is work space.
    #[inline]
    pub(crate) fn interpolate_all_sensitivities(
        &self,
        asked: RequestedTimes<'_>,
        directions: &SensitivityWorkspace<S>,
        row: &mut S::Sensitivity,
        out: &mut Vec<f64>,
    ) {
        by_family!(self.kind, |family| {
            family.interpolate_all_sensitivities(self, asked, directions, row, out);
        });
    }

    /// Appends y at the fraction θ of the last tried step, for `chosen` unknowns only. `row` is work space.
    pub(crate) fn interpolate_chosen(
        &mut self,
        theta: f64,
        y: &[f64],
        chosen: &[usize],
        row: &mut [f64],
        out: &mut Vec<f64>,
    ) {
        by_family!(self.kind, |family| {
            family.interpolate_chosen(self, theta, y, chosen, row, out);
        });
    }
}

#[cfg(test)]
mod tests;
