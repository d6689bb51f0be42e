//! Weights of rows, by which the elements of a column are compared when its pivot is chosen.
//!
//! ```text
//!   differential equations alone    1 / sizeᵢ
//!   other differential equations    1 / maxⱼ |wᵢⱼ| sizeⱼ
//!   algebraic equations             PREFERENCE / maxⱼ |wᵢⱼ| sizeⱼ
//! ```
//!
//! rounded to powers of two. An equation times 2ᵏ, or an unknown in units of 2ᵏ, changes weights by powers of two, and
//! products of weights and elements not at all: pivots are the same, and so are the bits of solutions but for that
//! power. Differential equations alone have rows in the units of their unknowns over time, so that no element needs to
//! be looked at. An algebraic equation is preferred, so that it holds to the rounding of its own terms where it hardly
//! determines its unknown. The row of an equation that reads no unknown is that of c M, and is the pivot of its unknown
//! whatever other rows have there: a number that is held stays what it is, to the bit.
//!
//! Only the choice depends on weights; elements are not scaled.
//!
//! Source: implicit equilibration of rows, Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed. (2002),
//! §9.8.

// Lengths are constants if storage has a fixed size, but only after inlining.
#![allow(clippy::inline_always)]

use crate::system::Pattern;

/// Bits of a number's exponent.
const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
/// How much smaller an element of an algebraic equation may be than another one and still be the pivot.
const PREFERENCE: f64 = 8.0;
/// The same for the row of an equation that reads no unknown.
pub(crate) const ALONE: f64 = (1_u64 << 60) as f64;
/// Sum of the exponents' bits of 2ᵏ and 2⁻ᵏ.
const OF_BOTH: u64 = 0x7fe0_0000_0000_0000;

/// 1/size, rounded to a power of two; zero if that is not a normal number.
#[inline(always)]
pub(crate) fn reciprocal(size: f64) -> f64 {
    f64::from_bits(OF_BOTH.saturating_sub(size.to_bits() & EXPONENT))
}

/// The rows of equations that read no unknown.
pub(crate) fn alone(n: usize, jacobian: &Pattern) -> Vec<usize> {
    let mut reads = vec![false; n];
    for (row, _) in jacobian.positions() {
        reads[row] = true;
    }
    (0..n).filter(|row| !reads[*row]).collect()
}

/// The weight of a row with this largest term.
#[inline(always)]
pub(crate) fn weight(largest: f64, is_differential: bool) -> f64 {
    (if is_differential { 1.0 } else { PREFERENCE }) * reciprocal(largest)
}

/// Writes the weights of the rows of c M − J, with unknowns of these sizes; ones if there are none. Those in `alone` read
/// no unknown.
#[inline(always)]
pub(super) fn weigh(
    weights: &mut [f64],
    c: f64,
    differential: impl Fn(usize) -> bool,
    jacobian: &Pattern,
    values: &[f64],
    sizes: Option<&[f64]>,
    alone: &[usize],
) {
    let Some(sizes) = sizes else {
        weights.fill(1.0);
        return;
    };
    let sizes = &sizes[..weights.len()];
    if (0..weights.len()).all(&differential) {
        for (weight, size) in weights.iter_mut().zip(sizes) {
            *weight = reciprocal(*size);
        }
    } else {
        for (i, (weight, size)) in weights.iter_mut().zip(sizes).enumerate() {
            *weight = if differential(i) { (c * size).abs() } else { 0.0 };
        }
        jacobian.for_each(values, |row, column, value| {
            let share = (value * sizes[column]).abs();
            if share > weights[row] {
                weights[row] = share;
            }
        });
        for (i, own) in weights.iter_mut().enumerate() {
            *own = weight(*own, differential(i));
        }
    }
    for row in alone {
        weights[*row] *= ALONE;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reciprocals_are_powers_of_two() {
        for (size, expected) in [(1.0, 1.0), (3.0, 0.5), (0.25, 4.0), (1e-3, 1024.0)] {
            assert_eq!(reciprocal(size), expected);
            assert_eq!(reciprocal(-size), expected);
        }
        assert_eq!(reciprocal(f64::INFINITY), 0.0);
        assert!(reciprocal(0.0).is_finite());
    }
}
