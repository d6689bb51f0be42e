//! Poles: where s I − A is singular; with unknowns that act late, where
//!
//! ```text
//!   Δ(s) = ⎡ s I − A   −A₁          ⎤        v = e^(−sτ) (E x + G v)
//!          ⎣ −e^(−sτ)E  I − e^(−sτ)G ⎦
//! ```
//!
//! is, which has infinitely many solutions. What is on its way, r_k(t + θ) for −τ_k ≤ θ ≤ 0, obeys
//! ∂r/∂t = ∂r/∂θ; by its values at Chebyshev points a matrix of finite size has eigenvalues close to those
//! furthest to the right, from which Newton's method goes on with Δ itself.
//!
//! Breda, Maset, Vermiglio, Pseudospectral differencing methods for characteristic roots of delay
//! differential equations, SIAM J. Sci. Comput. 27 (2005) 482–495; the matrix is that of Trefethen,
//! Spectral Methods in MATLAB (2000), ch. 6.

use std::f64::consts::{PI, TAU};

use nalgebra::linalg::Schur;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, DVector};

use super::StateSpace;
use super::error::LinearizeError;
use crate::blocks::blocks;
use crate::system::Pattern;

/// Iterations for each eigenvalue; three are usual.
const MOST_ITERATIONS: usize = 100;
/// Intervals between Chebyshev points along each delay.
const INTERVALS: usize = 24;
/// Waves along a delay that so many points resolve: |s| τ up to this.
const RESOLVED: f64 = 12.0;
/// Most corrections by Newton's method, and how small the last is, relative to the pole.
const MOST_CORRECTIONS: usize = 20;
const CORRECTED: f64 = 1e-12;
/// Poles of delays closer than this, relative to their size, are one.
const SAME: f64 = 1e-7;
/// Poles that are given where there are infinitely many.
const MOST_GIVEN: usize = 12;

/// A pole, 1/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// Real part: negative where the mode fades.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
    /// How far rounding may have moved it, 1/s.
    pub rounding: f64,
}

impl Pole {
    /// |s|, the angular frequency without damping, 1/s.
    pub fn frequency(self) -> f64 {
        self.re.hypot(self.im)
    }

    /// Whether it is on the imaginary axis, to rounding.
    pub fn is_on_axis(self) -> bool {
        self.re.abs() <= self.rounding
    }

    /// −1/Re s: the time in which the mode falls to 1/e, or, where it is negative, grows by e; s.
    pub fn time_constant(self) -> f64 {
        -1.0 / self.re
    }

    /// −Re s/|s|; `None` for a real pole.
    pub fn damping(self) -> Option<f64> {
        (self.im != 0.0).then(|| -self.re / self.frequency())
    }

    /// 2π/Im s, s; `None` for a real pole.
    pub fn period(self) -> Option<f64> {
        (self.im != 0.0).then(|| TAU / self.im.abs())
    }
}

/// Whether disturbances fade.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stability {
    /// All poles are left of the imaginary axis.
    Stable,
    /// A pole is on it, to rounding, and none right of it.
    Marginal,
    /// A pole is right of it.
    Unstable,
}

/// The poles of a linear model.
#[derive(Debug, Clone, PartialEq)]
pub struct Poles {
    /// From the right to the left; of a pair the one above comes first.
    pub poles: Vec<Pole>,
    /// Whether these are all: with unknowns that act late there are infinitely many.
    pub complete: bool,
}

impl Poles {
    /// Whether disturbances fade.
    pub fn stability(&self) -> Stability {
        let (on_axis, off): (Vec<Pole>, Vec<Pole>) =
            self.poles.iter().partition(|pole| pole.is_on_axis());
        if off.iter().any(|pole| pole.re > 0.0) {
            Stability::Unstable
        } else if on_axis.is_empty() {
            Stability::Stable
        } else {
            Stability::Marginal
        }
    }
}

