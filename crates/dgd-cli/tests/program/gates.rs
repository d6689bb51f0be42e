//! Discoveries on recordings of a pendulum: effects that hold, and effects that fail their own evidence.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{dgd, folder_with, path};

const PENDULUM: &str = "\
model pendulum
parameter g_over_l [1/s^2] = 9.5 in 1 .. 100, log
parameter bearing [1/s] = 0.02 in 0 .. 1, nominal 0.01
state phi [rad] = 1 nominal 1
state w [rad/s] = 0 nominal 1
equation speed: der(phi) = w
equation swing: der(w) = -g_over_l*sin(phi) - bearing*w
output phi [rad] noise 0.002
";

const AIR_DRAG: &str = "\
effect air_drag on pendulum
kind plant
parameter drag [1] = 0 in 0 .. 1, nominal 0.01
null drag = 0
add -drag*w*abs(w) to swing
";

const PUSH: &str = "\
effect push on pendulum
kind plant
parameter force [rad/s^2] = 0 in -5 .. 5, nominal 0.1
parameter since [s] = 10 in 0 ..
null force = 0
add if time > since then force else 0 to swing
";

/// A folder with the model and its effects.
fn folder() -> TempDir {
    let folder = folder_with(&[("pendulum.dgd", PENDULUM.as_bytes())]);
    fs::create_dir(folder.path().join("effects")).expect("a folder");
    for (name, text) in [("air_drag", AIR_DRAG), ("push", PUSH)] {
        fs::write(folder.path().join(format!("effects/{name}.dgd")), text).expect("a file");
    }
    folder
}

/// Simulates the pendulum with air drag, from two angles, with noise.
fn record(folder: &TempDir, drag: &str, until: &str) -> [String; 2] {
    let model = path(folder, "pendulum.dgd");
    let drag = format!("drag={drag}");
    [("a.csv", "phi=1", "1"), ("b.csv", "phi=0.6", "2")].map(|(name, start, seed)| {
        let file = path(folder, name);
        let args = ["simulate", &model, "--apply", "air_drag", "--set", &drag, "--set", start];
        let more = ["--until", until, "--every", "0.05", "--noise-seed", seed, "-o", &file];
        dgd(&[&args[..], &more].concat()).done();
        file
    })
}

fn found(folder: &TempDir, [train, valid]: &[String; 2]) -> Value {
    let model = path(folder, "pendulum.dgd");
    let args = ["discover", &model, "--data", train, "--valid", valid, "--format", "json"];
    dgd(&args).done().json()
}

#[test]
fn the_air_drag_of_a_pendulum_is_found() {
    let folder = folder();
    let result = found(&folder, &record(&folder, "0.05", "40"));
    let effects = result["effects"].as_array().expect("a list");
    let [effect] = effects.as_slice() else { panic!("{}", result["reason"]) };
    assert_eq!(effect["name"], "air_drag", "{}", result["reason"]);
    assert_eq!(effect["evidence"]["p_value"], 0.001);
    let drag = effect["parameters"]["drag"]["value"].as_f64().expect("a number");
    assert!((drag - 0.05).abs() < 1e-3, "{drag}");
}

/// Simulates the pendulum with a push beyond the bounds of its effect.
fn record_pushed(folder: &TempDir, force: f64, since: f64) -> [String; 2] {
    let wide = PUSH.replace("in -5 .. 5", "in -5000 .. 5000");
    let strong =
        folder_with(&[("pendulum.dgd", PENDULUM.as_bytes()), ("push.dgd", wide.as_bytes())]);
    let (model, effect) = (path(&strong, "pendulum.dgd"), path(&strong, "push.dgd"));
    let (force, since) = (format!("force={force}"), format!("since={since}"));
    [("a.csv", "phi=1", "1"), ("b.csv", "phi=0.6", "2")].map(|(name, start, seed)| {
        let file = path(folder, name);
        let args = ["simulate", &model, "--apply", &effect, "--set", &force, "--set", &since];
        let more = ["--set", start, "--until", "20", "--every", "0.05", "--noise-seed", seed];
        dgd(&[&args[..], &more, &["-o", &file]].concat()).done();
        file
    })
}

#[test]
fn a_push_that_spins_the_pendulum_ends_a_search_in_time() {
    let folder = folder();
    let result = found(&folder, &record_pushed(&folder, 8.0, 15.0));
    assert_eq!(result["verdict"], "unexplained", "{}", result["reason"]);
    assert_eq!(result["effects"], Value::Array(Vec::new()));
}

#[test]
fn what_one_reading_says_is_given_no_name() {
    let folder = folder();
    let recordings = record(&folder, "0", "20");
    for file in &recordings {
        // The last reading is half a radian off, as if something had begun just before it, or a push without bounds.
        let text = fs::read_to_string(file).expect("a recording");
        let (before, last) = text.trim_end().rsplit_once('\n').expect("rows");
        let header = text.lines().next().expect("a header");
        let column = header.split(',').position(|name| name.starts_with("phi")).expect("an angle");
        let mut cells: Vec<String> = last.split(',').map(str::to_owned).collect();
        let angle: f64 = cells[column].parse().expect("a number");
        cells[column] = (angle + 0.5).to_string();
        fs::write(file, format!("{before}\n{}\n", cells.join(","))).expect("a file");
    }
    let result = found(&folder, &recordings);
    assert_eq!(result["verdict"], "unexplained", "{}", result["reason"]);
    assert_eq!(result["effects"], Value::Array(Vec::new()));
    let notes = |name: &str| {
        let rows = result["ranking"].as_array().expect("a list").iter();
        let row = rows.clone().find(|row| row["effects"] == serde_json::json!([name]));
        row.unwrap_or_else(|| panic!("{name} was not fitted"))["note"].to_string()
    };
    let late = notes("unmeasured_flow(speed)");
    assert!(late.contains("only 1 reading comes after the onset"), "{late}");
    assert!(notes("push").contains("`force` is at its bound"), "{}", notes("push"));
}
