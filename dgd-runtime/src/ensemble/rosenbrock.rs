//! One step of a Rosenbrock method in each lane.

#![allow(clippy::inline_always)]

use super::dense::DensePolynomials;
use super::elimination::LaneLu;
use super::lanes::{LanePoint, LaneStorage, Lanes};
use super::stage::{LaneInputs, LaneTrial};
use crate::integrate::tableaux::{MAX_STAGES, RosenbrockTableau};
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// Work space.
pub(super) struct RosenbrockLanes<S: SolvableSystem> {
    f: <S::Vector as Storage>::Lanes,
    jacobian: <S::Jacobian as Storage>::Lanes,
    dfdt: <S::Vector as Storage>::Lanes,
    lu: LaneLu<S::Vector>,
    stage: <S::Vector as Storage>::Lanes,
    rhs: <S::Vector as Storage>::Lanes,
    k: [<S::Vector as Storage>::Lanes; MAX_STAGES],
}

impl<S: SolvableSystem> RosenbrockLanes<S> {
    pub(super) fn new(system: &S) -> Self {
        let signature = system.signature();
        let n = signature.unknowns.len();
        let zeros = || <S::Vector as Storage>::Lanes::zeros(n);
        Self {
            f: zeros(),
            jacobian: <S::Jacobian as Storage>::Lanes::zeros(signature.jacobian.len()),
            dfdt: zeros(),
            lu: LaneLu::new(n, &signature.jacobian),
            stage: zeros(),
            rhs: zeros(),
            k: std::array::from_fn(|_| zeros()),
        }
    }

    /// Tries a step; returns y⁺.
    ///
    /// ```text
    ///   (M/(h γ) − J) Uᵢ = f(t + αᵢ h, Yᵢ) + (M/h) Σⱼ cᵢⱼ Uⱼ + h γᵢ ∂f/∂t,  Yᵢ = y + Σⱼ aᵢⱼ Uⱼ
    ///   y⁺ = Y_s + U_s
    /// ```
    #[inline(always)]
    pub(super) fn attempt(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: &LaneTrial<'_, S>,
        inputs: &mut LaneInputs<S>,
        y_new: &mut [Lanes],
    ) {
        let Self { f, jacobian, dfdt, lu, stage, rhs, k, .. } = self;
        let LaneTrial { system, p, mass, t, y, h, sizes } = *trial;
        let n = mass.len();
        inputs.set(*t);
        system.linearize_lanes(
            LanePoint { t, y, u: inputs.now.lanes(), p },
            inputs.slope.lanes(),
            f.lanes_mut(),
            jacobian.lanes_mut(),
            dfdt.lanes_mut(),
        );
        let per_h = h.map(|h| 1.0 / h);
        let c = per_h.map(|per_h| per_h / tableau.gamma);
        lu.factorise(c, mass, &system.signature().jacobian, jacobian.lanes(), sizes);

        for i in 0..tableau.stages() {
            let (earlier, rest) = k.split_at_mut(i);
            let u_i = &mut rest[0].lanes_mut()[..n];
            let (a, c) = (&tableau.a[i], &tableau.c[i]);
            combine(y, earlier, a, c, stage.lanes_mut(), u_i);
            if i == 0 {
                rhs.lanes_mut().copy_from_slice(f.lanes());
            } else {
                trial.rhs(tableau.alpha[i], stage.lanes(), inputs, rhs.lanes_mut());
            }
            let slope = h.map(|h| h * tableau.gamma_sums[i]);
            let rates = rhs.lanes().iter().zip(dfdt.lanes()).zip(mass);
            for (u, ((f, dfdt), mass)) in u_i.iter_mut().zip(rates) {
                *u = *f + *mass * per_h * *u + slope * *dfdt;
            }
            lu.solve(n, u_i);
        }
        let last = k[tableau.stages() - 1].lanes();
        for ((y_new, stage), u) in y_new.iter_mut().zip(stage.lanes()).zip(last) {
            *y_new = *stage + *u;
        }
    }

    /// The local error of the last tried step.
    #[inline(always)]
    pub(super) fn error(&self, tableau: &RosenbrockTableau) -> &[Lanes] {
        self.k[tableau.stages() - 1].lanes()
    }

    /// Writes the dense output of the last tried step, from y to y⁺, with kₗ = Σⱼ dₗⱼ Uⱼ:
    ///
    /// ```text
    ///   c₁ = y⁺ − y + k₁,   c₂ = k₂ − k₁,   c₃ = k₃ − k₂,   c₄ = −k₃
    /// ```
    #[inline(always)]
    pub(super) fn write_dense(
        &self,
        tableau: &RosenbrockTableau,
        y: &[Lanes],
        y_new: &[Lanes],
        out: &mut DensePolynomials<S>,
    ) {
        let [c1, c2, c3, c4] = &mut out.c;
        let (c1, c2) = (c1.lanes_mut(), c2.lanes_mut());
        let (c3, c4) = (c3.lanes_mut(), c4.lanes_mut());
        for i in 0..y.len() {
            let [d1, d2, d3] = tableau.dense;
            let (mut k1, mut k2, mut k3) = (Lanes::ZERO, Lanes::ZERO, Lanes::ZERO);
            for (((d1, d2), d3), k) in d1.iter().zip(d2).zip(d3).zip(&self.k) {
                let k = k.lanes()[i];
                k1 = k1 + *d1 * k;
                k2 = k2 + *d2 * k;
                k3 = k3 + *d3 * k;
            }
            c1[i] = y_new[i] - y[i] + k1;
            c2[i] = k2 - k1;
            c3[i] = k3 - k2;
            c4[i] = -k3;
        }
    }
}

/// `stage` ← y + Σ aⱼ kⱼ and `coupling` ← Σ cⱼ kⱼ in one pass over the kⱼ.
#[inline(always)]
fn combine<V: LaneStorage>(
    y: &[Lanes],
    k: &[V],
    a: &[f64; MAX_STAGES],
    c: &[f64; MAX_STAGES],
    stage: &mut [Lanes],
    coupling: &mut [Lanes],
) {
    match k.len() {
        0 => {
            stage.copy_from_slice(y);
            coupling.fill(Lanes::ZERO);
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
fn combine_all<const J: usize, V: LaneStorage>(
    y: &[Lanes],
    k: &[V],
    a: &[f64; MAX_STAGES],
    c: &[f64; MAX_STAGES],
    stage: &mut [Lanes],
    coupling: &mut [Lanes],
) {
    let n = y.len();
    let mut slopes: [&[Lanes]; J] = [&[]; J];
    for (lanes, k) in slopes.iter_mut().zip(k) {
        *lanes = &k.lanes()[..n];
    }
    let (stage, coupling) = (&mut stage[..n], &mut coupling[..n]);
    for i in 0..n {
        let (mut value, mut sum) = (y[i], Lanes::ZERO);
        for j in 0..J {
            value = value + a[j] * slopes[j][i];
            sum = sum + c[j] * slopes[j][i];
        }
        stage[i] = value;
        coupling[i] = sum;
    }
}