/// The poles of a linear model.
pub(super) fn poles(system: &StateSpace) -> Result<Poles, LinearizeError> {
    if system.late.is_empty() {
        let mut poles = eigenvalues(&system.a)?;
        sort(&mut poles);
        return Ok(Poles { poles, complete: true });
    }
    let candidates = eigenvalues(&transported(system))?;
    let longest = system.late.iter().fold(0.0_f64, |longest, late| longest.max(late.tau));
    let mut poles: Vec<Pole> = Vec::new();
    for candidate in candidates {
        // Conjugates follow.
        if candidate.im < 0.0 || candidate.frequency() * longest > RESOLVED {
            continue;
        }
        let Some(pole) = corrected(system, candidate, longest) else { continue };
        let near = SAME * (pole.frequency() + 1.0 / longest);
        if poles.iter().all(|other| (other.re - pole.re).hypot(other.im - pole.im) > near) {
            poles.push(pole);
        }
    }
    sort(&mut poles);
    poles.truncate(MOST_GIVEN);
    let pair = |pole: Pole| {
        let below = (pole.im > 0.0).then_some(Pole { im: -pole.im, ..pole });
        std::iter::once(pole).chain(below)
    };
    Ok(Poles { poles: poles.into_iter().flat_map(pair).collect(), complete: false })
}

fn sort(poles: &mut [Pole]) {
    poles.sort_by(|a, b| {
        let by_size = a.im.abs().total_cmp(&b.im.abs());
        b.re.total_cmp(&a.re).then(by_size).then(b.im.total_cmp(&a.im))
    });
}

/// Eigenvalues, those of each block of states that act on each other by themselves: fast states that are
/// driven by slow ones, or drive them, leave no rounding in these.
fn eigenvalues(matrix: &DMatrix<f64>) -> Result<Vec<Pole>, LinearizeError> {
    let n = matrix.nrows();
    let places: Vec<(usize, usize)> =
        (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).filter(|at| matrix[*at] != 0.0).collect();
    let values: Vec<f64> = places.iter().map(|at| matrix[*at]).collect();
    let mut poles = Vec::with_capacity(n);
    for block in blocks(&Pattern::of(&places), &values, &vec![0.0; n]) {
        poles.extend(of_block(matrix.select_rows(&block).select_columns(&block))?);
    }
    Ok(poles)
}

/// Eigenvalues of one block.
fn of_block(mut matrix: DMatrix<f64>) -> Result<Vec<Pole>, LinearizeError> {
    let n = matrix.nrows();
    if n == 1 {
        return Ok(vec![Pole { re: matrix[(0, 0)], im: 0.0, rounding: 0.0 }]);
    }
    // States have units of very different sizes.
    balance_parlett_reinsch(&mut matrix);
    let rounding = 16.0 * f64::EPSILON * n as f64 * matrix.norm();
    let most = MOST_ITERATIONS * n;
    let schur = Schur::try_new(matrix.clone(), f64::EPSILON, most).or_else(|| {
        // Double shifts leave a few matrices as they are, a cycle for example; none in another basis.
        let axis = DVector::from_fn(n, |i, _| 1.0 / (1.0 + i as f64)).normalize();
        let turn = DMatrix::identity(n, n) - &axis * axis.transpose() * 2.0;
        Schur::try_new(&turn * &matrix * &turn, f64::EPSILON, most)
    });
    let found = schur.ok_or(LinearizeError::NoEigenvalues)?.complex_eigenvalues();
    if found.iter().any(|s| !(s.re.is_finite() && s.im.is_finite())) {
        return Err(LinearizeError::NoEigenvalues);
    }
    Ok(found.iter().map(|s| Pole { re: s.re, im: s.im, rounding }).collect())
}

