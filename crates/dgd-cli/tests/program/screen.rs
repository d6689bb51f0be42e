//! `dgd screen` on recordings with known faults and on sound ones.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;

use crate::support::{column, dgd, dgd_in, folder_with, listing, path, root};

const MODEL: &str = "models/mud_circulation.dgd";

/// The findings of the first recording.
fn findings(json: &Value) -> &Vec<Value> {
    json["recordings"][0]["findings"].as_array().expect("a list")
}

/// Kinds and columns of its faults.
fn faults(json: &Value) -> Vec<(String, Vec<String>)> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    findings(json)
        .iter()
        .filter(|finding| finding["severity"] == "fault")
        .map(|finding| {
            let channels = finding["channels"].as_array().expect("a list");
            (text(&finding["kind"]), channels.iter().map(text).collect())
        })
        .collect()
}

fn screened(args: &[&str]) -> Value {
    dgd(&[&["screen", "--format", "json"], args].concat()).done().json()
}

#[track_caller]
fn near(finding: &Value, truth: f64, most: f64) {
    let amount = &finding["amount"];
    let (value, half) = (
        amount["value"].as_f64().expect("a number"),
        amount["half_width"].as_f64().expect("an interval"),
    );
    assert!((value - truth).abs() <= half, "{amount}, truth {truth}");
    assert!(half <= most, "{amount}");
}

/// examples/data/field/truth.json: inlet B reads 0.5 bar too high; outlet A 0.06 too high, B 0.06 too low.
#[test]
fn the_offsets_of_the_field_data_are_found_and_laid_to_the_right_sensor() {
    for name in ["no_flow", "normal_circulation", "booster_ramps", "pump_tests"] {
        let json = screened(&["--data", &format!("examples/data/field/{name}.csv.gz"), MODEL]);
        let offsets: Vec<&Value> =
            findings(&json).iter().filter(|finding| finding["kind"] == "offset").collect();
        assert_eq!(offsets.len(), 2, "{name}");
        near(offsets[0], 0.5, 0.002);
        near(offsets[1], -0.12, 0.002);
        assert_eq!(offsets[0]["advice"], "drop `p_in_B`, or take its offset off", "{name}");
        let advice = offsets[1]["advice"].as_str().expect("a sentence");
        assert!(advice.starts_with("average them"), "{name}: {advice}");
        // Without flow the model determines both sides of the pump.
        if name == "no_flow" {
            assert_eq!(advice, "average them");
            let text = offsets[1]["text"].as_str().expect("a sentence");
            assert!(text.contains("their mean agrees with the model"), "{text}");
        }
    }
}

/// θ₁ = 0.951: the meter reads 1/0.951 of the flow, and the integrated level drifts by 39 m in an hour
/// (examples/data/field/README.md).
#[test]
fn the_balance_of_normal_circulation_shows_the_flow_meters_gain() {
    let json = screened(&["--data", "examples/data/field/normal_circulation.csv.gz", MODEL]);
    let balance = findings(&json).iter().find(|finding| finding["kind"] == "balance");
    let balance = balance.expect("the level runs away");
    near(balance, -39.2, 2.0);
    let text = balance["text"].as_str().expect("a sentence");
    // 1/0.951 = 1.0515.
    assert!(text.contains("as if `q_ssp` read 1.05"), "{text}");
}

#[test]
fn sound_recordings_have_no_fault() {
    // Faults that only a model reveals: the meters of `case_1` and `case_2` read 1/0.951 of the flow. In `booster_stop`
    // the booster line drains, so that its balance does not close.
    let entries = ["circulation", "booster_stop.train", "booster_stop.valid", "case_1", "case_2"];
    for data in entries {
        let path = format!("examples/data/{data}.csv");
        let json = screened(&["--data", &path]);
        assert_eq!(faults(&json), [], "{data}");
        assert_eq!(json["faults"], 0);
        let json = screened(&["--data", &path, MODEL]);
        let kinds: Vec<String> = faults(&json).into_iter().map(|(kind, _)| kind).collect();
        let expected: &[&str] = match data {
            "circulation" => &[],
            "case_1" | "case_2" => &["balance"],
            _ => continue,
        };
        assert_eq!(kinds, expected, "{data}");
    }
    dgd(&["screen", "--check", "--data", "examples/data/circulation.csv", MODEL]).done();
    let data = "examples/data/field/no_flow.csv.gz";
    dgd(&["screen", "--check", "--data", data]).refused(1, &["2 faults were found"]);
}

