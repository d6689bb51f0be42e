//! Noise that is not the same for all readings.

use std::path::Path;

use dgd_discover::{Discovery, Verdict};
use dgd_identify::Recording;

use crate::examined::{Examined, Samples, Texts};
use crate::random::Random;

fn examined(text: &str) -> Examined {
    Texts { model: ("model.dgd".to_owned(), text.to_owned()), effects: Vec::new() }.read()
}

/// A drug of two compartments in the readings of five patients with a log-normal error of 6 %. The elimination of the
/// plant, 22 C/(3.5 + C) mg/h with C in mg/l, saturates; that of the model does not.
fn drug() -> (Examined, Vec<Recording>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/discovery/drug");
    let examined = examined(&std::fs::read_to_string(folder.join("pk.dgd")).expect("a model"));
    let files = ["train1", "train2", "train3", "valid1", "valid2"];
    let of = |name| Samples::of_file(&folder.join(format!("pk_{name}.csv")));
    let recordings = files.map(|name| examined.recording_without_start(&of(name))).to_vec();
    (examined, recordings)
}

#[test]
fn an_elimination_that_saturates_is_found_in_readings_with_log_normal_noise() {
    let (examined, recordings) = drug();
    let (train, valid) = recordings.split_at(3);
    let discovery = examined.discover(train, valid, 2);
    assert_eq!(discovery.uneven, ["C"]);
    assert_eq!(discovery.verdict, Verdict::Effects, "{}", discovery.reason);
    let [effect] = discovery.effects.as_slice() else { panic!("{}", discovery.reason) };
    assert_eq!(effect.name, "parameter_varies(CL, A_1)", "{:#?}", discovery.ranking);
    let value = |name: &str| {
        let mut all = effect.parameters.iter().chain(&discovery.corrected_parameters);
        all.find(|own| own.name == name).map(|own| own.value).expect(name)
    };
    // kg and m³.
    let half = 1.0 / (value("inverse_half_CL_A_1") * value("V_1"));
    assert!((half / 3.5e-3 - 1.0).abs() < 0.2, "{half}");
}

/// A tank that cools, with nothing hidden; σ of a reading at a temperature, in a recording and at a sample.
const TANK: &str = "model tank
input P [W] hold
parameter C [J/K] = 50   in 1 .. 1e4, log
parameter H [W/K] = 0.4  in 0.01 .. 10, log
state T [K] = 10
equation heat: C*der(T) = P - H*T
output T [K]";

fn tank(noise: &str, seed: u64, sigma: impl Fn(f64, usize) -> f64) -> Recording {
    let examined = examined(&format!("{TANK} {noise}\n"));
    let mut random = Random::new(seed, 7);
    let (mut temperature, mut rows): (f64, Vec<[f64; 4]>) = (20.0, Vec::new());
    for k in 0..200_usize {
        let power = if k / 20 % 2 == 0 { 30.0 } else { 5.0 };
        let sigma = sigma(temperature, k);
        rows.push([4.0 * k as f64, power, temperature + sigma * random.normal(), sigma]);
        let rest = power / 0.5;
        temperature = rest + (temperature - rest) * (-0.5 / 50.0 * 4.0_f64).exp();
    }
    let column = |at: usize| -> Vec<f64> { rows.iter().map(|row| row[at]).collect() };
    let columns = vec![("P".to_owned(), column(1)), ("T".to_owned(), column(2))];
    let samples = Samples { times: column(0), columns };
    let mut recording = examined.recording_without_start(&samples);
    recording.deviations = vec![Some(column(3))];
    recording
}

/// That nothing is missing, and H and its standard error.
#[track_caller]
fn nothing_is_missing(noise: &str, recordings: &[Recording]) -> (Discovery, f64, f64) {
    let examined = examined(&format!("{TANK} {noise}\n"));
    let discovery = examined.discover(&recordings[..1], &recordings[1..], 2);
    assert_eq!(discovery.verdict, Verdict::Sufficient, "{}", discovery.reason);
    let mut all = discovery.corrected_parameters.iter();
    let loss = all.find(|own| own.name == "H").expect("H");
    let (value, std) = (loss.value, loss.std.expect("it is determined"));
    assert!((value - 0.5).abs() < 4.0 * std, "{value} ± {std}");
    (discovery, value, std)
}

fn without_columns(recording: Recording) -> Recording {
    Recording { deviations: Vec::new(), ..recording }
}

#[test]
fn even_noise_stays_as_it_is() {
    let recordings = [1, 2].map(|seed| without_columns(tank("", seed, |_, _| 0.1)));
    let (discovery, ..) = nothing_is_missing("", &recordings);
    assert!(discovery.uneven.is_empty());
}

#[test]
fn noise_in_proportion_is_no_discrepancy() {
    for noise in ["noise 0.05*T", "noise lognormal(0.05)"] {
        let recordings = [1, 2].map(|seed| without_columns(tank(noise, seed, |t, _| 0.05 * t)));
        let (discovery, ..) = nothing_is_missing(noise, &recordings);
        assert_eq!(discovery.uneven, ["T"]);
        // In the unit of the readings, at a usual one.
        let trace = &discovery.traces[0].outputs[0];
        for (read, own) in recordings[0].measured[0].iter().flatten().zip(&trace.measured) {
            assert!((read - own).abs() < 1e-9 * read.abs(), "{read} {own}");
        }
        let usual = (trace.measured.iter().map(|y| y * y).sum::<f64>() / 200.0).sqrt();
        assert!((discovery.gap[0].noise / usual - 0.05).abs() < 0.015, "{:?}", discovery.gap);
    }
}

#[test]
fn recorded_standard_deviations_weigh_readings() {
    let sigma = |_: f64, k: usize| if k.is_multiple_of(2) { 0.02 } else { 1.0 };
    let recordings = [1, 2].map(|seed| tank("", seed, sigma));
    let (discovery, _, std) = nothing_is_missing("", &recordings);
    assert_eq!(discovery.uneven, ["T"]);
    let plain = [1, 2].map(|seed| tank("", seed, |_, _| 0.02));
    let (_, _, of_the_best) = nothing_is_missing("", &plain);
    // Half of the readings determine it.
    assert!(std < 2.0 * of_the_best, "{std} {of_the_best}");
}

#[test]
fn a_recording_with_more_noise_than_others_counts_less() {
    let recordings =
        [(1, 0.02), (2, 0.6)].map(|(seed, std)| without_columns(tank("", seed, |_, _| std)));
    let (discovery, ..) = nothing_is_missing("", &recordings);
    assert_eq!(discovery.uneven, ["T"]);
    let trace = &discovery.traces[1].outputs[0];
    let read = recordings[1].measured[0].as_ref().expect("readings");
    assert!(trace.measured.iter().zip(read).all(|(a, b)| (a - b).abs() < 1e-9 * b.abs()));
}

#[test]
fn readings_that_log_normal_noise_cannot_give_are_refused() {
    let mut recording = without_columns(tank("noise lognormal(0.05)", 1, |_, _| 0.1));
    recording.measured[0].as_mut().expect("readings")[5] = -1.0;
    let examined = examined(&format!("{TANK} noise lognormal(0.05)\n"));
    let failed = std::panic::catch_unwind(|| examined.discover(&[recording], &[], 1));
    let why = failed.expect_err("a refusal");
    let why = why.downcast_ref::<String>().expect("the reason");
    assert!(why.contains("readings with log-normal noise are above zero"), "{why}");
}
