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

use crate::integrate::drive::Drive;
use crate::integrate::methods::newton::failed;
use crate::integrate::methods::stepper::{Base, Directions, Failed, Spoilt, Stepper, Trial};
use crate::integrate::methods::tableaux::{MAX_STAGES, RosenbrockTableau};
use crate::linalg::Factorisation;
use crate::system::{Pattern, Point, Storage, System};
use crate::width::{Work, run_by_fours};

/// Does something with each block of numbers from `$first` on, `$len` of them as a constant: what is
/// summed up over a block is in registers, and what is read cannot be what is written. Where all lengths
/// are constants, compilers do as well by themselves.
macro_rules! in_blocks {
    ($n:expr, |$len:ident, $first:ident| $body:block) => {
        let mut $first = 0;
        while $first + 4 <= $n {
            const $len: usize = 4;
            $body
            $first += $len;
        }
        if $first + 2 <= $n {
            const $len: usize = 2;
            $body
            $first += $len;
        }
        if $first < $n {
            const $len: usize = 1;
            $body
        }
    };
}

impl<S: System> Stepper<S> {
    /// Tries a step; the stepper is linearised where it starts.
    #[inline]
    pub(in crate::integrate) fn attempt_rosenbrock(
        &mut self,
        tableau: &RosenbrockTableau,
        trial: Trial<'_, S>,
        drive: &mut Drive<S>,
        directions: Option<&mut Directions<S>>,
    ) -> Result<(), Failed> {
        let Trial { base: Base { system, mass, t, .. }, h, .. } = trial;
        let mass = mass.as_ref();
        let pattern = &system.signature().jacobian;
        let jacobian = self.jacobian.as_ref();
        let factorised = self.factorisation.factorise(
            1.0 / (h * tableau.gamma),
            |i| !S::FEATURES.algebraic || mass[i] != 0.0,
            pattern,
            jacobian,
        );
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
            let dgdt = d.dgdt.as_ref();
            for first in (0..v_i.len()).step_by(n) {
                let column = first..first + n;
                let (g, dgdt) = (&g[column.clone()], &dgdt[column.clone()]);
                add_rates::<S>(&mut v_i[column], g, dgdt, mass, per_h, slope);
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
    pub(in crate::integrate) fn spoilt_rosenbrock(
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
    let (stage, coupling) = (&mut stage[..n], &mut coupling[..n]);
    if V::FIXED {
        coupling.fill(0.0);
        if J > 0 && closes {
            let last = &k[J - 1].as_ref()[..n];
            for i in 0..n {
                stage[i] += last[i];
            }
        } else {
            stage.copy_from_slice(y);
        }
        for j in 0..J {
            let k = &k[j].as_ref()[..n];
            for i in 0..n {
                if !closes {
                    stage[i] += a[j] * k[i];
                }
                coupling[i] += c[j] * k[i];
            }
        }
        return;
    }
    in_blocks!(n, |L, first| {
        let block = first..first + L;
        let (mut sum, mut coupled) = (block_at::<L>(y, first), [0.0; L]);
        if J > 0 && closes {
            sum = block_at(stage, first);
            let last = block_at::<L>(k[J - 1].as_ref(), first);
            for l in 0..L {
                sum[l] += last[l];
            }
        }
        for j in 0..J {
            let k = block_at::<L>(k[j].as_ref(), first);
            for l in 0..L {
                if !closes {
                    sum[l] += a[j] * k[l];
                }
                coupled[l] += c[j] * k[l];
            }
        }
        stage[block.clone()].copy_from_slice(&sum);
        coupling[block].copy_from_slice(&coupled);
    });
}

/// L numbers from this place on.
#[inline(always)]
fn block_at<const L: usize>(values: &[f64], first: usize) -> [f64; L] {
    let mut block = [0.0; L];
    block.copy_from_slice(&values[first..first + L]);
    block
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
    let n = b.len();
    let (f, dfdt, mass) = (&f[..n], &dfdt[..n], &mass[..n]);
    for i in 0..n {
        let mass = if S::FEATURES.algebraic { mass[i] } else { 1.0 };
        b[i] = f[i] + mass * per_h * b[i] + slope * dfdt[i];
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
pub(in crate::integrate) fn dense_vectors<V: Storage>(
    tableau: &RosenbrockTableau,
    y: &[f64],
    y_new: &[f64],
    k: &[V],
    dense: &mut [V; 4],
) {
    let [c1, c2, c3, c4] = dense;
    let n = y.len();
    let (c1, c2) = (&mut c1.as_mut()[..n], &mut c2.as_mut()[..n]);
    let (c3, c4) = (&mut c3.as_mut()[..n], &mut c4.as_mut()[..n]);
    let [d1, d2, d3] = tableau.dense;
    if V::FIXED {
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
        return;
    }
    in_blocks!(n, |L, first| {
        let (mut k1, mut k2, mut k3) = ([0.0; L], [0.0; L], [0.0; L]);
        for (((d1, d2), d3), k) in d1.iter().zip(d2).zip(d3).zip(k) {
            let k = block_at::<L>(k.as_ref(), first);
            for l in 0..L {
                k1[l] += d1 * k[l];
                k2[l] += d2 * k[l];
                k3[l] += d3 * k[l];
            }
        }
        let (y, y_new) = (block_at::<L>(y, first), block_at::<L>(y_new, first));
        for l in 0..L {
            let i = first + l;
            c1[i] = y_new[l] - y[l] + k1[l];
            c2[i] = k2[l] - k1[l];
            c3[i] = k3[l] - k2[l];
            c4[i] = -k3[l];
        }
    });
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
pub(in crate::integrate) fn interpolate<V: Storage>(
    theta: f64,
    y: &[f64],
    dense: &[V; 4],
    out: &mut [f64],
) {
    let n = y.len();
    let [c1, c2, c3, c4] = dense;
    let (c1, c2) = (&c1.as_ref()[..n], &c2.as_ref()[..n]);
    let (c3, c4) = (&c3.as_ref()[..n], &c4.as_ref()[..n]);
    for (i, out) in out[..n].iter_mut().enumerate() {
        *out = y[i] + theta * (c1[i] + theta * (c2[i] + theta * (c3[i] + theta * c4[i])));
    }
}

/// [`interpolate`] at each of the `asked` times, θ = (t − from)/h, appended to `out`.
pub(in crate::integrate) fn interpolate_all<V: Storage>(
    (from, per_h): (f64, f64),
    asked: &[f64],
    y: &V,
    dense: &[V; 4],
    out: &mut Vec<f64>,
) {
    let recorded = out.len();
    out.resize(recorded + y.as_ref().len() * asked.len(), 0.0);
    let out = &mut out[recorded..];
    run_by_fours(Rows { from, per_h, asked, y, dense, out });
}

/// Rows of dense output to be written.
struct Rows<'a, V> {
    from: f64,
    per_h: f64,
    asked: &'a [f64],
    y: &'a V,
    dense: &'a [V; 4],
    out: &'a mut [f64],
}

impl<V: Storage> Work for Rows<'_, V> {
    #[inline(always)]
    fn run(self) {
        match self.y.as_ref().len() {
            1 => self.run_few::<1, 8>(),
            2 => self.run_few::<2, 4>(),
            4 => self.run_few::<4, 2>(),
            n => {
                let Self { from, per_h, asked, y, dense, out } = self;
                for (t, out) in asked.iter().zip(out.chunks_exact_mut(n.max(1))) {
                    interpolate((t - from) * per_h, y.as_ref(), dense, out);
                }
            }
        }
    }
}

impl<V: Storage> Rows<'_, V> {
    /// Rows of N numbers, too few to fill vector operations: T of them side by side.
    #[inline(always)]
    fn run_few<const N: usize, const T: usize>(self) {
        let Self { from, per_h, asked, y, dense, out } = self;
        let (blocks, rest) = asked.as_chunks::<T>();
        let (blocks_out, rest_out) = out.as_chunks_mut::<N>().0.as_chunks_mut::<T>();
        let mut parts = [[[0.0; N]; T]; 5];
        for (part, values) in parts.iter_mut().zip([y].into_iter().chain(dense)) {
            for row in part {
                row.copy_from_slice(values.as_ref());
            }
        }
        let [y_0, c1, c2, c3, c4] = parts;
        for (t, rows) in blocks.iter().zip(blocks_out) {
            for k in 0..T {
                let theta = (t[k] - from) * per_h;
                for i in 0..N {
                    let inner = c2[k][i] + theta * (c3[k][i] + theta * c4[k][i]);
                    rows[k][i] = y_0[k][i] + theta * (c1[k][i] + theta * inner);
                }
            }
        }
        for (t, row) in rest.iter().zip(rest_out) {
            interpolate((t - from) * per_h, y.as_ref(), dense, row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers without a pattern, of all signs and sizes.
    fn number(k: usize) -> f64 {
        (k as f64 * 0.7 + 0.3).sin() * 10_f64.powf((k % 7) as f64 - 3.0)
    }

    fn rows_are_those_of_single_times<V: Storage>(n: usize) {
        let numbers = |first: usize| {
            let mut vector = V::zeros(n);
            for (i, value) in vector.as_mut().iter_mut().enumerate() {
                *value = number(100 * first + i);
            }
            vector
        };
        let (y, dense) = (numbers(0), [numbers(1), numbers(2), numbers(3), numbers(4)]);
        let (from, per_h) = (1.5, 1.0 / 0.7);
        for times in 0..20 {
            let asked: Vec<f64> = (0..times).map(|k| from + 0.03 * f64::from(k)).collect();
            let mut rows = vec![7.0];
            interpolate_all((from, per_h), &asked, &y, &dense, &mut rows);
            let mut expected = vec![7.0];
            for t in &asked {
                let mut row = vec![0.0; n];
                interpolate((t - from) * per_h, y.as_ref(), &dense, &mut row);
                expected.extend(row);
            }
            assert_eq!(rows, expected, "{n} numbers, {times} times");
        }
    }

    #[test]
    fn rows_of_dense_output_have_the_bits_of_single_times() {
        rows_are_those_of_single_times::<[f64; 1]>(1);
        rows_are_those_of_single_times::<[f64; 2]>(2);
        rows_are_those_of_single_times::<[f64; 3]>(3);
        rows_are_those_of_single_times::<[f64; 4]>(4);
        rows_are_those_of_single_times::<[f64; 10]>(10);
        rows_are_those_of_single_times::<Vec<f64>>(2);
        rows_are_those_of_single_times::<Vec<f64>>(11);
    }

    /// The sums of the stages and of the dense output, by the two ways in which they are made.
    #[test]
    fn sums_have_the_same_bits_on_stack_and_heap() {
        const N: usize = 11;
        let values = |first: usize| -> [f64; N] { std::array::from_fn(|i| number(50 * first + i)) };
        let k: [[f64; N]; 8] = std::array::from_fn(|j| values(j + 1));
        let heap: Vec<Vec<f64>> = k.iter().map(|k| k.to_vec()).collect();
        let y = values(0);
        let a: [f64; MAX_STAGES] = std::array::from_fn(|j| number(900 + j));
        let c: [f64; MAX_STAGES] = std::array::from_fn(|j| number(950 + j));
        for closes in [false, true] {
            let (mut stage, mut coupling) = (values(20), values(21));
            let (mut on_heap, mut coupled) = (stage, coupling);
            combine::<5, _>(&y, &k, &a, &c, closes, &mut stage, &mut coupling);
            combine::<5, _>(&y, &heap, &a, &c, closes, &mut on_heap, &mut coupled);
            assert_eq!((stage, coupling), (on_heap, coupled), "closes: {closes}");
        }
        let tableau = &crate::integrate::methods::tableaux::RODAS5P;
        let stages = tableau.stages();
        let mut dense = [[0.0; N]; 4];
        let mut on_heap: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; N]);
        dense_vectors(tableau, &y, &values(30), &k[..stages], &mut dense);
        dense_vectors(tableau, &y, &values(30), &heap[..stages], &mut on_heap);
        assert_eq!(dense.map(|c| c.to_vec()), on_heap);
    }
}
