//! Comparison with batch least squares, closed forms, and a direct integration of Table 3.1.

use super::*;

fn rows(k: usize) -> RegressorSample {
    let t = k as f64;
    let phi = vec![1.0, (0.37 * t).sin(), 0.01 * t];
    let z = 2.0 - 3.0 * phi[1] + 0.5 * phi[2] + 0.1 * (12.9 * t).sin();
    RegressorSample { phi, z }
}

#[test]
fn without_forgetting_it_is_batch_least_squares() {
    let (theta0, p0) = ([1.0, 0.0, -1.0], DMatrix::from_diagonal_element(3, 3, 10.0));
    let mut recursive =
        RecursiveLeastSquares::new(&theta0, &p0, Forgetting::default()).expect("P₀");
    // P⁻¹ = P₀⁻¹ + ΦᵀΦ, P⁻¹θ = P₀⁻¹θ₀ + Φᵀz
    let mut information = DMatrix::from_diagonal_element(3, 3, 0.1);
    let mut right = DVector::from_row_slice(&theta0) * 0.1;
    for k in 0..500 {
        let row = rows(k);
        recursive.update(k as f64, &row);
        let phi = DVector::from_column_slice(&row.phi);
        information += &phi * phi.transpose();
        right += &phi * row.z;
    }
    let batch = information.clone().cholesky().expect("positive definite");
    let theta = batch.solve(&right);
    for (found, expected) in recursive.theta().iter().zip(theta.iter()) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    assert!((recursive.covariance() * information - DMatrix::identity(3, 3)).amax() < 1e-11);
}

#[test]
fn with_forgetting_it_is_weighted_least_squares_whatever_the_steps() {
    let forgetting = Forgetting { rate: 0.02, ..Forgetting::default() };
    let p0 = DMatrix::from_diagonal_element(3, 3, 10.0);
    let mut recursive = RecursiveLeastSquares::new(&[0.0; 3], &p0, forgetting).expect("P₀");
    let taken = || (0..400).filter(|k| k % 7 != 3);
    for k in taken() {
        recursive.update(k as f64, &rows(k));
    }
    let weight = |k: usize| (-0.02 * (399.0 - k as f64)).exp();
    let mut information = DMatrix::from_diagonal_element(3, 3, 0.1 * weight(0));
    let mut right = DVector::zeros(3);
    for k in taken() {
        let row = rows(k);
        let phi = DVector::from_column_slice(&row.phi);
        information += &phi * phi.transpose() * weight(k);
        right += &phi * (row.z * weight(k));
    }
    let theta = information.cholesky().expect("positive definite").solve(&right);
    for (found, expected) in recursive.theta().iter().zip(theta.iter()) {
        assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    }
}

#[test]
fn a_scalar_with_a_constant_regressor_is_the_closed_form() {
    // Ṗ = βP − φ²P²: 1/P = φ²/β + (1/P₀ − φ²/β) e^(−βt), and with z = φθ* the error decays as
    // (θ − θ*)/(θ₀ − θ*) = P e^(−βt)/P₀.
    let (beta, phi, p0, truth) = (0.1f64, 0.2f64, 10.0, 0.951);
    let forgetting = Forgetting { rate: beta, ..Forgetting::default() };
    let start = DMatrix::from_element(1, 1, p0);
    let mut recursive = ContinuousLeastSquares::new(&[1.0], &start, forgetting).expect("P₀");
    let mut t = 0.0;
    for h in [0.5, 1.0, 3.0, 0.1, 5.0, 10.0] {
        recursive.advance(h, &mut |_| vec![RegressorSample { phi: vec![phi], z: phi * truth }]);
        t += h;
        let settled = phi * phi / beta;
        let p = (settled + (p0.recip() - settled) * (-beta * t).exp()).recip();
        let theta = truth + (1.0 - truth) * p * (-beta * t).exp() / p0;
        let result = (recursive.covariance()[(0, 0)], recursive.theta()[0]);
        // Gauss's rule with four nodes on e^(βt) over steps of βh ≤ 1: an error of (βh)⁸/2e9.
        assert!((result.0 / p - 1.0).abs() < 1e-9, "{result:?} {p}");
        assert!((result.1 - theta).abs() < 1e-10, "{result:?} {theta}");
    }
}

/// φ(t) and z(t) of two parameters, smooth.
fn smooth(t: f64) -> RegressorSample {
    let phi = vec![1.0 + 0.5 * (0.9 * t).sin(), (0.4 * t).cos()];
    RegressorSample { z: 2.0 * phi[0] - phi[1] + 0.3 * (1.3 * t).cos(), phi }
}

