//! The trait of families of methods, and the only place that distinguishes them.
//!
//! Families differ in their needs at the start of a step, in their memory of the previous one, and in the equations
//! that they solve for its end ([`FamilyTraits`]):
//!
//! | family | needs at (t, y) | remembers from step to step | equations |
//! |---|---|---|---|
//! | Rosenbrock | f, J, df/dt; g, ∂g/∂y, dg/dt | nothing | linear |
//! | explicit Runge–Kutta | – | slopes at the end of the previous step | none |
//! | singly diagonally implicit Runge–Kutta | J | the same | solved by iteration |
//! | backward differentiation | – | differences of earlier values, and a factorisation | solved by iteration |
//! | Taylor series | the series | nothing | none |

use crate::error::IntegrateError;
use crate::integrate::controller::{ControlLaw, Controller};
use crate::integrate::drive::InputCursor;
use crate::integrate::enclosure::PolynomialCoefficients;
use crate::integrate::methods::non_finite::NonFinite;
use crate::integrate::methods::stepper::{SensitivityWorkspace, StepFailure, StepTrial, Stepper};
use crate::linalg::norm::{Tolerances, larger, largest_block};
use crate::problem::Problem;
use crate::solution::Statistics;
use crate::solved::SolvableSystem;

/// The needs of a family at the start of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FamilyNeeds {
    /// Nothing but its memory.
    Nothing,
    /// J.
    Jacobian,
    /// J and df/dt; with sensitivities also those of their equations, and so second derivatives of f.
    AllDerivatives,
    /// The Taylor series of the solution.
    Series,
}

/// The memory of a family of the previous step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FamilyMemory {
    /// Nothing.
    Nothing,
    /// The slope at its end.
    Slope,
    /// Differences of equidistant values.
    Differences,
}

/// Equations that a family solves for the end of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EndEquations {
    /// None: the method is explicit.
    Nothing,
    /// Linear ones.
    Linear,
    /// Nonlinear equations, solved by Newton's method to a fraction of the tolerance.
    Nonlinear,
}

/// The properties of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FamilyTraits {
    pub(crate) needs: FamilyNeeds,
    pub(crate) remembers: FamilyMemory,
    pub(crate) solves: EndEquations,
}

impl FamilyTraits {
    /// Whether it needs slopes at the start of a solution.
    #[inline]
    pub(crate) fn wants_slopes(self) -> bool {
        self.remembers != FamilyMemory::Nothing
    }

    /// Whether a step needs a linearisation at (t, y).
    #[inline]
    pub(crate) fn wants_jacobian(self) -> bool {
        matches!(self.needs, FamilyNeeds::Jacobian | FamilyNeeds::AllDerivatives)
    }

    /// Whether the linearisation includes df/dt and the sensitivity equations.
    #[inline]
    pub(crate) fn wants_all_derivatives(self) -> bool {
        self.needs == FamilyNeeds::AllDerivatives
    }

    /// Whether a step needs the series at (t, y).
    #[inline]
    pub(crate) fn wants_series(self) -> bool {
        self.needs == FamilyNeeds::Series
    }

    #[inline]
    pub(crate) fn is_multistep(self) -> bool {
        self.remembers == FamilyMemory::Differences
    }

    /// Whether equations are solved by iteration.
    #[inline]
    pub(crate) fn solves_equations(self) -> bool {
        self.solves == EndEquations::Nonlinear
    }

    /// Whether equations are solved at all, so that models may be stiff and have algebraic unknowns.
    #[inline]
    pub(crate) fn is_implicit(self) -> bool {
        self.solves != EndEquations::Nothing
    }
}

/// A step that has been judged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JudgedStep {
    /// Its size.
    pub(crate) h: f64,
    /// The square of its error in units of the tolerance; NaN if it could not be evaluated.
    pub(crate) error: f64,
}