/// A recording as text, changed cell by cell; row 0 is the first below the header.
fn changed(change: impl Fn(usize, &str, &str) -> Option<String>) -> String {
    let text = fs::read_to_string(root().join("examples/data/circulation.csv")).expect("a file");
    let mut lines = text.lines();
    let head = lines.next().expect("a header");
    let names: Vec<&str> =
        head.split(',').map(|cell| cell.split(' ').next().unwrap_or("")).collect();
    let mut out = format!("{head}\n");
    for (row, line) in lines.enumerate() {
        let cells = line.split(',').zip(&names);
        let cells: Vec<String> =
            cells.map(|(cell, name)| change(row, name, cell).unwrap_or(cell.into())).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{}", cells.join(","));
    }
    out
}

fn of_changed(change: impl Fn(usize, &str, &str) -> Option<String>, args: &[&str]) -> Value {
    let folder = folder_with(&[("a.csv", changed(change).as_bytes())]);
    let data = path(&folder, "a.csv");
    screened(&[&["--data", data.as_str()], args].concat())
}

#[test]
fn each_planted_fault_is_the_one_that_is_found() {
    let one = |kind: &str, column: &str| vec![(kind.to_owned(), vec![column.to_owned()])];
    let number = |cell: &str| cell.parse::<f64>().expect("a number");
    let frozen = of_changed(
        |row, name, _| ((2000..2100).contains(&row) && name == "p_out").then(|| "35".into()),
        &[MODEL],
    );
    assert_eq!(faults(&frozen), one("frozen", "p_out"));
    assert_eq!(findings(&frozen)[0]["windows"], serde_json::json!([[2000.0, 2099.0]]));
    let spikes = of_changed(
        |row, name, cell| {
            (row % 700 == 350 && name == "q_ssp").then(|| format!("{}", number(cell) + 400.0))
        },
        &[MODEL],
    );
    assert_eq!(faults(&spikes), one("spikes", "q_ssp"));
    let saturated = of_changed(
        |_, name, cell| (name == "p_r").then(|| format!("{:.3}", number(cell).min(29.2))),
        &[],
    );
    assert_eq!(faults(&saturated), one("saturated", "p_r"));
    let empty = of_changed(|_, name, _| (name == "p_in").then(String::new), &[]);
    assert_eq!(faults(&empty), one("empty", "p_in"));
    let words = of_changed(|row, name, _| (row == 7 && name == "p_in").then(|| "Bad".into()), &[]);
    assert_eq!(faults(&words), one("not_a_number", "p_in"));
    // 0.4 bar off at the riser: both pressures are named, because two sensors do not determine which is off.
    let off = of_changed(
        |_, name, cell| (name == "p_r").then(|| format!("{:.3}", number(cell) + 0.4)),
        &[MODEL],
    );
    let both = vec!["p_r".to_owned(), "p_in".to_owned()];
    assert_eq!(faults(&off), [("disagrees".to_owned(), both)]);
    near(&findings(&off)[0], 0.4, 0.01);
}

#[test]
fn times_that_go_back_are_a_finding_here_and_refused_elsewhere() {
    // The clock is set back by a minute after 1000 s, and later forward again.
    let text = changed(|row, name, _| {
        (name == "time" && (1000..1060).contains(&row)).then(|| format!("{}", row - 60))
    });
    let folder = folder_with(&[("a.csv", text.as_bytes())]);
    let data = path(&folder, "a.csv");
    let json = screened(&["--data", &data]);
    assert_eq!(faults(&json)[0].0, "time_backwards");
    let text = findings(&json)[0]["text"].as_str().expect("a sentence");
    assert!(text.contains("`940` comes after `999`"), "{text}");
    dgd(&["fit", MODEL, "--data", &data]).refused(1, &["time runs backwards"]);
}

#[test]
fn a_model_names_columns_that_it_does_not_know_and_units_that_clash() {
    let folder = folder_with(&[("a.csv", &b""[..])]);
    let data = path(&folder, "a.csv");
    let text = changed(|_, _, _| None);
    let renamed = text.replacen("p_r [bara]", "P_RIS [bara]", 1);
    fs::write(&data, renamed.replacen("p_in [barg]", "p_in [m]", 1)).expect("writable");
    let json = screened(&["--data", &data, MODEL]);
    let value_of = |kind: &str| findings(&json).iter().find(|f| f["kind"] == kind).cloned();
    assert_eq!(value_of("unknown_column").expect("a remark")["channels"][0], "P_RIS");
    assert_eq!(value_of("unit").expect("a fault")["channels"][0], "p_in");
    // Renamed to a name of the model, the column is known in every command that reads data.
    let json = screened(&["--data", &data, "--rename", "P_RIS=p_r", MODEL]);
    assert!(findings(&json).iter().all(|f| f["kind"] != "unknown_column"));
    dgd(&["screen", "--data", &data, "--rename", "P_RISE=p_r"])
        .refused(1, &["there is no column `P_RISE`", "did you mean `P_RIS`?"]);
}

