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
use super::tableau::{MAX_STAGES, RosenbrockTableau};
use crate::linalg::{Factorisation, Singular};
use crate::system::{Pattern, Point, Storage, System};

/// Work space of the unknowns.
pub(crate) struct Rosenbrock<S: System> {
    tableau: &'static RosenbrockTableau,
    factorisation: S::Factorisation,
    /// f, ∂f/∂y and df/dt at the start of the step.
    pub(crate) f: S::Vector,
    pub(crate) jacobian: S::Jacobian,
    pub(crate) dfdt: S::Vector,
    /// Yᵢ, and f there.
    stage: S::Vector,
    pub(crate) rhs: S::Vector,
    /// Uᵢ.
    u: [S::Vector; MAX_STAGES],
    pub(crate) y_new: S::Vector,
    dense: [S::Vector; 3],
}

/// Work space of the sensitivities.
pub(crate) struct Directions<S: System> {
    /// S at the start of the step.
    pub(crate) s: S::Sensitivity,
    pub(crate) s_new: S::Sensitivity,
    /// Sizes for tolerances: nominal of the unknown over nominal of the parameter.
    pub(crate) sizes: S::Sensitivity,
    /// g, ∂g/∂y and dg/dt at the start of the step.
    pub(crate) g: S::Sensitivity,
    dgdy: S::SensitivityJacobian,
    dgdt: S::Sensitivity,
    stage: S::Sensitivity,
    rhs: S::Sensitivity,
    /// Vᵢ.
    v: [S::Sensitivity; MAX_STAGES],
    dense: [S::Sensitivity; 3],
}

impl<S: System> Directions<S> {
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
            dense: std::array::from_fn(|_| zeros()),
        }
    }

    /// S at the fraction θ of the step tried last.
    #[inline]
    pub(crate) fn interpolate(&self, theta: f64, out: &mut [f64]) {
        interpolate(theta, self.s.as_ref(), self.s_new.as_ref(), &self.dense, out);
    }
}

/// Where a step starts.
pub(crate) struct Base<'a, S: System> {
    pub(crate) system: &'a S,
    pub(crate) p: &'a [f64],
    pub(crate) z: &'a [f64],
    /// 1 where the unknown is differential, 0 where it is algebraic.
    pub(crate) mass: &'a S::Vector,
    pub(crate) t: f64,
}

impl<S: System> Clone for Base<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: System> Copy for Base<'_, S> {}

/// Evaluations of f that are not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Spoilt {
    Equation(usize),
    Derivative(usize),
}

impl<S: System> Rosenbrock<S> {
    pub(crate) fn new(system: &S, tableau: &'static RosenbrockTableau) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let zeros = || S::Vector::zeros(n);
        Self {
            tableau,
            factorisation: S::Factorisation::new(n, &signature.jacobian),
            f: zeros(),
            jacobian: S::Jacobian::zeros(signature.jacobian.len()),
            dfdt: zeros(),
            stage: zeros(),
            rhs: zeros(),
            u: std::array::from_fn(|_| zeros()),
            y_new: zeros(),
            dense: std::array::from_fn(|_| zeros()),
        }
    }