/// The scale of errors: values at the end of the step, and tolerances.
pub(crate) struct ErrorScale<'a, S: SolvableSystem> {
    pub(crate) tolerances: Tolerances,
    pub(crate) y: &'a [f64],
    pub(crate) sizes: &'a [f64],
    pub(crate) directions: Option<&'a SensitivityWorkspace<S>>,
}

impl<S: SolvableSystem> ErrorScale<'_, S> {
    /// The squared error of y, and of each block of S, in units of the tolerance; the largest.
    pub(super) fn square(
        &self,
        e: &[f64],
        of_s: impl Fn(&SensitivityWorkspace<S>) -> &[f64],
    ) -> f64 {
        let error = self.tolerances.mean_square(e, self.y, self.y, self.sizes);
        let Some(d) = self.directions else { return error };
        let (n, s) = (self.y.len().max(1), d.s.as_ref());
        larger(error, largest_block(self.tolerances, n, of_s(d), s, s, d.sizes.as_ref()))
    }
}

/// A family of methods, with the coefficients of one of them.
pub(crate) trait MethodFamily: Copy {
    const TRAITS: FamilyTraits;

    /// How steps are controlled.
    const LAW: ControlLaw;

    /// Order of the solution to which error estimates belong, at the start.
    fn estimate_order(self, rtol: f64) -> u32;

    /// Checks that the method can solve a problem.
    fn verify<S: SolvableSystem>(
        self,
        _problem: &Problem<'_, S>,
        _name: &'static str,
    ) -> Result<(), IntegrateError> {
        Ok(())
    }

    /// Allocates work space that only some families need.
    fn lay_out<S: SolvableSystem>(
        self,
        _stepper: &mut Stepper<S>,
        _system: &S,
        _rtol: f64,
        _n_s: usize,
    ) {
    }

    /// Tries a step; leaves y⁺ in `y_new` and S⁺ in `s_new`.
    fn attempt<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure>;

    /// Records that the last tried step, of size h, is accepted.
    #[inline]
    fn advance<S: SolvableSystem>(
        self,
        _stepper: &mut Stepper<S>,
        _h: f64,
        _mass: &S::Vector,
        _directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
    }

    /// Local error of the last tried step.
    #[inline]
    fn local_error<S: SolvableSystem>(self, stepper: &Stepper<S>) -> &[f64] {
        stepper.error.as_ref()
    }

    /// Local error of the sensitivities of the last tried step.
    #[inline]
    fn sensitivity_error<S: SolvableSystem>(self, directions: &SensitivityWorkspace<S>) -> &[f64] {
        directions.error.as_ref()
    }

    /// The first evaluation of the last tried step that is not finite, and its time; `None` if the family reports it
    /// itself.
    fn non_finite<S: SolvableSystem>(
        self,
        _stepper: &mut Stepper<S>,
        _trial: StepTrial<'_, S>,
        _drive: &mut InputCursor<S>,
        _directions: Option<&mut SensitivityWorkspace<S>>,
    ) -> Option<(f64, NonFinite)> {
        None
    }

    /// Chooses the next step after an accepted one.
    #[inline]
    fn adapt_to_acceptance<S: SolvableSystem>(
        self,
        _stepper: &mut Stepper<S>,
        judged: JudgedStep,
        _scale: &ErrorScale<'_, S>,
        controller: &mut Controller,
    ) {
        controller.accept(judged.h, judged.error);
    }

    /// Chooses the next step after a rejected one. Returns whether (t, y) itself may be the cause, rather than the step
    /// size or the memory.
    fn adapt_to_rejection<S: SolvableSystem>(
        self,
        _stepper: &mut Stepper<S>,
        judged: JudgedStep,
        controller: &mut Controller,
    ) -> bool {
        if judged.error.is_finite() {
            controller.reject(judged.h, judged.error);
        } else {
            controller.abandon(judged.h);
        }
        true
    }

