//! Sums over the stages of a Rosenbrock method, arranged to fill vector lanes.
//!
//! On the stack all lengths are constants, and the compiler fuses consecutive loops. On the heap sums are computed
//! block by block.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use crate::integrate::methods::tableaux::MAX_STAGES;
use crate::solved::SolvableSystem;
use crate::system::Storage;

/// Runs code on each block of `$len` numbers, a constant, from `$first` on: sums over a block stay in registers, and
/// reads cannot alias writes. If all lengths are constants, compilers achieve the same by themselves.
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

pub(super) use in_blocks;

/// `stage` ← y + Σ aⱼ kⱼ and `coupling` ← Σ cⱼ kⱼ of J increments, in one pass over them.
///
/// In closing stages, a differs from that of the previous stage by a one for its increment: `stage` is updated from
/// there.
#[inline(always)]
pub(super) fn combine<const J: usize, V: Storage>(
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

/// L numbers from position `first` on.
#[inline(always)]
pub(super) fn block_at<const L: usize>(values: &[f64], first: usize) -> [f64; L] {
    let mut block = [0.0; L];
    block.copy_from_slice(&values[first..first + L]);
    block
}

/// `stage` ← y + Σ aⱼ kⱼ of all increments in `k`.
pub(super) fn combine_any<V: Storage>(
    y: &[f64],
    k: &[V],
    a: &[f64; MAX_STAGES],
    stage: &mut [f64],
) {
    stage.copy_from_slice(y);
    for (a, k) in a.iter().zip(k) {
        for (stage, k) in stage.iter_mut().zip(k.as_ref()) {
            *stage += a * k;
        }
    }
}

/// b ← f + M/h b + slope · df/dt.
#[inline(always)]
pub(super) fn add_rates<S: SolvableSystem>(
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

/// `out` ← a + b.
#[inline(always)]
pub(super) fn sum(a: &[f64], b: &[f64], out: &mut [f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = a + b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::methods::rosenbrock::tests::number;

    /// The sums of the stages, computed in both ways.
    #[test]
    fn sums_of_stages_have_the_same_bits_on_stack_and_heap() {
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
    }
}