    /// Evaluates everything that a step from (t, y) shares between its stages.
    #[inline]
    pub(crate) fn linearize(
        &mut self,
        base: Base<'_, S>,
        drive: &mut Drive<S>,
        y: &[f64],
        directions: Option<(&mut Directions<S>, At)>,
    ) {
        let (u, udot) = drive.with_slope(base.t, y);
        let at = Point { t: base.t, y, u, p: base.p, z: base.z };
        let (f, jacobian, dfdt) = (self.f.as_mut(), self.jacobian.as_mut(), self.dfdt.as_mut());
        match directions {
            None => base.system.linearize(at, udot, f, jacobian, dfdt),
            Some((directions, place)) => {
                let s = match place {
                    At::Start => &directions.s,
                    At::End => &directions.s_new,
                };
                base.system.sensitivity_linearize(
                    at,
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

    /// Tries a step of size h from (t, y), where [`Rosenbrock::linearize`] was called; gives y⁺ in
    /// `y_new` and S⁺ in `s_new`. Accepting or rejecting it is the caller's business.
    #[inline]
    pub(crate) fn attempt(
        &mut self,
        base: Base<'_, S>,
        drive: &mut Drive<S>,
        y: &[f64],
        h: f64,
        mut directions: Option<&mut Directions<S>>,
    ) -> Result<(), Singular> {
        let Base { system, p, z, mass, t } = base;
        let signature = system.signature();
        let tableau = self.tableau;
        let mass = mass.as_ref();
        let per_h = 1.0 / h;

        self.factorisation.factorise(
            per_h / tableau.gamma,
            |i| mass[i] != 0.0,
            &signature.jacobian,
            self.jacobian.as_ref(),
        )?;

        for i in 0..tableau.stages() {
            let (earlier, rest) = self.u.split_at_mut(i);
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
        sum(self.stage.as_ref(), self.u[last].as_ref(), self.y_new.as_mut());
        if let Some(d) = directions {
            sum(d.stage.as_ref(), d.v[last].as_ref(), d.s_new.as_mut());
        }
        Ok(())
    }

    /// Local error of the step tried last.
    #[inline]
    pub(crate) fn local_error(&self) -> &[f64] {
        self.u[self.tableau.stages() - 1].as_ref()
    }

    /// Local error of the sensitivities of the step tried last.
    #[inline]
    pub(crate) fn sensitivity_error<'a>(&self, directions: &'a Directions<S>) -> &'a [f64] {
        directions.v[self.tableau.stages() - 1].as_ref()
    }

    /// The first evaluation of the step tried last that is not finite, and its time.
    pub(crate) fn spoilt(
        &mut self,
        base: Base<'_, S>,
        drive: &mut Drive<S>,
        y: &[f64],
        h: f64,
        mut directions: Option<&mut Directions<S>>,
    ) -> Option<(f64, Spoilt)> {
        let Base { system, p, z, t, .. } = base;
        let n = y.len();
        let bad = |values: &[f64]| values.iter().position(|value| !value.is_finite());
        let pattern = &system.signature().jacobian;

        if let Some(row) = bad(self.f.as_ref()) {
            return Some((t, Spoilt::Equation(row)));
        }
        let row = bad(self.jacobian.as_ref())
            .map(|k| pattern.rows[k])
            .or_else(|| bad(self.dfdt.as_ref()));
        if let Some(row) = row {
            return Some((t, Spoilt::Derivative(row)));
        }
        if let Some(d) = &directions {
            let rows = &system.signature().sensitivity_jacobian.rows;
            let row = bad(d.g.as_ref())
                .or_else(|| bad(d.dgdt.as_ref()))
                .or_else(|| bad(d.dgdy.as_ref()).map(|k| rows[k]));
            if let Some(row) = row {
                return Some((t, Spoilt::Derivative(row % n)));
            }
        }
        for i in 1..self.tableau.stages() {
            let (a, c) = (&self.tableau.a[i], &self.tableau.c[i]);
            let stage_t = t + self.tableau.alpha[i] * h;
            combine(y, &self.u[..i], a, c, self.stage.as_mut(), self.rhs.as_mut());
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

    /// Prepares [`Rosenbrock::interpolate`] for the step tried last.
    #[inline]
    pub(crate) fn prepare_dense(&mut self, directions: Option<&mut Directions<S>>) {
        let stages = self.tableau.stages();
        dense_vectors(self.tableau, &self.u[..stages], &mut self.dense);
        if let Some(d) = directions {
            dense_vectors(self.tableau, &d.v[..stages], &mut d.dense);
        }
    }

    /// y at the fraction θ of the step tried last.
    #[inline]
    pub(crate) fn interpolate(&self, theta: f64, y: &[f64], out: &mut [f64]) {
        interpolate(theta, y, self.y_new.as_ref(), &self.dense, out);
    }
}

/// End of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum At {
    Start,
    End,
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
fn add_product(b: &mut [f64], pattern: &Pattern, values: &[f64], x: &[f64]) {
    for ((&row, &column), value) in pattern.rows.iter().zip(pattern.columns.iter()).zip(values) {
        b[row] += value * x[column];
    }
}

#[inline(always)]
fn sum(a: &[f64], b: &[f64], out: &mut [f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = a + b;
    }
}

/// kₗ = Σⱼ dₗⱼ Uⱼ.
#[inline(always)]
fn dense_vectors<V: Storage>(tableau: &RosenbrockTableau, k: &[V], dense: &mut [V; 3]) {
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
fn interpolate<V: Storage>(theta: f64, y: &[f64], y_new: &[f64], dense: &[V; 3], out: &mut [f64]) {
    let rest = 1.0 - theta;
    let [k1, k2, k3] = dense.each_ref().map(AsRef::as_ref);
    for (((((out, y), y_new), k1), k2), k3) in
        out.iter_mut().zip(y).zip(y_new).zip(k1).zip(k2).zip(k3)
    {
        *out = rest * y + theta * (y_new + rest * (k1 + theta * (k2 + theta * k3)));
    }
}
