//! One step of a Rosenbrock method, for the unknowns alone or with their sensitivities.
//!
//! Sensitivities use the same method applied to the system of y and S together. Its Jacobian is block-triangular,
//!
//! ```text
//!   ⎡ J           ⎤        (M/(h γ) − J) Vᵢⱼ = gⱼ(stage) + (M/h) Σ c V + h γᵢ ∂gⱼ/∂t + ∂gⱼ/∂y Uᵢ
//!   ⎣ ∂gⱼ/∂y   J  ⎦
//! ```
//!
//! so one factorisation serves all. Without ∂gⱼ/∂y, the second derivatives of f, the method would lose its order.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

mod dense;
mod lanes;

use crate::integrate::controller::ControlLaw;
use crate::integrate::drive::InputCursor;
use crate::integrate::enclosure::PolynomialCoefficients;
use crate::integrate::methods::family::{
    EndEquations, FamilyMemory, FamilyNeeds, FamilyTraits, MethodFamily, RequestedTimes,
};
use crate::integrate::methods::newton::failed;
use crate::integrate::methods::non_finite::NonFinite;
use crate::integrate::methods::stepper::{
    SensitivityWorkspace, StepBase, StepFailure, StepTrial, Stepper,
};
use crate::integrate::methods::tableaux::RosenbrockTableau;
use crate::linalg::Factorisation;
use crate::solution::Statistics;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern, Storage};
use dense::{dense_vectors, interpolate, interpolate_all};
use lanes::{add_rates, combine, combine_any, sum};

/// Linearly implicit Runge–Kutta methods.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rosenbrock(pub(crate) &'static RosenbrockTableau);

impl MethodFamily for Rosenbrock {
    const TRAITS: FamilyTraits = FamilyTraits {
        needs: FamilyNeeds::AllDerivatives,
        remembers: FamilyMemory::Nothing,
        solves: EndEquations::Linear,
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
        statistics.factorisations += 1;
        stepper.attempt_rosenbrock(self.0, trial, drive, directions)?;
        statistics.evaluations += self.0.evaluations();
        Ok(())
    }

    #[inline]
    fn local_error<S: SolvableSystem>(self, stepper: &Stepper<S>) -> &[f64] {
        stepper.k[self.0.stages() - 1].as_ref()
    }

    #[inline]
    fn sensitivity_error<S: SolvableSystem>(self, directions: &SensitivityWorkspace<S>) -> &[f64] {
        directions.v[self.0.stages() - 1].as_ref()
    }

    fn non_finite<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) -> Option<(f64, NonFinite)> {
        stepper.find_non_finite(self.0, trial, drive, directions)
    }

    #[inline]
    fn prepare_dense<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        y: &[f64],
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        let stages = self.0.stages();
        let y_new = stepper.y_new.as_ref();
        dense_vectors(self.0, y, y_new, &stepper.k[..stages], &mut stepper.dense);
        if let Some(d) = directions {
            let (s, s_new) = (d.s.as_ref(), d.s_new.as_ref());
            dense_vectors(self.0, s, s_new, &d.v[..stages], &mut d.dense);
        }
    }

    #[inline]
    fn interpolate<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        theta: f64,
        y: &[f64],
        out: &mut [f64],
    ) {
        interpolate(theta, y, &stepper.dense, out);
    }

    fn polynomial<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        i: usize,
        y: f64,
        out: &mut PolynomialCoefficients,
    ) -> usize {
        let [c1, c2, c3, c4] = &stepper.dense;
        out[..5].copy_from_slice(&[
            y,
            c1.as_ref()[i],
            c2.as_ref()[i],
            c3.as_ref()[i],
            c4.as_ref()[i],
        ]);
        5
    }

    #[inline]
    fn interpolate_sensitivities<S: SolvableSystem>(
        self,
        _stepper: &Stepper<S>,
        theta: f64,
        directions: &SensitivityWorkspace<S>,
        out: &mut [f64],
    ) {
        interpolate(theta, directions.s.as_ref(), &directions.dense, out);
    }

    #[inline]
    fn interpolate_all<S: SolvableSystem>(
        self,
        stepper: &Stepper<S>,
        asked: RequestedTimes<'_>,
        y: &S::Vector,
        _row: &mut S::Vector,
        out: &mut Vec<f64>,
    ) {
        interpolate_all(asked, y, &stepper.dense, out);
    }

    #[inline]
    fn interpolate_all_sensitivities<S: SolvableSystem>(
        self,
        _stepper: &Stepper<S>,
        asked: RequestedTimes<'_>,
        directions: &SensitivityWorkspace<S>,
        _row: &mut S::Sensitivity,
        out: &mut Vec<f64>,
    ) {
        interpolate_all(asked, &directions.s, &directions.dense, out);
    }

    fn interpolate_chosen<S: SolvableSystem>(
        self,
        stepper: &mut Stepper<S>,
        theta: f64,
        y: &[f64],
        chosen: &[usize],
        _row: &mut [f64],
        out: &mut Vec<f64>,
    ) {
        let y_new = stepper.y_new.as_ref();
        out.extend(chosen.iter().map(|&i| {
            let k = stepper.k.each_ref().map(|k| [k.as_ref().get(i).copied().unwrap_or(0.0)]);
            let (mut dense, mut value) = ([[0.0]; 4], [0.0]);
            let stages = self.0.stages();
            dense_vectors(self.0, &[y[i]], &[y_new[i]], &k[..stages], &mut dense);
            interpolate(theta, &[y[i]], &dense, &mut value);
            value[0]
        }));
    }
}

