//! Evaluates a model's functions at eight points at a time.
//!
//! A function at eight points is the function itself in a loop over lanes: the same operations, so the same bits. If
//! the model has fixed sizes and its function is inlined, the loop reads and writes lane l of arrays, and compilers
//! vectorise it. Arguments are copied first, so that reads cannot alias writes.

// Loops become vector operations of the caller's width only if they are inlined into it.
#![allow(clippy::inline_always)]

use crate::system::{EvaluationPoint, Signature, System};

pub use crate::system::storage::{LANES, LaneStorage, Lanes};

/// Several points at which a model is evaluated; lengths are those of an [`EvaluationPoint`]. Not for models with
/// discrete numbers.
#[derive(Debug, Clone, Copy)]
pub struct LanePoint<'a> {
    /// Time, s.
    pub t: &'a Lanes,
    /// Unknowns.
    pub y: &'a [Lanes],
    /// Inputs.
    pub u: &'a [Lanes],
    /// Parameters.
    pub p: &'a [Lanes],
}

/// Numbers of lane l; of fixed size, so that they stay in registers.
#[inline(always)]
fn lane<const N: usize>(numbers: &[Lanes; N], l: usize) -> [f64; N] {
    let mut values = [0.0; N];
    for (value, number) in values.iter_mut().zip(numbers) {
        *value = number.0[l];
    }
    values
}

#[inline(always)]
fn set_lane<const N: usize>(numbers: &mut [Lanes; N], l: usize, values: &[f64; N]) {
    for (number, value) in numbers.iter_mut().zip(values) {
        number.0[l] = *value;
    }
}

#[inline(always)]
fn fixed<const N: usize>(numbers: &[Lanes]) -> &[Lanes; N] {
    numbers.try_into().unwrap_or_else(|_| wrong_length(numbers.len(), N))
}

#[inline(always)]
fn fixed_mut<const N: usize>(numbers: &mut [Lanes]) -> &mut [Lanes; N] {
    let len = numbers.len();
    numbers.try_into().unwrap_or_else(|_| wrong_length(len, N))
}

#[cold]
fn wrong_length(found: usize, expected: usize) -> ! {
    panic!("expected {expected} numbers, found {found}")
}

/// [`System::rhs`] lane by lane, for a model of these sizes.
///
/// # Panics
///
/// If a slice has a different length.
#[inline(always)]
pub fn rhs<S: System, const N: usize, const U: usize, const P: usize>(
    system: &S,
    at: LanePoint<'_>,
    f: &mut [Lanes],
) {
    let (t, y, u, p) = (*at.t, *fixed::<N>(at.y), *fixed::<U>(at.u), *fixed::<P>(at.p));
    let mut values = [Lanes::ZERO; N];
    for l in 0..LANES {
        let (y, u, p) = (lane(&y, l), lane(&u, l), lane(&p, l));
        let mut row = [0.0; N];
        system.rhs(EvaluationPoint { t: t.0[l], y: &y, u: &u, p: &p, z: &[] }, &mut row);
        set_lane(&mut values, l, &row);
    }
    *fixed_mut::<N>(f) = values;
}

/// [`System::linearize`] lane by lane, for a model of these sizes, with J non-zeros in ∂f/∂y.
///
/// # Panics
///
/// If a slice has a different length.
#[inline(always)]
pub fn linearize<S: System, const N: usize, const U: usize, const P: usize, const J: usize>(
    system: &S,
    at: LanePoint<'_>,
    udot: &[Lanes],
    f: &mut [Lanes],
    jacobian: &mut [Lanes],
    dfdt: &mut [Lanes],
) {
    let (t, y, u, p) = (*at.t, *fixed::<N>(at.y), *fixed::<U>(at.u), *fixed::<P>(at.p));
    let udot = *fixed::<U>(udot);
    let (mut rows, mut slopes) = ([Lanes::ZERO; N], [Lanes::ZERO; N]);
    let mut values = [Lanes::ZERO; J];
    for l in 0..LANES {
        let (y, u, p) = (lane(&y, l), lane(&u, l), lane(&p, l));
        let (mut row, mut entries, mut slope) = ([0.0; N], [0.0; J], [0.0; N]);
        let point = EvaluationPoint { t: t.0[l], y: &y, u: &u, p: &p, z: &[] };
        system.linearize(point, &lane(&udot, l), &mut row, &mut entries, &mut slope);
        set_lane(&mut rows, l, &row);
        set_lane(&mut values, l, &entries);
        set_lane(&mut slopes, l, &slope);
    }
    *fixed_mut::<N>(f) = rows;
    *fixed_mut::<J>(jacobian) = values;
    *fixed_mut::<N>(dfdt) = slopes;
}

