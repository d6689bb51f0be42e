//! The report of `dgd fit` on the quality of a fit and the uncertainty of its estimates.

use std::fmt::Write as _;

use serde_json::Value;

use crate::support::{Normal, dgd, dgd_in, folder_with, listing};

const MODEL: &[u8] = b"\
model tank
input u [1] hold
input v [1] hold
parameter gain [1] = 0.8 in 0 ..
parameter tau [s] = 40 in 1 .. 1000
state x [1] = 2
equation tank: tau * der(x) = gain*u - x
output y [1] = x
output twice [mm] = 2 [mm] * x
";

/// A recording with gain 0.5, tau 20 s, noise of 0.05, and a contribution `of_v` of v to the reading of y.
fn recording(seed: u64, of_v: f64) -> String {
    let mut normal = Normal(seed);
    let mut text = "time [s],u [1],v [1],y [1],twice [mm]\n".to_owned();
    let mut x = 2.0;
    for k in 0..400_usize {
        let u = [4.0, 1.0, 6.0, 3.0][k / 25 % 4];
        let v = [0.0, 1.0, 0.0, 0.0, 1.0][k / 11 % 5];
        let y = x + of_v * v + 0.05 * normal.next();
        let twice = 2.0 * x + 0.1 * normal.next();
        let _ = writeln!(text, "{k},{u},{v},{y},{twice}");
        x = 0.5 * u + (x - 0.5 * u) * (-1.0f64 / 20.0).exp();
    }
    text
}

#[track_caller]
fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn quality_is_told_for_fitted_and_held_out_recordings() {
    let files = [
        ("m.dgd", MODEL),
        ("a.csv", &recording(1, 0.0).into_bytes()),
        ("b.csv", &recording(2, 0.0).into_bytes()),
    ];
    let folder = folder_with(&files);
    let args = ["fit", "m.dgd", "--data", "a.csv", "--valid", "b.csv"];
    let result = dgd_in(folder.path(), &[&args[..], &["--format", "json"]].concat()).done().json();
    for (name, unit, sigma) in [("y", "1^2", 0.05), ("twice", "mm^2", 0.1)] {
        for (set, rms, samples) in [("train", "rms_train", 400), ("valid", "rms_valid", 340)] {
            let output = &result["outputs"][name];
            let quality = &output["quality"][set];
            assert_eq!(
                (&quality["samples"], &quality["mse_unit"]),
                (&samples.into(), &unit.into())
            );
            let mse = number(&quality["mse"]);
            assert!((mse.sqrt() / number(&output[rms]) - 1.0).abs() < 1e-9);
            // The relative scatter of σ from n samples is 1/√(2n); five of these.
            assert!((mse.sqrt() / sigma - 1.0).abs() < 5.0 / 678f64.sqrt(), "{name} {set} {mse}");
            // fit % = 100 (1 − √(1 − R²))
            let unexplained = 1.0 - number(&quality["r_squared"]);
            let fit = 100.0 * (1.0 - unexplained.sqrt());
            assert!((number(&quality["fit_percent"]) - fit).abs() < 1e-9);
            assert!(fit > 80.0 && fit < 100.0, "{fit}");
            // No missing term: one of 12 tests below 0.001 happens by chance in 1 % of cases.
            assert!(number(&quality["whiteness"]["p_value"]) > 1e-3, "{quality}");
            assert_eq!(quality["whiteness"]["autocorrelation"].as_array().map(Vec::len), Some(25));
            for input in ["u", "v"] {
                assert!(number(&quality["inputs"][input]["p_value"]) > 1e-3, "{quality}");
            }
        }
    }
    let text = dgd_in(folder.path(), &args).done().out;
    assert!(text.contains("fit valid %") && !text.contains("correlate with"), "{text}");
    assert!(!text.contains("no white noise"), "{text}");
}

#[test]
fn errors_that_go_with_an_input_are_said_to() {
    let data = recording(3, 0.2).into_bytes();
    let folder = folder_with(&[("m.dgd", MODEL), ("a.csv", &data)]);
    let text = dgd_in(folder.path(), &["fit", "m.dgd", "--data", "a.csv"]).done().out;
    assert!(text.contains("residuals of `y` correlate with `v` (correlation +0."), "{text}");
    assert!(text.contains("`dgd discover` looks for it") && !text.contains("`twice` go"), "{text}");
    // The addition to `y` also biases the parameters shared with `twice`.
    assert!(text.contains("residuals of `y`") && text.contains("are autocorrelated"), "{text}");
}

