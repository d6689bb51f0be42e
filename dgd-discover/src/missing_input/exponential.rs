//! Exact discretisation of a linear system over one interval.
//!
//! ```text
//!   δẋ = A δx + B d, A, B, d constant over h:   δx(t + h) = e^{hA} δx(t) + h φ₁(hA) B d
//!   φ₁(z) = (e^z − 1)/z = Σ zᵏ/(k + 1)!,        e^z = 1 + z φ₁(z)
//!   φ₁(2z) = ½ (e^z + 1) φ₁(z)
//! ```
//!
//! A is balanced by powers of two (Parlett & Reinsch, Numer. Math. 13 (1969) 293–304), so that units
//! do not inflate its norm, then scaled by 2⁻ˢ to a norm below ½, where the series ends within 16
//! terms, and squared s times. Rounding grows with the number of squarings, to about 2ˢ ε: 10⁻⁷ of
//! the slowest mode at hλ = 10⁹ of the fastest.
//!
//! Source: Higham, Functions of Matrices (2008), §10.7.4.

use nalgebra::DMatrix;
use nalgebra::linalg::balancing::balance_parlett_reinsch;

/// Faster modes than this over an interval are as good as at rest; more squarings only add rounding.
const MOST_SQUARINGS: i32 = 60;

/// e^{hA} and h φ₁(hA) for a square, finite A.
pub(crate) fn exponentials(a: &DMatrix<f64>, h: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = a.nrows();
    let identity = DMatrix::<f64>::identity(n, n);
    if n == 0 || h == 0.0 {
        return (identity, DMatrix::zeros(n, n));
    }
    // A = D Z D⁻¹
    let mut z = a * h;
    let balance = balance_parlett_reinsch(&mut z);

    let norm = largest_row_sum(&z);
    let squarings =
        if norm > 0.5 { ((2.0 * norm).log2().ceil() as i32).clamp(0, MOST_SQUARINGS) } else { 0 };
    z *= 0.5f64.powi(squarings);

    let mut term = identity.clone();
    let mut phi = identity.clone();
    for k in 1..=16 {
        term = &term * &z / f64::from(k + 1);
        phi += &term;
        if largest_row_sum(&term) < f64::EPSILON {
            break;
        }
    }
    let mut exponential = &identity + &z * &phi;
    for _ in 0..squarings {
        phi = (&exponential + &identity) * &phi * 0.5;
        exponential = &exponential * &exponential;
    }

    for column in 0..n {
        for row in 0..n {
            let scale = balance[row] / balance[column];
            exponential[(row, column)] *= scale;
            phi[(row, column)] *= scale * h;
        }
    }
    (exponential, phi)
}

fn largest_row_sum(a: &DMatrix<f64>) -> f64 {
    a.row_iter().map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::exponentials;

    #[test]
    fn an_oscillator_and_its_integral_have_closed_forms() {
        // ẋ = [0 ω; −ω 0] x in units that differ by 10⁶: e^{hA} is a turn by ωh.
        let (omega, unit, h) = (3.0f64, 1e6, 0.7);
        let a = DMatrix::from_row_slice(2, 2, &[0.0, omega * unit, -omega / unit, 0.0]);
        let (exponential, integral) = exponentials(&a, h);
        let (sin, cos) = (omega * h).sin_cos();
        let expected = [cos, -sin / unit, sin * unit, cos];
        for (x, e) in exponential.iter().zip(expected) {
            assert!((x - e).abs() <= 1e-14 * e.abs(), "{x:e} {e:e}");
        }
        // ∫₀ʰ e^{As} ds
        let expected = [sin, -(1.0 - cos) / unit, (1.0 - cos) * unit, sin].map(|x| x / omega);
        for (x, e) in integral.iter().zip(expected) {
            assert!((x - e).abs() <= 1e-14 * e.abs(), "{x:e} {e:e}");
        }
    }

    #[test]
    fn a_fast_mode_leaves_the_slow_one_alone() {
        // e^{hA} of the triangular matrix [−a b; 0 −c] in closed form, a h = 10⁶.
        let (fast, coupling, slow, h) = (1e6, 5e5, 1e-3, 1.0);
        let a = DMatrix::from_row_slice(2, 2, &[-fast, coupling, 0.0, -slow]);
        let (exponential, integral) = exponentials(&a, h);
        let held = (-slow * h).exp();
        // 21 squarings of numbers known to 2⁻⁵³.
        let allowed = 4.0 * 2f64.powi(21 - 53);
        assert!((exponential[(1, 1)] / held - 1.0).abs() < allowed);
        assert!((exponential[(0, 1)] / (coupling / (fast - slow) * held) - 1.0).abs() < allowed);
        assert!(exponential[(0, 0)].abs() < allowed);
        assert!((integral[(1, 1)] / ((1.0 - held) / slow) - 1.0).abs() < allowed);
        assert!((integral[(0, 0)] * fast - 1.0).abs() < allowed);
    }

    #[test]
    fn an_integrator_is_exact() {
        let (exponential, integral) = exponentials(&DMatrix::zeros(1, 1), 2.5);
        assert_eq!((exponential[0], integral[0]), (1.0, 2.5));
    }
}
