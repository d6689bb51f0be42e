//! Storage for the numbers of a model: of one problem, or of eight members of an ensemble at a time.

// Loops become vector operations of the caller's width only if they are inlined into it.
#![allow(clippy::inline_always)]

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Numbers whose count is known at compile time, `[f64; N]`, or at run time, `Vec<f64>`.
pub trait Storage: AsRef<[f64]> + AsMut<[f64]> + Clone {
    /// The same count of numbers for several members of an ensemble.
    type Lanes: LaneStorage;
    /// A square matrix of that size, for several members.
    type LaneSquare: LaneStorage;

    /// Whether the count is known at compile time.
    const FIXED: bool;

    /// `len` zeros.
    ///
    /// # Panics
    ///
    /// If the size is fixed and is not `len`.
    fn zeros(len: usize) -> Self;

    /// Takes the numbers, which the caller puts back: an array is copied, so that it can stay in registers for a while,
    /// and a vector is moved.
    #[must_use]
    fn take(&mut self) -> Self;
}

impl<const N: usize> Storage for [f64; N] {
    type Lanes = [Lanes; N];
    type LaneSquare = [[Lanes; N]; N];

    const FIXED: bool = true;

    #[inline]
    fn zeros(len: usize) -> Self {
        assert_eq!(len, N, "storage of fixed size");
        [0.0; N]
    }

    #[inline]
    fn take(&mut self) -> Self {
        *self
    }
}

impl Storage for Vec<f64> {
    type Lanes = Vec<Lanes>;
    type LaneSquare = Vec<Lanes>;

    const FIXED: bool = false;

    fn zeros(len: usize) -> Self {
        vec![0.0; len]
    }

    #[inline]
    fn take(&mut self) -> Self {
        std::mem::take(self)
    }
}

/// Number of members in one [`Lanes`].
pub const LANES: usize = 8;

/// One number for each of several members of an ensemble.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Lanes(pub [f64; LANES]);

impl Lanes {
    /// Zeros.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// The same number in all lanes.
    #[inline(always)]
    pub const fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    /// `f` of each number.
    #[must_use]
    #[inline(always)]
    pub fn map(mut self, f: impl Fn(f64) -> f64) -> Self {
        for number in &mut self.0 {
            *number = f(*number);
        }
        self
    }

    /// Takes the numbers of `other` in these lanes.
    #[must_use]
    #[inline(always)]
    pub fn choose(mut self, other: Self, lanes: [bool; LANES]) -> Self {
        for ((a, b), is_other) in self.0.iter_mut().zip(other.0).zip(lanes) {
            *a = if is_other { b } else { *a };
        }
        self
    }

    /// The lanes in which `holds` is true of the number and its counterpart.
    #[inline(always)]
    pub fn lanes_where(self, other: Self, holds: impl Fn(f64, f64) -> bool) -> [bool; LANES] {
        let mut lanes = [false; LANES];
        for ((lane, a), b) in lanes.iter_mut().zip(self.0).zip(other.0) {
            *lane = holds(a, b);
        }
        lanes
    }

    /// `f` of each number and its counterpart.
    #[must_use]
    #[inline(always)]
    pub fn combine(mut self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a = f(*a, b);
        }
        self
    }
}

/// Operations on values: all lanes are read before any is written.
macro_rules! operation {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.combine(other, |a, b| a $operator b)
            }
        }
    };
}

operation!(Add, add, +);
operation!(Sub, sub, -);
operation!(Mul, mul, *);
operation!(Div, div, /);

impl Mul<Lanes> for f64 {
    type Output = Lanes;

    #[inline(always)]
    fn mul(self, other: Lanes) -> Lanes {
        other.map(|b| self * b)
    }
}

impl Neg for Lanes {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

/// Numbers in lanes, whose count is known at compile time or at run time.
pub trait LaneStorage: Clone {
    /// `len` zeros.
    ///
    /// # Panics
    ///
    /// If the size is fixed and is not `len`.
    fn zeros(len: usize) -> Self;

    /// All of them.
    fn lanes(&self) -> &[Lanes];

    /// All of them, to write to.
    fn lanes_mut(&mut self) -> &mut [Lanes];
}

impl<const N: usize> LaneStorage for [Lanes; N] {
    #[inline(always)]
    fn zeros(len: usize) -> Self {
        assert_eq!(len, N, "storage of fixed size");
        [Lanes::ZERO; N]
    }

    #[inline(always)]
    fn lanes(&self) -> &[Lanes] {
        self
    }

    #[inline(always)]
    fn lanes_mut(&mut self) -> &mut [Lanes] {
        self
    }
}

/// A square matrix, column by column.
impl<const N: usize> LaneStorage for [[Lanes; N]; N] {
    #[inline(always)]
    fn zeros(len: usize) -> Self {
        assert_eq!(len, N * N, "storage of fixed size");
        [[Lanes::ZERO; N]; N]
    }

    #[inline(always)]
    fn lanes(&self) -> &[Lanes] {
        self.as_flattened()
    }

    #[inline(always)]
    fn lanes_mut(&mut self) -> &mut [Lanes] {
        self.as_flattened_mut()
    }
}

impl LaneStorage for Vec<Lanes> {
    fn zeros(len: usize) -> Self {
        vec![Lanes::ZERO; len]
    }

    fn lanes(&self) -> &[Lanes] {
        self
    }

    fn lanes_mut(&mut self) -> &mut [Lanes] {
        self
    }
}
