//! One step of a Rosenbrock method, for the unknowns alone or with their sensitivities.
//!
//! Sensitivities are the same method applied to the system of y and S together. Its Jacobian is
//! block-triangular,
//!
//! ```text
//!   ⎡ J           ⎤        (M/(h γ) − J) Vᵢⱼ = gⱼ(stage) + (M/h) Σ c V + h γᵢ ∂gⱼ/∂t + ∂gⱼ/∂y Uᵢ
//!   ⎣ ∂gⱼ/∂y   J  ⎦
//! ```
//!
//! so that one factorisation serves all. Without ∂gⱼ/∂y, the second derivatives of f, the method
//! would lose its order.

// Lengths are constants where storage has a fixed size, and only once inlined there.
#![allow(clippy::inline_always)]

use super::drive::Drive;
use super::stepper::{Base, Directions, Spoilt, Stepper, Trial};
use super::tableau::{MAX_STAGES, RosenbrockTableau};
use crate::linalg::{Factorisation, Singular};
use crate::system::{Pattern, Point, Storage, System};

impl<S: System> Stepper<S> {
    /// Tries a step; the stepper is linearised where it starts.
    #[inline]
    pub(super) fn attempt_rosenbrock(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: Trial<'_, S>,
        drive: &mut Drive<S>,
        mut directions: Option<&mut Directions<S>>,
    ) -> Result<(), Singular> {
        let Trial { base: Base { system, p, z, mass, t }, y, h, .. } = trial;
        let signature = system.signature();
        let mass = mass.as_ref();
        let per_h = 1.0 / h;

        self.factorisation.factorise(
            per_h / tableau.gamma,
            |i| mass[i] != 0.0,
            &signature.jacobian,
            self.jacobian.as_ref(),
        )?;

        for i in 0..tableau.stages() {
            let (earlier, rest) = self.k.split_at_mut(i);
            let u_i = rest[0].as_mut();
            let (a, c) = (&tableau.a[i], &tableau.c[i]);
            let slope = h * tableau.gamma_sums[i];

            // Yᵢ = y + Σ aᵢⱼ Uⱼ,  Uᵢ ← Σ cᵢⱼ Uⱼ
            combine(y, earlier, a, c, self.stage.as_mut(), u_i);
            if let Some(d) = &mut directions {
                let (earlier, rest) = d.v.split_at_mut(i);
                combine(d.s.as_ref(), earlier, a, c, d.stage.as_mut(), rest[0].as_mut());
            }

            // The first stage stands where the step starts.
            let stage_t = t + tableau.alpha[i] * h;
            let u = drive.at(stage_t, self.stage.as_ref());
            let at = Point { t: stage_t, y: self.stage.as_ref(), u, p, z };
            let f = self.rhs.as_mut();
            match &mut directions {
                _ if i == 0 => f.copy_from_slice(self.f.as_ref()),
                None => system.rhs(at, f),
                Some(d) => system.sensitivity_rhs(at, d.stage.as_ref(), f, d.rhs.as_mut()),
            }

            // Uᵢ ← W⁻¹ (f + M/h Σ cᵢⱼ Uⱼ + h γᵢ df/dt)
            add_rates(u_i, f, self.dfdt.as_ref(), mass, per_h, slope);
            self.factorisation.solve(u_i);

            if let Some(d) = &mut directions {
                // Vᵢ ← W⁻¹ (g + M/h Σ cᵢⱼ Vⱼ + h γᵢ dg/dt + ∂g/∂y Uᵢ)
                let v_i = d.v[i].as_mut();
                let g = if i == 0 { d.g.as_ref() } else { d.rhs.as_ref() };
                let n = mass.len().max(1);
                let columns = v_i.chunks_exact_mut(n).zip(g.chunks_exact(n));
                for ((v, g), dgdt) in columns.zip(d.dgdt.as_ref().chunks_exact(n)) {
                    add_rates(v, g, dgdt, mass, per_h, slope);
                }
                add_product(v_i, &signature.sensitivity_jacobian, d.dgdy.as_ref(), u_i);
                self.factorisation.solve(v_i);
            }
        }

        // y⁺ = Y_s + U_s
        let last = tableau.stages() - 1;
        sum(self.stage.as_ref(), self.k[last].as_ref(), self.y_new.as_mut());
        if let Some(d) = directions {
            sum(d.stage.as_ref(), d.v[last].as_ref(), d.s_new.as_mut());
        }
        Ok(())
    }

