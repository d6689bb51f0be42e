//! Profiles of regressions, against closed forms of the sum of squares.

use dgd_identify::regression::{
    RegressionFit, RegressionMethod, RegressionProblem, regress, regression_profiles,
};
use dgd_identify::{NoiseSource as Sensor, Profile, ProfileEnd, THRESHOLD};

use super::{Case, LINE, made_up};

use crate::support::Noise;

/// A linear and a nonlinear parameter.
const RISE: &str = "\
model rise
input x [1] linear
parameter a [1] = 1
parameter b [1] = 0.5 in 0 .. 5
output y [1] = a*(1 - exp(-b*x))
";

/// Residuals of what an input is taken to give, with a little noise.
fn case(text: &str, truth: impl Fn(f64) -> f64) -> (Case, Vec<f64>) {
    let mut noise = Noise::new(7);
    let errors: Vec<f64> = (0..30).map(|_| 0.05 * noise.next()).collect();
    let measured = |t: f64| truth(0.1 * t) + errors[t as usize];
    let recording = made_up(1.0, 30, &[("x", &|t| 0.1 * t)], &[&measured]);
    (Case::made_up(text, recording), (0..30).map(|k| measured(f64::from(k))).collect())
}

fn of(case: &Case, method: RegressionMethod, estimate: usize) -> (RegressionFit, Profile) {
    let problem = case.problem();
    let fit = regress(&problem, method).expect("a fit");
    let mut profiles = regression_profiles(&problem, &fit, &[estimate]).expect("a profile");
    (fit, profiles.pop().expect("one"))
}

#[test]
fn a_linear_parameter_has_a_parabola_for_a_profile() {
    for method in [RegressionMethod::LeastSquares, RegressionMethod::Bounded] {
        for j in 0..2 {
            let (case, _) = case(LINE, |x| 1.0 + 0.5 * x);
            let (fit, profile) = of(&case, method, j);
            let (value, std) = (fit.estimates[j].value, fit.estimates[j].std.expect("a std"));
            for (at, deviance) in profile.values.iter().zip(&profile.deviance) {
                let parabola = ((at - value) / std).powi(2);
                assert!((deviance - parabola).abs() < 1e-9, "{deviance} is not {parabola}");
            }
            let (low, high) = profile.interval();
            let half = THRESHOLD.sqrt() * std;
            // A crossing is known to a thousandth.
            assert!((low.expect("closed") - (value - half)).abs() < 2e-3 * half);
            assert!((high.expect("closed") - (value + half)).abs() < 2e-3 * half);
        }
    }
}

#[test]
fn others_are_fitted_wherever_one_is_held() {
    let (case, measured) = case(RISE, |x| 2.0 * (1.0 - (-0.4 * x).exp()));
    for method in [RegressionMethod::VariableProjection, RegressionMethod::NelderMead] {
        // Held b: a in closed form. Held a: the least over a fine grid of b, refined by a parabola.
        let sum_at = |a: f64, b: f64| -> f64 {
            let shape = |k: usize| 1.0 - (-b * 0.1 * k as f64).exp();
            measured.iter().enumerate().map(|(k, y)| (a * shape(k) - y).powi(2)).sum()
        };
        let with_best_a = |b: f64| {
            let shape = |k: usize| 1.0 - (-b * 0.1 * k as f64).exp();
            let of_both: f64 = measured.iter().enumerate().map(|(k, y)| shape(k) * y).sum();
            let of_shape: f64 = (0..measured.len()).map(|k| shape(k).powi(2)).sum();
            sum_at(of_both / of_shape, b)
        };
        let with_best_b = |a: f64| {
            let h = 1e-4;
            let grid = (1..50_000).map(|k| h * f64::from(k));
            let b = grid.min_by(|b, c| sum_at(a, *b).total_cmp(&sum_at(a, *c))).expect("a grid");
            let [below, at, above] = [b - h, b, b + h].map(|b| sum_at(a, b));
            at - (above - below).powi(2) / (8.0 * (above - 2.0 * at + below))
        };
        let (fit, of_b) = of(&case, method, 1);
        let least = with_best_a(fit.estimates[1].value);
        let variance = fit.rows[0].sigma.powi(2);
        for (b, deviance) in of_b.values.iter().zip(&of_b.deviance) {
            let expected = (with_best_a(*b) - least) / variance;
            assert!((deviance - expected).abs() < 1e-6, "b = {b}: {deviance} is not {expected}");
        }
        let (_, of_a) = of(&case, method, 0);
        // The data bends little: a curve with a long tail, far from symmetric.
        for (a, deviance) in of_a.values.iter().zip(&of_a.deviance).step_by(4) {
            let expected = (with_best_b(*a) - least) / variance;
            assert!((deviance - expected).abs() < 1e-4, "a = {a}: {deviance} is not {expected}");
        }
        let (low, high) = of_a.interval();
        let (low, high) = (low.expect("closed"), high.expect("closed"));
        let value = fit.estimates[0].value;
        assert!(high - value > 1.2 * (value - low), "{low} .. {value} .. {high}");
        assert!(of_a.with_upper.iter().any(|term| term.estimate == 1 && term.change < 0.0));
    }
}

#[test]
fn what_is_not_told_apart_is_open_and_names_the_other() {
    let text = LINE.replace("a + b*x", "a*b*x").replace("a [1] = 0", "a [1] = 1");
    let (case, _) = case(&text, |x| 3.0 * x);
    let problem = RegressionProblem { noise: vec![Some(Sensor::Known(0.05))], ..case.problem() };
    let fit = regress(&problem, RegressionMethod::VariableProjection).expect("a fit");
    let profiles = regression_profiles(&problem, &fit, &[0]).expect("a profile");
    let profile = &profiles[0];
    assert!(matches!(profile.upper, ProfileEnd::Open(_)), "{:?}", profile.upper);
    let [term] = profile.with_upper.as_slice() else { panic!("{:?}", profile.with_upper) };
    assert!(term.estimate == 1 && term.change < 0.0, "{term:?}");
}
