//! Information criteria at the maximum of the likelihood, and what a tracked state has learnt.

use std::f64::consts::TAU;

use dgd_data::InMemory;
use dgd_work::{
    CompareRequest, FitRequest, LineFormat, RunRequest, SilentReporter, SimulateRequest,
    TaskContext, TrackRequest, compare, fit, simulate, track,
};
use serde_json::Value;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number: {value}"))
}

/// −2 ln L = Σ n (ln 2πσ² + 1) with σ² = Σ e²/n of each output, in its unit; `fit` and `compare` have the same.
#[test]
fn a_fit_has_the_criteria_that_compare_has() {
    let (model, csv) = (include_str!("found/aic.dgd"), include_str!("found/aic.csv"));
    let in_cm = model.replace("output y = x  noise 0.05", "output y [cm] = x*1 [m]  noise 5 [cm]");
    let csv_in_cm = csv.replace("y [1]", "y [m]");
    let two = format!("{model}\noutput z = 2*x  noise 0.1\n");
    let csv_of_two: String = (csv.lines().enumerate())
        .map(|(k, line)| {
            let y: f64 = line.split(',').nth(1).and_then(|y| y.parse().ok()).unwrap_or(0.0);
            let z = 2.0 * y + 0.2 * (1.7 * k as f64).sin();
            if k == 0 { format!("{line},z\n") } else { format!("{line},{z}\n") }
        })
        .collect();
    for (model, csv, wanted) in
        [(model, csv, Some(-33.063)), (&in_cm, &csv_in_cm, None), (&two, &csv_of_two, None)]
    {
        let other = model.replace("= 0.5  in", "= 0.4  in");
        let files = InMemory::default()
            .with_file("m.dgd", model)
            .with_file("o.dgd", other)
            .with_file("d.csv", csv);
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        let request = FitRequest::new("m.dgd", vec!["d.csv".into()]);
        let fitted = fit(&request, session).unwrap_or_else(|error| panic!("{error}"));
        let alone = fitted.to_json();
        let contenders = vec!["m.dgd".to_owned(), "o.dgd".to_owned()];
        let request = CompareRequest::new(contenders, vec!["d.csv".into()]);
        let compared = compare(&request, session).unwrap_or_else(|error| panic!("{error}"));
        let compared = compared.to_json();
        let of_compare = &compared["contenders"][0];
        for criterion in ["aic", "bic"] {
            let (a, b) = (number(&alone[criterion]), number(&of_compare[criterion]));
            assert!((a - b).abs() < 1e-6 * b.abs(), "{criterion}: {a} {b}");
        }
        let outputs = alone["outputs"].as_object().expect("outputs");
        let mut by_hand = 2.0 * (2 + outputs.len()) as f64;
        for output in outputs.values() {
            let train = &output["quality"]["train"];
            by_hand += number(&train["samples"]) * ((TAU * number(&train["mse"])).ln() + 1.0);
        }
        let aic = number(&alone["aic"]);
        assert!((aic - by_hand).abs() < 1e-6 * by_hand.abs(), "{aic} {by_hand}");
        if let Some(wanted) = wanted {
            assert!((aic - wanted).abs() < 1e-3, "{aic}");
        }
    }
}

/// The model's noise by a formula is what `compare` judges by, too.
#[test]
fn noise_by_a_formula_has_the_same_criteria_in_both() {
    let model = include_str!("found/relative_noise_far_start.dgd");
    let files = InMemory::default()
        .with_file("m.dgd", model)
        .with_file("o.dgd", model.replace("0.05*abs(y)", "0.1*abs(y)"))
        .with_file("d.csv", include_str!("found/white_relative_noise.csv"));
    let session = TaskContext::new(&SilentReporter).with_files(&files);
    let request = FitRequest::new("m.dgd", vec!["d.csv".into()]);
    let alone = fit(&request, session).unwrap_or_else(|error| panic!("{error}"));
    let contenders = vec!["m.dgd".to_owned(), "o.dgd".to_owned()];
    let request = CompareRequest::new(contenders, vec!["d.csv".into()]);
    let compared = compare(&request, session).unwrap_or_else(|error| panic!("{error}"));
    let compared = compared.to_json();
    let (a, b) = (number(&alone.to_json()["aic"]), number(&compared["contenders"][0]["aic"]));
    assert!((a - b).abs() < 1e-6 * b.abs(), "{a} {b}");
    assert!(number(&compared["contenders"][1]["aic"]) > b, "a noise twice as large is worse");
}

#[test]
fn a_state_that_its_first_reading_determines_has_learnt_from_it() {
    let csv = include_str!("found/track.csv");
    let said = |model: &str, csv: &str| {
        let files = InMemory::default().with_file("m.dgd", model).with_file("d.csv", csv);
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        let mut request = TrackRequest::new("m.dgd", "d.csv");
        request.start_std = vec!["x=1".to_owned(), "v=1".to_owned()];
        let mut out = Vec::new();
        let tracked = track(&request, None, session, &mut out, LineFormat::Csv);
        tracked.unwrap_or_else(|error| panic!("{error}")).remarks.join("\n")
    };
    let model = include_str!("found/track.dgd");
    assert!(!said(model, csv).contains("says little"), "{}", said(model, csv));
    // The first readings come later.
    let late: String = (csv.lines().enumerate())
        .map(|(k, line)| {
            let inputs: Vec<&str> = line.split(',').take(2).collect();
            if (1..4).contains(&k) { inputs.join(",") + ",,\n" } else { format!("{line}\n") }
        })
        .collect();
    assert!(!said(model, &late).contains("says little"), "{}", said(model, &late));
    // What nothing reads stays as unknown as it was.
    let apart =
        format!("{model}\nstate b = 1 noise 1e-9 [1/s^(1/2)]\nequation e3: der(b) = 0 [1/s]\n");
    assert!(said(&apart, csv).contains("says little about `b`"), "{}", said(&apart, csv));
}

#[test]
fn a_constant_output_has_the_column_of_its_noise_by_a_formula() {
    let files = InMemory::default().with_file("m.dgd", include_str!("found/cn.dgd"));
    let session = TaskContext::new(&SilentReporter).with_files(&files);
    let mut run = RunRequest::new("m.dgd");
    run.solve.until = Some(1.0);
    let found = simulate(&SimulateRequest::new(run), session).unwrap_or_else(|e| panic!("{e}"));
    for (name, wanted) in [("std(a)", 0.13), ("std(b)", 0.125)] {
        let column = found.table.columns.iter().find(|column| column.name == name);
        let values = &column.unwrap_or_else(|| panic!("no `{name}`")).values;
        assert!(values.iter().all(|sigma| (sigma - wanted).abs() < 1e-12), "{name}: {values:?}");
    }
}