    /// The first evaluation of the step tried last that is not finite, and its time.
    pub(super) fn spoilt_rosenbrock(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: Trial<'_, S>,
        drive: &mut Drive<S>,
        mut directions: Option<&mut Directions<S>>,
    ) -> Option<(f64, Spoilt)> {
        let Trial { base: Base { system, p, z, t, .. }, y, h, .. } = trial;
        let n = y.len();
        let bad = |values: &[f64]| values.iter().position(|value| !value.is_finite());
        let pattern = &system.signature().jacobian;

        if let Some(row) = bad(self.f.as_ref()) {
            return Some((t, Spoilt::Equation(row)));
        }
        let row = bad(self.jacobian.as_ref())
            .map(|k| pattern.position(k).0)
            .or_else(|| bad(self.dfdt.as_ref()));
        if let Some(row) = row {
            return Some((t, Spoilt::Derivative(row)));
        }
        if let Some(d) = &directions {
            let pattern = &system.signature().sensitivity_jacobian;
            let row = bad(d.g.as_ref())
                .or_else(|| bad(d.dgdt.as_ref()))
                .or_else(|| bad(d.dgdy.as_ref()).map(|k| pattern.position(k).0));
            if let Some(row) = row {
                return Some((t, Spoilt::Derivative(row % n)));
            }
        }
        for i in 1..tableau.stages() {
            let (a, c) = (&tableau.a[i], &tableau.c[i]);
            let stage_t = t + tableau.alpha[i] * h;
            combine(y, &self.k[..i], a, c, self.stage.as_mut(), self.rhs.as_mut());
            let u = drive.at(stage_t, self.stage.as_ref());
            let at = Point { t: stage_t, y: self.stage.as_ref(), u, p, z };
            let row = match &mut directions {
                None => {
                    system.rhs(at, self.rhs.as_mut());
                    bad(self.rhs.as_ref()).map(Spoilt::Equation)
                }
                Some(d) => {
                    combine(d.s.as_ref(), &d.v[..i], a, c, d.stage.as_mut(), d.rhs.as_mut());
                    let s = d.stage.as_ref();
                    system.sensitivity_rhs(at, s, self.rhs.as_mut(), d.rhs.as_mut());
                    bad(self.rhs.as_ref())
                        .map(Spoilt::Equation)
                        .or_else(|| bad(d.rhs.as_ref()).map(|row| Spoilt::Derivative(row % n)))
                }
            };
            if let Some(row) = row {
                return Some((stage_t, row));
            }
        }
        None
    }
}

/// `stage` ← y + Σ aⱼ kⱼ and `coupling` ← Σ cⱼ kⱼ in one pass over the kⱼ.
#[inline(always)]
fn combine<V: Storage>(
    y: &[f64],
    k: &[V],
    a: &[f64; MAX_STAGES],
    c: &[f64; MAX_STAGES],
    stage: &mut [f64],
    coupling: &mut [f64],
) {
    match k.len() {
        0 => {
            stage.copy_from_slice(y);
            coupling.fill(0.0);
        }
        1 => combine_all::<1, V>(y, k, a, c, stage, coupling),
        2 => combine_all::<2, V>(y, k, a, c, stage, coupling),
        3 => combine_all::<3, V>(y, k, a, c, stage, coupling),
        4 => combine_all::<4, V>(y, k, a, c, stage, coupling),
        5 => combine_all::<5, V>(y, k, a, c, stage, coupling),
        6 => combine_all::<6, V>(y, k, a, c, stage, coupling),
        _ => combine_all::<7, V>(y, k, a, c, stage, coupling),
    }
}

#[inline(always)]
fn combine_all<const J: usize, V: Storage>(
    y: &[f64],
    k: &[V],
    a: &[f64; MAX_STAGES],
    c: &[f64; MAX_STAGES],
    stage: &mut [f64],
    coupling: &mut [f64],
) {
    let n = y.len();
    let k: [&[f64]; J] = std::array::from_fn(|j| &k[j].as_ref()[..n]);
    let (stage, coupling) = (&mut stage[..n], &mut coupling[..n]);
    for i in 0..n {
        let (mut value, mut sum) = (y[i], 0.0);
        for j in 0..J {
            value += a[j] * k[j][i];
            sum += c[j] * k[j][i];
        }
        stage[i] = value;
        coupling[i] = sum;
    }
}

/// b ← f + M/h b + slope · df/dt.
#[inline(always)]
fn add_rates(b: &mut [f64], f: &[f64], dfdt: &[f64], mass: &[f64], per_h: f64, slope: f64) {
    for (((b, f), dfdt), mass) in b.iter_mut().zip(f).zip(dfdt).zip(mass) {
        *b = f + mass * per_h * *b + slope * dfdt;
    }
}

/// b ← b + A x.
#[inline(always)]
pub(super) fn add_product(b: &mut [f64], pattern: &Pattern, values: &[f64], x: &[f64]) {
    pattern.for_each(values, |row, column, value| b[row] += value * x[column]);
}

#[inline(always)]
fn sum(a: &[f64], b: &[f64], out: &mut [f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = a + b;
    }
}

/// kₗ = Σⱼ dₗⱼ Uⱼ.
#[inline(always)]
pub(super) fn dense_vectors<V: Storage>(tableau: &RosenbrockTableau, k: &[V], dense: &mut [V; 3]) {
    for (weights, out) in tableau.dense.iter().zip(dense) {
        let out = out.as_mut();
        out.fill(0.0);
        for (weight, k) in weights.iter().zip(k) {
            for (out, k) in out.iter_mut().zip(k.as_ref()) {
                *out += weight * k;
            }
        }
    }
}

/// (1−θ) y + θ (y⁺ + (1−θ) (k₁ + θ (k₂ + θ k₃))).
#[inline(always)]
pub(super) fn interpolate<V: Storage>(
    theta: f64,
    y: &[f64],
    y_new: &[f64],
    dense: &[V; 3],
    out: &mut [f64],
) {
    let rest = 1.0 - theta;
    let [k1, k2, k3] = dense.each_ref().map(AsRef::as_ref);
    for (((((out, y), y_new), k1), k2), k3) in
        out.iter_mut().zip(y).zip(y_new).zip(k1).zip(k2).zip(k3)
    {
        *out = rest * y + theta * (y_new + rest * (k1 + theta * (k2 + theta * k3)));
    }
}