/// θ and P by small steps of the classical Runge–Kutta method on θ̇ and Ṗ.
fn integrated(until: f64, beta: f64, normalisation: Normalisation) -> (DVector<f64>, DMatrix<f64>) {
    let h = 1e-3;
    let slope = |t: f64, theta: &DVector<f64>, p: &DMatrix<f64>| {
        let RegressorSample { phi, z } = smooth(t);
        let phi = DVector::from_vec(phi);
        let m2 = match normalisation {
            Normalisation::None => 1.0,
            Normalisation::Regressors => 1.0 + phi.norm_squared(),
            Normalisation::Covariance => 1.0 + phi.dot(&(p * &phi)),
        };
        let p_phi = p * &phi;
        let epsilon = (z - phi.dot(theta)) / m2;
        (&p_phi * epsilon, p * beta - &p_phi * p_phi.transpose() / m2)
    };
    let (mut theta, mut p) = (DVector::zeros(2), DMatrix::from_diagonal_element(2, 2, 3.0));
    for k in 0..(until / h).round() as u32 {
        let t = f64::from(k) * h;
        let k1 = slope(t, &theta, &p);
        let k2 = slope(t + h / 2.0, &(&theta + &k1.0 * (h / 2.0)), &(&p + &k1.1 * (h / 2.0)));
        let k3 = slope(t + h / 2.0, &(&theta + &k2.0 * (h / 2.0)), &(&p + &k2.1 * (h / 2.0)));
        let k4 = slope(t + h, &(&theta + &k3.0 * h), &(&p + &k3.1 * h));
        theta += (k1.0 + (k2.0 + k3.0) * 2.0 + k4.0) * (h / 6.0);
        p += (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) * (h / 6.0);
    }
    (theta, p)
}

#[test]
fn steps_of_a_sample_integrate_the_table_as_it_is_written() {
    for normalisation in [Normalisation::None, Normalisation::Regressors] {
        let forgetting = Forgetting { rate: 0.1, normalisation, ..Forgetting::default() };
        let p0 = DMatrix::from_diagonal_element(2, 2, 3.0);
        let mut recursive = ContinuousLeastSquares::new(&[0.0; 2], &p0, forgetting).expect("P₀");
        for k in 0..40 {
            recursive.advance(0.5, &mut |after| vec![smooth(0.5 * f64::from(k) + after)]);
        }
        let (theta, p) = integrated(20.0, 0.1, normalisation);
        // The Runge–Kutta steps err by 1e-3⁴ times derivatives of the order of P² φ⁴ = 100.
        let estimate = DVector::from_column_slice(recursive.theta());
        assert!((&estimate - &theta).amax() < 1e-7, "{normalisation:?} {estimate} {theta}");
        assert!((recursive.covariance() - p).amax() < 1e-7);
    }
    // m² with P itself is evaluated at the start of a step: short steps approximate it.
    let forgetting =
        Forgetting { rate: 0.1, normalisation: Normalisation::Covariance, ..Forgetting::default() };
    let p0 = DMatrix::from_diagonal_element(2, 2, 3.0);
    let mut recursive = ContinuousLeastSquares::new(&[0.0; 2], &p0, forgetting).expect("P₀");
    for k in 0..4000 {
        recursive.advance(0.005, &mut |after| vec![smooth(0.005 * f64::from(k) + after)]);
    }
    let (theta, _) = integrated(20.0, 0.1, Normalisation::Covariance);
    let estimate = DVector::from_column_slice(recursive.theta());
    assert!((&estimate - &theta).amax() < 0.01, "{estimate} {theta}");
}

#[test]
fn without_excitation_nothing_winds_up() {
    // Only the first parameter is excited after t = 50: the other's variance would grow by e^(β 500).
    let limit = 100.0;
    let forgetting = Forgetting { rate: 0.1, limit, ..Forgetting::default() };
    let p0 = DMatrix::from_diagonal_element(2, 2, 10.0);
    let mut continuous = ContinuousLeastSquares::new(&[0.0; 2], &p0, forgetting).expect("P₀");
    let mut discrete = RecursiveLeastSquares::new(&[0.0; 2], &p0, forgetting).expect("P₀");
    let row = |t: f64| {
        let second = if t < 50.0 { (0.3 * t).sin() } else { 0.0 };
        RegressorSample { z: 4.0 + 3.0 * second, phi: vec![1.0, second] }
    };
    for k in 0..550 {
        let t = f64::from(k);
        continuous.advance(1.0, &mut |after| vec![row(t + after)]);
        discrete.update(t, &row(t));
    }
    assert!(continuous.frozen() > 400.0, "{}", continuous.frozen());
    for (theta, p) in
        [(continuous.theta(), continuous.covariance()), (discrete.theta(), discrete.covariance())]
    {
        let norm = p.singular_values().max();
        assert!(norm <= limit && norm > 0.5 * limit, "{norm}");
        // The common information remains, up to the effect of the start.
        assert!((theta[0] - 4.0).abs() < 0.01 && (theta[1] - 3.0).abs() < 0.05, "{theta:?}");
    }
    // It still learns: the second parameter has changed.
    for k in 0..200 {
        let t = 1000.0 + f64::from(k);
        let changed = |t: f64| RegressorSample {
            z: 4.0 + 5.0 * (0.3 * t).sin(),
            phi: vec![1.0, (0.3 * t).sin()],
        };
        continuous.advance(1.0, &mut |after| vec![changed(t + after)]);
        discrete.update(t, &changed(t));
    }
    for theta in [continuous.theta(), discrete.theta()] {
        assert!((theta[1] - 5.0).abs() < 0.01, "{theta:?}");
    }
    // Without a limit numbers overflow; nothing panics.
    let forgetting = Forgetting { rate: 10.0, ..Forgetting::default() };
    let mut lost = RecursiveLeastSquares::new(&[0.0; 2], &p0, forgetting).expect("P₀");
    for k in 0..1000 {
        lost.update(f64::from(k), &row(100.0));
    }
    assert!((lost.theta()[0] - 4.0).abs() < 1e-9, "{:?}", lost.theta());
}