#[test]
fn recordings_of_one_file_name_are_told_apart() {
    let folder = folder_with(&[("m.dgd", MODEL)]);
    for (name, seed) in [("a", 5), ("b", 6)] {
        std::fs::create_dir(folder.path().join(name)).expect("a folder");
        let data = recording(seed, 0.0);
        std::fs::write(folder.path().join(name).join("run.csv"), data).expect("a file");
    }
    let args = ["fit", "m.dgd", "--data", "a/run.csv", "--data", "b/run.csv"];
    let more = ["--profile", "tau,x(0)", "--bootstrap", "20", "--format", "json"];
    let plot = ["--plot", "fit.svg", "--information"];
    let run = dgd_in(folder.path(), &[&args[..], &more, &plot].concat()).done();
    let result = run.json();
    let names = |result: &Value| -> Vec<String> {
        result.as_object().expect("names").keys().cloned().collect()
    };
    assert_eq!(names(&result["profiles"]), ["tau", "x(0) of a/run.csv", "x(0) of b/run.csv"]);
    let entries = ["gain", "tau", "x(0) of a/run.csv", "x(0) of b/run.csv"];
    assert_eq!(names(&result["bootstrap"]["estimates"]), entries);
    assert_eq!(names(&result["information"]), entries);
    let drawn: Vec<String> =
        listing(&folder).into_iter().filter(|name| name.contains("profile")).collect();
    assert_eq!(drawn.len(), 3, "{drawn:?}");
}

#[test]
fn start_values_are_called_by_their_files_by_all_estimators() {
    let folder = folder_with(&[("m.dgd", MODEL)]);
    for (name, seed) in [("a.csv", 7), ("b.csv", 8)] {
        let data = recording(seed, 0.0);
        let rows: Vec<&str> = data.lines().take(80).collect();
        std::fs::write(folder.path().join(name), rows.join("\n")).expect("a file");
    }
    let expected = ["x(0) of a.csv", "x(0) of b.csv"];
    for estimator in ["output-error", "prediction-error"] {
        let out = format!("{estimator}.out");
        let args = ["fit", "m.dgd", "--data", "a.csv", "--data", "b.csv", "--profile", "x(0)"];
        let more = ["--estimator", estimator, "-o", &out, "--plot", &format!("{estimator}.svg")];
        let text = dgd_in(folder.path(), &[&args[..], &more].concat()).done().out;
        assert!(expected.iter().all(|name| text.contains(name)), "{text}");
        let result = std::fs::read(folder.path().join(out).join("result.json")).expect("a result");
        let answer: Value = serde_json::from_slice(&result).expect("JSON");
        let profiles = answer["profiles"].as_object().expect("profiles");
        assert!(profiles.keys().eq(expected), "{answer:#}");
        let files = listing(&folder);
        for file in ["a.csv", "b.csv"] {
            let drawn = format!("{estimator}.profile-x(0)_of_{file}.svg");
            assert!(files.contains(&drawn), "{files:?}");
        }
    }
}

