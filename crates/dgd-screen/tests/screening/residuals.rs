//! False-alarm and detection rates of the tests of residuals.

use dgd_screen::residuals::{cross_correlation, portmanteau};

use crate::support::Normal;

const SEEDS: u64 = 300;

/// Allows five standard deviations of the binomial distribution for the number of p-values below 0.05.
#[track_caller]
fn about_one_in_twenty(count: usize) {
    let n = SEEDS as f64;
    let (mean, std) = (0.05 * n, (0.05 * 0.95 * n).sqrt());
    assert!((count as f64 - mean).abs() <= 5.0 * std, "{count} of {n}");
}

/// e(k) = a e(k−1) + noise.
fn autoregressive(seed: u64, n: usize, a: f64) -> Vec<f64> {
    let mut normal = Normal::new(seed);
    let mut e = 0.0;
    let mut next = || {
        e = a * e + normal.next();
        e
    };
    (0..n + 100).map(|_| next()).skip(100).collect()
}

#[test]
fn white_noise_fails_as_often_as_said_with_gaps_and_in_pieces() {
    let mut whole = 0;
    let mut broken = 0;
    for seed in 0..SEEDS {
        let mut e = Normal::new(seed).many(600, 3.0);
        whole += usize::from(portmanteau(&[&e], 25).expect("enough").p_value < 0.05);
        for k in (0..600).filter(|k| k % 7 == 3 || (100..140).contains(k)) {
            e[k] = f64::NAN;
        }
        let found = portmanteau(&[&e[..250], &e[250..]], 25).expect("enough");
        broken += usize::from(found.p_value < 0.05);
    }
    about_one_in_twenty(whole);
    about_one_in_twenty(broken);
}

#[test]
fn colour_is_found_with_its_autocorrelation() {
    let e = autoregressive(1, 4000, 0.5);
    let found = portmanteau(&[&e], 25).expect("enough");
    assert!(found.p_value < 1e-12);
    // ρ_l = a^l; Bartlett: the variance of ρ_1 is (1 − a²)/N.
    let std = (0.75f64 / 4000.0).sqrt();
    assert!((found.autocorrelation[0] - 0.5).abs() < 5.0 * std, "{:?}", found.autocorrelation);
    assert_eq!(portmanteau(&[&e[..31]], 25), None);
    assert_eq!(portmanteau(&[&[0.0; 100]], 25), None);
}

#[test]
fn an_input_that_changes_seldom_does_not_go_with_coloured_residuals() {
    let u: Vec<f64> = (0..2000).map(|k| [1.0, 4.0, 2.0, 3.0][k / 50 % 4]).collect();
    for a in [0.0, 0.8] {
        let mut false_alarms = 0;
        let mut per_lag = 0;
        for seed in 0..SEEDS {
            let e = autoregressive(seed, 2000, a);
            let found = cross_correlation(&[(&e, &u)], 25).expect("it changes");
            false_alarms += usize::from(found.p_value < 0.05);
            per_lag += usize::from(found.correlation[0].abs() > found.limit);
        }
        about_one_in_twenty(per_lag);
        // Bonferroni's bound is one-sided.
        assert!(false_alarms as f64 <= 0.05 * SEEDS as f64 + 5.0 * 3.8, "{a}: {false_alarms}");
    }
}

#[test]
fn what_an_input_leaves_is_found_at_its_lag() {
    let mut normal = Normal::new(5);
    let u = normal.many(1000, 2.0);
    let e: Vec<f64> = (0..1000)
        .map(|k: usize| 0.3 * k.checked_sub(6).map_or(0.0, |k| u[k]) + normal.next())
        .collect();
    let found =
        cross_correlation(&[(&e[..500], &u[..500]), (&e[500..], &u[500..])], 25).expect("both");
    assert_eq!(found.lag, 6);
    // r = 0.3·2/√(0.6² + 1)
    let expected = 0.6 / 1.36f64.sqrt();
    assert!(
        (found.correlation[6] - expected).abs() < 5.0 / 1000f64.sqrt(),
        "{:?}",
        found.correlation[6]
    );
    assert!(found.p_value < 1e-12);
    assert_eq!(cross_correlation(&[(&e, &[2.5; 1000])], 25), None);
}
