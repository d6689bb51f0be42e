//! Poles of a linear model: the s at which s I − A is singular. With delayed unknowns, the s at which
//!
//! ```text
//!   Δ(s) = ⎡ s I − A   −A₁          ⎤        v = e^(−sτ) (E x + G v)
//!          ⎣ −e^(−sτ)E  I − e^(−sτ)G ⎦
//! ```
//!
//! is singular, of which there are infinitely many. The history in transit, r_k(t + θ) for −τ_k ≤ θ ≤ 0, obeys ∂r/∂t =
//! ∂r/∂θ. Discretised at Chebyshev points it gives a finite matrix whose eigenvalues approximate the poles furthest to
//! the right; Newton's method on Δ refines them.
//!
//! Breda, Maset, Vermiglio, Pseudospectral differencing methods for characteristic roots of delay
//! differential equations, SIAM J. Sci. Comput. 27 (2005) 482–495; the matrix is that of Trefethen,
//! Spectral Methods in MATLAB (2000), ch. 6.

use std::f64::consts::{PI, TAU};

use nalgebra::linalg::Schur;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, DVector};

use super::StateSpace;
use super::conserved::{ConservedCombination, without};
use super::error::LinearizeError;
use crate::linalg::blocks::blocks;
use crate::system::Pattern;

/// Maximum iterations for each eigenvalue; three are usual.
const MOST_ITERATIONS: usize = 100;
/// Minimum and maximum number of intervals between Chebyshev points along each delay. N intervals resolve |s| τ up to
/// N/2.
const INTERVALS: [usize; 2] = [24, 120];
/// Maximum number of Newton corrections, and the size of the last relative to the pole.
const MOST_CORRECTIONS: usize = 20;
const CORRECTED: f64 = 1e-12;
/// Poles of delay systems closer than this, relative to their size, count as one.
const SAME: f64 = 1e-7;
/// Number of poles returned if there are infinitely many.
const MOST_GIVEN: usize = 12;

/// A pole, 1/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// Real part: negative for a decaying mode.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
    /// Bound on the rounding error, 1/s.
    pub rounding: f64,
}

impl Pole {
    /// |s|, the undamped angular frequency, 1/s.
    pub fn frequency(self) -> f64 {
        self.re.hypot(self.im)
    }

    /// Whether it is on the imaginary axis, to rounding.
    pub fn is_on_axis(self) -> bool {
        self.re.abs() <= self.rounding
    }

    /// −1/Re s, s: the time in which the mode decays to 1/e or, if negative, grows by a factor e.
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

/// Whether disturbances decay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stability {
    /// All poles are left of the imaginary axis.
    Stable,
    /// A pole is on the axis, to rounding, and none is right of it.
    Marginal,
    /// A pole is right of it.
    Unstable,
    /// None was found right of it, but delayed unknowns may cause some outside the searched region.
    Unknown,
}

/// The poles of a linear model.
#[derive(Debug, Clone, PartialEq)]
pub struct Poles {
    /// From right to left; of a pair, the one with positive imaginary part comes first.
    pub poles: Vec<Pole>,
    /// Whether these are all: with delayed unknowns there are infinitely many.
    pub complete: bool,
    /// Whether it is certain that no other pole is right of the imaginary axis.
    pub certain: bool,
}

impl Poles {
    /// Whether disturbances decay.
    pub fn stability(&self) -> Stability {
        let (on_axis, off): (Vec<Pole>, Vec<Pole>) =
            self.poles.iter().partition(|pole| pole.is_on_axis());
        if off.iter().any(|pole| pole.re > 0.0) {
            Stability::Unstable
        } else if !self.certain {
            Stability::Unknown
        } else if on_axis.is_empty() {
            Stability::Stable
        } else {
            Stability::Marginal
        }
    }
}

