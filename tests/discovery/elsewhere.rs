//! Effects missing from models that have nothing to do with drilling are found by templates that fit
//! any model.

use std::path::Path;

use dgd_discover::{Discovery, Verdict};

use crate::examined::{Examined, Samples, Texts};
use crate::nulls;
use crate::nulls::Noise;
use crate::servo;
use crate::servo::Servo;
use crate::uniform::kolmogorov_smirnov;

/// Two tanks in cascade, in the volts of their level sensor, which nothing runs over from. The measure
/// of the upper level is free: nothing shows it.
const TANKS: &str = "/// Two tanks in cascade.
model tanks

input u [V] hold    /// pump

parameter k1 [V^(1/2)/s] = 0.05  in 1e-4 .. 1, log    /// out of the upper tank
parameter k2 [V^(1/2)/s] = 0.05  in 1e-4 .. 1, log    /// into the lower one
parameter k3 [V^(1/2)/s] = 0.05  in 1e-4 .. 1, log    /// out of the lower one
parameter k4 [1/s]       = 0.05  in 1e-4 .. 1, log    /// pump
parameter y0 [V]         = 0     in -3 .. 3           /// sensor without water

state x1 [V] = 5
state x2 [V] = 5

function root(x [V]) = if x > 0 [V] then sqrt(x) else 0 [V^(1/2)]

equation upper: der(x1) = k4*u - k1*root(x1)
equation lower: der(x2) = k2*root(x1) - k3*root(x2)

output y [V] = x2 + y0  noise 0.05 [V]
";

fn examined(name: &str, text: &str) -> Examined {
    Texts { model: (name.to_owned(), text.to_owned()), effects: Vec::new() }.read()
}

fn found(examined: &Examined, train: &Samples, valid: &Samples) -> Discovery {
    let [train, valid] = [train, valid].map(|samples| examined.recording_without_start(samples));
    examined.discover(&[train], &[valid], 1)
}

#[test]
#[ignore = "the recordings are not part of this project: `.ci/run` runs this where they are"]
fn two_real_tanks_lack_something_without_a_name() {
    // Schoukens, Mattsson, Wigren, Noël, Cascaded tanks benchmark combining soft and hard nonlinearities
    // (2016), doi:10.4121/12960104.
    let folder =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/reference/cascaded_tanks");
    let [train, valid] = ["estimation", "validation"].map(|part| {
        let text = std::fs::read_to_string(folder.join(format!("{part}.csv")));
        let text = text.expect("a recording");
        let rows = text.split_once('\n').expect("a header").1;
        Samples::of_csv(&format!("time [s],u [V],y [V]\n{rows}"))
    });
    let discovery = found(&examined("tanks.dgd", TANKS), &train, &valid);
    // No model of two tanks explains these to the noise of 0.02 V: nothing is named, and the place is told.
    assert_eq!(discovery.verdict, Verdict::Unexplained, "{}", discovery.reason);
    assert!(discovery.effects.is_empty() && !discovery.unexplained.is_empty());
    let [gap] = discovery.gap.as_slice() else { panic!("one output") };
    // Without overflow 0.57 V and 0.65 V are the least by a global search.
    assert!((gap.train_before - 0.57).abs() < 0.02, "{}", gap.train_before);
    assert!((gap.valid_before - 0.65).abs() < 0.03, "{}", gap.valid_before);
}

/// Something hidden in a servo is found by name, and its size within four standard deviations and a part
/// in a thousand for the servo's steps of 0.1 ms, and creeping in place of sticking.
#[track_caller]
fn is_found(hidden: Servo, name: &str, truth: f64) {
    let examined = examined("servo.dgd", servo::MODEL);
    let discovery = found(&examined, &hidden.record(1, 150), &hidden.record(2, 150));
    assert_eq!(discovery.verdict, Verdict::Effects, "{}", discovery.reason);
    let [effect] = discovery.effects.as_slice() else { panic!("{}", discovery.reason) };
    assert_eq!(effect.name, name, "{}\n{:#?}", discovery.reason, discovery.ranking);
    // What stays at its null is not it.
    let own = effect.parameters.iter().find(|own| own.std.is_some());
    let size = own.expect("a size");
    let std = size.std.expect("the data determines it");
    assert!((size.value - truth).abs() < 4.0 * std + 0.001 * truth, "{} ± {std}", size.value);
    for gap in &discovery.gap {
        assert!(gap.valid_after < 1.2 * gap.noise, "{}", gap.output);
    }
}

