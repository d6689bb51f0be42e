//! The trait of families of methods, and the only place that distinguishes them.
//!
//! Families differ in their needs at the start of a step, in their memory of the previous one, and in the equations
//! that they solve for its end ([`Traits`]):
//!
//! | family | needs at (t, y) | remembers from step to step | equations |
//! |---|---|---|---|
//! | Rosenbrock | f, J, df/dt; g, ∂g/∂y, dg/dt | nothing | linear |
//! | explicit Runge–Kutta | – | slopes at the end of the previous step | none |
//! | singly diagonally implicit Runge–Kutta | J | the same | solved by iteration |
//! | backward differentiation | – | differences of earlier values, and a factorisation | solved by iteration |
//! | Taylor series | the series | nothing | none |

use crate::error::IntegrateError;
use crate::integrate::controller::{Controller, Law};
use crate::integrate::drive::Drive;
use crate::integrate::enclosure::Coefficients;
use crate::integrate::methods::non_finite::NonFinite;
use crate::integrate::methods::stepper::{Directions, Failed, Stepper, Trial};
use crate::linalg::norm::{Tolerances, larger, largest_block};
use crate::problem::Problem;
use crate::solution::Statistics;
use crate::solved::Solved;

/// The needs of a family at the start of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Needs {
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
pub(crate) enum Remembers {
    /// Nothing.
    Nothing,
    /// The slope at its end.
    Slope,
    /// Differences of equidistant values.
    Differences,
}

/// Equations that a family solves for the end of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Solves {
    /// None: the method is explicit.
    Nothing,
    /// Linear ones.
    Linear,
    /// Nonlinear equations, solved by Newton's method to a fraction of the tolerance.
    Nonlinear,
}

/// The properties of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Traits {
    pub(crate) needs: Needs,
    pub(crate) remembers: Remembers,
    pub(crate) solves: Solves,
}

impl Traits {
    /// Whether it needs slopes at the start of a solution.
    #[inline]
    pub(crate) fn wants_slopes(self) -> bool {
        self.remembers != Remembers::Nothing
    }

    /// Whether a step needs a linearisation at (t, y).
    #[inline]
    pub(crate) fn wants_jacobian(self) -> bool {
        matches!(self.needs, Needs::Jacobian | Needs::AllDerivatives)
    }

    /// Whether the linearisation includes df/dt and the sensitivity equations.
    #[inline]
    pub(crate) fn wants_all_derivatives(self) -> bool {
        self.needs == Needs::AllDerivatives
    }

    /// Whether a step needs the series at (t, y).
    #[inline]
    pub(crate) fn wants_series(self) -> bool {
        self.needs == Needs::Series
    }

    #[inline]
    pub(crate) fn is_multistep(self) -> bool {
        self.remembers == Remembers::Differences
    }

    /// Whether equations are solved by iteration.
    #[inline]
    pub(crate) fn solves_equations(self) -> bool {
        self.solves == Solves::Nonlinear
    }

    /// Whether equations are solved at all, so that models may be stiff and have algebraic unknowns.
    #[inline]
    pub(crate) fn is_implicit(self) -> bool {
        self.solves != Solves::Nothing
    }
}

/// A step that has been judged.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judged {
    /// Its size.
    pub(crate) h: f64,
    /// The square of its error in units of the tolerance; NaN if it could not be evaluated.
    pub(crate) error: f64,
}

/// The scale of errors: values at the end of the step, and tolerances.
pub(crate) struct Scale<'a, S: Solved> {
    pub(crate) tolerances: Tolerances,
    pub(crate) y: &'a [f64],
    pub(crate) sizes: &'a [f64],
    pub(crate) directions: Option<&'a Directions<S>>,
}

impl<S: Solved> Scale<'_, S> {
    /// The squared error of y, and of each block of S, in units of the tolerance; the largest.
    pub(super) fn square(&self, e: &[f64], of_s: impl Fn(&Directions<S>) -> &[f64]) -> f64 {
        let error = self.tolerances.mean_square(e, self.y, self.y, self.sizes);
        let Some(d) = self.directions else { return error };
        let (n, s) = (self.y.len().max(1), d.s.as_ref());
        larger(error, largest_block(self.tolerances, n, of_s(d), s, s, d.sizes.as_ref()))
    }
}

/// A family of methods, with the coefficients of one of them.
pub(crate) trait Family: Copy {
    const TRAITS: Traits;

    /// How steps are controlled.
    const LAW: Law;

    /// Order of the solution to which error estimates belong, at the start.
    fn estimate_order(self, rtol: f64) -> u32;