impl<S: SolvableSystem> Stepper<S> {
    /// Tries a step; the stepper is linearised at its start.
    #[inline]
    fn attempt_rosenbrock(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        directions: Option<&mut SensitivityWorkspace<S>>,
    ) -> Result<(), StepFailure> {
        let StepTrial { base: StepBase { system, mass, t, .. }, h, .. } = trial;
        let mass = mass.as_ref();
        let pattern = &system.signature().jacobian;
        let factorised = self.factorise_step(
            1.0 / (h * tableau.gamma),
            |i| !S::FEATURES.algebraic || mass[i] != 0.0,
            pattern,
            trial.sizes,
        );
        let jacobian = self.jacobian.as_ref();
        factorised.map_err(|singular| failed(singular, t, pattern, jacobian))?;
        match directions {
            None => self.make_stages(tableau, trial, drive, None),
            Some(directions) => self.make_stages(tableau, trial, drive, Some(directions)),
        }
        Ok(())
    }

    /// All stages, and with the last one y⁺ and S⁺. Stages are written out one by one, so that the
    /// lengths of their sums are constants.
    #[inline(always)]
    fn make_stages(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        mut directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        let stages = tableau.stages();
        macro_rules! make {
            ($($i:literal)*) => {
                $(if $i < stages {
                    self.make_stage::<$i>(tableau, trial, drive, directions.as_deref_mut());
                })*
            };
        }
        make!(0 1 2 3 4 5 6 7);

        // y⁺ = Y_s + U_s. Y shares its storage with y⁺, which saves a vector for large models.
        let last = stages - 1;
        for (y, u) in self.y_new.as_mut().iter_mut().zip(self.k[last].as_ref()) {
            *y += u;
        }
        if let Some(d) = directions {
            sum(d.stage.as_ref(), d.v[last].as_ref(), d.s_new.as_mut());
        }
    }

    /// The increments of the stage after I others, from theirs.
    #[inline(always)]
    fn make_stage<const I: usize>(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        mut directions: Option<&mut SensitivityWorkspace<S>>,
    ) {
        let StepTrial { base: StepBase { system, p, z, mass, t }, y, h, .. } = trial;
        let (y, mass) = (y.as_ref(), mass.as_ref());
        let per_h = 1.0 / h;
        let slope = h * tableau.gamma_sums[I];
        let closes = I >= tableau.closing;
        let (a, c) = (&tableau.a[I], &tableau.c[I]);

        // Yᵢ = y + Σ aᵢⱼ Uⱼ,  Uᵢ ← Σ cᵢⱼ Uⱼ
        let (mut stage, mut u_i) = (self.y_new.take(), self.k[I].take());
        combine::<I, _>(y, &self.k, a, c, closes, stage.as_mut(), u_i.as_mut());
        let mut of_s = directions.as_deref_mut().map(|d| {
            let (mut stage, mut v_i) = (d.stage.take(), d.v[I].take());
            combine::<I, _>(d.s.as_ref(), &d.v, a, c, closes, stage.as_mut(), v_i.as_mut());
            (stage, v_i)
        });

        // The first stage is at the start of the step.
        let f = if I == 0 {
            self.f.as_ref()
        } else {
            let stage_t = t + tableau.alpha[I] * h;
            let u = drive.evaluate(stage_t, stage.as_ref());
            let point = EvaluationPoint { t: stage_t, y: stage.as_ref(), u, p, z };
            let f = self.rhs.as_mut();
            match (&mut directions, &of_s) {
                (Some(d), Some((stage, _))) => {
                    system.sensitivity_rhs(point, stage.as_ref(), f, d.rhs.as_mut());
                }
                _ => system.rhs(point, f),
            }
            self.rhs.as_ref()
        };

        // Uᵢ ← W⁻¹ (f + M/h Σ cᵢⱼ Uⱼ + h γᵢ df/dt)
        add_rates::<S>(u_i.as_mut(), f, self.dfdt.as_ref(), mass, per_h, slope);
        self.keep_sums(u_i.as_mut());
        self.factorisation.solve(u_i.as_mut());

        if let (Some(d), Some((_, v_i))) = (&directions, &mut of_s) {
            // Vᵢ ← W⁻¹ (g + M/h Σ cᵢⱼ Vⱼ + h γᵢ dg/dt + ∂g/∂y Uᵢ)
            let v_i = v_i.as_mut();
            let g = if I == 0 { d.g.as_ref() } else { d.rhs.as_ref() };
            let n = mass.len().max(1);
            let dgdt = d.dgdt.as_ref();
            for first in (0..v_i.len()).step_by(n) {
                let column = first..first + n;
                let (g, dgdt) = (&g[column.clone()], &dgdt[column.clone()]);
                add_rates::<S>(&mut v_i[column], g, dgdt, mass, per_h, slope);
            }
            let pattern = &system.signature().sensitivity_jacobian;
            add_product(v_i, pattern, d.dgdy.as_ref(), u_i.as_ref());
            self.keep_sums(v_i);
            self.factorisation.solve(v_i);
        }
        self.y_new = stage;
        self.k[I] = u_i;
        if let (Some(d), Some((stage, v_i))) = (directions, of_s) {
            d.stage = stage;
            d.v[I] = v_i;
        }
    }

