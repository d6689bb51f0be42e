//! The first ten minutes: a project, its five commands, and data in foreign formats.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{Run, dgd, dgd_in, folder_with, path, piped};

const TEMPLATES: [&str; 8] =
    ["motor", "tank", "exchanger", "battery", "reactor", "circuit", "vehicle", "drilling"];

/// The commands of a project's README.
fn commands(folder: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(folder.join("README.md")).expect("a README");
    let block = text.split("```").nth(1).expect("commands");
    let lines = block.lines().filter_map(|line| line.strip_prefix("dgd "));
    lines.map(|line| line.split_whitespace().map(str::to_owned).collect()).collect()
}

fn begun(folder: &TempDir, template: &str) -> std::path::PathBuf {
    let project = folder.path().join(template);
    dgd(&["new", &project.display().to_string(), "--template", template]).done();
    project
}

/// Runs the commands of a template's README; the hidden effect must be named, and no other.
fn follow(template: &str) {
    let folder = folder_with(&[]);
    let project = begun(&folder, template);
    let commands = commands(&project);
    assert_eq!(commands.len(), 5, "{template}");
    for words in &commands {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        dgd_in(&project, &words).done();
    }
    let json = |name: &str| -> Value {
        let text = fs::read_to_string(project.join(name)).expect("it was written");
        serde_json::from_str(&text).expect("JSON")
    };
    let truth = json("truth.json");
    let hidden = truth.get("effects").or_else(|| truth["booster_stop"].get("effects"));
    let hidden = hidden.and_then(|all| all[0].as_str()).expect("an effect is hidden").to_owned();
    let result = json("found/result.json");
    let named: Vec<&str> = result["effects"]
        .as_array()
        .expect("a list of effects")
        .iter()
        .filter_map(|effect| effect["name"].as_str())
        .collect();
    assert_eq!(named, [hidden.as_str()], "{template}");
}

#[test]
fn the_commands_of_a_template_find_what_is_hidden() {
    follow("tank");
}

#[test]
#[ignore = "minutes: .ci/nightly runs it"]
fn the_commands_of_every_template_find_what_is_hidden() {
    for template in TEMPLATES {
        follow(template);
    }
}

#[test]
fn every_template_is_sound() {
    let folder = folder_with(&[]);
    for template in TEMPLATES {
        let project = begun(&folder, template);
        let check = &commands(&project)[0];
        let words: Vec<&str> = check.iter().map(String::as_str).collect();
        dgd_in(&project, &words).done();
        let effects = fs::read_dir(project.join("effects")).expect("a library").flatten();
        for effect in effects.filter(|entry| entry.path().is_file()) {
            let file = effect.path().display().to_string();
            dgd_in(&project, &["check", &file]).done();
        }
        let again = dgd(&["new", &project.display().to_string(), "--template", template]);
        again.refused(1, &["is there already"]);
    }
}

#[test]
fn a_project_needs_a_source() {
    let folder = folder_with(&[]);
    dgd(&["new", &path(&folder, "a")]).refused(2, &["--from", "--template"]);
    let run = dgd(&["new", &path(&folder, "a"), "--template", "rocket"]);
    run.refused(2, &["rocket", "motor", "drilling"]);
}

/// A first-order lag driven by steps, without noise: 2 s, gain 3, computed in closed form.
fn lag_csv(header: &str, time: impl Fn(usize) -> String) -> String {
    let mut text = format!("{header}\n");
    let mut y = 0.5;
    for k in 0..200 {
        let u = if (k / 25) % 2 == 0 { 1.0 } else { 2.0 };
        writeln!(text, "{},{u},{y:.6}", time(k)).expect("a string takes all");
        let rest = 3.0 * u;
        y = rest + (y - rest) * (-0.2_f64 / 2.0).exp();
    }
    text
}

fn seconds(k: usize) -> String {
    format!("{:.1}", 0.2 * k as f64)
}

