//! A condition that coincides with windows is named, and coincidence by chance is not.

use dgd_discover::{ConditionKind, KnownKind, KnownQuantity, WindowCondition, condition};
use dgd_runtime::Unit;

use crate::support::{Normal, seconds};

const SAMPLES: usize = 3000;

fn known(name: &str, kind: KnownKind, values: Vec<Vec<f64>>) -> KnownQuantity {
    let unit = Unit { symbol: "lpm".into(), factor: 1.0, offset: 0.0 };
    KnownQuantity { name: name.to_owned(), kind, unit, values }
}

/// A flow that stays at random levels for random times and moves to the next in 20 to 60 s.
fn flow(normal: &mut Normal) -> Vec<f64> {
    let mut values = Vec::new();
    let mut level = 1500.0;
    while values.len() < SAMPLES {
        let rest = 80 + (200.0 * normal.uniform()) as usize;
        values.extend(std::iter::repeat_n(level, rest));
        let (next, steps) = (2000.0 * normal.uniform(), 20 + (40.0 * normal.uniform()) as usize);
        values.extend((0..steps).map(|k| level + (next - level) * k as f64 / steps as f64));
        level = next;
    }
    values.truncate(SAMPLES);
    values
}

/// A slow oscillation of random phases, like a controlled level.
fn level(normal: &mut Normal) -> Vec<f64> {
    let parts: Vec<[f64; 3]> = (0..5)
        .map(|_| [normal.next(), 0.01 + 0.05 * normal.uniform(), 6.0 * normal.uniform()])
        .collect();
    let value = |k: usize| parts.iter().map(|[a, f, start]| a * (f * k as f64 + start).sin()).sum();
    (0..SAMPLES).map(value).collect()
}

/// Windows in which a predicate holds.
fn windows(holds: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::new();
    for k in (0..SAMPLES).filter(|k| holds(*k)) {
        match all.last_mut() {
            Some(last) if last[1] == k as f64 - 1.0 => last[1] = k as f64,
            _ => all.push([k as f64; 2]),
        }
    }
    all
}

fn of_one(windows: Vec<[f64; 2]>, known: &[KnownQuantity]) -> Option<WindowCondition> {
    condition(&[seconds(SAMPLES)], &[windows], known)
}

/// Two flows as inputs, a level measured with noise, and an unknown of the model.
fn quantities(seed: u64) -> Vec<KnownQuantity> {
    let normal = &mut Normal::new(seed);
    let (a, b, measured, unknown) = (flow(normal), flow(normal), level(normal), level(normal));
    let noisy = measured.iter().map(|x| x + 0.1 * normal.next()).collect();
    vec![
        known("a", KnownKind::Input, vec![a]),
        known("b", KnownKind::Input, vec![b]),
        known("measured", KnownKind::Output, vec![noisy]),
        known("unknown", KnownKind::Unknown, vec![unknown]),
    ]
}

#[test]
fn windows_of_a_falling_flow_are_called_so() {
    let mut said = 0;
    for seed in 0..10 {
        let all = quantities(seed);
        let a = &all[0].values[0];
        // The effect begins when the flow falls, and lasts for 20 s.
        let falls = |k: usize| (k.max(21) - 20..=k).any(|k| a[k] < a[k - 1] - 4.0);
        // With few windows nothing is reported.
        let Some(found) = of_one(windows(falls), &all) else { continue };
        said += 1;
        assert_eq!(found.quantity, "a", "seed {seed}: {found:?}");
        assert_eq!(found.kind, ConditionKind::Falling, "seed {seed}: {found:?}");
        assert!(found.threshold.is_some_and(|threshold| threshold > 0.0), "{found:?}");
        assert!(found.share_inside > 0.8 && found.share_outside < 0.2, "{found:?}");
        assert!(found.p_value <= 0.05, "{found:?}");
    }
    assert!(said >= 8, "{said} of 10");
}