/// The matrix of the states and of what is on its way: x, then for each late unknown r at the
/// Chebyshev points behind the first, at which r = E x + G v.
fn transported(system: &StateSpace) -> DMatrix<f64> {
    let (n, n_v) = (system.a.nrows(), system.late.len());
    let len = n + n_v * INTERVALS;
    let place = |k: usize, point: usize| n + k * INTERVALS + point - 1;
    let derivative = chebyshev_derivative();
    let mut matrix = DMatrix::zeros(len, len);
    matrix.view_mut((0, 0), (n, n)).copy_from(&system.a);
    for (k, late) in system.late.iter().enumerate() {
        // v_k is r_k at the last point.
        let column = place(k, INTERVALS);
        for i in 0..n {
            matrix[(i, column)] += system.late_a[(i, k)];
        }
        // θ = τ (ξ − 1)/2 for −1 ≤ ξ ≤ 1.
        let per_time = 2.0 / late.tau;
        for point in 1..=INTERVALS {
            let row = place(k, point);
            for other in 1..=INTERVALS {
                matrix[(row, place(k, other))] += per_time * derivative[(point, other)];
            }
            let first = per_time * derivative[(point, 0)];
            for i in 0..n {
                matrix[(row, i)] += first * system.late_x[(k, i)];
            }
            for j in 0..n_v {
                matrix[(row, place(j, INTERVALS))] += first * system.late_v[(k, j)];
            }
        }
    }
    matrix
}

/// Derivatives at the points cos(iπ/N), from 1 to −1, of the polynomial through values there.
fn chebyshev_derivative() -> DMatrix<f64> {
    let n = INTERVALS;
    let x = |i: usize| (PI * i as f64 / n as f64).cos();
    let weight = |i: usize| {
        let end = if i == 0 || i == n { 2.0 } else { 1.0 };
        if i.is_multiple_of(2) { end } else { -end }
    };
    let mut derivative = DMatrix::zeros(n + 1, n + 1);
    for i in 0..=n {
        for j in (0..=n).filter(|j| *j != i) {
            derivative[(i, j)] = weight(i) / (weight(j) * (x(i) - x(j)));
        }
        // Of a constant it is zero.
        derivative[(i, i)] = -derivative.row(i).sum();
    }
    derivative
}

/// The solution of det Δ(s) = 0 next to a candidate, by Newton's method: s ← s − 1/tr(Δ⁻¹ Δ').
fn corrected(system: &StateSpace, candidate: Pole, longest: f64) -> Option<Pole> {
    let (n, n_v) = (system.a.nrows(), system.late.len());
    let mut s = Complex::new(candidate.re, candidate.im);
    for _ in 0..MOST_CORRECTIONS {
        let mut delta = DMatrix::from_element(n + n_v, n + n_v, Complex::new(0.0, 0.0));
        let mut slope = delta.clone();
        for i in 0..n {
            for j in 0..n {
                delta[(i, j)].re = -system.a[(i, j)];
            }
            delta[(i, i)] += s;
            slope[(i, i)].re = 1.0;
            for k in 0..n_v {
                delta[(i, n + k)].re = -system.late_a[(i, k)];
            }
        }
        for (k, late) in system.late.iter().enumerate() {
            let shift = (-s * late.tau).exp();
            let (of_x, of_v) = (system.late_x.row(k), system.late_v.row(k));
            for (column, source) in of_x.iter().chain(of_v.iter()).enumerate() {
                let source = *source;
                delta[(n + k, column)] -= shift * source;
                slope[(n + k, column)] += shift * source * late.tau;
            }
            delta[(n + k, n + k)].re += 1.0;
        }
        let Some(solved) = delta.lu().solve(&slope) else {
            // Singular to the last bit.
            return Some(Pole { re: s.re, im: s.im, ..candidate });
        };
        let step = solved.trace().inv();
        s -= step;
        if !(s.re.is_finite() && s.im.is_finite()) {
            return None;
        }
        if step.norm() <= CORRECTED * (s.norm() + 1.0 / longest) {
            let moved = (s - Complex::new(candidate.re, candidate.im)).norm();
            let is_near = moved <= 0.1 * (candidate.frequency() + 1.0 / longest);
            // Of a real pole nothing is left but rounding.
            let im = if s.im.abs() <= SAME * (s.norm() + 1.0 / longest) { 0.0 } else { s.im.abs() };
            return is_near.then_some(Pole { re: s.re, im, rounding: CORRECTED * s.norm() });
        }
    }
    None
}
