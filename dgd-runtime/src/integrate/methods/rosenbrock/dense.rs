//! Dense output of Rosenbrock methods: values between the ends of a step.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use crate::integrate::methods::family::RequestedTimes;
use crate::integrate::methods::rosenbrock::lanes::{block_at, in_blocks};
use crate::integrate::methods::tableaux::RosenbrockTableau;
use crate::linalg::width::{WidthTask, run_by_fours};
use crate::system::Storage;

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
pub(super) fn interpolate<V: Storage>(theta: f64, y: &[f64], dense: &[V; 4], out: &mut [f64]) {
    let n = y.len();
    let [c1, c2, c3, c4] = dense;
    let (c1, c2) = (&c1.as_ref()[..n], &c2.as_ref()[..n]);
    let (c3, c4) = (&c3.as_ref()[..n], &c4.as_ref()[..n]);
    for (i, out) in out[..n].iter_mut().enumerate() {
        *out = y[i] + theta * (c1[i] + theta * (c2[i] + theta * (c3[i] + theta * c4[i])));
    }
}

/// [`interpolate`] at each of the `asked` times, θ = (t − from)/h, appended to `out`.
pub(super) fn interpolate_all<V: Storage>(
    asked: RequestedTimes<'_>,
    y: &V,
    dense: &[V; 4],
    out: &mut Vec<f64>,
) {
    let recorded = out.len();
    out.resize(recorded + y.as_ref().len() * asked.times.len(), 0.0);
    let out = &mut out[recorded..];
    run_by_fours(DenseRows { asked, y, dense, out });
}

/// Rows of dense output to write.
struct DenseRows<'a, V> {
    asked: RequestedTimes<'a>,
    y: &'a V,
    dense: &'a [V; 4],
    out: &'a mut [f64],
}

impl<V: Storage> WidthTask for DenseRows<'_, V> {
    #[inline(always)]
    fn run(self) {
        match self.y.as_ref().len() {
            1 => self.run_few::<1, 8>(),
            2 => self.run_few::<2, 4>(),
            4 => self.run_few::<4, 2>(),
            n => {
                let Self { asked: RequestedTimes { from, per_h, times }, y, dense, out } = self;
                for (t, out) in times.iter().zip(out.chunks_exact_mut(n.max(1))) {
                    interpolate((t - from) * per_h, y.as_ref(), dense, out);
                }
            }
        }
    }
}

impl<V: Storage> DenseRows<'_, V> {
    /// Rows of N numbers, too few to fill vector operations, computed T at a time.
    #[inline(always)]
    fn run_few<const N: usize, const T: usize>(self) {
        let Self { asked: RequestedTimes { from, per_h, times }, y, dense, out } = self;
        let (blocks, rest) = times.as_chunks::<T>();
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
    use crate::integrate::methods::rosenbrock::tests::number;

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
            let asked_times = RequestedTimes { from, per_h, times: &asked };
            interpolate_all(asked_times, &y, &dense, &mut rows);
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

    /// The sums of the dense output, computed in both ways.
    #[test]
    fn sums_of_dense_output_have_the_same_bits_on_stack_and_heap() {
        const N: usize = 11;
        let values = |first: usize| -> [f64; N] { std::array::from_fn(|i| number(50 * first + i)) };
        let k: [[f64; N]; 8] = std::array::from_fn(|j| values(j + 1));
        let heap: Vec<Vec<f64>> = k.iter().map(|k| k.to_vec()).collect();
        let y = values(0);
        let tableau = &crate::integrate::methods::tableaux::RODAS5P;
        let stages = tableau.stages();
        let mut dense = [[0.0; N]; 4];
        let mut on_heap: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; N]);
        dense_vectors(tableau, &y, &values(30), &k[..stages], &mut dense);
        dense_vectors(tableau, &y, &values(30), &heap[..stages], &mut on_heap);
        assert_eq!(dense.map(|c| c.to_vec()), on_heap);
    }
}
