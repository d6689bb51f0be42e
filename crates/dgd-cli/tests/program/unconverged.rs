//! Fits that do not converge, and fits that must: files and exit codes.

use std::fmt::Write as _;
use std::fs;

use tempfile::TempDir;

use crate::support::{dgd, dgd_in, folder_with, listing};

/// Three decays with logarithmically estimated rates.
const DECAYS: &str = "\
model decays
parameter k1 [1/s] = 1e-4 in 1e-8 .. 1e4, log
parameter k2 [1/s] = 1e-4 in 1e-8 .. 1e4, log
parameter k3 [1/s] = 1e-4 in 1e-8 .. 1e4, log
state x1 = 1
state x2 = 1
state x3 = 1
equation one: der(x1) = -k1*x1
equation two: der(x2) = -k2*x2
equation three: der(x3) = -k3*x3
output x1 noise 0.01
output x2 noise 0.01
output x3 noise 0.01
";

const RATES: [f64; 3] = [0.3, 0.2, 0.5];

/// The model with changes, and a recording of it with errors that look like noise.
fn decays(changes: &[(&str, &str)]) -> TempDir {
    let mut model = DECAYS.to_owned();
    for (from, to) in changes {
        model = model.replace(from, to);
    }
    let mut data = "time [s],x1,x2,x3\n".to_owned();
    for t in 0..=100_u32 {
        let _ = write!(data, "{t}");
        for (i, rate) in (0_u32..).zip(RATES) {
            let error = 0.01 * (f64::from((t + 1) * (t + 7 + 31 * i)) * 1.234).sin();
            let _ = write!(data, ",{}", (-rate * f64::from(t)).exp() + error);
        }
        data.push('\n');
    }
    folder_with(&[("decays.dgd", model.as_bytes()), ("run.csv", data.as_bytes())])
}

/// A fit with fixed initial values.
fn fit(folder: &TempDir, more: &[&str]) -> crate::support::Run {
    let args = ["fit", "decays.dgd", "--data", "run.csv", "--fix", "x1,x2,x3", "--format", "json"];
    dgd_in(folder.path(), &[&args, more].concat())
}

#[test]
fn rates_four_decades_too_slow_are_found_and_not_leapt_over() {
    // The first Gauss–Newton step goes up a hundred decades, where everything has decayed at once: closer to the
    // measurements than no decay, and without a slope.
    let result = fit(&decays(&[]), &[]).done().json();
    assert_eq!(result["converged"], true);
    for (name, rate) in ["k1", "k2", "k3"].iter().zip(RATES) {
        let value = result["parameters"][name]["value"].as_f64().expect("a number");
        assert!((value / rate - 1.0).abs() < 0.1, "{name} = {value}");
    }
}

#[test]
fn a_search_that_ends_on_a_plain_says_so_and_keeps_what_it_has() {
    let folder = decays(&[]);
    let fast = ["--set", "k1=5000", "--set", "k2=5000", "--set", "k3=5000", "-o", "out"];
    let run = fit(&folder, &fast);
    run.refused(3, &["see nothing of the parameters", "in out"]);
    assert_eq!(listing(&folder), ["decays.dgd", "out", "run.csv"]);
    let result = fs::read_to_string(folder.path().join("out/result.json")).expect("a result");
    let result: serde_json::Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result["converged"], false);
    assert_eq!(result["termination"], "flat");
    assert!(folder.path().join("out/decays.dgd").exists());
}

