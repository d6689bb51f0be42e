//! Noise is recognised as noise, and discrepancies hidden in it are detected.

use dgd_discover::{
    CheckKind, NoiseColour, SensorNoise, averaging_lengths, discrepancy_windows,
    effective_sample_size, white_noise, whiteness,
};

use crate::support::{Normal, seconds};

#[test]
fn white_noise_is_called_so_at_its_level() {
    let times = seconds(1500);
    let seeds = 600;
    let mut below = [0usize; 2];
    for seed in 0..seeds {
        let r = Normal::new(seed).many(1500, 0.7);
        let noise = white_noise(&times, &r, &r).expect("enough samples");
        let found = whiteness(&r, &noise, 0).expect("enough samples");
        below[0] += usize::from(found.p_value < 1e-4);
        below[1] += usize::from(found.p_value < 0.05);
    }
    // 0.06 expected below 1e-4; below 0.05 at most 30 with a standard deviation of 5.3.
    assert_eq!(below[0], 0);
    assert!(below[1] <= 30 + 3 * 5, "{}", below[1]);
    // The checks overlap, so Bonferroni's bound is not reached; but they must not be insensitive either.
    assert!(below[1] >= 4, "{}", below[1]);
}

#[test]
fn a_slow_drift_below_the_noise_is_seen() {
    // 0.3σ in all; and ±0.3σ, with the mean removed by a fit. Σ means² over the noise's variance is 5000·0.15² = 112 of
    // the whole, and as much of the halves: χ² around 112 with a standard deviation of 2·√112 = 21, where 36 is at a
    // level of 1e-7 after Bonferroni.
    let drifts: [fn(f64) -> f64; 2] = [|x| 0.3 * x, |x| 0.6 * (x - 0.5)];
    for (seed, drift) in (0..20).flat_map(|seed| drifts.map(|drift| (seed, drift))) {
        let times = seconds(5000);
        let mut r = Normal::new(seed).many(5000, 1.0);
        for (k, r) in r.iter_mut().enumerate() {
            *r += drift(k as f64 / 4999.0);
        }
        let noise = white_noise(&times, &r, &r).expect("enough samples");
        let found = whiteness(&r, &noise, 4).expect("enough samples");
        assert!(found.p_value < 1e-7, "seed {seed}: {found:?}");
        assert!(matches!(found.worst.kind, CheckKind::BlockMeans(_)));
    }
}

#[test]
fn a_sine_between_lags_is_seen_in_correlations() {
    let mut r = Normal::new(5).many(4000, 1.0);
    for (k, r) in r.iter_mut().enumerate() {
        *r += 0.5 * (k as f64 * 2.0 * std::f64::consts::PI / 7.3).sin();
    }
    let found = whiteness(&r, &SensorNoise::known(1.0), 0).expect("enough samples");
    assert!(found.p_value < 1e-6);
    assert!(found.checks.iter().any(|c| c.kind == CheckKind::Correlation(25) && c.p_value < 1e-6));
}

#[test]
fn the_mean_square_has_its_distribution() {
    // P(χ²_N > statistic) of white noise is uniform: its mean over seeds is ½ ± 1/√(12·300).
    let sum: f64 = (0..300)
        .map(|seed| {
            let r = Normal::new(seed).many(400, 1.0);
            whiteness(&r, &SensorNoise::known(1.0), 0).expect("enough samples").checks[0].p_value
        })
        .sum();
    assert!((sum / 300.0 - 0.5).abs() < 4.0 / (12.0f64 * 300.0).sqrt(), "{sum}");
}

#[test]
fn windows_hold_the_misfit_and_nothing_else() {
    let times: Vec<f64> = seconds(6000).iter().map(|t| 0.5 * t).collect();
    for seed in 0..20 {
        let mut r = Normal::new(seed).many(6000, 2.0);
        assert_eq!(
            discrepancy_windows(
                &times,
                &r,
                &SensorNoise::known(2.0),
                &averaging_lengths(&times, &r)
            ),
            []
        );
        for (k, r) in r.iter_mut().enumerate() {
            let t = times[k];
            // Short and strong; faint and lasting.
            if (400.0..=430.0).contains(&t) {
                *r += 6.0;
            }
            if (1500.0..=2100.0).contains(&t) {
                *r -= 1.0;
            }
            if k % 10 == 3 {
                *r = f64::NAN;
            }
        }
        let windows = discrepancy_windows(
            &times,
            &r,
            &SensorNoise::known(2.0),
            &averaging_lengths(&times, &r),
        );
        let first = windows.first().expect("a window");
        // Averages over 10 s or more mark half their length.
        assert!((first.from - 400.0).abs() <= 5.0 && (first.until - 430.0).abs() <= 5.0);
        // 3σ over 54 samples: the mean is known to σ/√54.
        assert!((first.mean - 6.0).abs() < 1.5, "{first:?}");
        assert!(first.peak_sigma > 5.0);
        assert!(windows.len() > 1, "{windows:?}");
        for window in &windows[1..] {
            assert!(window.from >= 1425.0 && window.until <= 2175.0, "{windows:?}");
            assert!(window.mean < 0.0 && window.peak_sigma < -5.0);
        }
    }
}

#[test]
fn correlated_noise_has_no_windows_and_hides_none() {
    let times = seconds(6000);
    let (std, memory) = (1.5, 12.0);
    let noise =
        SensorNoise { colour: Some(NoiseColour { std, memory }), ..SensorNoise::known(1.0) };
    let taken_for_white = SensorNoise::known(noise.total());
    let phi = f64::exp(-1.0 / memory);
    let mut without_colour = 0;
    for seed in 0..40 {
        let mut normal = Normal::new(seed);
        let mut v = std * normal.next();
        let mut r: Vec<f64> = (0..6000)
            .map(|_| {
                v = phi * v + std * (1.0 - phi * phi).sqrt() * normal.next();
                v + normal.next()
            })
            .collect();
        assert_eq!(discrepancy_windows(&times, &r, &noise, &averaging_lengths(&times, &r)), []);
        let windows =
            discrepancy_windows(&times, &r, &taken_for_white, &averaging_lengths(&times, &r));
        without_colour += usize::from(!windows.is_empty());
        // A mean over 300 s is known to 1.5 √(2·12/300) = 0.42.
        for r in &mut r[3000..3600] {
            *r += 4.0;
        }
        let windows = discrepancy_windows(&times, &r, &noise, &averaging_lengths(&times, &r));
        assert!(!windows.is_empty(), "{seed}");
        for window in windows {
            assert!(window.from >= 2900.0 && window.until <= 3700.0, "{seed}: {window:?}");
        }
    }
    assert_eq!(without_colour, 40);
}

#[test]
fn correlated_samples_are_worth_fewer() {
    // AR(1) with coefficient a: N (1 − a)/(1 + a).
    let (a, n) = (0.9, 40_000);
    let mut normal = Normal::new(11);
    let mut x = 0.0;
    let r: Vec<f64> = (0..n)
        .map(|_| {
            x = a * x + normal.next();
            x
        })
        .collect();
    let expected = f64::from(n) * (1.0 - a) / (1.0 + a);
    // 2105 independent samples: their number is known to about 2·√(2·60/40000) = 11 % from 60 lags.
    assert!((effective_sample_size(&r) / expected - 1.0).abs() < 0.25);
    let white = effective_sample_size(&normal.many(4000, 1.0));
    assert!(white > 3200.0, "{white}");
    assert_eq!(effective_sample_size(&[]), 0.0);
    assert_eq!(effective_sample_size(&[f64::NAN]), 0.0);
}
