//! What a user is told when a run cannot be finished, and what is kept of it: equation and variable by
//! their names, the time, exit code 3, and the rows up to there.

mod support;

use std::fs;

use support::{Run, column, dgd, folder_with, path};
use tempfile::TempDir;

/// A folder with a model of this text.
fn with_model(text: &str) -> (TempDir, String) {
    let folder = folder_with(&[("m.dgd", format!("model m\n{text}").as_bytes())]);
    let model = path(&folder, "m.dgd");
    (folder, model)
}

/// Simulates a model of this text, in four rows.
fn run(text: &str, more: &[&str]) -> Run {
    let (_folder, model) = with_model(text);
    let args = ["simulate", &model, "--until", "3", "--every", "1"];
    dgd(&[&args, more].concat())
}

#[test]
fn a_start_that_is_impossible_names_equation_and_unknown() {
    let text = "unknown z [m] = 1\nequation area: z^2 + 1 [m^2] = 0\n";
    run(text, &[]).refused(3, &["no consistent values at t = 0 s", "`area`", "`z`"]);
    let text = "parameter a = -1\nstate x = sqrt(a)\nequation e: der(x) = -x * 1 [1/s]\n";
    run(text, &[]).refused(3, &["start value of `x`", "t = 0 s", "not finite"]);
}

/// s falls to zero at 1.5 s, from where on its root is none.
const ROOT: &str = "
state s [cm] = 150
state v [m^(1/2)*s] = 0
equation fall: der(s) = -1 [m/s]
equation gain: der(v) = sqrt(s)
";

#[test]
fn what_is_not_finite_is_said_with_equation_unknown_time_and_values() {
    run(ROOT, &[]).refused(3, &["`gain`", "t = 1.49999999", "it determines `v`", "`s` = ", " cm"]);
}

#[test]
fn rows_up_to_a_failure_are_printed() {
    let rows = |csv: &str| (column(csv, "time [s]"), column(csv, "s [cm]"));
    let stopped = run(ROOT, &[]);
    let (times, s) = rows(&stopped.out);
    assert_eq!(times, [0.0, 1.0]);
    assert!((s[1] - 50.0).abs() < 1e-6, "{s:?}");

    let stopped = run(ROOT, &["--format", "json"]);
    stopped.refused(3, &["`gain`"]);
    let result = stopped.json();
    assert_eq!(result["rows"], 2);
    assert!(result["error"].as_str().is_some_and(|error| error.contains("`gain`")), "{result}");
}

#[test]
fn rows_up_to_a_failure_are_kept_beside_the_file_asked_for() {
    let (folder, model) = with_model(ROOT);
    for command in ["simulate", "sensitivity"] {
        let out = path(&folder, &format!("{command}.csv"));
        let args = [command, &model, "--until", "3", "--every", "1", "-o", &out];
        dgd(&args).refused(3, &[&format!("{command}.partial.csv (2 rows)"), "`gain`"]);
        assert!(!fs::exists(&out).expect("the folder is there"));
        let kept = fs::read_to_string(path(&folder, &format!("{command}.partial.csv")));
        assert_eq!(column(&kept.expect("it was written"), "time [s]"), [0.0, 1.0]);
    }
}

#[test]
fn a_step_that_becomes_too_small_names_the_unknown() {
    // x = √(1 − t/s) ends at 1 s with an infinite slope.
    let text = "state x = 1\nequation decay: der(x) = -0.5 [1/s] / x\n";
    run(text, &[]).refused(3, &["step size fell to", "t = 1", "`x`"]);
}

#[test]
fn an_input_that_ends_too_early_is_named_with_both_times() {
    let text = "input q [lpm] linear\nstate v [l] = 0\nequation e: der(v) = q\n";
    let folder = folder_with(&[
        ("m.dgd", format!("model m\n{text}").as_bytes()),
        ("q.csv", b"time [s],q [lpm]\n0,1\n2,3\n"),
    ]);
    let (model, data) = (path(&folder, "m.dgd"), path(&folder, "q.csv"));
    let args = ["simulate", &model, "--data", &data, "--until", "3"];
    dgd(&args).refused(3, &["`q`", "3 s", "2 s"]);
}

#[test]
fn a_delay_below_zero_is_named() {
    let text = "input q [lpm]\nparameter tau [s] = 1\nstate v [l] = 0\n\
                equation e: der(v) = delay(q, tau)\n";
    let folder = folder_with(&[
        ("m.dgd", format!("model m\n{text}").as_bytes()),
        ("q.csv", b"time [s],q [lpm]\n0,1\n2,3\n"),
    ]);
    let (model, data) = (path(&folder, "m.dgd"), path(&folder, "q.csv"));
    let run = dgd(&["simulate", &model, "--data", &data, "--set", "tau=-2"]);
    run.refused(3, &["`delay(q, tau)`", "-2 s"]);
}

#[test]
fn a_ball_that_comes_to_rest_has_endless_impacts() {
    let text = "
state h [m] = 1
state v [m/s] = 0
equation fall: der(h) = v
modes ball {
  flying { equation weight: der(v) = -9.81 [m/s^2] }
  flying -> flying when h falls below 0 [m] {
    reset h = 0 [m]
    reset v = -0.5*v
  }
}
";
    // The impacts have a limit at √(2 h/g) (1 + e)/(1 − e) = 1.35457 s.
    let stopped = run(text, &[]);
    stopped.refused(3, &["`ball`", "without end at t = 1.3545"]);
    assert_eq!(column(&stopped.out, "time [s]"), [0.0, 1.0]);
}