#[test]
fn windows_above_a_level_have_its_threshold() {
    for seed in 0..10 {
        let all = quantities(seed);
        let unknown = &all[3].values[0];
        let mut sorted = unknown.clone();
        sorted.sort_by(f64::total_cmp);
        let rim = sorted[SAMPLES * 3 / 4];
        let found = of_one(windows(|k| unknown[k] > rim), &all);
        let found = found.unwrap_or_else(|| panic!("seed {seed}"));
        assert_eq!((found.quantity.as_str(), &found.kind), ("unknown", &ConditionKind::Above));
        let range = sorted[SAMPLES - 1] - sorted[0];
        let threshold = found.threshold.expect("a level");
        assert!((threshold - rim).abs() < 0.02 * range, "{threshold} {rim}");
    }
}

#[test]
fn an_input_is_said_before_an_output_that_follows_it() {
    let mut all = quantities(4);
    let a = all[0].values[0].clone();
    all[2].values[0] = a.iter().map(|a| a / 100.0).collect();
    let found = of_one(windows(|k| a[k] < 700.0), &all).expect("a condition");
    assert_eq!((found.quantity.as_str(), found.kind), ("a", ConditionKind::Below));
}

#[test]
fn windows_within_a_mode_are_of_that_mode() {
    let normal = &mut Normal::new(2);
    let mode: Vec<f64> = flow(normal).iter().map(|a| (a / 700.0).floor()).collect();
    let modes = ["closed", "half", "open"].map(str::to_owned).to_vec();
    let inside = windows(|k| mode[k] == 1.0);
    let mut all = quantities(3);
    all.push(known("valve", KnownKind::Mode(modes), vec![mode]));
    let found = of_one(inside, &all).expect("a condition");
    assert_eq!(found.quantity, "valve");
    assert_eq!(found.kind, ConditionKind::Mode("half".to_owned()));
    // The middle of a cell differs from the times of samples.
    assert!(found.share_inside > 0.99 && found.share_outside < 0.01, "{found:?}");
}

#[test]
fn windows_at_random_go_with_nothing() {
    let seeds = 300;
    let claims = (0..seeds).filter(|seed| {
        let mut normal = Normal::new(10_000 + seed);
        let marks: Vec<(usize, usize)> = (0..3 + seed % 8)
            .map(|_| {
                let length = 30 + (200.0 * normal.uniform()) as usize;
                ((normal.uniform() * SAMPLES as f64) as usize, length)
            })
            .collect();
        let inside =
            |k: usize| marks.iter().any(|(from, length)| (*from..from + length).contains(&k));
        of_one(windows(inside), &quantities(*seed)).is_some()
    });
    // At p ≤ 0.05 fifteen of 300 with a standard deviation of 3.8, minus those that are not strong enough.
    let claims = claims.count();
    assert!(claims <= 12, "{claims} of {seeds}");
}

#[test]
fn what_sets_in_once_goes_with_nothing_that_drifts_or_steps_once() {
    for seed in 0..20 {
        let onset = 1000 + 90 * seed as usize;
        let mut all = quantities(seed);
        let drift = (0..SAMPLES).map(|k| k as f64).collect();
        let step = (0..SAMPLES).map(|k| f64::from(u8::from(k >= onset))).collect();
        all.push(known("drift", KnownKind::Input, vec![drift]));
        all.push(known("step", KnownKind::Input, vec![step]));
        assert_eq!(of_one(windows(|k| k >= onset), &all), None, "seed {seed}");
        // Nor several windows after it: the step holds in all of them, but occurred once.
        let late = of_one(windows(|k| k >= onset && k % 300 > 100), &all[4..]);
        assert_eq!(late, None, "seed {seed}");
    }
}

#[test]
fn several_recordings_are_taken_together() {
    // One pulse in each: two recordings give two windows; one window alone proves nothing.
    let pulse = |from: usize| -> Vec<f64> {
        (0..SAMPLES).map(|k| f64::from(u8::from((from..from + 100).contains(&k)))).collect()
    };
    let quantity = |pulses: &[usize]| {
        known("pulse", KnownKind::Input, pulses.iter().map(|from| pulse(*from)).collect())
    };
    let inside = |from: usize| vec![[from as f64, from as f64 + 99.0]];
    let times = vec![seconds(SAMPLES), seconds(SAMPLES)];
    let both = condition(&times, &[inside(700), inside(1900)], &[quantity(&[700, 1900])]);
    assert_eq!(both.map(|found| found.kind), Some(ConditionKind::Above));
    assert_eq!(of_one(inside(700), &[quantity(&[700])]), None);
}
