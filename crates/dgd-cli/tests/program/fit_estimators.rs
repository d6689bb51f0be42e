//! `dgd fit --estimator`: regressions, including recursive ones, and tables of independent rows.

use std::fmt::Write as _;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{column, dgd, dgd_in, folder_with, listing, path, root};

const CIRCULATION: [&str; 4] =
    ["fit", "models/mud_circulation.dgd", "--data", "examples/data/circulation.csv"];

fn json(args: &[&str]) -> Value {
    let run = dgd(&[args, &["--format", "json"]].concat());
    assert_eq!(run.code, 0, "{}", run.err);
    serde_json::from_str(&run.out).expect("it is JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn linear_least_squares_finds_what_simulation_does() {
    let regression = json(&[&CIRCULATION[..], &["--estimator", "least-squares"]].concat());
    let simulation = json(&CIRCULATION);
    assert_eq!(regression["estimator"], "least-squares");
    for name in ["c0", "c2", "F2"] {
        let [a, b] = [&regression, &simulation].map(|r| number(&r["parameters"][name]["value"]));
        assert!((a / b - 1.0).abs() < 0.01, "{name}: {a} {b}");
        assert_eq!(regression["parameters"][name]["linear"], true);
        assert!(number(&regression["parameters"][name]["std"]) > 0.0);
    }
    assert_eq!(
        (&regression["rank"], regression["names"].as_array().map(Vec::len)),
        (&4.into(), Some(4))
    );
    assert!(number(&regression["condition_number"]) > 1.0);
    let rows = regression["rows"].as_array().expect("rows");
    assert_eq!(rows[0]["name"], "return_line");
    assert_eq!(rows[0]["multiplied_by"], "M_ssp");
    assert_eq!((&rows[1]["name"], &rows[1]["unit"]), (&"p_out".into(), &"barg".into()));
    assert!(number(&rows[1]["r_squared"]) > 0.999);
    // Simulated with these estimates the model fits as well as after an output-error fit, to 10 %.
    for output in ["p_r", "q_ssp"] {
        let [a, b] = [&regression, &simulation].map(|r| number(&r["outputs"][output]["rms_train"]));
        assert!(a < 1.1 * b, "{output}: {a} {b}");
    }
}

#[test]
fn a_table_of_rows_needs_no_time() {
    // NIST's Misra1a: certified values.
    let files = ["fit", "tests/nist/misra1a.dgd", "--data", "tests/nist/misra1a.csv"];
    for (estimator, digits) in [("separable", 1e-8), ("nelder-mead", 1e-6), ("output-error", 1e-4)]
    {
        let result = json(&[&files[..], &["--estimator", estimator]].concat());
        for (name, certified) in [("b1", 238.942_129_18), ("b2", 5.501_564_318_1e-4)] {
            let value = number(&result["parameters"][name]["value"]);
            assert!((value / certified - 1.0).abs() < digits, "{estimator} {name}: {value}");
        }
        // √(1.2455138894e-1/14)
        let rms = number(&result["outputs"]["y"]["rms_train"]);
        assert!((rms - 0.094_321).abs() < 1e-6, "{estimator}: {rms}");
    }
    // All rows of a validation table count.
    let result = json(&[&files[..], &["--estimator", "separable", "--valid", files[3]]].concat());
    assert_eq!(result["outputs"]["y"]["rms_train"], result["outputs"]["y"]["rms_valid"]);

    dgd(&[&files[..], &["--estimator", "recursive", "--free", "b1"]].concat())
        .refused(1, &["no time"]);
    // A model with states needs a time column.
    let folder =
        folder_with(&[("rows.csv", b"w_ssp [%],q_boost [lpm],q_tf [lpm],p_r [bara]\n50,1,1,20\n")]);
    let rows = path(&folder, "rows.csv");
    dgd(&["fit", "models/mud_circulation.dgd", "--data", &rows]).refused(1, &["E602", "time"]);
}

#[test]
fn active_bounds_come_with_the_free_solution() {
    let folder = folder_with(&[
        (
            "m.dgd",
            b"model m\ninput x [m]\nparameter a [mm] = 1 in 0 ..\nparameter b [1] = 1 in 0 ..\n\
              output y [m] = a + b*x\n",
        ),
        ("d.csv", b"x [m],y [m]\n1,0.5\n2,1.5\n3,2.5\n"),
    ]);
    let run = dgd_in(
        folder.path(),
        &[
            "fit",
            "m.dgd",
            "--data",
            "d.csv",
            "--estimator",
            "bounded",
            "-o",
            "out",
            "--plot",
            "rows.svg",
        ],
    );
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(run.out.contains("at its lower bound, without bounds −500"), "{}", run.out);
    let text = std::fs::read_to_string(folder.path().join("out/result.json")).expect("a result");
    let result: Value = serde_json::from_str(&text).expect("JSON");
    // A table has no time: its residuals are drawn over its rows.
    let picture = std::fs::read_to_string(folder.path().join("rows.svg")).expect("a picture");
    for part in ["residual of", "fitted", "measured", "Row"] {
        assert!(picture.contains(part), "{part}");
    }
    let a = &result["parameters"]["a"];
    assert_eq!(
        (&a["value"], &a["at_bound"], &a["std"]),
        (&0.0.into(), &"lower".into(), &Value::Null)
    );
    assert!((number(&a["unbounded"]) + 500.0).abs() < 1e-9);
    // b = Σxy/Σx²
    assert!((number(&result["parameters"]["b"]["value"]) - 11.0 / 14.0).abs() < 1e-12);
    let model = std::fs::read_to_string(folder.path().join("out/m.dgd")).expect("the model");
    assert!(model.contains("parameter a [mm] = 0 "), "{model}");
}

/// The residuals of three samples after a fit with two estimates carry no information on their noise.
#[test]
fn the_noise_of_few_samples_is_the_declared_one_or_there_are_no_stds() {
    let model = |noise: &str| {
        format!(
            "model m\ninput x [m]\nparameter a [m] = 1\nparameter b [1] = 1\n\
             output y [m] = a + b*x {noise}\n"
        )
    };
    let rows = |n: usize| {
        let row = |k: usize| format!("{k},{}\n", k as f64 + 0.1 * (k % 3) as f64);
        format!("x [m],y [m]\n{}", (1..=n).map(row).collect::<String>())
    };
    let folder = folder_with(&[
        ("declared.dgd", model("noise 50 [cm]").as_bytes()),
        ("silent.dgd", model("").as_bytes()),
        ("3.csv", rows(3).as_bytes()),
        ("12.csv", rows(12).as_bytes()),
    ]);
    for estimator in ["output-error", "separable", "least-squares"] {
        let run = |model: &str, data: &str, format: &str| {
            let args = ["fit", model, "--data", data, "--estimator", estimator, "--format", format];
            dgd_in(folder.path(), &args).done()
        };
        let result = |model: &str, data: &str| -> Value {
            serde_json::from_str(&run(model, data, "json").out).expect("JSON")
        };
        let declared = result("declared.dgd", "3.csv");
        assert_eq!(declared["few_samples"]["y"]["samples"], 3);
        assert_eq!(declared["few_samples"]["y"]["declared_noise"], 0.5);
        // σ²/Σ(x − mean)²
        let std = number(&declared["parameters"]["b"]["std"]);
        assert!((std - 0.5 / 2.0_f64.sqrt()).abs() < 1e-6, "{estimator}: {std}");
        let text = run("declared.dgd", "3.csv", "text").out;
        assert!(text.contains("its declared noise was taken, 0.5 m"), "{text}");

        let silent = result("silent.dgd", "3.csv");
        assert_eq!(silent["parameters"]["b"]["std"], Value::Null);
        assert_eq!(silent["covariance"][0][0], Value::Null);
        let text = run("silent.dgd", "3.csv", "text").out;
        assert!(text.contains("3 samples of `y`") && text.contains("too few"), "{text}");
        assert!(!text.contains("not determined"), "{text}");

        let enough = result("silent.dgd", "12.csv");
        assert_eq!(enough["few_samples"], serde_json::json!({}));
        assert!(number(&enough["parameters"]["b"]["std"]) > 0.0);
    }
}

/// Pump and friction use the reading, the riser's balance the true flow: 3.9.
const FLOW_CORRECTION: &[u8] = b"\
effect flow_correction on mud_circulation
kind plant
parameter theta_1 [1] = 1 in 0.5 .. 2
null theta_1 = 1
replace q_ssp in riser by theta_1*q_ssp
";

#[test]
fn the_recursive_estimator_follows_the_flow_correction() {
    let folder = folder_with(&[("flow_correction.dgd", FLOW_CORRECTION)]);
    let (effect, out) = (path(&folder, "flow_correction.dgd"), path(&folder, "out"));
    let args = [
        "fit",
        "models/mud_circulation.dgd",
        "--apply",
        &effect,
        "--data",
        "examples/data/field/normal_circulation.csv.gz",
        "--free",
        "theta_1",
        "--outputs",
        "p_r,q_ssp",
        "--estimator",
        "recursive",
        "--filter",
        "5",
    ];
    let result = json(&[&args[..], &["-o", &out]].concat());
    let theta = &result["parameters"]["theta_1"];
    assert!((number(&theta["value"]) - 0.951).abs() < 0.01, "{theta}");
    assert_eq!(theta["std"], Value::Null);
    assert_eq!(result["recursive"]["samples"], 3601);
    let csv = std::fs::read_to_string(folder.path().join("out/estimates.csv")).expect("a trace");
    let trace = column(&csv, "theta_1 [1]");
    assert_eq!((trace.len(), trace[0]), (3601, 1.0));
    assert_eq!(trace.last().copied(), theta["value"].as_f64());
    let mut files = listing(&folder);
    files.retain(|name| name == "out");
    assert_eq!(files, ["out"]);

    // With forgetting the estimate keeps moving: its mean is the number of the thesis, and P stays below its limit.
    let more = ["--forgetting", "0.1", "--most-variance", "5"];
    let result = json(&[&args[..], &more, &["-o", &out]].concat());
    let csv = std::fs::read_to_string(folder.path().join("out/estimates.csv")).expect("a trace");
    let trace = column(&csv, "theta_1 [1]");
    let mean = trace[60..].iter().sum::<f64>() / (trace.len() - 60) as f64;
    assert!((mean - 0.951).abs() < 0.01, "{mean}");
    assert!(number(&result["recursive"]["p"][0][0]) <= 5.0);

    let refused =
        |more: &[&str], parts: &[&str]| dgd(&[&args[..], more].concat()).refused(2, parts);
    refused(&["--forgetting=-1"], &["--forgetting"]);
    refused(&["--start-variance", "0"], &["--start-variance"]);
    let bad = [&args[..args.len() - 1], &["-5"]].concat();
    assert_eq!(dgd(&bad).code, 2);
}

#[test]
fn what_cannot_be_had_from_readings_is_told_by_name() {
    let instruments = [
        "fit",
        "models/mud_circulation.dgd",
        "--apply",
        "examples/data/field/field_instruments.dgd",
        "--data",
        "examples/data/field/pump_tests.csv.gz",
        "--estimator",
    ];
    dgd(&[&instruments[..], &["least-squares"]].concat())
        .refused(1, &["`return_line`", "`q_ssp` would if `theta_1`", "`output-error`"]);
    let exponent = ["--apply", "pump_speed_exponent", "--fix", "theta_1"];
    dgd(&[&instruments[..], &["bounded"], &exponent].concat())
        .refused(1, &["`speed_exponent` does not enter", "linearly", "`separable`"]);
    dgd(&[&CIRCULATION[..], &["--estimator", "bounded", "--outputs", "p_r"]].concat())
        .refused(1, &["`q_ssp`"]);
    dgd(&[&CIRCULATION[..], &["--estimator", "bounded", "--free", "c1", "--outputs", "p_r"]]
        .concat())
    .refused(1, &["`c1`"]);
    dgd(&[&CIRCULATION[..], &["--estimator", "bounded", "--steady", "q=1"]].concat())
        .refused(2, &["no state is called `q`", "q_ssp"]);
    dgd(&[&CIRCULATION[..], &["--estimator", "bounded", "--smoothing", "0"]].concat())
        .refused(2, &["--smoothing"]);
    dgd(&[&CIRCULATION[..], &["--estimator", "bounded", "--until", "0"]].concat())
        .refused(1, &["0 rows are too few"]);
    let line = [
        "fit",
        "models/mud_circulation_u_tubing.dgd",
        "--data",
        "examples/data/booster_stop.train.csv",
        "--until",
        "300",
        "--estimator",
        "separable",
    ];
    dgd(&line).refused(1, &["`tau_d`", "delay", "`output-error`"]);
    // No measurement at the outlet contains the terms of the line's own equations.
    dgd(&[&line[..], &["--fix", "tau_d"]].concat()).refused(1, &["`riser`", "reads `q_bo`"]);
}

/// A simulated recording of the mud circulation whose signals stay close to a point.
fn circulating(folder: &TempDir, rows: usize) -> String {
    let mut csv = "time [s],w_ssp [%],q_boost [lpm],q_tf [lpm]\n".to_owned();
    for k in 0..rows {
        let speed = 52.0 + 0.2 * [0.0, 1.0, -1.0, 0.4, -0.6][k / 60 % 5];
        let boost = 1850.0 + 8.0 * (0.011 * k as f64).sin();
        let fill = [290, 294][k / 150 % 2];
        writeln!(csv, "{k},{speed},{boost},{fill}").expect("a string takes all");
    }
    let (inputs, data) = (path(folder, "inputs.csv"), path(folder, "data.csv"));
    std::fs::write(&inputs, csv).expect("a folder");
    let model = "models/mud_circulation.dgd";
    let args = ["simulate", model, "--data", &inputs, "--noise-seed", "5", "-o", &data];
    dgd(&[&args[..], &["--set", "h_r=47.6"]].concat()).done();
    data
}

#[test]
fn the_linear_model_has_the_parameters_and_says_how_far_it_holds() {
    let folder = folder_with(&[]);
    let data = circulating(&folder, 600);
    let out = path(&folder, "out");
    let args = ["fit", "models/mud_circulation.dgd", "--data", &data, "--noise", "declared"];
    let linearised = [&args[..], &["--estimator", "linearised"]].concat();
    let linear = json(&[&linearised[..], &["-o", &out, "--valid", &data]].concat());
    let model = json(&args);
    assert_eq!((&linear["estimator"], &linear["steps"]), (&"linearised".into(), &"exact".into()));
    for name in ["M_ssp", "c0", "c2", "F2"] {
        let [a, b] = [&linear, &model].map(|result| &result["parameters"][name]);
        let (apart, std) = (number(&a["value"]) - number(&b["value"]), number(&b["std"]));
        assert!(apart.abs() < 3.0 * std, "{name}: {a} {b}");
        assert!((number(&a["std"]) / std - 1.0).abs() < 0.3, "{name}: {a} {b}");
    }
    // The point is the steady state of the estimates with the mean flow: outflow equals inflow.
    let point = &linear["linearised"]["points"][0];
    let flows = ["q_boost", "q_tf"].map(|name| number(&point["inputs"][name]["value"]));
    let through = number(&point["unknowns"]["q_ssp"]["value"]) * 6e4;
    assert!((flows.iter().sum::<f64>() / through - 1.0).abs() < 1e-9, "{point}");
    assert_eq!(linear["linearised"]["at"], "mean");
    for name in ["p_r", "p_out"] {
        let output = &linear["linearised"]["model"]["outputs"][name];
        // The signals are so small that the nonlinear model fits as well.
        let [with, without] = [&output["rms"], &linear["outputs"][name]["rms_train"]].map(number);
        assert!((with / without - 1.0).abs() < 0.05, "{name}: {with} {without}");
        assert!(number(&output["difference"]) < 0.3 * number(&linear["outputs"][name]["noise"]));
        let linear_r = number(&linear["outputs"][name]["quality"]["train"]["r_squared"]);
        assert!((number(&output["quality"]["r_squared"]) - linear_r).abs() < 0.03, "{name}");
        assert!(number(&linear["outputs"][name]["rms_valid"]) < 0.012);
    }
    let fitted = std::fs::read_to_string(folder.path().join("out/mud_circulation.dgd"));
    assert!(!fitted.expect("the model").contains("M_ssp [kg/m^4]     = 1.1e8 "));

    // By its other name, at other points, and as text.
    let other = [&args[..], &["--estimator", "linearized"]].concat();
    assert_eq!(json(&other)["parameters"], linear["parameters"]);
    for at in ["steady", "120"] {
        let answer = json(&[&linearised[..], &["--at", at]].concat());
        let [a, b] = [&answer, &model].map(|result| &result["parameters"]["F2"]);
        let apart = number(&a["value"]) - number(&b["value"]);
        assert!(apart.abs() < 3.0 * number(&b["std"]), "{at}: {a} {b}");
    }
    let text = dgd(&linearised).done().out;
    for part in ["steady state with the means of the inputs", "rms model", "fit model %", "h_r"] {
        assert!(text.contains(part), "{text}");
    }
    assert!(!text.contains("by more than the noise"), "{text}");

    // Large signals cause a remark.
    let text = dgd(&[&CIRCULATION[..], &["--estimator", "linearised"]].concat()).done().out;
    assert!(text.contains("by more than the noise"), "{text}");
}

/// A tank with a valve that opens at a level.
const VALVE: &[u8] = b"\
model valve
input u [1] hold
parameter k [1/s] = 0.2 in 0.01 ..
state x [1] = 1
modes gate {
  closed { equation e: der(x) = k*(u - x) }
  open   { equation e: der(x) = k*(u - 2*x) }
  closed -> open when x rises above 1.5
}
output y [1] = x
";

#[test]
fn what_has_no_linear_model_is_told_by_name() {
    let mut csv = "time [s],u [1],y [1]\n".to_owned();
    for t in 0..60 {
        let since = f64::from((t - 40).max(0));
        let y = 4.0 - 3.0 * (-0.2 * since).exp();
        let u = if t < 40 { 1 } else { 4 };
        writeln!(csv, "{t},{u},{}", y.min(2.0)).expect("a string takes all");
    }
    let late = b"model late\ninput u [1] hold\nparameter k [1/s] = 0.2\nstate x [1] = 1\n\
        equation e: der(x) = k*(u - delay(x, 2 [s]))\noutput y [1] = x\n";
    let sum = b"model sum\ninput u [1] hold\nparameter k [1/s] = 0.2\nstate x [1] = 1\n\
        equation e: der(x) = k*u\noutput y [1] = x\n";
    let folder = folder_with(&[
        ("valve.dgd", VALVE),
        ("late.dgd", late),
        ("sum.dgd", sum),
        ("d.csv", csv.as_bytes()),
    ]);
    let refused = |model: &str, more: &[&str], code: i32, parts: &[&str]| {
        let args = ["fit", model, "--data", "d.csv", "--estimator", "linearised"];
        dgd_in(folder.path(), &[&args[..], more].concat()).refused(code, parts);
    };
    let parts = ["d.csv", "`gate: closed`", "`open`", "`--until`", "`--estimator output-error`"];
    refused("valve.dgd", &["--at", "steady"], 1, &parts);
    refused("late.dgd", &[], 3, &["cannot be linearised", "d.csv", "`x` late", "output-error"]);
    refused("sum.dgd", &[], 3, &["`e`", "`x` changes by", "`--at T`"]);
    refused("valve.dgd", &["--at", "somewhere"], 2, &["`steady` or `mean`"]);
    let args = [&CIRCULATION[..], &["--at", "mean"]].concat();
    dgd(&args).refused(2, &["`--at` needs `--estimator linearised`"]);
    // In a single mode there is no reason to refuse.
    let args = ["fit", "valve.dgd", "--data", "d.csv", "--estimator", "linearised"];
    let result = dgd_in(folder.path(), &[&args[..], &["--until", "39", "--fix", "k"]].concat());
    let text = result.done().out;
    assert!(text.contains("d.csv stays in these modes: gate: closed"), "{text}");
}

#[test]
fn every_estimator_is_in_the_help() {
    let help = dgd(&["fit", "--help"]).out;
    for name in [
        "output-error",
        "linearised",
        "least-squares",
        "bounded",
        "separable",
        "nelder-mead",
        "recursive",
    ] {
        assert!(help.contains(&format!("- {name}:")), "{name}\n{help}");
    }
    assert!(root().join("docs/identification.md").exists());
}

#[test]
fn a_fit_by_any_method_ends_at_the_same_values() {
    // Inputs change at every sample. Only some of these methods make equal steps between samples.
    let fitted = |method: &str| -> Vec<f64> {
        let data = "examples/data/booster_stop.train.csv";
        let model = "models/mud_circulation.dgd";
        let run = dgd(&[
            "fit", model, "--data", data, "--until", "300", "--method", method, "--rtol", "1e-8",
            "--format", "json",
        ]);
        let fit = run.done().json();
        let parameters = fit["parameters"].as_object().expect("parameters");
        parameters.values().filter_map(|one| one["value"].as_f64()).collect()
    };
    let expected = fitted("rodas5p");
    assert!(!expected.is_empty());
    for method in ["kencarp4", "bdf", "tsit5"] {
        let result = fitted(method);
        for (result, expected) in result.iter().zip(&expected) {
            assert!(
                (result - expected).abs() <= 1e-4 * expected.abs(),
                "{method}: {result}, {expected}"
            );
        }
        assert_eq!(result.len(), expected.len(), "{method}");
    }
}
