//! The exact response of a linear system after a time h, and its derivatives with respect to A.
//!
//! ```text
//!   ẋ = A x + b₀ + b₁ t    ⇒    x(h) = Φ x(0) + Γ₀ b₀ + Γ₁ b₁
//!   Φ = e^(Ah),   Γ₀ = ∫₀ʰ e^(As) ds,   Γ₁ = ∫₀ʰ Γ₀(s) ds
//! ```
//!
//! Computed from series where ‖Ah‖ is small, then by doubling,
//!
//! ```text
//!   Γ₁(2h) = Φ Γ₁ + h Γ₀ + Γ₁,   Γ₀(2h) = Φ Γ₀ + Γ₀,   Φ(2h) = Φ²
//! ```
//!
//! and for directions A' of A with the product rule in every operation.
//!
//! Al-Mohy, Higham, Computing the Fréchet derivative of the matrix exponential, SIAM J. Matrix Anal.
//! Appl. 30 (2009) 1639–1657, differentiate their algorithm likewise.

use nalgebra::DMatrix;
use nalgebra::linalg::balancing::balance_parlett_reinsch;

/// Largest ‖Ah‖ for which the series are used.
const SMALL: f64 = 0.5;
/// Terms of the series of Γ₁/h²: the remainder is below 0.5¹⁶/18!.
const TERMS: u32 = 16;

/// Φ, Γ₀ and Γ₁ for one length of time.
#[derive(Debug, Clone)]
pub struct Response {
    pub phi: DMatrix<f64>,
    pub gamma_0: DMatrix<f64>,
    pub gamma_1: DMatrix<f64>,
}

/// A response, and its derivatives in some directions of A.
#[derive(Debug, Clone)]
pub struct DifferentiatedResponse {
    pub value: Response,
    pub slopes: Vec<Response>,
}

/// Responses of one system, cached by length of time.
pub struct Responses<'a> {
    a: &'a DMatrix<f64>,
    directions: Vec<&'a DMatrix<f64>>,
    /// The norm of A with states in units of their sizes, 1/s.
    norm: f64,
    known: Vec<(f64, DifferentiatedResponse)>,
}

impl<'a> Responses<'a> {
    /// For ẋ = A x + …, with states of these sizes.
    pub fn new(a: &'a DMatrix<f64>, directions: Vec<&'a DMatrix<f64>>, sizes: &[f64]) -> Self {
        let column = |j: usize| -> f64 {
            (0..a.nrows()).map(|i| (a[(i, j)] * sizes[j] / sizes[i]).abs()).sum()
        };
        let norm = (0..a.ncols()).map(column).fold(0.0, f64::max);
        Self { a, directions, norm, known: Vec::new() }
    }

    /// For ẋ = A x + … without given sizes of the states: uses sizes that balance A (Parlett & Reinsch, Balancing a
    /// matrix for calculation of eigenvalues and eigenvectors, Numer. Math. 13 (1969) 293–304).
    pub fn balanced(a: &'a DMatrix<f64>) -> Self {
        if !a.norm().is_finite() {
            // Balancing would not end, and the response is not finite either.
            return Self::new(a, Vec::new(), &vec![1.0; a.nrows()]);
        }
        let sizes = balance_parlett_reinsch(&mut a.clone());
        Self::new(a, Vec::new(), sizes.as_slice())
    }

    /// The response after a time h; `rounding` is that of the times whose difference h is.
    pub fn response(&mut self, h: f64, rounding: f64) -> &DifferentiatedResponse {
        let known = self.known.iter().position(|(known, _)| (known - h).abs() <= rounding);
        if known.is_none() {
            let computed = self.computed(h);
            self.known.push((h, computed));
        }
        &self.known[known.unwrap_or(self.known.len() - 1)].1
    }

    fn computed(&self, h: f64) -> DifferentiatedResponse {
        let mut doublings = 0;
        let mut part = h;
        // A NaN norm ends the loop, and the result is NaN.
        while self.norm * part > SMALL && doublings < 1100 {
            part *= 0.5;
            doublings += 1;
        }
        let mut response = self.series(part);
        for _ in 0..doublings {
            response = doubled(&response, part);
            part *= 2.0;
        }
        response
    }

    fn series(&self, h: f64) -> DifferentiatedResponse {
        let n = self.a.nrows();
        let identity = DMatrix::identity(n, n);
        // Γ₁ = h² Σ Nᵏ/(k+2)!, N = Ah, by Horner's rule.
        let power = self.a * h;
        let mut factor = (1..=TERMS + 2).map(f64::from).product::<f64>().recip();
        let mut sum = &identity * factor;
        let mut slopes = vec![DMatrix::zeros(n, n); self.directions.len()];
        for k in (0..TERMS).rev() {
            factor *= f64::from(k + 3);
            for (slope, direction) in slopes.iter_mut().zip(&self.directions) {
                *slope = *direction * &sum * h + &power * &*slope;
            }
            sum = &power * sum + &identity * factor;
        }
        // Γ₀ = h + A Γ₁,  Φ = 1 + A Γ₀.
        let gamma_1 = sum * (h * h);
        let gamma_0 = &identity * h + self.a * &gamma_1;
        let phi = identity + self.a * &gamma_0;
        let slopes = slopes.into_iter().zip(&self.directions).map(|(slope, direction)| {
            let of_1 = slope * (h * h);
            let of_0 = *direction * &gamma_1 + self.a * &of_1;
            let of_phi = *direction * &gamma_0 + self.a * &of_0;
            Response { phi: of_phi, gamma_0: of_0, gamma_1: of_1 }
        });
        let slopes = slopes.collect();
        DifferentiatedResponse { value: Response { phi, gamma_0, gamma_1 }, slopes }
    }
}