    /// Increments add nothing to conserved sums.
    #[inline(always)]
    fn keep_sums(&self, right: &mut [f64]) {
        if S::FEATURES.conserved && self.keeps_sums {
            for sum in &self.sums {
                for column in right.chunks_exact_mut(sum.shares.len()) {
                    column[sum.row] = 0.0;
                }
            }
        }
    }

    /// The first evaluation of the last tried step that is not finite, and its time.
    fn find_non_finite(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: StepTrial<'_, S>,
        drive: &mut InputCursor<S>,
        mut directions: Option<&mut SensitivityWorkspace<S>>,
    ) -> Option<(f64, NonFinite)> {
        let StepTrial { base: StepBase { system, p, z, t, .. }, y, h, .. } = trial;
        let y = y.as_ref();
        let n = y.len();
        let bad = |values: &[f64]| values.iter().position(|value| !value.is_finite());
        let pattern = &system.signature().jacobian;

        if let Some(row) = bad(self.f.as_ref()) {
            return Some((t, NonFinite::Equation(row)));
        }
        let row = bad(self.jacobian.as_ref())
            .map(|k| pattern.position(k).0)
            .or_else(|| bad(self.dfdt.as_ref()));
        if let Some(row) = row {
            return Some((t, NonFinite::Derivative(row)));
        }
        if let Some(d) = &directions {
            let pattern = &system.signature().sensitivity_jacobian;
            let row = bad(d.g.as_ref())
                .or_else(|| bad(d.dgdt.as_ref()))
                .or_else(|| bad(d.dgdy.as_ref()).map(|k| pattern.position(k).0));
            if let Some(row) = row {
                return Some((t, NonFinite::Derivative(row % n)));
            }
        }
        for i in 1..tableau.stages() {
            let a = &tableau.a[i];
            let stage_t = t + tableau.alpha[i] * h;
            combine_any(y, &self.k[..i], a, self.stage.as_mut());
            let u = drive.evaluate(stage_t, self.stage.as_ref());
            let point = EvaluationPoint { t: stage_t, y: self.stage.as_ref(), u, p, z };
            let row = match &mut directions {
                None => {
                    system.rhs(point, self.rhs.as_mut());
                    bad(self.rhs.as_ref()).map(NonFinite::Equation)
                }
                Some(d) => {
                    combine_any(d.s.as_ref(), &d.v[..i], a, d.stage.as_mut());
                    let s = d.stage.as_ref();
                    system.sensitivity_rhs(point, s, self.rhs.as_mut(), d.rhs.as_mut());
                    bad(self.rhs.as_ref())
                        .map(NonFinite::Equation)
                        .or_else(|| bad(d.rhs.as_ref()).map(|row| NonFinite::Derivative(row % n)))
                }
            };
            if let Some(row) = row {
                return Some((stage_t, row));
            }
        }
        None
    }
}

/// b ← b + A x.
#[inline(always)]
pub(in crate::integrate) fn add_product(
    b: &mut [f64],
    pattern: &Pattern,
    values: &[f64],
    x: &[f64],
) {
    pattern.for_each(values, |row, column, value| b[row] += value * x[column]);
}

#[cfg(test)]
mod tests {
    /// Irregular numbers, of various signs and sizes.
    pub(super) fn number(k: usize) -> f64 {
        (k as f64 * 0.7 + 0.3).sin() * 10_f64.powf((k % 7) as f64 - 3.0)
    }
}
