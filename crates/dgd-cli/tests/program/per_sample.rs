//! `--steps`, and fits to recordings with inputs that change at every sample.

use std::fmt::Write;
use std::fs;

use serde_json::json;

use crate::support::{dgd_in, root};

const MODEL: &str = "bench/peers/dgd/recording.dgd";

/// A folder with the model, and a recording made with it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let write = |name: &str, text: &str| {
        fs::write(folder.path().join(name), text).expect("a file");
    };
    write("model.dgd", &fs::read_to_string(root().join(MODEL)).expect("the model"));
    let (header, mut inputs) = ("time [s],w [1],q_b [m^3/s],q_tf [m^3/s]", Vec::new());
    for k in 0..400 {
        let (slow, fast) = ((0.02 * f64::from(k)).sin(), (1.3 * f64::from(k)).sin());
        let (w, q_b) = (0.85 + 0.05 * slow + 0.01 * fast, 0.03 + 0.001 * fast);
        inputs.push(format!("{k},{w},{q_b},0.002"));
    }
    write("inputs.csv", &format!("{header}\n{}\n", inputs.join("\n")));
    let arguments = ["simulate", "model.dgd", "--data", "inputs.csv", "--steps", "adaptive"];
    let run = dgd_in(folder.path(), &[&arguments[..], &["--format", "json"]].concat()).done();
    let result = run.json();
    let values = |name: &str| {
        let columns = result["columns"].as_array().expect("columns");
        let column = columns.iter().find(|column| column["name"] == name).expect("a column");
        column["values"].as_array().expect("values").clone()
    };
    let (h, q) = (values("h"), values("q"));
    let mut text = format!("{header},h [m],q [m^3/s]\n");
    for ((inputs, h), q) in inputs.iter().zip(h).zip(q) {
        let _ = writeln!(text, "{inputs},{h},{q}");
    }
    write("data.csv", &text);
    folder
}

/// Whether it is a Taylor method, whose low orders are the cheapest here.
fn is_series(method: &serde_json::Value) -> bool {
    method.as_str().is_some_and(|name| name.starts_with("taylor"))
}

#[test]
fn runs_and_fits_step_from_sample_to_sample() {
    let folder = folder();
    let json = |arguments: &[&str]| {
        let run = dgd_in(folder.path(), &[arguments, &["--format", "json"]].concat());
        run.done().json()
    };
    for command in ["simulate", "sensitivity"] {
        let run =
            |steps: &str| json(&[command, "model.dgd", "--data", "inputs.csv", "--steps", steps]);
        let locked = run("per-sample=2");
        assert_eq!(locked["steps_per_sample"], json!(2));
        assert!(is_series(&locked["method"]), "{}", locked["method"]);
        assert_eq!(locked["steps"], json!(2 * 399));
        assert!(run("per-sample")["steps_per_sample"].is_u64());
        assert!(run("auto")["steps_per_sample"].is_null());
    }

    let fit = |more: &[&str]| {
        let arguments = ["fit", "model.dgd", "--data", "data.csv", "--set", "c0=140"];
        json(&[&arguments[..], more].concat())
    };
    let three = ["--free", "M,c0,c2"];
    let locked = fit(&three);
    assert_eq!(locked["steps"]["per_sample"], json!(1));
    assert!(is_series(&locked["steps"]["method"]), "{}", locked["steps"]);
    let adaptive = fit(&[&three[..], &["--steps", "adaptive"]].concat());
    assert_eq!(adaptive["steps"], json!("adaptive"));
    for name in ["M", "c0", "c2"] {
        let value_of = |fit: &serde_json::Value| fit["parameters"][name]["value"].as_f64();
        let (a, b) = (value_of(&locked).expect("a value"), value_of(&adaptive).expect("a value"));
        // The data is exact to the tolerance of 1e-6 with which it was made.
        assert!((a / b - 1.0).abs() < 1e-3, "{name}: {a} {b}");
    }
}

#[test]
fn what_the_recording_does_not_determine_is_named() {
    let folder = folder();
    let arguments = ["fit", "model.dgd", "--data", "data.csv", "--free", "M,c0,c2,F"];
    let run = dgd_in(folder.path(), &arguments).done();
    // The friction is ρ g c2 + F: ρ g c2 = 10987.2 · 2e4 has the opposite effect of F = 3e8.
    let ratio = format!("{:.3}", 10987.2 * 2e4 / 3e8);
    let text = "no output sees a change of `c2` by +1.000 % and `F` by -";
    assert!(run.out.contains(&format!("{text}{ratio} %")), "{}", run.out);
    assert_eq!(run.out.matches("not determined").count(), 2, "{}", run.out);
}

#[test]
fn steps_that_cannot_be_are_refused() {
    let folder = folder();
    let run = |steps: &str, more: &[&str]| {
        let arguments = ["simulate", "model.dgd", "--data", "inputs.csv", "--steps", steps];
        dgd_in(folder.path(), &[&arguments[..], more].concat())
    };
    run("per-sample=0", &[]).refused(2, &["--steps", "1 or more"]);
    run("often", &[]).refused(2, &["`per-sample=N`"]);
    run("per-sample", &["--method", "bdf"]).refused(3, &["`bdf`", "--steps adaptive"]);
    let tank = "model tank\nstate h [m] = 2\nmodes gate {\n\
                open { equation e: 1 [s] * der(h) = -h }\n\
                shut { equation e: der(h) = 0 [m/s] }\n\
                open -> shut when h falls below 1 [m]\n}\noutput h [m]\n";
    fs::write(folder.path().join("tank.dgd"), tank).expect("a file");
    let tank = ["simulate", "tank.dgd", "--until", "5", "--steps", "per-sample"];
    dgd_in(folder.path(), &tank).refused(3, &["gate", "--steps adaptive"]);
}