/// The response of twice the time.
fn doubled(response: &DifferentiatedResponse, h: f64) -> DifferentiatedResponse {
    let Response { phi, gamma_0, gamma_1 } = &response.value;
    let slopes = response.slopes.iter().map(|slope| Response {
        phi: &slope.phi * phi + phi * &slope.phi,
        gamma_0: &slope.phi * gamma_0 + phi * &slope.gamma_0 + &slope.gamma_0,
        gamma_1: &slope.phi * gamma_1 + phi * &slope.gamma_1 + &slope.gamma_0 * h + &slope.gamma_1,
    });
    let slopes = slopes.collect();
    let value = Response {
        phi: phi * phi,
        gamma_0: phi * gamma_0 + gamma_0,
        gamma_1: phi * gamma_1 + gamma_0 * h + gamma_1,
    };
    DifferentiatedResponse { value, slopes }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exponentials(a: &DMatrix<f64>, h: f64) -> (DMatrix<f64>, DMatrix<f64>) {
        let response = Responses::balanced(a).response(h, 0.0).value.clone();
        (response.phi, response.gamma_0)
    }

    #[test]
    fn a_matrix_that_overflows_has_a_response_that_is_not_finite() {
        for large in [f64::INFINITY, 1e200, f64::NAN] {
            let a = DMatrix::from_row_slice(2, 2, &[-1.0, large, 1.0, -1.0]);
            let (phi, _) = exponentials(&a, 1.0);
            assert!(phi.iter().any(|x| !x.is_finite()), "{large}: {phi}");
        }
    }

    /// x(h) of ẋ₁ = −k x₁ + b, ẋ₂ = x₁ − c x₂, from its closed form and that of its derivative with respect to k.
    #[test]
    fn responses_of_two_stages_are_those_of_the_formula() {
        for (k, c, h) in [(0.3, 2.0, 0.1), (0.3, 2.0, 7.0), (400.0, 0.01, 30.0)] {
            let a = DMatrix::from_row_slice(2, 2, &[-k, 0.0, 1.0, -c]);
            let direction = DMatrix::from_row_slice(2, 2, &[-1.0, 0.0, 0.0, 0.0]);
            let mut responses = Responses::new(&a, vec![&direction], &[1.0, 1.0]);
            let found = responses.response(h, 0.0);
            let [ek, ec] = [(-k * h).exp(), (-c * h).exp()];
            let near = |found: f64, expected: f64, scale: f64| {
                assert!((found - expected).abs() <= 1e-11 * scale, "{found} {expected}");
            };
            let Response { phi, gamma_0, gamma_1 } = &found.value;
            near(phi[(0, 0)], ek, 1.0);
            near(phi[(1, 0)], (ek - ec) / (c - k), 1.0 / c);
            near(phi[(1, 1)], ec, 1.0);
            near(gamma_0[(0, 0)], -(-k * h).exp_m1() / k, 1.0 / k);
            let ramp = |k: f64| (h + (-k * h).exp_m1() / k) / k;
            near(gamma_1[(0, 0)], ramp(k), ramp(k));
            // ∫ Γ₀₂₁: by partial fractions of 1/((s + k)(s + c) s²).
            near(gamma_1[(1, 0)], (ramp(k) - ramp(c)) / (c - k), ramp(k) / c);
            let slope = &found.slopes[0];
            near(slope.phi[(0, 0)], -h * ek, h);
            let of_exp = (-h * ek + (ek - ec) / (c - k)) / (c - k);
            near(slope.phi[(1, 0)], of_exp, h / c);
            let of_step = (h * ek + (-k * h).exp_m1() / k) / k;
            near(slope.gamma_0[(0, 0)], of_step, 1.0 / (k * k));
        }
    }

    /// x(h) of a linear ramp: derivatives of all three against extrapolated differences, for states that are coupled
    /// both ways and whose units are far apart.
    #[test]
    fn derivatives_are_those_of_differences() {
        let a = DMatrix::from_row_slice(
            3,
            3,
            &[
                -0.4, 2e6, 0.0, //
                -3e-7, -0.1, 1e-6, //
                0.5, 1e5, -2.0,
            ],
        );
        let direction = DMatrix::from_row_slice(
            3,
            3,
            &[
                0.2, -1e6, 3e-1, //
                1e-7, 0.3, 0.0, //
                0.1, 2e5, 1.0,
            ],
        );
        let sizes = [1e6, 1.0, 1e6];
        let of = |by: f64| {
            let moved = &a + &direction * by;
            Responses::new(&moved, Vec::new(), &sizes).response(3.0, 0.0).value.clone()
        };
        let mut responses = Responses::new(&a, vec![&direction], &sizes);
        let found = &responses.response(3.0, 0.0).slopes[0];
        let by = 1e-3;
        let parts = |r: &Response| [r.phi.clone(), r.gamma_0.clone(), r.gamma_1.clone()];
        let difference =
            |part: usize, by: f64| (&parts(&of(by))[part] - &parts(&of(-by))[part]) / (2.0 * by);
        for (part, found) in parts(found).iter().enumerate() {
            let expected = (difference(part, by / 2.0) * 4.0 - difference(part, by)) / 3.0;
            for i in 0..3 {
                for j in 0..3 {
                    let scale = sizes[i] / sizes[j];
                    let error = (found[(i, j)] - expected[(i, j)]).abs();
                    assert!(error <= 1e-9 * scale, "{i} {j}: {error} of {scale}");
                }
            }
        }
    }

    #[test]
    fn an_oscillator_and_its_integral_have_closed_forms() {
        // ẋ = [0 ω; −ω 0] x in units that differ by 10⁶: e^{hA} is a rotation by ωh.
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