    /// Checks that the method can solve a problem.
    fn verify<S: Solved>(
        self,
        _problem: &Problem<'_, S>,
        _name: &'static str,
    ) -> Result<(), IntegrateError> {
        Ok(())
    }

    /// Allocates work space that only some families need.
    fn lay_out<S: Solved>(self, _stepper: &mut Stepper<S>, _system: &S, _rtol: f64, _n_s: usize) {}

    /// Tries a step; leaves y⁺ in `y_new` and S⁺ in `s_new`.
    fn attempt<S: Solved>(
        self,
        stepper: &mut Stepper<S>,
        trial: Trial<'_, S>,
        drive: &mut Drive<S>,
        directions: Option<&mut Directions<S>>,
        statistics: &mut Statistics,
    ) -> Result<(), Failed>;

    /// Records that the last tried step, of size h, is accepted.
    #[inline]
    fn advance<S: Solved>(
        self,
        _stepper: &mut Stepper<S>,
        _h: f64,
        _mass: &S::Vector,
        _directions: Option<&mut Directions<S>>,
    ) {
    }

    /// Local error of the last tried step.
    #[inline]
    fn local_error<S: Solved>(self, stepper: &Stepper<S>) -> &[f64] {
        stepper.error.as_ref()
    }

    /// Local error of the sensitivities of the last tried step.
    #[inline]
    fn sensitivity_error<S: Solved>(self, directions: &Directions<S>) -> &[f64] {
        directions.error.as_ref()
    }

    /// The first evaluation of the last tried step that is not finite, and its time; `None` if the family reports it
    /// itself.
    fn non_finite<S: Solved>(
        self,
        _stepper: &mut Stepper<S>,
        _trial: Trial<'_, S>,
        _drive: &mut Drive<S>,
        _directions: Option<&mut Directions<S>>,
    ) -> Option<(f64, NonFinite)> {
        None
    }

    /// Chooses the next step after an accepted one.
    #[inline]
    fn adapt_to_acceptance<S: Solved>(
        self,
        _stepper: &mut Stepper<S>,
        judged: Judged,
        _scale: &Scale<'_, S>,
        controller: &mut Controller,
    ) {
        controller.accept(judged.h, judged.error);
    }

    /// Chooses the next step after a rejected one. Returns whether (t, y) itself may be the cause, rather than the step
    /// size or the memory.
    fn adapt_to_rejection<S: Solved>(
        self,
        _stepper: &mut Stepper<S>,
        judged: Judged,
        controller: &mut Controller,
    ) -> bool {
        if judged.error.is_finite() {
            controller.reject(judged.h, judged.error);
        } else {
            controller.abandon(judged.h);
        }
        true
    }

    /// Prepares [`Family::interpolate`] for the last tried step.
    #[inline]
    fn prepare_dense<S: Solved>(
        self,
        _stepper: &mut Stepper<S>,
        _y: &[f64],
        _directions: Option<&mut Directions<S>>,
    ) {
    }

    /// y at the fraction θ of the last tried step.
    fn interpolate<S: Solved>(self, stepper: &Stepper<S>, theta: f64, y: &[f64], out: &mut [f64]);

    /// The same for the i-th unknown, as coefficients in powers of θ. Returns their number.
    fn polynomial<S: Solved>(
        self,
        stepper: &Stepper<S>,
        i: usize,
        y: f64,
        out: &mut Coefficients,
    ) -> usize;

    /// S at the fraction θ of the last tried step.
    fn interpolate_sensitivities<S: Solved>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        directions: &Directions<S>,
        out: &mut [f64],
    );

    /// Appends y at each requested time within the last tried step.
    #[inline]
    fn interpolate_all<S: Solved>(
        self,
        stepper: &Stepper<S>,
        asked: Asked<'_>,
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
    fn interpolate_all_sensitivities<S: Solved>(
        self,
        stepper: &Stepper<S>,
        asked: Asked<'_>,
        directions: &Directions<S>,
        row: &mut S::Sensitivity,
        out: &mut Vec<f64>,
    ) {
        for t in asked.times {
            self.interpolate_sensitivities(stepper, asked.part(*t), directions, row.as_mut());
            out.extend_from_slice(row.as_ref());
        }
    }

    /// Appends y at the fraction θ of the last tried step, for `chosen` unknowns only.
    fn interpolate_chosen<S: Solved>(
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
pub(crate) struct Asked<'a> {
    /// Start of the step, and 1/h.
    pub(super) from: f64,
    pub(super) per_h: f64,
    pub(super) times: &'a [f64],
}

impl<'a> Asked<'a> {
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
                let $family = $crate::integrate::methods::taylor::Taylor { order };
                $body
            }
        }
    };
}

pub(crate) use by_family;