#[test]
fn columns_without_any_value_are_told_by_commands_that_run_a_model() {
    let folder = folder_with(&[]);
    let without = |column: &str| {
        let name = format!("{column}.csv");
        let text = changed(|_, name, _| (name == column).then(String::new));
        fs::write(folder.path().join(&name), text).expect("the folder is writable");
        path(&folder, &name)
    };
    let fit = dgd(&["fit", MODEL, "--data", &without("p_in"), "--format", "json"]).done();
    assert!(fit.err.contains("the column `p_in` has no value in any row"), "{}", fit.err);
    assert!(fit.json()["outputs"]["p_in"]["rms_train"].is_null(), "{}", fit.out);
    dgd(&["fit", MODEL, "--data", &without("q_tf")])
        .refused(1, &["the input `q_tf` has no value in any row"]);
}

/// Rows of a moving pressure in bar from two sensors, with the second reading changed.
fn pressures(change: impl Fn(f64) -> f64) -> String {
    let mut text = String::new();
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    for k in 0..1200 {
        let p = 20.0 + if k < 600 { 0.0 } else { 2.0 };
        let (a, b) = (p + 0.02 * noise(), change(p + 0.02 * noise()));
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{k},{a:.4},{b:.6}");
    }
    text
}

#[test]
fn columns_are_compared_in_one_unit() {
    let bars = format!("time [s],p_A [bara],p_B [barg]\n{}", pressures(|p| p - 1.01325));
    let pascals = format!("time [s],p_A [bara],p_B [Pa]\n{}", pressures(|p| 1e5 * p));
    let flow = format!("time [s],p_A [bara],p_B [lpm]\n{}", pressures(|p| p));
    let bare = format!("time [s],p_A [bara],p_B\n{}", pressures(|p| p));
    let folder = folder_with(&[
        ("bars.csv", bars.as_bytes()),
        ("pascals.csv", pascals.as_bytes()),
        ("flow.csv", flow.as_bytes()),
        ("bare.csv", bare.as_bytes()),
    ]);
    let run = |args: &[&str]| dgd_in(folder.path(), &[&["screen"], args].concat());
    // Gauge and absolute pressure differ by one atmosphere, which is not a fault.
    let json = run(&["--data", "bars.csv", "--same", "p_A,p_B", "--format", "json"]).done().json();
    assert_eq!(faults(&json), []);
    let pair = &json["recordings"][0]["redundant"][0];
    let offset = pair["offset"]["value"].as_f64().expect("a number");
    // Both read the same up to a noise of 0.02/√12 bar, in means over 1200 rows.
    assert!(offset.abs() < 5.0 * 0.02 / 12f64.sqrt() * (2.0 / 1200f64).sqrt(), "{pair}");
    assert_eq!(json["recordings"][0]["columns"][1]["unit"], "bara");

    // One table of all recordings, in the unit of the first.
    run(&["--data", "bars.csv", "--data", "pascals.csv", "-o", "out"]).done();
    let steady = fs::read_to_string(folder.path().join("out/steady.csv")).expect("a table");
    let means = column(&steady, "p_B [barg]");
    assert_eq!(means.len(), 4, "{steady}");
    // The unit Pa does not distinguish gauge from absolute pressure.
    for (mean, truth) in means.iter().zip([18.987, 20.987, 20.0, 22.0]) {
        assert!((mean - truth).abs() < 0.01, "{mean} {truth}");
    }
    let clash = &["`p_B` is in `lpm`", "does not convert to `barg`", "--rename"];
    run(&["--data", "bars.csv", "--data", "flow.csv"]).refused(1, clash);
    let clash = &["`p_B` is in `lpm`", "does not convert to `bara`"];
    run(&["--data", "flow.csv", "--same", "p_A,p_B"]).refused(1, clash);
    let bare = ["--data", "bare.csv", "--same", "p_A,p_B"];
    run(&bare).refused(1, &["the column `p_B` has no unit", "write `p_B [bara]`"]);
    run(&[&bare[..], &["--rename", "p_B=p_B [bara]"]].concat()).done();
}