#[test]
fn dry_friction_of_a_servo_is_found() {
    is_found(Servo { friction: 1.2, ..Servo::default() }, "dry_friction(w, motor)", 1.2);
}

#[test]
fn a_dead_band_of_an_amplifier_is_found() {
    is_found(Servo { dead_band: 0.2, ..Servo::default() }, "dead_band(u)", 0.2);
}

/// Where a limit begins, its derivative shows nothing of it.
#[test]
fn an_amplifier_that_saturates_is_found() {
    is_found(Servo { most: Some(1.4), ..Servo::default() }, "input_saturation(u)", 1.4);
}

#[test]
fn a_slow_tachometer_is_found() {
    is_found(Servo { lag: 0.4, ..Servo::default() }, "sensor_lag(w)", 0.4);
}

#[test]
fn an_encoder_that_rounds_lacks_nothing() {
    // Steps of one and of ten times the encoder's noise: what rounding adds, step/√12, is noise, too.
    let examined = examined("servo.dgd", servo::MODEL);
    for step in [0.005, 0.05] {
        let rounding = Servo { step, ..Servo::default() };
        let discovery = found(&examined, &rounding.record(1, 150), &rounding.record(2, 150));
        assert_eq!(discovery.verdict, Verdict::Sufficient, "{step}: {}", discovery.reason);
        let expected = 0.005_f64.hypot(step / 12_f64.sqrt());
        let noise = discovery.gap[1].noise;
        assert!((noise / expected - 1.0).abs() < 0.1, "{step}: {noise}, not {expected}");
    }
}

#[test]
fn a_short_recording_under_coloured_noise_lacks_nothing() {
    // A hundred memories of the noise, and fifty: start values from the first 3 s are off by a good part of it.
    let examined = examined("servo.dgd", servo::MODEL);
    for (memory, seeds) in [(0.5, [1, 2]), (0.5, [21, 22]), (1.0, [19, 20])] {
        let servo = Servo { memory: Some(memory), ..Servo::default() };
        let [train, valid] = seeds.map(|seed| servo.record(seed, 50));
        let discovery = found(&examined, &train, &valid);
        assert_eq!(discovery.verdict, Verdict::Sufficient, "{memory} s: {}", discovery.reason);
        let from = discovery.traces[1].counts_from.expect("start values are estimated");
        assert!(from > 3.0, "{memory} s: {from}");
    }
}

#[test]
fn a_servo_without_dry_friction_has_none() {
    let examined = examined("servo.dgd", servo::MODEL);
    let plain = Servo::default();
    for seed in [3, 5] {
        let discovery = found(&examined, &plain.record(seed, 150), &plain.record(seed + 1, 150));
        assert_eq!(discovery.verdict, Verdict::Sufficient, "{}", discovery.reason);
    }
}

#[test]
fn p_values_are_uniform_where_nothing_is_hidden() {
    // The first of those that `discovery_benchmark --nulls` looks at.
    for noise in [Noise::White, Noise::Coloured] {
        let said = nulls::said(20, noise, 2);
        assert!(said.iter().all(|said| said.verdict == Verdict::Sufficient), "{noise:?}: {said:?}");
        let p_values: Vec<f64> = said.iter().map(|said| said.p_value).collect();
        let p = kolmogorov_smirnov(&p_values);
        assert!(p > 0.01, "{noise:?}: {p}, {p_values:?}");
    }
}
