//! One step of a singly diagonally implicit Runge–Kutta method, for the unknowns alone or with their
//! sensitivities.
//!
//! ```text
//!   0 = f(t + cᵢ h, Yᵢ) − M (Yᵢ − Ȳᵢ)/(h γ),   Ȳᵢ = y + h Σⱼ aᵢⱼ kⱼ,   kᵢ = (Yᵢ − Ȳᵢ)/(h γ)
//! ```
//!
//! kᵢ is computed from the difference rather than from f, so that algebraic unknowns have slopes like the others, and
//! residuals of Newton's method are not multiplied by the rates of a stiff model. All stages share a matrix.

use crate::integrate::controller::ControlLaw;
use crate::integrate::drive::InputCursor;
use crate::integrate::enclosure::PolynomialCoefficients;
use crate::integrate::methods::family::{
    EndEquations, FamilyMemory, FamilyNeeds, FamilyTraits, MethodFamily,
};
use crate::integrate::methods::stepper::{SensitivityWorkspace, StepFailure, StepTrial, Stepper};
use crate::integrate::methods::tableaux::MAX_STAGES;
use crate::integrate::methods::tableaux::{RungeKuttaTableau, extrapolate};
use crate::solution::Statistics;
use crate::solved::SolvableSystem;

/// Maximum number of Newton iterations for a stage.
const MOST_ITERATIONS: i32 = 7;

/// Singly diagonally implicit Runge–Kutta methods with an explicit first stage.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Esdirk(pub(crate) &'static RungeKuttaTableau);

impl MethodFamily for Esdirk {
    const TRAITS: FamilyTraits = FamilyTraits {
        needs: FamilyNeeds::Jacobian,
        remembers: FamilyMemory::Slope,
        solves: EndEquations::Nonlinear,
    };
    const LAW: ControlLaw = ControlLaw::Predictive;

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
        stepper.attempt_esdirk(self.0, trial, drive, directions, statistics)
    }

    #[inline]
    fn advance<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        _h: f64,
        mass: &S::Vector,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        stepper.advance_slopes(self.0, mass, directions);
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
    /// Tries a step; J is known at its start.
    fn attempt_esdirk(
        &mut self,
        tableau: &RungeKuttaTableau,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        mut directions: Option<&mut SensitivityWorkspace<S>>,
        statistics: &mut Statistics,
    ) -> Result<(), StepFailure> {
        let StepTrial { base, y, h, .. } = trial;
        let y = y.as_ref();
        let c = 1.0 / (h * tableau.gamma);
        self.factorise_iteration(&trial, c, statistics)?;
        for i in 1..tableau.stages() {
            let t = base.t + tableau.c[i] * h;
            let guess = predictor(tableau, i);
            extrapolate(y, h, &self.k[..i], &tableau.a[i], self.stage.as_mut());
            let (known, k) = (self.stage.as_ref(), &self.k[..i]);
            extrapolate(known, h * tableau.gamma, k, &guess, self.y_new.as_mut());
            self.solve_unknowns(&trial, drive, t, c, MOST_ITERATIONS, statistics)?;
            slope(self.k[i].as_mut(), c, self.y_new.as_ref(), self.stage.as_ref());

            if let Some(d) = &mut directions {
                extrapolate(d.s.as_ref(), h, &d.v[..i], &tableau.a[i], d.stage.as_mut());
                let (known, v) = (d.stage.as_ref(), &d.v[..i]);
                extrapolate(known, h * tableau.gamma, v, &guess, d.s_new.as_mut());
                self.solve_sensitivities(&trial, drive, t, c, d, statistics)?;
                slope(d.v[i].as_mut(), c, d.s_new.as_ref(), d.stage.as_ref());
            }
        }
        tableau.local_error(h, &self.k, self.error.as_mut());
        if let Some(d) = directions {
            tableau.local_error(h, &d.v, d.error.as_mut());
        }
        Ok(())
    }
}

/// k ← c (Y − Ȳ).
fn slope(k: &mut [f64], c: f64, y: &[f64], known: &[f64]) {
    for ((k, y), known) in k.iter_mut().zip(y).zip(known) {
        *k = c * (y - known);
    }
}

/// Weights of the slopes of earlier stages in the guess of the i-th: the line through the two nearest ones.
fn predictor(tableau: &RungeKuttaTableau, i: usize) -> [f64; MAX_STAGES] {
    let mut weights = [0.0; MAX_STAGES];
    let c = tableau.c;
    let distance = |j: usize| (c[i] - c[j]).abs();
    let nearest = |but: Option<usize>| {
        let others = (0..i).filter(|j| Some(*j) != but);
        others.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
    };
    let Some(first) = nearest(None) else { return weights };
    match nearest(Some(first)) {
        None => weights[first] = 1.0,
        Some(second) => {
            let along = (c[i] - c[first]) / (c[second] - c[first]);
            weights[first] = 1.0 - along;
            weights[second] = along;
        }
    }
    weights
}