#[test]
fn a_fit_that_runs_out_of_simulations_is_written_and_goes_on() {
    let folder = decays(&[]);
    let run = fit(&folder, &["--evaluations", "4", "-o", "out"]);
    run.refused(3, &["no minimum was reached in", "in out", "--resume"]);
    let read = || fs::read_to_string(folder.path().join("out/result.json")).expect("a result");
    let result: serde_json::Value = serde_json::from_str(&read()).expect("JSON");
    assert_eq!(result["converged"], false);
    assert_eq!(result["status"], "not converged");
    assert!(result["left_out"][0].as_str().is_some_and(|words| words.contains("not converged")));
    let value = result["parameters"]["k1"]["value"].as_f64().expect("a number");
    assert!(value > 1e-4, "the best so far: {value}");
    assert!(listing(&folder).contains(&".out.dgd-journal".to_owned()), "{:?}", listing(&folder));
    // The text reports it as well.
    let args =
        ["fit", "decays.dgd", "--data", "run.csv", "--fix", "x1,x2,x3", "--evaluations", "4"];
    let text = dgd_in(folder.path(), &args);
    assert!(text.code == 3 && text.out.contains("not converged"), "{}", text.out);

    let resumed = fit(&folder, &["-o", "out", "--resume"]).done();
    assert!(resumed.err.contains("going on with"), "{}", resumed.err);
    let resumed = read();
    assert_eq!(listing(&folder), ["decays.dgd", "out", "run.csv"]);
    fit(&folder, &["-o", "out"]).done();
    assert_eq!(resumed, read());
}

#[test]
fn every_estimator_that_searches_keeps_the_best_it_has() {
    let folder = decays(&[("= 1e-4", "= 1")]);
    let run = fit(&folder, &["--estimator", "prediction-error", "--evaluations", "1"]);
    run.refused(3, &["no maximum of the likelihood"]);
    assert_eq!(run.json()["converged"], false);
    for estimator in ["separable", "nelder-mead"] {
        let nist = ["tests/nist/misra1a.dgd", "--data", "tests/nist/misra1a.csv"];
        let more = ["--estimator", estimator, "--evaluations", "2", "--format", "json"];
        let run = dgd(&[&["fit"], &nist[..], &more].concat());
        run.refused(3, &["no minimum was reached in"]);
        assert_eq!(run.json()["converged"], false, "{estimator}");
        let all_args = dgd(&[&["fit"], &nist[..], &more[..2], &more[4..]].concat()).done().json();
        assert_eq!(all_args["converged"], true, "{estimator}");
    }
    let args = ["fit", "decays.dgd", "--data", "run.csv", "--evaluations", "2"];
    let more = ["--estimator", "least-squares"];
    dgd_in(folder.path(), &[&args[..], &more].concat())
        .refused(2, &["--evaluations", "least-squares"]);
}

#[test]
fn a_simplex_that_ends_on_a_plain_says_so() {
    let model = "model plain
        input t_s
        parameter c = 0.1
        parameter k = 100 in 1e-8 .. 1e4, log
        output y = c + exp(-k*t_s)  noise 0.01";
    let mut data = "t_s,y\n".to_owned();
    for t in 1..=50_i32 {
        let error = 0.01 * f64::from((t + 1) * (t + 7)).sin();
        let _ = writeln!(data, "{t},{}", 0.3 + (-0.1 * f64::from(t)).exp() + error);
    }
    let folder = folder_with(&[("m.dgd", model.as_bytes()), ("d.csv", data.as_bytes())]);
    let with = |estimator: &str, more: &[&str]| {
        let args = ["fit", "m.dgd", "--data", "d.csv", "--estimator", estimator];
        dgd_in(folder.path(), &[&args[..], more].concat())
    };
    let run = with("nelder-mead", &["--format", "json"]);
    run.refused(3, &["see nothing of the parameters"]);
    assert_eq!(run.json()["converged"], false);
    let near = with("nelder-mead", &["--set", "k=1"]).done();
    assert!(near.out.contains("k "), "{}", near.out);
    // With derivatives a search follows the small slope of a plateau.
    let result = with("separable", &["--format", "json"]).done().json();
    let value = result["parameters"]["k"]["value"].as_f64().expect("a number");
    assert!((value / 0.1 - 1.0).abs() < 0.03, "{value}");
}

