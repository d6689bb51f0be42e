//! One step of an explicit Runge–Kutta method, for the unknowns alone or with their sensitivities.
//!
//! The method is applied to the system of y and S together, ẏ = f and Ṡ = g. It is for models
//! without algebraic unknowns.
//!
//! If the model is stiff for it, stability limits the steps and errors are far below the tolerance. The last two stages
//! are at the same time, and the difference of their slopes gives the largest rate λ of the model,
//!
//! ```text
//!   h |λ| ≈ h ‖k_s − k_{s−1}‖ / ‖Y_s − Y_{s−1}‖
//! ```
//!
//! # Source
//!
//! Hairer and Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), §IV.2.

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
use crate::integrate::methods::tableaux::{RungeKuttaTableau, extrapolate};
use crate::solution::Statistics;
use crate::solved::SolvableSystem;
use crate::system::EvaluationPoint;

/// Number of steps at the stability limit after which the model counts as stiff.
const STIFF: u32 = 15;
/// Number of other steps in a row after which it no longer does.
const NOT_STIFF: u32 = 6;

/// Explicit Runge–Kutta methods.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ExplicitRungeKutta(pub(crate) &'static RungeKuttaTableau);

impl MethodFamily for ExplicitRungeKutta {
    const TRAITS: FamilyTraits = FamilyTraits {
        needs: FamilyNeeds::Nothing,
        remembers: FamilyMemory::Slope,
        solves: EndEquations::Nothing,
    };
    const LAW: ControlLaw = ControlLaw::ProportionalIntegral { beta: 0.04 };

    fn estimate_order(self, _rtol: f64) -> u32 {
        self.0.estimate_order
    }

    #[inline]
    fn attempt<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        stepper.attempt_explicit(self.0, trial, drive, directions, statistics);
        Ok(())
    }

    #[inline]
    fn advance<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        h: f64,
        mass: &S::Vector,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        stepper.note_stiffness(self.0, h);
        stepper.advance_slopes(self.0, mass, directions);
    }

    fn non_finite<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        trial: StepTrial<'_, S>,
        _drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) -> Option<(f64, NonFinite)> {
        stepper.non_finite_slope(self.0, trial, directions.as_deref())
    }

    #[inline]
    fn interpolate<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        y: &[f64],
        out: &mut [f64],
    ) {
        self.0.interpolate(theta, stepper.h, y, &stepper.k, out);
    }

    fn polynomial<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        i: usize,
        y: f64,
        out: &mut PolynomialCoefficients,
    ) -> usize {
        self.0.polynomial(i, stepper.h, y, &stepper.k, out)
    }

    #[inline]
    fn interpolate_sensitivities<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        directions: &SensitivityWorkspace<S>,
        out: &mut [f64],
    ) {
        self.0.interpolate(theta, stepper.h, directions.s.as_ref(), &directions.v, out);
    }
}

impl<S: SolvableSystem> Stepper<S> {
    /// Tries a step.
    fn attempt_explicit(
        &mut self,
        tableau: &RungeKuttaTableau,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        mut directions: Option<&mut SensitivityWorkspace<S>>,
        statistics: &mut Statistics,
    ) {
        let StepTrial { base: StepBase { system, p, z, t, .. }, y, h, .. } = trial;
        let y = y.as_ref();
        let last = tableau.stages() - 1;
        for i in 1..=last {
            let (earlier, rest) = self.k.split_at_mut(i);
            let stage = if i == last { &mut self.y_new } else { &mut self.stage };
            extrapolate(y, h, earlier, &tableau.a[i], stage.as_mut());
            let t = t + tableau.c[i] * h;
            let point = EvaluationPoint {
                t,
                y: stage.as_ref(),
                u: drive.evaluate(t, stage.as_ref()),
                p,
                z,
            };
            match &mut directions {
                None => system.rhs(point, rest[0].as_mut()),
                Some(d) => {
                    let (earlier, rest_v) = d.v.split_at_mut(i);
                    let stage = if i == last { &mut d.s_new } else { &mut d.stage };
                    extrapolate(d.s.as_ref(), h, earlier, &tableau.a[i], stage.as_mut());
                    let (f, g) = (rest[0].as_mut(), rest_v[0].as_mut());
                    system.sensitivity_rhs(point, stage.as_ref(), f, g);
                }
            }
        }
        statistics.evaluations += last;
        tableau.local_error(h, &self.k, self.error.as_mut());
        if let Some(d) = directions {
            tableau.local_error(h, &d.v, d.error.as_mut());
        }
    }

    /// Records whether stability limits the last tried step, which is accepted.
    fn note_stiffness(&mut self, tableau: &RungeKuttaTableau, h: f64) {
        let last = tableau.stages() - 1;
        let distance = |a: &[f64], b: &[f64]| -> f64 {
            a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
        };
        let slopes = distance(self.k[last].as_ref(), self.k[last - 1].as_ref());
        let values = distance(self.y_new.as_ref(), self.stage.as_ref());
        let (stiff, others) = self.stiff_steps;
        self.stiff_steps = if h * slopes > 0.9 * tableau.stability * values {
            (stiff + 1, 0)
        } else if others + 1 == NOT_STIFF {
            (0, 0)
        } else {
            (stiff, others + 1)
        };
    }

    /// Whether the model has turned out to be stiff for an explicit method.
    pub(in crate::integrate) fn is_stiff(&self) -> bool {
        self.stiff_steps.0 >= STIFF
    }

    /// The first slope of the last tried step that is not finite, and its time.
    fn non_finite_slope(
        &self,
        tableau: &RungeKuttaTableau,
        trial: StepTrial<'_, S>,
        directions: Option<&SensitivityWorkspace<S>>,
    ) -> Option<(f64, NonFinite)> {
        let n = trial.y.as_ref().len();
        let bad = |values: &[f64]| values.iter().position(|value| !value.is_finite());
        (0..tableau.stages()).find_map(|i| {
            let of_f = bad(self.k[i].as_ref()).map(NonFinite::Equation);
            let of_g = || {
                let row = directions.and_then(|d| bad(d.v[i].as_ref()));
                row.map(|row| NonFinite::Derivative(row % n))
            };
            let what = of_f.or_else(of_g)?;
            Some((trial.base.t + tableau.c[i] * trial.h, what))
        })
    }
}
