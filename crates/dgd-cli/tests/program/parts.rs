//! Models with parts on the command line: dotted names in settings, variants, data and results.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{column, dgd, folder_with, path};

const CASCADE: &str = "\
model cascade
import \"tank.dgd\"
input q [m^3/s] linear   # measured
part upper: tank(h = 2)
part lower: tank
upper.q_in = q
lower.q_in = upper.q_out
output upper.h [m] noise 1 [mm]
output level [m] = lower.h noise 1 [mm]
";

const TANK: &str = "\
model tank
constant A [m^2] = 1
input q_in [m^3/s] linear
parameter k [m^2/s] = 0.02 in 0 .. 1
state h [m] = 1
equation level: A*der(h) = q_in - q_out
let q_out = k*h
variant wall { round { let side = 1 } square { let side = 4 } }
";

/// A folder with the model, data of its input, and effects.
fn folder(effects: &[(&str, &str)]) -> TempDir {
    let data = inputs();
    let files: [(&str, &[u8]); 3] = [
        ("cascade.dgd", CASCADE.as_bytes()),
        ("tank.dgd", TANK.as_bytes()),
        ("data.csv", data.as_bytes()),
    ];
    let folder = folder_with(&files);
    fs::create_dir(folder.path().join("effects")).expect("the folder is writable");
    for (name, text) in effects {
        fs::write(folder.path().join("effects").join(name), text).expect("it is writable");
    }
    folder
}

fn inputs() -> String {
    let mut text = "time [s],q [m^3/s]\n".to_owned();
    for i in 0..=200 {
        let _ = writeln!(text, "{i},{}", if i < 100 { 0.01 } else { 0.04 });
    }
    text
}

#[test]
fn names_with_points_are_names() {
    let folder = folder(&[]);
    let model = path(&folder, "cascade.dgd");
    let shown = dgd(&["check", &model]).done();
    assert!(shown.err.contains("part upper: tank; part lower: tank"), "{}", shown.err);
    let data = path(&folder, "data.csv");
    let args = ["simulate", &model, "--data", &data];
    let more = ["--set", "lower.k=0", "--set", "lower.h=3", "--variant", "lower.wall=square"];
    let out = dgd(&[&args[..], &more].concat()).done().out;
    // The lower tank has no outlet, so the total volume grows by the inflow: h' = q is exact.
    let (upper, lower) = (column(&out, "upper.h [m]"), column(&out, "lower.h [m]"));
    assert_eq!((upper[0], lower[0]), (2.0, 3.0));
    // 1 m^3 until 99 s, the ramp between two samples, 4 m^3 from 100 s on.
    let came_in = 0.99 + 0.025 + 4.0;
    assert!((upper[200] + lower[200] - 5.0 - came_in).abs() < 1e-4, "{}", lower[200]);
    let to_args = ["--of", "level", "--to", "upper.k,lower.k"];
    let out = dgd(&[&["sensitivity", &model, "--data", &data][..], &to_args].concat()).done().out;
    assert!(out.starts_with("time [s],d(level)/d(upper.k) "), "{out}");
    dgd(&[&args[..], &["--set", "upper.q_in=1"]].concat()).refused(1, &["E205", "upper.q_in"]);
}

#[test]
fn a_fit_of_what_parts_declare_becomes_their_arguments() {
    let folder = folder(&[]);
    let (model, data) = (path(&folder, "cascade.dgd"), path(&folder, "data.csv"));
    let truth = ["--set", "upper.k=0.03", "--set", "lower.k=0.05", "--set", "lower.h=1.5"];
    let recording = path(&folder, "recording.csv");
    let simulate = ["simulate", &model, "--data", &data, "-o", &recording];
    dgd(&[&simulate[..], &truth].concat()).done();

    let goal = path(&folder, "fitted");
    dgd(&["fit", &model, "--data", &recording, "-o", &goal]).done();
    let result = fs::read_to_string(format!("{goal}/result.json")).expect("a result");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    for (name, k) in [("upper.k", 0.03), ("lower.k", 0.05)] {
        let estimate = result["parameters"][name]["value"].as_f64().expect("a number");
        // Data without noise, to the tolerance of both simulations.
        assert!((estimate / k - 1.0).abs() < 1e-4, "{name} = {estimate}");
    }
    let fitted = fs::read_to_string(format!("{goal}/cascade.dgd")).expect("a model");
    assert!(fitted.contains("import \"../tank.dgd\""), "{fitted}");
    assert!(fitted.contains("part upper: tank(h = ") && fitted.contains(", k = 0.0"), "{fitted}");
    assert!(fitted.contains("part lower: tank(h = "), "{fitted}");
    let fitted = format!("{goal}/cascade.dgd");
    let again = dgd(&["simulate", &fitted, "--data", &data]).done().out;
    let recorded = fs::read_to_string(recording).expect("the recording");
    let (a, b) = (column(&again, "level [m]"), column(&recorded, "level [m]"));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-3), "{:?}", a.last());
}

#[test]
fn the_text_of_a_model_with_parts_reads_back_beside_what_it_imports() {
    let folder = folder(&[]);
    let (model, data) = (path(&folder, "cascade.dgd"), path(&folder, "data.csv"));
    let written = path(&folder, "written.dgd");
    let emitted = dgd(&["emit", &model, "--stage", "ast"]).done().out;
    fs::write(&written, emitted).expect("the folder is writable");
    let simulated = |model: &str| dgd(&["simulate", model, "--data", &data]).done().out;
    assert_eq!(simulated(&written), simulated(&model));
}

#[test]
fn the_text_of_a_model_whose_part_was_changed_is_that_model() {
    let leak = "effect leak on cascade\nkind plant\nparameter loss [m^3/s] = 0.002\nnull loss = 0\n\
                add -loss to lower.level\n";
    let offset = "effect offset(y: output [m])\nkind sensor\nparameter offset [m] = 0.1\n\
                  null offset = 0\nreplace output y by y + offset\n";
    let folder = folder(&[("leak.dgd", leak), ("offset.dgd", offset)]);
    let (model, data) = (path(&folder, "cascade.dgd"), path(&folder, "data.csv"));
    let with = ["--apply", "leak", "--apply", "offset(upper.h)", "--set", "offset_upper.h=0.2"];
    let simulate = ["simulate", &model, "--data", &data];
    let changed = dgd(&[&simulate[..], &with].concat()).done().out;
    let emitted = dgd(&[&["emit", &model, "--stage", "ast"][..], &with[..4]].concat()).done().out;
    assert!(emitted.contains("part upper: tank(h = 2)\n# part lower: tank\n"), "{emitted}");
    assert!(emitted.contains("input q [m^3/s] linear   # measured"), "{emitted}");
    let written = path(&folder, "written.dgd");
    fs::write(&written, emitted).expect("the folder is writable");
    dgd(&["check", &written]).done();
    let again = ["simulate", &written, "--data", &data, "--set", "offset_upper.h=0.2"];
    assert_eq!(dgd(&again).done().out, changed);
}