#[test]
fn of_several_starting_points_those_on_plains_are_not_the_best() {
    // The model's own start is on a plateau, and so are about half of the random ones.
    let folder = decays(&[("= 1e-4", "= 100")]);
    let result = fit(&folder, &["--starts", "24"]).done().json();
    assert_eq!(result["converged"], true);
    let several = &result["multi_start"];
    assert!(several["without_minimum"].as_u64() > Some(0), "{result}");
    // "3 of N" counts the starts that reached a minimum, without the model's own, which is not random.
    let ends = several["ends"].as_array().expect("a list");
    assert_eq!(ends.len(), 24);
    let reached = ends.iter().skip(1).filter(|end| end["minimum"].is_u64()).count();
    let volume = several["found_volume"].as_f64().expect("enough did");
    assert!((volume - 3.0 / reached as f64).abs() < 1e-12, "{volume} of {reached}");
    for end in ends.iter().filter(|end| end["minimum"] == 0) {
        assert!(end["deviance_above"].as_f64().expect("a fit") < 0.1, "{end}");
    }
    for (name, rate) in ["k1", "k2", "k3"].iter().zip(RATES) {
        let value = result["parameters"][name]["value"].as_f64().expect("a number");
        assert!((value / rate - 1.0).abs() < 0.1, "{name} = {value}");
    }
}

#[test]
fn starts_are_drawn_between_bounds_where_that_is_asked_for() {
    // `--spread` by values draws a rate within a decade of 1e-4 1/s; by bounds anywhere from 1e-8 to 1e4, where it may
    // have decayed before the second sample, and ends at its bound.
    let folder = decays(&[]);
    let minima = |spread: &str| {
        let result = fit(&folder, &["--starts", "12", "--spread", spread]).done().json();
        assert_eq!(result["multi_start"]["spread"], spread);
        result["multi_start"]["minima"].as_array().expect("a list").len()
    };
    assert_eq!(minima("values"), 1);
    assert!(minima("bounds") > 1);
    let one = ["fit", "decays.dgd", "--data", "run.csv", "--spread", "bounds"];
    dgd_in(folder.path(), &one).refused(2, &["`--spread`", "add `--starts N`"]);
    let run = fit(&folder, &["--starts", "12", "--spread", "bounds", "-o", "out"]).done();
    assert_eq!(run.json()["converged"], true);
    let page = fs::read_to_string(folder.path().join("out/report.html")).expect("a page");
    for part in ["Starting points", "another minimum", "minimum 2", "at 95 %"] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn what_is_at_a_bound_takes_no_degree_of_freedom_of_the_noise() {
    let folder = decays(&[("k1 [1/s] = 1e-4 in 1e-8 .. 1e4", "k1 [1/s] = 0.1 in 0.01 .. 0.25")]);
    let result = fit(&folder, &[]).done().json();
    assert_eq!(result["parameters"]["k1"]["at_bound"], "upper", "{result}");
    assert_eq!(result["degrees_of_freedom"], 303 - 2);
    // Estimated noise equals the residuals of the fit.
    let chi = result["reduced_chi_square"].as_f64().expect("a number");
    assert!((chi - 1.0).abs() < 1e-5, "{chi}");
}

#[test]
fn a_bad_fit_is_told_before_all_else() {
    // The pseudo-noise is 0.01 sin(…), with an rms of 0.0072, and 0.001 is declared.
    let folder = decays(&[("noise 0.01", "noise 0.001")]);
    let args = ["fit", "decays.dgd", "--data", "run.csv", "--fix", "x1,x2,x3", "--set", "k1=0.1"];
    let fit = |more: &[&str]| dgd_in(folder.path(), &[&args[..], more].concat()).done().out;
    let bad = fit(&["--noise", "declared", "-o", "out"]);
    assert!(
        bad.starts_with("The fit is bad: the residuals are 7.2 times the declared noise.\n"),
        "{bad}"
    );
    let page = fs::read_to_string(folder.path().join("out/report.html")).expect("a page");
    for part in [
        "Converged, but the residuals are 7.2 times",
        "the noise is larger than was declared",
        "AICc ",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // The weights of the samples do not matter.
    let estimated = fit(&[]);
    assert!(estimated.starts_with("The fit is bad: the residuals are 7.2 times"), "{estimated}");
}