#[test]
fn what_is_said_to_measure_the_same_and_does_not_is_told() {
    let apart = format!("time [s],p [bar],back [bar]\n{}", pressures(|p| 3.0 * p - 40.0));
    let few = format!("time [s],p [bar],few [bar]\n{}", pressures(|_| f64::NAN));
    let few = few.replacen("NaN", "20.01", 3);
    let folder = folder_with(&[("apart.csv", apart.as_bytes()), ("few.csv", few.as_bytes())]);
    let result = |data: &str, same: &str| {
        let args = ["screen", "--data", data, "--same", same, "--format", "json"];
        let json = dgd_in(folder.path(), &args).done().json();
        let about =
            findings(&json).iter().find(|f| f["channels"].as_array().is_some_and(|c| c.len() == 2));
        about.cloned().unwrap_or_else(|| panic!("{json:#}"))
    };
    let unlike = result("apart.csv", "p,back");
    assert_eq!((&unlike["kind"], &unlike["severity"]), (&"unlike".into(), &"fault".into()));
    let untold = result("few.csv", "p,few");
    assert_eq!((&untold["kind"], &untold["severity"]), (&"untold".into(), &"remark".into()));
    let both = ["screen", "--data", "apart.csv", "--data", "few.csv", "--same", "back,few"];
    dgd_in(folder.path(), &both).refused(2, &["no recording has both `back` and `few`"]);
}

#[test]
fn columns_that_move_in_opposite_directions_are_said_to() {
    let about = |p: f64| 42.0 - p;
    let [near, far] = [pressures(about), pressures(|p| -p)];
    let [near, far] = [near, far].map(|rows| format!("time [s],p [bar],back [bar]\n{rows}"));
    let folder = folder_with(&[("near.csv", near.as_bytes()), ("far.csv", far.as_bytes())]);
    let run = |args: &[&str]| dgd_in(folder.path(), &[&["screen"], args].concat()).done();
    for data in ["near.csv", "far.csv"] {
        let args = ["--data", data, "--same", "p,back"];
        let json = run(&[&args[..], &["--format", "json"]].concat()).json();
        let names = ["p", "back"].map(str::to_owned).to_vec();
        assert_eq!(faults(&json), [("opposed".to_owned(), names)], "{json:#}");
        let text = run(&args).out;
        assert!(
            text.contains("`p` and `back` move in opposite directions, correlation -1.00"),
            "{text}"
        );
        assert!(text.contains("is the sign of one of them wrong?"), "{text}");
    }
    // Without `--same`, they are not known to measure the same quantity.
    assert_eq!(faults(&run(&["--data", "near.csv", "--format", "json"]).json()), []);
}

#[test]
fn a_check_that_finds_faults_prints_one_document() {
    let data = "examples/data/field/no_flow.csv.gz";
    let run = dgd(&["screen", "--check", "--data", data, "--format", "json"]);
    run.refused(1, &["2 faults were found"]);
    assert_eq!(run.json()["faults"], 2);
}

#[test]
fn the_folder_and_the_picture_are_written_and_the_same_every_time() {
    let folder = folder_with(&[]);
    let run = |out: &str| {
        let picture = format!("{out}.svg");
        let args = ["screen", "--data", "examples/data/field/normal_circulation.csv.gz", MODEL];
        let (out, picture) = (path(&folder, out), path(&folder, &picture));
        dgd(&[&args[..], &["-o", &out, "--plot", &picture]].concat()).done();
        ["screen.json", "steady.csv"].map(|name| fs::read(format!("{out}/{name}")).expect(name))
    };
    assert_eq!(run("one"), run("two"));
    assert_eq!(listing(&folder), ["one", "one.svg", "two", "two.svg"]);
    let page = fs::read_to_string(folder.path().join("one/report.html")).expect("a page");
    assert!(page.contains("<svg") && page.contains("p_in_B"), "{page}");
    // Steady intervals are a table of independent rows.
    let steady = fs::read_to_string(folder.path().join("one/steady.csv")).expect("a table");
    let mut lines = steady.lines();
    let cells = lines.next().unwrap_or_default().split(',').count();
    assert!(steady.lines().count() > 5 && lines.all(|line| line.split(',').count() == cells));
}

#[test]
fn what_the_options_name_must_be_there() {
    let data = "examples/data/field/no_flow.csv.gz";
    dgd(&["screen", "--data", data, "--same", "p_in_A,p_in_C"])
        .refused(2, &["no column is called `p_in_C`", "did you mean"]);
    dgd(&["screen", "--data", data, "--rest", "p_r"]).refused(2, &["NAME=RATE"]);
    dgd(&["screen", "--data", data, "--window", "0"]).refused(2, &["a length of time"]);
    let folder = folder_with(&[("rows.csv", b"x [m],y [m]\n1,2\n")]);
    dgd_in(folder.path(), &["screen", "--data", "rows.csv"]).refused(1, &["no time column"]);
}
