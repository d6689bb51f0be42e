//! `dgd track`: rows out for rows in, from files and from standard input.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;

use serde_json::Value;

use crate::support::{column, command, dgd_in, folder_with, listing, piped};

const TANKS: &str = "\
/// Two tanks, one into the other.
model tanks
constant A [m^2] = 1
input q_in [lpm] hold
parameter a_1 [cm^2] = 10  in 0.1 .. 100, log
parameter a_2 [cm^2] = 12  in 0.1 .. 100, log, fixed
state h_1 [m] = 1
state h_2 [m] = 0.5
function out(h [m], a [m^2]) = a*sqrt(2*9.81 [m/s^2]*h)
equation upper: A*der(h_1) = q_in - out(h_1, a_1)
equation lower: A*der(h_2) = out(h_1, a_1) - out(h_2, a_2)
output h_1 [m]                  noise 1 [cm]
output p_2 [mbar] = 9.81e3 [Pa/m]*h_2  noise 1 [mbar]
";

/// Numbers in (−√3, √3), of unit variance, the same in every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0) * 3.0_f64.sqrt()
    }
}

/// A recording of the tanks with another valve, by the classical Runge–Kutta method.
fn recording(rows: usize) -> String {
    let (a_1, a_2) = (15e-4, 12e-4);
    let f = |h: [f64; 2], q: f64| {
        let out = |h: f64, a: f64| a * (2.0 * 9.81 * h).sqrt();
        [q - out(h[0], a_1), out(h[0], a_1) - out(h[1], a_2)]
    };
    let mut noise = Noise(9);
    let mut h = [1.1, 0.4];
    let mut text = "time [s],q_in [lpm],h_1 [cm],p_2 [mbar]\n".to_owned();
    for k in 0..rows {
        let lpm = [300.0, 450.0, 380.0][k / 40 % 3];
        let (level, pressure) = (100.0 * h[0] + noise.next(), 98.1 * h[1] + noise.next());
        let _ = writeln!(text, "{},{lpm},{level:.3},{pressure:.3}", 5 * k);
        let (q, dt) = (lpm / 60_000.0, 5.0);
        let add = |h: [f64; 2], k: [f64; 2], s: f64| [h[0] + s * k[0], h[1] + s * k[1]];
        let k1 = f(h, q);
        let k2 = f(add(h, k1, dt / 2.0), q);
        let k3 = f(add(h, k2, dt / 2.0), q);
        let k4 = f(add(h, k3, dt), q);
        h = [0, 1].map(|i| h[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    text
}

#[test]
fn a_file_gives_one_line_for_each_row_and_finds_the_valve() {
    let data = recording(240);
    let folder = folder_with(&[("t.dgd", TANKS.as_bytes()), ("d.csv", data.as_bytes())]);
    for estimator in ["ekf", "ukf", "recursive"] {
        let args = ["track", "t.dgd", "--data", "d.csv", "--estimator", estimator];
        let run = dgd_in(folder.path(), &args).done();
        assert_eq!(run.out.lines().count(), 241);
        assert_eq!(
            run.out.lines().next(),
            Some(
                "time [s],h_1 [m],std(h_1) [m],h_2 [m],std(h_2) [m],a_1 [cm^2],std(a_1) [cm^2],\
                 innovation(h_1) [m],std(innovation(h_1)) [m],innovation(p_2) [mbar],\
                 std(innovation(p_2)) [mbar],nis [1]"
            )
        );
        let (valve, std) = (column(&run.out, "a_1 [cm^2]"), column(&run.out, "std(a_1) [cm^2]"));
        let (last, std) = (valve[239], std[239]);
        assert!((last - 15.0).abs() < 4.0 * std && std < 0.5, "{estimator}: {last} ± {std}");
        // The report lists the uncertainty of each quantity, with its source.
        for part in
            ["10 % of its size", "noise: h_1 0.0100 m (declared)", "times as large as expected"]
        {
            assert!(run.err.contains(part), "{}", run.err);
        }
        let ratio = column(&run.out, "nis [1]").iter().sum::<f64>() / 480.0;
        assert!((0.8..1.25).contains(&ratio), "{estimator}: {ratio}");
    }
}

#[test]
fn standard_input_is_answered_row_by_row_as_a_file_is() {
    let data = recording(60);
    let folder = folder_with(&[("t.dgd", TANKS.as_bytes()), ("d.csv", data.as_bytes())]);
    let of_file = dgd_in(folder.path(), &["track", "t.dgd", "--data", "d.csv"]).done();
    let args = ["track", "t.dgd", "--data", "-", "--quiet"];
    let streamed = piped(folder.path(), &args, &data).done();
    assert_eq!(of_file.out, streamed.out);
    assert_eq!(streamed.err, "");

    // The answer to a row arrives before the next row is written.
    let mut child = command(folder.path(), &args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut input = child.stdin.take().expect("a pipe");
    let mut answers = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let mut lines = data.lines();
    writeln!(input, "{}", lines.next().expect("a header")).expect("it reads");
    for (k, line) in lines.take(10).enumerate() {
        writeln!(input, "{line}").expect("it reads");
        input.flush().expect("it reads");
        if k == 0 {
            answers.next().expect("a header").expect("text");
        }
        let answer = answers.next().expect("an answer").expect("text");
        assert_eq!(Some(answer.as_str()), of_file.out.lines().nth(k + 1));
    }
    drop(input);
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn results_go_to_files_whole_and_to_programs_as_json() {
    let data = recording(80);
    let folder = folder_with(&[("t.dgd", TANKS.as_bytes()), ("d.csv", data.as_bytes())]);
    let args = ["track", "t.dgd", "--data", "d.csv", "-o", "out.csv", "--plot", "out.svg"];
    let run = dgd_in(folder.path(), &args).done();
    assert_eq!(run.out, "");
    let out = std::fs::read_to_string(folder.path().join("out.csv")).expect("a file");
    assert_eq!(out.lines().count(), 81);
    let figure = std::fs::read_to_string(folder.path().join("out.svg")).expect("a picture");
    assert!(figure.contains("innovation of"), "no panel of innovations");

    let args =
        ["track", "t.dgd", "--data", "d.csv", "--format", "json", "--start-std", "h_1=2 [cm]"];
    let run = dgd_in(folder.path(), &args).done();
    let lines: Vec<Value> =
        run.out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(lines.len(), 81);
    let tracked = &lines[0]["settings"]["tracked"]["h_1"];
    assert_eq!(
        (tracked["start_std"].as_f64(), tracked["start_std_from"].as_str()),
        (Some(0.02), Some("asked"))
    );
    let last = &lines[80];
    assert_eq!(last["time"], 395.0);
    assert!(last["parameters"]["a_1"]["std"].as_f64().is_some_and(|std| std < 2.0));
    assert_eq!(last["innovations"]["p_2"]["used"], true);

    // An unreadable row leaves no file.
    let broken = data.replace("\n100,", "\n90,");
    std::fs::write(folder.path().join("broken.csv"), &broken).expect("writable");
    let args = ["track", "t.dgd", "--data", "-", "-o", "none.csv", "--strict"];
    piped(folder.path(), &args, &broken).refused(1, &["line 22", "from 95 s to 90 s"]);
    assert!(!listing(&folder).iter().any(|name| name.contains("none")), "{:?}", listing(&folder));
}

#[test]
fn gaps_and_outliers_are_told() {
    let mut rows: Vec<String> = recording(120).lines().map(str::to_owned).collect();
    rows[20] = "95,300,NaN,NaN".to_owned();
    rows[31] = "150,,,40".to_owned();
    rows[60] = "295,450,900,40".to_owned();
    let data = rows.join("\n");
    let folder = folder_with(&[("t.dgd", TANKS.as_bytes()), ("d.csv", data.as_bytes())]);
    let args = ["track", "t.dgd", "--data", "d.csv", "--gate", "6", "--outputs", "h_1"];
    let run = dgd_in(folder.path(), &args).done();
    assert!(run.err.contains("beyond the gate, not used: 1"), "{}", run.err);
    assert!(
        run.err.contains("rows without input `q_in`, which kept its last value: 1"),
        "{}",
        run.err
    );
    assert!(!run.out.contains("p_2") && !run.err.contains("lost its way"), "{}", run.err);
    let innovation = column(&run.out, "innovation(h_1) [m]");
    assert!(innovation[19].is_nan() && innovation[59] > 5.0);
    // The upper tank carries no information on the lower one, whose valve stays as uncertain as before and is named.
    let args = ["track", "t.dgd", "--data", "d.csv", "--free", "a_2", "--outputs", "h_1"];
    let run = dgd_in(folder.path(), &args).done();
    assert!(run.err.contains("the data says little about `h_2`, `a_2`"), "{}", run.err);
    let std = column(&run.out, "std(a_2) [cm^2]");
    assert!(std.iter().all(|std| (std / 3.6 - 1.0).abs() < 1e-9), "{std:?}");
}

#[test]
fn what_makes_no_sense_is_refused_in_the_users_names() {
    let data = recording(5);
    let silent = TANKS.replace("noise 1 [mbar]", "");
    let late = TANKS.replace("output h_1 [m]  ", "output h_1 [m] = delay(h_1, 3 [s])  ");
    let ahead = late.replace("3 [s]", "-3 [s]");
    let folder = folder_with(&[
        ("t.dgd", TANKS.as_bytes()),
        ("silent.dgd", silent.as_bytes()),
        ("late.dgd", late.as_bytes()),
        ("ahead.dgd", ahead.as_bytes()),
        ("d.csv", data.as_bytes()),
    ]);
    let refused = |args: &[&str], code: i32, parts: &[&str]| {
        let all_args: Vec<&str> = ["track"].iter().chain(args).copied().collect();
        dgd_in(folder.path(), &all_args).refused(code, parts);
    };
    refused(
        &["silent.dgd", "--data", "d.csv"],
        2,
        &["`p_2` declares no noise", "--noise 'p_2=… [mbar]'"],
    );
    let more_args = ["silent.dgd", "--data", "d.csv", "--noise", "p_2=2"];
    dgd_in(folder.path(), &[&["track"], &more_args[..]].concat()).done();
    refused(&["ahead.dgd", "--data", "d.csv"], 3, &["what output `h_1` will be", "`output-error`"]);
    dgd_in(folder.path(), &["track", "late.dgd", "--data", "d.csv"]).done();
    refused(&["t.dgd", "--data", "d.csv", "--forgetting", "0.9"], 2, &["--estimator recursive"]);
    refused(
        &["t.dgd", "--data", "d.csv", "--process-noise", "a_3=1"],
        1,
        &["no state and no parameter is called `a_3`", "a_1"],
    );
    refused(
        &["t.dgd", "--data", "d.csv", "--start-std", "h_1=2 [bar]"],
        1,
        &["`h_1` is in `m`", "bar"],
    );
    refused(&["t.dgd", "--data", "d.csv", "--noise", "h_1=-1"], 2, &["--noise"]);
    refused(&["t.dgd", "--data", "none.csv"], 1, &["none.csv"]);
    refused(&["t.dgd", "--data", "d.csv", "--gate", "0"], 2, &["--gate"]);
    let run = piped(folder.path(), &["track", "t.dgd", "--data", "-"], "");
    run.refused(1, &["standard input", "empty"]);
    let run = piped(folder.path(), &["track", "t.dgd", "--data", "-"], "time [s],h_1 [m]\n0,1\n");
    run.refused(1, &["no column for the input `q_in`"]);
    let run = piped(
        folder.path(),
        &["track", "t.dgd", "--data", "-", "--strict"],
        "time [s],q_in [lpm],h_1 [m]\n0,300,1\n5,x,1\n",
    );
    run.refused(1, &["line 3", "`x` in column `q_in` is not a number"]);
    assert_eq!(run.out.lines().count(), 2);
    // Programs get the error as a line like the others.
    let run = piped(
        folder.path(),
        &["track", "t.dgd", "--data", "-", "--strict", "--format", "json"],
        "time [s],q_in [lpm],h_1 [m]\n0,300,1\n5,x,1\n",
    );
    run.refused(1, &["line 3"]);
    let lines: Vec<Value> =
        run.out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let keys = ["settings", "states", "error"];
    assert!(lines.len() == 3 && (0..3).all(|k| !lines[k][keys[k]].is_null()), "{}", run.out);
    // The same applies to errors before the first row.
    let before: [(&[&str], i32, &str); 4] = [
        (&["t.dgd", "--data", "none.csv"], 1, "diagnostics"),
        (&["t.dgd", "--data", "d.csv", "--rename", "time=t [xx]"], 1, "diagnostics"),
        (&["t.dgd", "--data", "d.csv", "--gate", "0"], 2, "error"),
        (&["t.dgd", "--data", "d.csv", "--from", "1e9"], 2, "error"),
    ];
    for (args, code, key) in before {
        let run = dgd_in(folder.path(), &[&["track"], args, &["--format", "json"]].concat());
        assert_eq!(run.code, code, "{}", run.err);
        let lines: Vec<Value> =
            run.out.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
        assert!(lines.len() == 1 && !lines[0][key].is_null(), "{}", run.out);
    }
}

/// The tanks have no process noise, so prediction error and output error agree.
#[test]
fn a_fit_by_prediction_error_finds_the_valve_and_that_nothing_strays() {
    let data = recording(120);
    let folder = folder_with(&[("t.dgd", TANKS.as_bytes()), ("d.csv", data.as_bytes())]);
    let fit = |more: &[&str]| {
        let args = ["fit", "t.dgd", "--data", "d.csv", "--valid", "d.csv", "--noise", "declared"];
        let all_args: Vec<&str> = args.iter().chain(more).copied().collect();
        dgd_in(folder.path(), &all_args).done()
    };
    let by_simulation = fit(&["--format", "json"]).json();
    let drawn = ["--estimator", "prediction-error", "-o", "fitted", "--plot", "fit.svg"];
    let text = fit(&drawn).out;
    assert!(text.contains("h_1 strays in a minute") && text.contains("rms, valid"), "{text}");
    // Two outputs of two recordings, each with its innovations.
    let picture = std::fs::read_to_string(folder.path().join("fit.svg")).expect("a picture");
    assert_eq!(picture.matches("innovation of").count(), 4);
    assert_eq!(picture.matches("one row ahead").count(), 4);
    let result = std::fs::read(folder.path().join("fitted/result.json")).expect("a result");
    let fitted: Value = serde_json::from_slice(&result).expect("JSON");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{fitted:#}"));
    let (a, b) = (&fitted["parameters"]["a_1"], &by_simulation["parameters"]["a_1"]);
    let std = number(&b["std"]);
    assert!((number(&a["value"]) - number(&b["value"])).abs() < std, "{a} {b}");
    assert!((number(&a["value"]) - 15.0).abs() < 4.0 * number(&a["std"]), "{a}");
    assert!(number(&fitted["process_noise_in_a_minute"]["h_1"]["value"]) < 5e-3);
    let starts = |fitted: &Value| -> Vec<String> {
        let values = fitted["starts"][0]["values"].as_object().expect("start values");
        values.keys().cloned().collect()
    };
    assert_eq!(starts(&fitted), ["h_1", "h_2"]);
    assert_eq!(starts(&fitted), starts(&by_simulation));
    let rms = number(&fitted["outputs"]["h_1"]["rms_train"]);
    assert!((0.8e-2..1.2e-2).contains(&rms), "{rms}");
    let model = std::fs::read_to_string(folder.path().join("fitted/t.dgd")).expect("a model");
    assert!(!model.contains("= 10  in"), "{model}");
}

/// Elements of an array are tracked like single states.
#[test]
fn elements_are_tracked_like_single_states() {
    let array = "model line\nsize N = 3\nparameter k[1..N] [1/s] = (0.05, 0.02, 0.03)  in 0.001 .. 1\n\
                 input q\nstate T[1..N] = 0.5  noise 0.002 [1/s^(1/2)]\n\
                 equation first: der(T[1]) = k[1]*(q - T[1])\n\
                 for i in 2..N { equation next[i]: der(T[i]) = k[i]*(T[i-1] - T[i]) }\n\
                 output y_1 = T[1]  noise 0.01\noutput y_3 = T[3]  noise 0.01\n";
    let single = "model line\nparameter k[1..3] [1/s] = (0.05, 0.02, 0.03)  in 0.001 .. 1\ninput q\n\
                  state T_1 = 0.5  noise 0.002 [1/s^(1/2)]\nstate T_2 = 0.5  noise 0.002 [1/s^(1/2)]\n\
                  state T_3 = 0.5  noise 0.002 [1/s^(1/2)]\n\
                  equation first: der(T_1) = k[1]*(q - T_1)\nequation n2: der(T_2) = k[2]*(T_1 - T_2)\n\
                  equation n3: der(T_3) = k[3]*(T_2 - T_3)\n\
                  output y_1 = T_1  noise 0.01\noutput y_3 = T_3  noise 0.01\n";
    let row = |k: i32| format!("{},{},{},{}\n", 5 * k, 1 + k % 4, 0.5 + 0.03 * f64::from(k), 0.6);
    let data: String =
        "time [s],q,y_1,y_3\n".chars().map(String::from).chain((0..40).map(row)).collect();
    let folder = folder_with(&[
        ("array.dgd", array.as_bytes()),
        ("single.dgd", single.as_bytes()),
        ("d.csv", data.as_bytes()),
    ]);
    let rows = |model: &str, more: &[&str]| {
        let all_args = [&["track", model, "--data", "d.csv"], more].concat();
        let out = dgd_in(folder.path(), &all_args).done().out;
        out.split_once('\n').map(|(_, rows)| rows.to_owned()).unwrap_or_default()
    };
    for estimator in ["ekf", "ukf"] {
        let more = ["--estimator", estimator];
        assert_eq!(rows("array.dgd", &more), rows("single.dgd", &more), "{estimator}");
    }
    let entries = ["--start-std", "T=0.3", "--process-noise", "T[2]=0.1"];
    let each = [
        "--start-std",
        "T_1=0.3",
        "--start-std",
        "T_2=0.3",
        "--start-std",
        "T_3=0.3",
        "--process-noise",
        "T_2=0.1",
    ];
    assert_eq!(rows("array.dgd", &entries), rows("single.dgd", &each));
}