#[test]
fn a_skeleton_of_a_recording_runs_and_is_fitted() {
    let csv = lag_csv("t,u [V],y [m]", seconds);
    let folder = folder_with(&[("run.csv", csv.as_bytes())]);
    let made = dgd_in(folder.path(), &["new", "plant", "--from", "run.csv"]).done();
    assert!(made.err.contains("inputs: `u`; outputs: `y`"), "{}", made.err);
    let project = folder.path().join("plant");
    for words in commands(&project).iter().take(3) {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        dgd_in(&project, &words).done();
    }
    let text = fs::read_to_string(project.join("fitted/result.json")).expect("it was written");
    let fitted: Value = serde_json::from_str(&text).expect("JSON");
    let value = |name: &str| fitted["parameters"][name]["value"].as_f64().expect("a number");
    assert!((value("tau_y") - 2.0).abs() < 1e-3, "{}", value("tau_y"));
    assert!((value("k_y_u") - 3.0).abs() < 1e-3, "{}", value("k_y_u"));
    // The same for compressed text, which is copied, and for a binary table.
    let files = [("zipped", "run.csv.gz"), ("binary", "run.parquet")];
    for (name, file) in files.into_iter().take(if cfg!(feature = "parquet") { 2 } else { 1 }) {
        let run = ["simulate", "plant/plant.dgd", "--data", "plant/data.csv", "-o", file];
        dgd_in(folder.path(), &run).done();
        let made = dgd_in(folder.path(), &["new", name, "--from", file]).done();
        assert!(made.err.contains("inputs: `u`; outputs: `y`"), "{}", made.err);
        let read = |path: &str| {
            let model = "plant/plant.dgd";
            dgd_in(folder.path(), &["simulate", model, "--data", path]).done().out
        };
        assert_eq!(read(&format!("{name}/data.csv")), read("plant/data.csv"), "{file}");
        let (project, model) = (folder.path().join(name), format!("{name}.dgd"));
        dgd_in(&project, &["check", &model]).done();
        dgd_in(&project, &["fit", &model, "--data", "data.csv"]).done();
    }
    let named = dgd_in(folder.path(), &["new", "b", "--from", "run.csv", "--outputs", "z"]);
    named.refused(2, &["no such column", "`u`, `y`"]);
}

const LAG: &[u8] = b"\
model lag
input u [V] hold
state y [m] = 0.5
equation e: 2 [s]*der(y) = 3 [m/V]*u - y
output y [m]
";

/// Runs the lag with a recording on standard input.
fn lag(csv: &str, more: &[&str]) -> Run {
    let folder = folder_with(&[("lag.dgd", LAG)]);
    let args = [&["simulate", "lag.dgd", "--data", "-"], more].concat();
    piped(folder.path(), &args, csv).done()
}

#[test]
fn data_comes_in_on_standard_input_under_any_name_of_time() {
    let plain = lag(&lag_csv("time [s],u [V],y [m]", seconds), &[]);
    for (header, note) in [
        ("t,u [V],y [m]", "`t` is taken as the time, in seconds"),
        ("Time [s],u [V],y [m]", "`Time` is taken as the time"),
    ] {
        let run = lag(&lag_csv(header, seconds), &[]);
        assert_eq!(run.out, plain.out, "{header}");
        assert!(run.err.contains(note), "{}", run.err);
    }
    assert!(!plain.err.contains("taken as"), "{}", plain.err);
    let twice = dgd(&["fit", "models/two_tanks.dgd", "--data", "-", "--valid", "-"]);
    twice.refused(2, &["`-` is standard input"]);
}

#[test]
fn the_fit_of_each_measured_output_is_told() {
    let csv = lag_csv("time [s],u [V],y [m]", seconds);
    let run = lag(&csv, &[]);
    assert!(run.err.contains("100.0 %"), "{}", run.err);
    let json = lag(&csv, &["--format", "json"]).json();
    let fit = json["agreement"][0]["fit_percent"].as_f64().expect("a number");
    assert!(fit > 99.99, "{fit}");
    assert_eq!(json["agreement"][0]["samples"], 200);
}

