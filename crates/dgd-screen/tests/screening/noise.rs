//! Noise estimates from records that contain more than noise.

use dgd_screen::noise::{quantisation_step, white_noise};

use crate::support::{Normal, seconds};

/// Within four of the estimate's own standard errors: exceeded by chance once in 16 000.
fn assert_noise(times: &[f64], r: &[f64], std: f64) {
    let noise = white_noise(times, r, r).expect("enough samples");
    let error = noise.std / std - 1.0;
    assert!(error.abs() < 4.0 * noise.relative_error, "{error} of {}", noise.relative_error);
}

#[test]
fn drifts_steps_sines_and_spikes_are_no_noise() {
    for seed in 0..20 {
        let times = seconds(5000);
        let mut r = Normal::new(seed).many(5000, 0.2);
        for (k, r) in r.iter_mut().enumerate() {
            let t = times[k];
            *r += 0.01 * t + 5.0 * (t / 60.0).sin() + if t > 2000.0 { 30.0 } else { 0.0 };
            if k % 400 == 17 {
                *r += 100.0;
            }
        }
        assert_noise(&times, &r, 0.2);
    }
}

#[test]
fn samples_may_be_missing_and_spacing_uneven() {
    let mut normal = Normal::new(7);
    let mut t = 0.0;
    let (mut times, mut r) = (Vec::new(), Vec::new());
    for k in 0..4000 {
        t += 0.5 + normal.uniform();
        times.push(t);
        r.push(if k % 9 == 4 { f64::NAN } else { 3e-3 * normal.next() + 0.05 * t });
    }
    assert_noise(&times, &r, 3e-3);
}

#[test]
fn the_stated_error_is_the_spread_over_records() {
    let times = seconds(1000);
    let estimates: Vec<_> = (0..400)
        .map(|seed| {
            let r = Normal::new(seed).many(1000, 1.0);
            white_noise(&times, &r, &r).expect("enough samples")
        })
        .collect();
    let mean = estimates.iter().map(|n| n.std).sum::<f64>() / 400.0;
    let spread = (estimates.iter().map(|n| (n.std - mean).powi(2)).sum::<f64>() / 399.0).sqrt();
    // A standard deviation from 400 values is known to 1/√800 = 3.5 %, the mean to spread/20.
    let stated = estimates[0].relative_error;
    assert!((spread / stated - 1.0).abs() < 4.0 * 0.035, "{spread} {stated}");
    assert!((mean - 1.0).abs() < 4.0 * spread / 20.0, "{mean}");
}

#[test]
fn a_quantised_sensor_tells_its_step() {
    let mut normal = Normal::new(3);
    let reading = |value: f64| 1.25 + (value / 0.05).round() * 0.05;
    let times = seconds(3000);
    // σ of half a step: rounding adds step²/12 to the variance, white at this size.
    let readings: Vec<f64> =
        times.iter().map(|t| reading(0.025 * normal.next() + 1e-3 * t)).collect();
    let step = quantisation_step(&readings).expect("quantised");
    assert!((step / 0.05 - 1.0).abs() < 1e-9, "{step}");
    let noise = white_noise(&times, &readings, &readings).expect("enough samples");
    let expected = (0.025f64.powi(2) + 0.05f64.powi(2) / 12.0).sqrt();
    assert!((noise.std / expected - 1.0).abs() < 5.0 * noise.relative_error, "{}", noise.std);

    // A sensor that hardly changes has at least the noise of rounding.
    let still: Vec<f64> = times.iter().map(|t| reading(2e-3 * t)).collect();
    let noise = white_noise(&times, &still, &still).expect("enough samples");
    assert!(noise.std >= 0.05 / 12f64.sqrt() * (1.0 - 1e-9));

    assert_eq!(quantisation_step(&normal.many(3000, 1.0)), None);
}

#[test]
fn a_value_that_is_set_and_held_has_no_noise() {
    let times = seconds(3600);
    let held = |levels: &[f64]| -> Vec<f64> {
        (0..3600).map(|k| levels[k * levels.len() / 3600]).collect()
    };
    for levels in [
        &[0.0, 1000.0, 2000.0, 500.0, 1500.0, 0.0][..],
        &[0.0, 50.0],
        // More levels than needed to detect a step, all multiples of 50.
        &[0.0, 500.0, 50.0, 600.0, 200.0, 800.0, 350.0, 1000.0, 150.0, 700.0, 450.0, 900.0],
    ] {
        let set = held(levels);
        assert_eq!(white_noise(&times, &set, &set), None, "{levels:?}");
    }

    // A reading that flickers between a few levels has the noise of its flicker: with a rare change by q, e² is q²·(4 +
    // 1 + 1)/6 on three triples.
    let q = 0.1;
    let flicker: Vec<f64> = (0..3600).map(|k| if k % 20 == 10 { 20.0 + q } else { 20.0 }).collect();
    let noise = white_noise(&times, &flicker, &flicker).expect("it flickers");
    assert!((noise.std / (q / 20f64.sqrt()) - 1.0).abs() < 0.01, "{noise:?}");
    // Two additional steps do not change it.
    let stepped: Vec<f64> = flicker
        .iter()
        .enumerate()
        .map(|(k, r)| r + if k / 1200 == 1 { 5.0 } else { 0.0 })
        .collect();
    let noise = white_noise(&times, &stepped, &stepped).expect("it flickers");
    assert!((noise.std / (q / 20f64.sqrt()) - 1.0).abs() < 0.01, "{noise:?}");
}

#[test]
fn a_calculated_value_that_is_rounded_has_the_noise_of_rounding() {
    // It is mostly constant, moves by many steps per sample in between, and its last digit flickers.
    let value = |k: usize| {
        let ramp = (k as f64 - 2000.0).clamp(0.0, 300.0);
        let turn = if k % 500 == 250 { 0.1 } else { 0.0 };
        ((7.77 * ramp + turn) / 0.1).round() * 0.1
    };
    let times = seconds(3600);
    let readings: Vec<f64> = (0..3600).map(value).collect();
    let noise = white_noise(&times, &readings, &readings).expect("it is rounded");
    assert!((noise.std / (0.1 / 12f64.sqrt()) - 1.0).abs() < 1e-6, "{noise:?}");
}

#[test]
fn too_little_says_nothing() {
    let times = seconds(9);
    assert_eq!(white_noise(&times, &[1.0; 9], &[1.0; 9]), None);
    assert_eq!(white_noise(&times[..4], &[1.0, 2.0, 0.0, 1.0], &[1.0; 4]), None);
    assert_eq!(white_noise(&times, &[f64::NAN; 9], &[f64::NAN; 9]), None);
}