#[test]
fn intervals_are_reported_and_drawn() {
    let data = recording(4, 0.0).into_bytes();
    let folder = folder_with(&[("m.dgd", MODEL), ("a.csv", &data)]);
    let args = ["fit", "m.dgd", "--data", "a.csv", "--profile", "all", "--bootstrap", "99"];
    let more = ["--seed", "7", "-o", "out", "--plot", "fit.svg"];
    let text = dgd_in(folder.path(), &[&args[..], &more].concat()).done().out;
    for part in ["by profile", "by bootstrap", "99 data sets"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let result = std::fs::read_to_string(folder.path().join("out/result.json")).expect("a result");
    let answer: Value = serde_json::from_str(&result).expect("JSON");
    for (name, truth) in [("gain", 0.5), ("tau", 20.0)] {
        let estimate = &answer["parameters"][name];
        let (value, std) = (number(&estimate["value"]), number(&estimate["std"]));
        let profile = &answer["profiles"][name];
        let (low, high) = (number(&profile["interval"][0]), number(&profile["interval"][1]));
        assert!(low < value && value < high && (value - truth).abs() < 5.0 * std);
        // Nearly linear in its parameters, with white noise: all three intervals agree.
        assert!(((high - low) / (2.0 * 1.959_964 * std) - 1.0).abs() < 0.05, "{profile}");
        assert_eq!(profile["lower"]["end"], "interval");
        let resampled = &answer["bootstrap"]["estimates"][name];
        assert!((number(&resampled["std"]) / std - 1.0).abs() < 0.4, "{resampled} {std}");
    }
    let files = listing(&folder);
    for file in ["fit.svg", "fit.profile-gain.svg", "fit.profile-tau.svg"] {
        assert!(files.iter().any(|name| name == file), "{files:?}");
    }

    // The same seed gives the same bytes for any number of threads.
    let json =
        |more: &[&str]| dgd_in(folder.path(), &[&args[..], &["--format", "json"], more].concat());
    let one = json(&["--seed", "7", "--threads", "1"]).done().out;
    assert_eq!(one, json(&["--seed", "7", "--threads", "3"]).done().out);
    assert_eq!(one.trim(), result.trim());
    assert_ne!(one, json(&["--seed", "8"]).done().out);
}

#[test]
fn outliers_are_borne_and_counted() {
    let clean = recording(6, 0.0);
    // A sensor that reads 9 for two of every 20 samples.
    let mut lines: Vec<String> = clean.lines().map(str::to_owned).collect();
    for (k, line) in lines.iter_mut().enumerate().skip(1).filter(|(k, _)| k % 20 < 2) {
        let mut cells: Vec<&str> = line.split(',').collect();
        let read = if k % 3 == 0 { "9" } else { "8.5" };
        cells[3] = read;
        *line = cells.join(",");
    }
    let spoilt = lines.join("\n") + "\n";
    let folder = folder_with(&[("m.dgd", MODEL), ("a.csv", spoilt.as_bytes())]);
    let fit = |more: &[&str]| {
        let args = ["fit", "m.dgd", "--data", "a.csv", "--outputs", "y"];
        dgd_in(folder.path(), &[&args[..], more].concat())
    };
    let off = |loss: &str| {
        let result = fit(&["--loss", loss, "--format", "json"]).done().json();
        assert_eq!(result["loss"], loss);
        let gain = &result["parameters"]["gain"];
        let sigma = number(&result["outputs"]["y"]["noise"]);
        let light = result["outputs"]["y"]["light_samples"].as_u64().expect("a count");
        (number(&gain["value"]) - 0.5, number(&gain["std"]), sigma, light)
    };
    let (_, by_squares, sigma, light) = off("squares");
    assert!(sigma > 1.0 && light == 0, "{sigma} {light}");
    for loss in ["huber", "cauchy", "tukey"] {
        let (error, std, sigma, light) = off(loss);
        assert!(error.abs() < 5.0 * std && std < 0.5 * by_squares, "{loss}: {error} ± {std}");
        assert!((0.04..0.07).contains(&sigma), "{loss}: {sigma}");
        assert!((40..=55).contains(&light), "{loss}: {light}");
    }
    let text = fit(&["--loss", "tukey"]).done().out;
    assert!(
        text.contains("`y`: 4") && text.contains("of 400 samples weigh less than half"),
        "{text}"
    );
    fit(&["--loss", "huber", "--estimator", "bounded"]).refused(2, &["`--loss`", "output-error"]);
    fit(&["--starts", "4", "--estimator", "recursive"]).refused(2, &["`--starts`", "output-error"]);
}

#[test]
fn recordings_in_which_nothing_moves_are_said_to_be() {
    let mut normal = Normal(9);
    let mut still = "time [s],u [1],v [1],y [1],twice [mm]\n".to_owned();
    for k in 0..100 {
        let (y, twice) = (1.0 + 0.05 * normal.next(), 2.0 + 0.1 * normal.next());
        let _ = writeln!(still, "{k},2,0,{y},{twice}");
    }
    let moving = recording(10, 0.0);
    let files = [("m.dgd", MODEL), ("a.csv", still.as_bytes()), ("b.csv", moving.as_bytes())];
    let folder = folder_with(&files);
    let contains = |more: &[&str]| {
        let args = ["fit", "m.dgd", "--data", "a.csv"];
        let text = dgd_in(folder.path(), &[&args[..], more].concat()).done().out;
        text.contains("no input moves in any recording")
    };
    assert!(contains(&[]));
    assert!(!contains(&["--data", "b.csv"]));
}

#[test]
fn recordings_that_cannot_tell_are_said_to() {
    let late = String::from_utf8(MODEL.to_vec()).expect("text");
    let late = late.replace("gain*u", "gain*delay(u, wait)");
    let late = late.replace("state x", "parameter wait [s] = 500 in 0 ..\nstate x");
    let data = recording(11, 0.0);
    let files = [("m.dgd", MODEL), ("late.dgd", late.as_bytes()), ("a.csv", data.as_bytes())];
    let folder = folder_with(&files);
    let fit = |args: &[&str]| dgd_in(folder.path(), &[&["fit"], args].concat()).done().out;
    let text = fit(&["late.dgd", "--data", "a.csv"]);
    assert!(
        text.contains("the delay `wait` is 500 s, and the longest recording lasts 399 s"),
        "{text}"
    );
    assert!(!fit(&["late.dgd", "--data", "a.csv", "--set", "wait=3"]).contains("the delay"));

    // A recording used for both, under another name and truncated.
    let part: Vec<&str> = data.lines().take(200).collect();
    std::fs::write(folder.path().join("b.csv"), part.join("\n") + "\n").expect("a file");
    std::fs::write(folder.path().join("c.csv"), recording(12, 0.0)).expect("a file");
    let text = fit(&["m.dgd", "--data", "a.csv", "--valid", "b.csv", "--valid", "c.csv"]);
    assert!(text.contains("b.csv is a.csv again"), "{text}");
    assert!(!text.contains("c.csv is"), "{text}");
}

#[test]
fn minima_are_told_apart() {
    let model = b"\
model wave
input s [s] linear
parameter w [rpm] = 30 in 5 .. 200
parameter a [1] = 0.4 in -2 .. 2
output y [1] = sin(w*s)
output z [1] = a^2*s/(1 [s])
";
    let mut normal = Normal(8);
    let mut text = "time [s],s [s],y [1],z [1]\n".to_owned();
    for k in 0..80 {
        let t = 0.1 * f64::from(k);
        let (y, z) = ((5.7 * t).sin() + 0.05 * normal.next(), 1.44 * t + 0.05 * normal.next());
        let _ = writeln!(text, "{t},{t},{y},{z}");
    }
    let folder = folder_with(&[("m.dgd", model), ("a.csv", text.as_bytes())]);
    let fit = |more: &[&str]| {
        let args = ["fit", "m.dgd", "--data", "a.csv", "--seed", "2"];
        dgd_in(folder.path(), &[&args[..], more].concat()).done()
    };
    let result = fit(&["--starts", "30", "--format", "json"]);
    let same = fit(&["--starts", "30", "--format", "json", "--threads", "3"]);
    assert_eq!(result.out, same.out);
    let result = result.json();
    // 5.7 1/s.
    let w = &result["parameters"]["w"];
    assert!((number(&w["value"]) - 54.43).abs() < 5.0 * number(&w["std"]), "{w}");
    let several = &result["multi_start"];
    assert_eq!(several["points"], 30);
    let minima = several["minima"].as_array().expect("a list");
    let points = |minimum: &Value| minimum["points"].as_array().expect("a list").len();
    let lost = several["without_minimum"].as_u64().expect("a count") as usize;
    assert_eq!(minima.iter().map(points).sum::<usize>() + lost, 30);
    assert!(minima.len() > 3, "{several}");
    let [a, b] = [0, 1].map(|k| number(&minima[k]["estimates"]["a"]["value"]));
    assert!((a + b).abs() < 1e-3 && (a.abs() - 1.2).abs() < 0.05, "{a} {b}");
    assert_eq!(minima[0]["estimates"]["w"]["unit"], "rpm");

    let text = fit(&["--starts", "30"]).out;
    for part in [
        "of 30 starting points led to this minimum",
        "led to another one, as good: `a` = ",
        "the rest led to",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(fit(&["--format", "json"]).json().get("multi_start").is_none());
}

#[test]
fn parameters_that_cancel_are_open_and_named() {
    let model = String::from_utf8(MODEL.to_vec()).expect("text");
    let model = model.replace("gain*u", "gain*factor*u");
    let model = model.replace("state x", "parameter factor [1] = 1 in 0 ..\nstate x");
    let data = recording(5, 0.0).into_bytes();
    let folder = folder_with(&[("m.dgd", model.as_bytes()), ("a.csv", &data)]);
    let run = dgd_in(folder.path(), &["fit", "m.dgd", "--data", "a.csv", "--profile", "gain"]);
    let text = run.done().out;
    assert!(
        text.contains("`gain` is open above") && text.contains("`factor` makes up for it"),
        "{text}"
    );
}

#[test]
fn what_has_no_intervals_is_refused_by_name() {
    let fit = ["fit", "models/mud_circulation.dgd", "--data", "examples/data/circulation.csv"];
    dgd(&[&fit[..], &["--profile", "c3"]].concat())
        .refused(2, &["--profile c3", "`c0`", "`h_r(0)`"]);
    dgd(&[&fit[..], &["--bootstrap", "9", "--estimator", "bounded"]].concat())
        .refused(2, &["--bootstrap", "output-error"]);
}

#[test]
fn what_determines_each_parameter_is_told() {
    let args = ["fit", "models/mud_circulation.dgd", "--data", "examples/data/circulation.csv"];
    let args = [&args[..], &["--information"]].concat();
    let text = dgd(&args).done().out;
    assert!(text.contains("`M_ssp`: ") && text.contains("% from transients"), "{text}");
    let result = dgd(&[&args[..], &["--format", "json"]].concat()).done().json();
    let value_of = |name: &str| &result["information"][name];
    for name in ["M_ssp", "c0", "c2", "F2", "h_r(0)"] {
        let sum: f64 =
            value_of(name)["outputs"].as_object().expect("outputs").values().map(number).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{name}: {sum}");
        assert!(
            (number(&value_of(name)["steady"]) + number(&value_of(name)["transient"]) - 1.0).abs()
                < 1e-3
        );
    }
    // Two steady operating points, and the effect of more samples of each kind.
    let points = result["operating_points"].as_array().expect("points");
    assert_eq!(points.len(), 2, "{points:?}");
    assert_eq!(points[0]["inputs"]["q_boost"]["unit"], "lpm");
    for name in ["M_ssp", "c0", "c2", "F2"] {
        let again = &value_of(name)["std_with_as_much_again"];
        assert!((number(&again["all"]) - 0.5_f64.sqrt()).abs() < 1e-3, "{name}: {again}");
        let parts = value_of(name)["operating_points"].as_array().expect("parts");
        let steady: f64 = parts.iter().map(number).sum();
        assert!((steady - number(&value_of(name)["steady"])).abs() < 1e-12, "{name}");
    }
    // More steady operation improves the friction, but not a mass.
    let best = |name: &str| {
        let again = &value_of(name)["std_with_as_much_again"];
        let rests = again["operating_points"].as_array().expect("numbers").iter().map(number);
        (number(&again["transient"]), rests.fold(f64::INFINITY, f64::min))
    };
    let (mass, friction) = (best("M_ssp"), best("F2"));
    assert!(mass.1 > 0.98 && mass.0 < 0.72, "{mass:?}");
    assert!(friction.1 < friction.0, "{friction:?}");
    for part in ["at 2 operating points", "a test as long again", "rest at `w_ssp` = "] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // The same if other parameters are not determined.
    let fewer = [&args[..], &["--outputs", "p_r,q_ssp", "--format", "json"]].concat();
    let fewer = dgd(&fewer).done().json();
    assert_eq!(fewer["information"]["c2"], Value::Null);
    for name in ["M_ssp", "c0"] {
        let parts = &fewer["information"][name];
        let sum = number(&parts["steady"]) + number(&parts["transient"]);
        assert!((sum - 1.0).abs() < 1e-3, "{name}: {parts}");
    }
    // A mass shows only under acceleration.
    assert!(number(&value_of("M_ssp")["transient"]) > 0.9, "{}", value_of("M_ssp"));
    assert!(
        number(&value_of("c0")["steady"]) > 2.0 * number(&value_of("M_ssp")["steady"]),
        "{}",
        value_of("c0")
    );
}