    /// Prepares [`MethodFamily::interpolate`] for the last tried step.
    #[inline]
    fn prepare_dense<S: SolvableSystem>(
        self,
        _stepper: &mut Stepper<S>,
        _y: &[f64],
        _directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
    }

    /// y at the fraction θ of the last tried step.
    fn interpolate<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        y: &[f64],
        out: &mut [f64],
    );

    /// The same for the i-th unknown, as coefficients in powers of θ. Returns their number.
    fn polynomial<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        i: usize,
        y: f64,
        out: &mut PolynomialCoefficients,
    ) -> usize;

    /// S at the fraction θ of the last tried step.
    fn interpolate_sensitivities<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        directions: &SensitivityWorkspace<S>,
        out: &mut [f64],
    );

    /// Appends y at each requested time within the last tried step.
    #[inline]
    fn interpolate_all<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        asked: RequestedTimes<'_>,
        y: &S::Vector,
        row: &mut S::Vector,
        out: &mut Vec<f64>,
    ) {
        for t in asked.times {
            self.interpolate(stepper, asked.part(*t), y.as_ref(), row.as_mut());
            out.extend_from_slice(row.as_ref());
        }
    }

    /// Appends S at each requested time within the last tried step.
    #[inline]
    fn interpolate_all_sensitivities<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        asked: RequestedTimes<'_>,
        directions: &SensitivityWorkspace<S>,
        row: &mut S::Sensitivity,
        out: &mut Vec<f64>,
    ) {
        for t in asked.times {
            self.interpolate_sensitivities(stepper, asked.part(*t), directions, row.as_mut());
            out.extend_from_slice(row.as_ref());
        }
    }

    /// Appends y at the fraction θ of the last tried step, for `chosen` unknowns only.
    fn interpolate_chosen<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        theta: f64,
        y: &[f64],
        chosen: &[usize],
        row: &mut [f64],
        out: &mut Vec<f64>,
    ) {
        self.prepare_dense(stepper, y, None);
        self.interpolate(stepper, theta, y, row);
        out.extend(chosen.iter().map(|i| row[*i]));
    }
}

/// Requested times within a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RequestedTimes<'a> {
    /// Start of the step, and 1/h.
    pub(super) from: f64,
    pub(super) per_h: f64,
    pub(super) times: &'a [f64],
}

impl<'a> RequestedTimes<'a> {
    pub(crate) fn new(from: f64, to: f64, times: &'a [f64]) -> Self {
        Self { from, per_h: 1.0 / (to - from), times }
    }

    /// θ at a time.
    #[inline]
    pub(super) fn part(self, t: f64) -> f64 {
        (t - self.from) * self.per_h
    }
}

/// Evaluates `$body` with the family of a [`MethodKind`](super::catalogue::MethodKind), as its concrete type.
macro_rules! by_family {
    ($kind:expr, |$family:ident| $body:expr) => {
        match $kind {
            $crate::integrate::methods::catalogue::MethodKind::Rosenbrock(tableau) => {
                let $family = $crate::integrate::methods::rosenbrock::Rosenbrock(tableau);
                $body
            }
            $crate::integrate::methods::catalogue::MethodKind::Explicit(tableau) => {
                let $family = $crate::integrate::methods::explicit_rk::ExplicitRungeKutta(tableau);
                $body
            }
            $crate::integrate::methods::catalogue::MethodKind::Esdirk(tableau) => {
                let $family = $crate::integrate::methods::esdirk::Esdirk(tableau);
                $body
            }
            $crate::integrate::methods::catalogue::MethodKind::Bdf(most) => {
                let $family = $crate::integrate::methods::multistep::Bdf { most_order: most };
                $body
            }
            $crate::integrate::methods::catalogue::MethodKind::Taylor(order) => {
                let $family = $crate::integrate::methods::taylor::TaylorMethod { order };
                $body
            }
        }
    };
}

pub(crate) use by_family;
