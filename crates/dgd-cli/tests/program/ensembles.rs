//! `dgd simulate --ensemble`.

use std::fs;

use crate::support::{column, dgd, dgd_in, folder_with, path};

const TANK: &str = "tests/golden/data/model.dgd";
const DATA: &str = "tests/golden/data/good.csv";
/// The second set leaves h to the model, the third k.
const SETS: &[u8] = b"k [1],h [mm]\n1,1000\n1.5,\n,1200\n0.5,900\n";

#[test]
fn each_set_gives_what_a_run_with_its_values_gives() {
    let folder = folder_with(&[("sets.csv", SETS)]);
    let sets = path(&folder, "sets.csv");
    let entries = dgd(&["simulate", TANK, "--data", DATA, "--ensemble", &sets]).done().out;
    let header = entries.lines().next().expect("a header");
    let numbers = column(&entries, "set [1]");
    for (number, settings) in
        [vec!["k=1", "h=1"], vec!["k=1.5"], vec!["h=1.2"], vec!["k=0.5", "h=0.9"]]
            .iter()
            .enumerate()
    {
        let mut words = vec!["simulate", TANK, "--data", DATA];
        words.extend(settings.iter().flat_map(|setting| ["--set", *setting]));
        let one = dgd(&words).done().out;
        let single = one.lines().next().expect("a header");
        assert_eq!(header, format!("set [1],{single}"));
        let rows: Vec<usize> =
            (0..numbers.len()).filter(|k| numbers[*k] == number as f64 + 1.0).collect();
        for name in single.split(',') {
            let (of_set, alone) = (column(&entries, name), column(&one, name));
            assert_eq!(rows.len(), alone.len());
            for (row, alone) in rows.iter().zip(alone) {
                // Both within a few rtol = 1e-6 of the solution.
                let far = (of_set[*row] - alone).abs();
                assert!(far <= 1e-5 * alone.abs(), "{settings:?} {name}: {far}");
            }
        }
    }
}

#[test]
fn files_are_the_same_for_any_number_of_threads() {
    let rows: Vec<String> = (0..40).map(|k| format!("{}\n", 0.5 + 0.02 * f64::from(k))).collect();
    let rows = rows.concat();
    let folder = folder_with(&[("sets.csv", format!("k [1]\n{rows}").as_bytes())]);
    let sets = path(&folder, "sets.csv");
    let run = |threads: &str, out: &str| {
        let out = path(&folder, out);
        let words = ["simulate", TANK, "--data", DATA, "--ensemble", &sets];
        let run = dgd(&[&words[..], &["--threads", threads, "-o", &out]].concat()).done();
        assert!(run.err.contains("40 sets"), "{}", run.err);
        fs::read(out).expect("the result")
    };
    let one = run("1", "one.csv");
    assert_eq!(run("2", "two.csv"), one);
    assert_eq!(run("3", "three.csv"), one);
}

#[test]
fn programs_are_told_the_same() {
    let folder = folder_with(&[("sets.csv", SETS)]);
    let sets = path(&folder, "sets.csv");
    let words = ["simulate", TANK, "--data", DATA, "--ensemble", &sets];
    let table = dgd(&words).done().out;
    let document = dgd(&[&words[..], &["--format", "json"]].concat()).done().json();
    assert_eq!(document["sets"], 4);
    assert_eq!(document["failed"], serde_json::json!([]));
    let h = document["columns"].as_array().expect("columns").iter().find(|c| c["name"] == "h");
    let h: Vec<f64> =
        serde_json::from_value(h.expect("a state")["values"].clone()).expect("numbers");
    // The JSON reader may round the last bit differently.
    for (document, written) in h.iter().zip(column(&table, "h [m]")) {
        assert!((document - written).abs() <= 2.0 * f64::EPSILON * written.abs());
    }
    assert_eq!(document["set"].as_array().map(Vec::len), Some(h.len()));
}

#[test]
fn sets_that_fail_are_named_and_the_others_written() {
    // ẋ = c x² from 1 ends at 1/c.
    let model = b"model explosion\n\nparameter c [1/s] = 1\n\nstate x [1] = 1\n\n\
        equation growth: der(x) = c*x^2\n";
    let folder = folder_with(&[("m.dgd", model), ("sets.csv", b"c [1/s]\n0.1\n2\n0.2\n")]);
    let words = ["simulate", "m.dgd", "--until", "1", "--every", "0.5", "--ensemble", "sets.csv"];
    let run = dgd_in(folder.path(), &words);
    run.refused(3, &["1 of 3 sets", "set 2", "x"]);
    assert_eq!(column(&run.out, "set [1]"), [1.0, 1.0, 1.0, 3.0, 3.0, 3.0]);
    let document = dgd_in(folder.path(), &[&words[..], &["--format", "json"]].concat());
    assert_eq!(document.json()["failed"][0]["set"], 2);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let files: [(&str, &[u8]); 3] =
        [("sets.csv", SETS), ("typo.csv", b"K [1]\n1\n"), ("timed.csv", b"time [s],k [1]\n0,1\n")];
    let folder = folder_with(&files);
    let run = |sets: &str, more: &[&str]| {
        let sets = path(&folder, sets);
        dgd(&[&["simulate", TANK, "--data", DATA, "--ensemble", &sets], more].concat())
    };
    run("typo.csv", &[]).refused(1, &["E613", "`K` is neither", "meant to be `k`"]);
    run("timed.csv", &[]).refused(1, &["E613", "no time"]);
    run("none.csv", &[]).refused(1, &["none.csv"]);
    run("sets.csv", &["--noise-seed", "1"]).refused(2, &["--noise-seed"]);
    run("sets.csv", &["--start", "measured"]).refused(2, &["--start measured"]);
    run("sets.csv", &["--plot", "a.gif"]).refused(2, &["a.gif"]);
}

#[test]
fn a_picture_shows_where_the_sets_are() {
    let folder = folder_with(&[("sets.csv", SETS)]);
    let (sets, picture) = (path(&folder, "sets.csv"), path(&folder, "fan.svg"));
    dgd(&["simulate", TANK, "--data", DATA, "--ensemble", &sets, "--plot", &picture]).done();
    let svg = fs::read_to_string(picture).expect("a picture");
    for part in ["median", "50 %", "90 %", "measured"] {
        assert!(svg.contains(part), "{part}");
    }
}