/// The poles of a linear model.
pub(super) fn poles(
    system: &StateSpace,
    conserved: &[ConservedCombination],
) -> Result<Poles, LinearizeError> {
    if system.delayed_unknowns.is_empty() {
        let mut poles = eigenvalues(&without(&system.a, &system.states, conserved))?;
        let zero = Pole { re: 0.0, im: 0.0, rounding: 0.0 };
        poles.extend(conserved.iter().map(|_| zero));
        sort(&mut poles);
        return Ok(Poles { poles, complete: true, certain: true });
    }
    let longest =
        system.delayed_unknowns.iter().fold(0.0_f64, |longest, delayed| longest.max(delayed.tau));
    let [least, most] = INTERVALS;
    let wanted = radius(system).map(|radius| (2.0 * radius * longest).ceil());
    let intervals = wanted.map_or(least, |wanted| (wanted as usize).clamp(least, most));
    let certain = wanted.is_some_and(|wanted| wanted <= intervals as f64);
    let resolved = 0.5 * intervals as f64;
    let candidates = eigenvalues(&transported(system, intervals))?;
    let mut poles: Vec<Pole> = Vec::new();
    for candidate in candidates {
        // Conjugates are added later.
        if candidate.im < 0.0 || candidate.frequency() * longest > resolved {
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
    let poles = poles.into_iter().flat_map(pair).collect();
    Ok(Poles { poles, complete: false, certain })
}

/// Bound on |s| for poles right of the imaginary axis: there |e^(−sτ)| ≤ 1, and s is an eigenvalue of a matrix whose
/// entries are bounded by those of |A| + |A₁| (1 + |G| + |G|² + …) |E|. `None` if delayed unknowns depend on each other
/// in a cycle, so that the sum does not end.
fn radius(system: &StateSpace) -> Option<f64> {
    let mut way = system.delayed_x.abs();
    let mut bound = system.a.abs();
    for _ in 0..=system.delayed_unknowns.len() {
        bound += system.delayed_a.abs() * &way;
        way = system.delayed_v.abs() * way;
    }
    balance_parlett_reinsch(&mut bound);
    let largest = bound.row_iter().map(|row| row.sum()).fold(0.0, f64::max);
    (way.amax() == 0.0).then_some(largest)
}

fn sort(poles: &mut [Pole]) {
    poles.sort_by(|a, b| {
        let by_size = a.im.abs().total_cmp(&b.im.abs());
        b.re.total_cmp(&a.re).then(by_size).then(b.im.total_cmp(&a.im))
    });
}

/// Eigenvalues, block by block of mutually coupled states: fast states that drive slow ones, or are driven by them,
/// then add no rounding errors to the slow eigenvalues.
pub(super) fn eigenvalues(matrix: &DMatrix<f64>) -> Result<Vec<Pole>, LinearizeError> {
    let n = matrix.nrows();
    let places: Vec<(usize, usize)> =
        (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).filter(|at| matrix[*at] != 0.0).collect();
    let values: Vec<f64> = places.iter().map(|at| matrix[*at]).collect();
    let mut poles = Vec::with_capacity(n);
    for block in blocks(&Pattern::from_places(&places), &values, &vec![0.0; n]) {
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
    // Units of states differ greatly in size.
    balance_parlett_reinsch(&mut matrix);
    let rounding = 16.0 * f64::EPSILON * n as f64 * matrix.norm();
    let most = MOST_ITERATIONS * n;
    let schur = Schur::try_new(matrix.clone(), f64::EPSILON, most).or_else(|| {
        // Double shifts leave a few matrices unchanged, a cycle for example; a change of basis helps.
        let axis = DVector::from_fn(n, |i, _| 1.0 / (1.0 + i as f64)).normalize();
        let turn = DMatrix::identity(n, n) - &axis * axis.transpose() * 2.0;
        Schur::try_new(&turn * &matrix * &turn, f64::EPSILON, most)
    });
    let eigenvalues = schur.ok_or(LinearizeError::NoEigenvalues)?.complex_eigenvalues();
    if eigenvalues.iter().any(|s| !(s.re.is_finite() && s.im.is_finite())) {
        return Err(LinearizeError::NoEigenvalues);
    }
    Ok(eigenvalues.iter().map(|s| Pole { re: s.re, im: s.im, rounding }).collect())
}

/// The matrix of the states and the history in transit: x, then for each delayed unknown r at the Chebyshev points
/// after the first, at which r = E x + G v.
fn transported(system: &StateSpace, intervals: usize) -> DMatrix<f64> {
    let (n, n_v) = (system.a.nrows(), system.delayed_unknowns.len());
    let len = n + n_v * intervals;
    let place = |k: usize, point: usize| n + k * intervals + point - 1;
    let derivative = chebyshev_derivative(intervals);
    let mut matrix = DMatrix::zeros(len, len);
    matrix.view_mut((0, 0), (n, n)).copy_from(&system.a);
    for (k, delayed) in system.delayed_unknowns.iter().enumerate() {
        // v_k is r_k at the last point.
        let column = place(k, intervals);
        for i in 0..n {
            matrix[(i, column)] += system.delayed_a[(i, k)];
        }
        // θ = τ (ξ − 1)/2 for −1 ≤ ξ ≤ 1.
        let per_time = 2.0 / delayed.tau;
        for point in 1..=intervals {
            let row = place(k, point);
            for other in 1..=intervals {
                matrix[(row, place(k, other))] += per_time * derivative[(point, other)];
            }
            let first = per_time * derivative[(point, 0)];
            for i in 0..n {
                matrix[(row, i)] += first * system.delayed_x[(k, i)];
            }
            for j in 0..n_v {
                matrix[(row, place(j, intervals))] += first * system.delayed_v[(k, j)];
            }
        }
    }
    matrix
}

/// Differentiation matrix of the polynomial through values at the points cos(iπ/N), from 1 to −1.
fn chebyshev_derivative(n: usize) -> DMatrix<f64> {
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
        // The derivative of a constant is zero.
        derivative[(i, i)] = -derivative.row(i).sum();
    }
    derivative
}

/// The solution of det Δ(s) = 0 next to a candidate, by Newton's method: s ← s − 1/tr(Δ⁻¹ Δ').
fn corrected(system: &StateSpace, candidate: Pole, longest: f64) -> Option<Pole> {
    let (n, n_v) = (system.a.nrows(), system.delayed_unknowns.len());
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
                delta[(i, n + k)].re = -system.delayed_a[(i, k)];
            }
        }
        for (k, delayed) in system.delayed_unknowns.iter().enumerate() {
            let shift = (-s * delayed.tau).exp();
            let (of_x, of_v) = (system.delayed_x.row(k), system.delayed_v.row(k));
            for (column, source) in of_x.iter().chain(of_v.iter()).enumerate() {
                let source = *source;
                delta[(n + k, column)] -= shift * source;
                slope[(n + k, column)] += shift * source * delayed.tau;
            }
            delta[(n + k, n + k)].re += 1.0;
        }
        let Some(solved) = delta.lu().solve(&slope) else {
            // Singular to the last bit: the pole is exact.
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
            // The imaginary part of a real pole is rounding.
            let im = if s.im.abs() <= SAME * (s.norm() + 1.0 / longest) { 0.0 } else { s.im.abs() };
            return is_near.then_some(Pole { re: s.re, im, rounding: CORRECTED * s.norm() });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compute(matrix: &DMatrix<f64>) -> Vec<Pole> {
        let mut poles = eigenvalues(matrix).expect("the iteration converges");
        sort(&mut poles);
        poles
    }

    #[test]
    fn a_cycle_has_roots_of_one() {
        // Each state drives the next: implicit double shifts leave this unchanged.
        for n in 3..9 {
            let cycle = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i == (j + 1) % n)));
            let poles = compute(&cycle);
            for k in 0..n {
                let root = Complex::from_polar(1.0, TAU * k as f64 / n as f64);
                let near = poles.iter().map(|pole| (Complex::new(pole.re, pole.im) - root).norm());
                let nearest = near.fold(f64::INFINITY, f64::min);
                // The matrix is normal: its eigenvalues move by no more than the rounding.
                assert!(nearest < 1e-13, "{n}: {nearest:e} from {root} in {poles:?}");
            }
            assert_eq!(poles.len(), n);
        }
    }

    #[test]
    fn what_fast_states_drive_keeps_its_digits() {
        // Rates from 1e-12 to 1e10 1/s in a chain: the poles equal them bit for bit.
        let n = 12;
        let rate = |i: usize| -(100_f64.powf(i as f64) * 1e-12);
        let chain = DMatrix::from_fn(n, n, |i, j| match () {
            () if i == j => rate(i),
            () if i + 1 == j => -rate(j),
            () => 0.0,
        });
        let found: Vec<f64> = compute(&chain).iter().map(|pole| pole.re).collect();
        let mut expected: Vec<f64> = (0..n).map(rate).collect();
        expected.sort_by(|a, b| b.total_cmp(a));
        assert_eq!(found, expected);
    }

    #[test]
    fn units_of_the_states_do_not_matter() {
        // A mass of 2 kg on a spring of 50 N/m with 4 N s/m, its states in units 1e9 apart: −1 ± √24 i.
        let poles = compute(&DMatrix::from_row_slice(2, 2, &[0.0, 1e-9, -25e9, -2.0]));
        assert!((poles[0].re + 1.0).abs() < 1e-13 && (poles[0].im - 24_f64.sqrt()).abs() < 1e-13);
        assert_eq!(poles[1].im, -poles[0].im);
        assert!((poles[0].damping().expect("a pair") - 0.2).abs() < 1e-14);
        assert!((poles[0].period().expect("a pair") - TAU / 24_f64.sqrt()).abs() < 1e-13);
    }

    #[test]
    fn the_derivative_is_exact_for_polynomials() {
        let n = 24;
        let derivative = chebyshev_derivative(n);
        let x = |i: usize| (PI * i as f64 / n as f64).cos();
        let values = DVector::from_fn(n + 1, |i, _| x(i).powi(7) - x(i));
        let slopes = &derivative * values;
        for (i, slope) in slopes.iter().enumerate() {
            // Entries up to N²/3, each good to rounding.
            assert!((slope - (7.0 * x(i).powi(6) - 1.0)).abs() < 1e-11, "{i}");
        }
    }
}