/// [`System::outputs`] lane by lane, for a model of these sizes.
///
/// # Panics
///
/// If a slice has a different length.
#[inline(always)]
pub fn outputs<S: System, const N: usize, const U: usize, const P: usize, const W: usize>(
    system: &S,
    at: LanePoint<'_>,
    w: &mut [Lanes],
) {
    let (t, y, u, p) = (*at.t, *fixed::<N>(at.y), *fixed::<U>(at.u), *fixed::<P>(at.p));
    let mut values = [Lanes::ZERO; W];
    for l in 0..LANES {
        let (y, u, p) = (lane(&y, l), lane(&u, l), lane(&p, l));
        let mut row = [0.0; W];
        system.outputs(EvaluationPoint { t: t.0[l], y: &y, u: &u, p: &p, z: &[] }, &mut row);
        set_lane(&mut values, l, &row);
    }
    *fixed_mut::<W>(w) = values;
}

/// Maximum numbers of unknowns, inputs, parameters and outputs, each, of a model that is evaluated in lanes; ∂f/∂y has
/// up to [`MOST_NONZEROS`] non-zeros.
pub(super) const MOST: usize = 64;
pub(super) const MOST_NONZEROS: usize = 576;
/// Maximum number of unknowns: dense elimination in all lanes pays up to about here.
const MOST_UNKNOWNS: usize = 24;

/// Numbers of lane l of a model whose sizes are known at run time.
fn gather<'a>(numbers: &[Lanes], l: usize, into: &'a mut [f64]) -> &'a [f64] {
    let into = &mut into[..numbers.len()];
    for (value, number) in into.iter_mut().zip(numbers) {
        *value = number.0[l];
    }
    into
}

fn scatter(values: &[f64], l: usize, numbers: &mut [Lanes]) {
    for (number, value) in numbers.iter_mut().zip(values) {
        number.0[l] = *value;
    }
}

/// Calls `evaluate` with the point of each lane.
fn each_point(at: LanePoint<'_>, mut evaluate: impl FnMut(usize, EvaluationPoint<'_>)) {
    let (mut y, mut u, mut p) = ([0.0; MOST], [0.0; MOST], [0.0; MOST]);
    for l in 0..LANES {
        let (y, u) = (gather(at.y, l, &mut y), gather(at.u, l, &mut u));
        let p = gather(at.p, l, &mut p);
        evaluate(l, EvaluationPoint { t: at.t.0[l], y, u, p, z: &[] });
    }
}

/// [`System::rhs`] lane by lane.
pub(crate) fn rhs_of_any<S: System + ?Sized>(system: &S, at: LanePoint<'_>, f: &mut [Lanes]) {
    let mut row = [0.0; MOST];
    let row = &mut row[..f.len()];
    each_point(at, |l, at| {
        system.rhs(at, row);
        scatter(row, l, f);
    });
}

/// [`System::linearize`] lane by lane.
pub(crate) fn linearize_any<S: System + ?Sized>(
    system: &S,
    at: LanePoint<'_>,
    udot: &[Lanes],
    f: &mut [Lanes],
    jacobian: &mut [Lanes],
    dfdt: &mut [Lanes],
) {
    let (mut row, mut slope, mut slopes) = ([0.0; MOST], [0.0; MOST], [0.0; MOST]);
    let mut entries = [0.0; MOST_NONZEROS];
    let (row, slope) = (&mut row[..f.len()], &mut slope[..f.len()]);
    let entries = &mut entries[..jacobian.len()];
    each_point(at, |l, at| {
        system.linearize(at, gather(udot, l, &mut slopes), row, entries, slope);
        scatter(row, l, f);
        scatter(entries, l, jacobian);
        scatter(slope, l, dfdt);
    });
}

/// [`System::outputs`] lane by lane.
pub(crate) fn outputs_of_any<S: System + ?Sized>(system: &S, at: LanePoint<'_>, w: &mut [Lanes]) {
    let mut row = [0.0; MOST];
    let row = &mut row[..w.len()];
    each_point(at, |l, at| {
        system.outputs(at, row);
        scatter(row, l, w);
    });
}

/// Whether a model can be run in lanes: it is small and has no events or delays.
pub(super) fn suit(signature: &Signature) -> bool {
    let sizes = [
        signature.unknowns.len(),
        signature.n_u(),
        signature.parameters.len(),
        signature.outputs.len(),
    ];
    let is_small = sizes.iter().all(|size| *size <= MOST)
        && signature.jacobian.len() <= MOST_NONZEROS
        && signature.unknowns.len() <= MOST_UNKNOWNS;
    let is_late = !(signature.delays.is_empty()
        && signature.varying_delays.is_empty()
        && signature.delayed_inputs.is_empty()
        && signature.delayed_unknowns.is_empty());
    is_small && !is_late && signature.discrete.is_empty()
}
