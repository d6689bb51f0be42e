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
        directions: Option<&mut Directions<S>>,
    ) -> Result<(), Singular> {
        let Trial { base: Base { system, mass, .. }, h, .. } = trial;
        let mass = mass.as_ref();
        self.factorisation.factorise(
            1.0 / (h * tableau.gamma),
            |i| !S::FEATURES.algebraic || mass[i] != 0.0,
            &system.signature().jacobian,
            self.jacobian.as_ref(),
        )?;
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
        trial: Trial<'_, S>,
        drive: &mut Drive<S>,
        mut directions: Option<&mut Directions<S>>,
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

        // y⁺ = Y_s + U_s. Y is kept where y⁺ comes to be: one vector less for large models.
        let last = stages - 1;
        for (y, u) in self.y_new.as_mut().iter_mut().zip(self.k[last].as_ref()) {
            *y += u;
        }
        if let Some(d) = directions {
            sum(d.stage.as_ref(), d.v[last].as_ref(), d.s_new.as_mut());
        }
    }

    /// The stage after I others: its increments, from theirs.
    #[inline(always)]
    fn make_stage<const I: usize>(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: Trial<'_, S>,
        drive: &mut Drive<S>,
        mut directions: Option<&mut Directions<S>>,
    ) {
        let Trial { base: Base { system, p, z, mass, t }, y, h, .. } = trial;
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

        // The first stage stands where the step starts.
        let f = if I == 0 {
            self.f.as_ref()
        } else {
            let stage_t = t + tableau.alpha[I] * h;
            let u = drive.at(stage_t, stage.as_ref());
            let at = Point { t: stage_t, y: stage.as_ref(), u, p, z };
            let f = self.rhs.as_mut();
            match (&mut directions, &of_s) {
                (Some(d), Some((stage, _))) => {
                    system.sensitivity_rhs(at, stage.as_ref(), f, d.rhs.as_mut());
                }
                _ => system.rhs(at, f),
            }
            self.rhs.as_ref()
        };

        // Uᵢ ← W⁻¹ (f + M/h Σ cᵢⱼ Uⱼ + h γᵢ df/dt)
        add_rates::<S>(u_i.as_mut(), f, self.dfdt.as_ref(), mass, per_h, slope);
        self.factorisation.solve(u_i.as_mut());

        if let (Some(d), Some((_, v_i))) = (&directions, &mut of_s) {
            // Vᵢ ← W⁻¹ (g + M/h Σ cᵢⱼ Vⱼ + h γᵢ dg/dt + ∂g/∂y Uᵢ)
            let v_i = v_i.as_mut();
            let g = if I == 0 { d.g.as_ref() } else { d.rhs.as_ref() };
            let n = mass.len().max(1);
            let columns = v_i.chunks_exact_mut(n).zip(g.chunks_exact(n));
            for ((v, g), dgdt) in columns.zip(d.dgdt.as_ref().chunks_exact(n)) {
                add_rates::<S>(v, g, dgdt, mass, per_h, slope);
            }
            let pattern = &system.signature().sensitivity_jacobian;
            add_product(v_i, pattern, d.dgdy.as_ref(), u_i.as_ref());
            self.factorisation.solve(v_i);
        }
        self.y_new = stage;
        self.k[I] = u_i;
        if let (Some(d), Some((stage, v_i))) = (directions, of_s) {
            d.stage = stage;
            d.v[I] = v_i;
        }
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
        let y = y.as_ref();
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
            let a = &tableau.a[i];
            let stage_t = t + tableau.alpha[i] * h;
            combine_any(y, &self.k[..i], a, self.stage.as_mut());
            let u = drive.at(stage_t, self.stage.as_ref());
            let at = Point { t: stage_t, y: self.stage.as_ref(), u, p, z };
            let row = match &mut directions {
                None => {
                    system.rhs(at, self.rhs.as_mut());
                    bad(self.rhs.as_ref()).map(Spoilt::Equation)
                }
                Some(d) => {
                    combine_any(d.s.as_ref(), &d.v[..i], a, d.stage.as_mut());
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

/// `stage` ← y + Σ aⱼ kⱼ and `coupling` ← Σ cⱼ kⱼ of J increments, in one pass over them.
///
/// Where the method closes, a differs from that of the stage before by a one for its increment:
/// `stage` goes on from there.
#[inline(always)]
fn combine<const J: usize, V: Storage>(
    y: &[f64],
    k: &[V],
    a: &[f64; MAX_STAGES],
    c: &[f64; MAX_STAGES],
    closes: bool,
    stage: &mut [f64],
    coupling: &mut [f64],
) {
    let n = y.len();
    let k: [&[f64]; J] = std::array::from_fn(|j| &k[j].as_ref()[..n]);
    let (stage, coupling) = (&mut stage[..n], &mut coupling[..n]);
    coupling.fill(0.0);
    if J > 0 && closes {
        for i in 0..n {
            stage[i] += k[J - 1][i];
        }
        for j in 0..J {
            for i in 0..n {
                coupling[i] += c[j] * k[j][i];
            }
        }
    } else {
        stage.copy_from_slice(y);
        for j in 0..J {
            for i in 0..n {
                stage[i] += a[j] * k[j][i];
                coupling[i] += c[j] * k[j][i];
            }
        }
    }
}

/// `stage` ← y + Σ aⱼ kⱼ of all increments in `k`.
fn combine_any<V: Storage>(y: &[f64], k: &[V], a: &[f64; MAX_STAGES], stage: &mut [f64]) {
    stage.copy_from_slice(y);
    for (a, k) in a.iter().zip(k) {
        for (stage, k) in stage.iter_mut().zip(k.as_ref()) {
            *stage += a * k;
        }
    }
}

/// b ← f + M/h b + slope · df/dt.
#[inline(always)]
fn add_rates<S: System>(
    b: &mut [f64],
    f: &[f64],
    dfdt: &[f64],
    mass: &[f64],
    per_h: f64,
    slope: f64,
) {
    for (((b, f), dfdt), mass) in b.iter_mut().zip(f).zip(dfdt).zip(mass) {
        let mass = if S::FEATURES.algebraic { *mass } else { 1.0 };
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

/// cₗ of y + θ (c₁ + θ (c₂ + θ (c₃ + θ c₄))), the dense output of the tableau in powers of θ, with
/// kₗ = Σⱼ dₗⱼ Uⱼ:
///
/// ```text
///   c₁ = y⁺ − y + k₁,   c₂ = k₂ − k₁,   c₃ = k₃ − k₂,   c₄ = −k₃
/// ```
#[inline(always)]
pub(super) fn dense_vectors<V: Storage>(
    tableau: &RosenbrockTableau,
    y: &[f64],
    y_new: &[f64],
    k: &[V],
    dense: &mut [V; 4],
) {
    let [c1, c2, c3, c4] = dense.each_mut().map(AsMut::as_mut);
    let n = y.len();
    let (c1, c2, c3, c4) = (&mut c1[..n], &mut c2[..n], &mut c3[..n], &mut c4[..n]);
    let [d1, d2, d3] = tableau.dense;
    weigh(d1, k, c1);
    weigh(d2, k, c2);
    weigh(d3, k, c3);
    for i in 0..n {
        let [k1, k2, k3] = [c1[i], c2[i], c3[i]];
        c1[i] = y_new[i] - y[i] + k1;
        c2[i] = k2 - k1;
        c3[i] = k3 - k2;
        c4[i] = -k3;
    }
}

/// `sum` ← Σ wⱼ kⱼ.
#[inline(always)]
fn weigh<V: Storage>(weights: &[f64], k: &[V], sum: &mut [f64]) {
    sum.fill(0.0);
    for (weight, k) in weights.iter().zip(k) {
        for (sum, k) in sum.iter_mut().zip(k.as_ref()) {
            *sum += weight * k;
        }
    }
}

/// y + θ (c₁ + θ (c₂ + θ (c₃ + θ c₄))).
#[inline(always)]
pub(super) fn interpolate<V: Storage>(theta: f64, y: &[f64], dense: &[V; 4], out: &mut [f64]) {
    let n = y.len();
    let [c1, c2, c3, c4] = dense.each_ref().map(|c| &c.as_ref()[..n]);
    for (i, out) in out[..n].iter_mut().enumerate() {
        *out = y[i] + theta * (c1[i] + theta * (c2[i] + theta * (c3[i] + theta * c4[i])));
    }
}

/// [`interpolate`] at each of the `asked` times, θ = (t − from)/h, appended to `out`. `row` is work
/// space. Not inlined, so that what is written is known to be apart from what is read.
#[inline(never)]
pub(super) fn interpolate_all<V: Storage>(
    (from, per_h): (f64, f64),
    asked: &[f64],
    y: &V,
    dense: &[V; 4],
    row: &mut V,
    out: &mut Vec<f64>,
) {
    let n = y.as_ref().len();
    if n > 2 {
        for t in asked {
            interpolate((t - from) * per_h, y.as_ref(), dense, row.as_mut());
            out.extend_from_slice(row.as_ref());
        }
        return;
    }
    // Few components do not fill vector instructions: times are put side by side.
    let recorded = out.len();
    out.resize(recorded + n * asked.len(), 0.0);
    for (t, out) in asked.iter().zip(out[recorded..].chunks_exact_mut(n.max(1))) {
        interpolate((t - from) * per_h, y.as_ref(), dense, out);
    }
}