#[test]
fn stamps_stay_stamps() {
    let stamp = |k: usize| format!("2026-11-21T10:00:{:02}.{}Z", k / 5, 2 * (k % 5));
    let csv = lag_csv("time,u [V],y [m]", stamp);
    let run = lag(&csv, &["--quiet"]);
    let times = |text: &str| -> Vec<String> {
        text.lines().map(|line| line.split(',').next().unwrap_or_default().to_owned()).collect()
    };
    let expected: Vec<String> = times(&csv).iter().map(|t| t.replace(".0Z", "Z")).collect();
    assert_eq!(times(&run.out), expected);
    let json = lag(&csv, &["--format", "json"]).json();
    assert_eq!(json["start"], "2026-11-21T10:00:00Z");
    assert_eq!(json["time"][1], 0.2);
    // The same applies to tables of other commands.
    let folder = folder_with(&[
        ("lag.dgd", LAG),
        ("run.csv", csv.as_bytes()),
        ("sets.csv", b"y [m]\n1\n2\n"),
    ]);
    let first = |args: &[&str], column: usize| -> Vec<String> {
        let run = dgd_in(folder.path(), &[args, &["--data", "run.csv", "--quiet"]].concat()).done();
        let cell = |line: &str| line.split(',').nth(column).unwrap_or_default().to_owned();
        run.out.lines().take(3).map(cell).collect()
    };
    assert_eq!(first(&["track", "lag.dgd", "--noise", "y=0.01"], 0), expected[..3]);
    assert_eq!(first(&["simulate", "lag.dgd", "--ensemble", "sets.csv"], 1), expected[..3]);
    dgd_in(
        folder.path(),
        &["invert", "lag.dgd", "--data", "run.csv", "--for", "e", "-o", "missing.csv"],
    )
    .done();
    let missing = fs::read_to_string(folder.path().join("missing.csv")).expect("it was written");
    assert_eq!(times(&missing)[..3], expected[..3]);
    for args in [
        &["track", "lag.dgd", "--noise", "y=0.01", "-o", "t.json"][..],
        &["invert", "lag.dgd", "--for", "e", "-o", "t.json"],
    ] {
        dgd_in(folder.path(), &[args, &["--data", "run.csv"]].concat()).done();
        let text = fs::read_to_string(folder.path().join("t.json")).expect("it was written");
        let json: Value = serde_json::from_str(&text).expect("JSON");
        let start = json.get("start").unwrap_or(&json["settings"]["start"]);
        assert_eq!(start, "2026-11-21T10:00:00Z", "{args:?}");
    }
    // The output can be read again.
    lag(&run.out, &[]);
}

#[test]
fn an_array_of_numbers_takes_one_line_with_the_digits_of_csv() {
    let csv = lag_csv("time [s],u [V],y [cm]", seconds);
    let table = lag(&csv, &[]).out;
    let text = lag(&csv, &["--format", "json"]).out;
    assert!(text.lines().count() < 100, "{text}");
    // Parsed from the text, because the digits must equal those of CSV.
    let columns: Vec<Vec<f64>> = text
        .lines()
        .filter_map(|line| line.trim().strip_prefix("\"values\": ["))
        .map(|line| line.trim_end_matches(']').split(", ").flat_map(str::parse).collect())
        .collect();
    for (row, line) in table.lines().skip(1).enumerate() {
        for (column, cell) in line.split(',').skip(1).enumerate() {
            assert_eq!(Ok(columns[column][row]), cell.parse::<f64>());
        }
    }
}

#[test]
fn shells_and_man_know_the_commands() {
    for (shell, mark) in [
        ("bash", "_dgd()"),
        ("zsh", "#compdef dgd"),
        ("fish", "complete -c dgd"),
        ("powershell", "Register-ArgumentCompleter"),
    ] {
        let text = dgd(&["completions", shell]).done().out;
        assert!(text.contains(mark) && text.contains("linearize"), "{shell}");
    }
    let folder = folder_with(&[]);
    dgd(&["man", &path(&folder, "man1")]).done();
    let page = fs::read_to_string(folder.path().join("man1/dgd-fit.1")).expect("a page");
    assert!(page.contains("\\-\\-valid") && page.contains("dgd\\-fit"), "{page}");
    let schema: Value = dgd(&["schema"]).done().json();
    assert_eq!(schema["version"], 3);
}
