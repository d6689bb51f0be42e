//! `dgd discover` on rigs other than drilling: it names the right effect, accounts for every effect, and its sentences
//! agree with the numbers.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::{dgd, folder_with, path, root};

/// The result of a discovery in one of the cases.
fn found(case: &str, model: &str, [train, valid]: [&str; 2], more: &[&str]) -> Value {
    let file =
        |name: &str| root().join("tests/defects").join(case).join(name).display().to_string();
    let (model, train, valid) =
        (file(model), file(&format!("{train}.csv.gz")), file(&format!("{valid}.csv.gz")));
    let args = ["discover", &model, "--data", &train, "--valid", &valid, "--format", "json"];
    let result = dgd(&[&args[..], more].concat()).done().json();
    sentences_agree(&result);
    result
}

fn list<'a>(result: &'a Value, key: &str) -> &'a [Value] {
    result[key].as_array().unwrap_or_else(|| panic!("{key} is not a list"))
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("{value} is not a text"))
}

fn names(result: &Value) -> Vec<&str> {
    list(result, "effects").iter().map(|effect| text(&effect["name"])).collect()
}

/// Every effect file of a folder is in the ranking, was screened, or is a reservation.
#[track_caller]
pub(crate) fn nothing_vanishes(result: &Value, folder: &Path) {
    let mut known: Vec<&str> = list(result, "ranking")
        .iter()
        .flat_map(|row| list(row, "effects"))
        .chain(list(result, "screened").iter().map(|row| &row["name"]))
        .map(text)
        .collect();
    known.extend(list(result, "reservations").iter().map(text).flat_map(|words| words.split('`')));
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("an entry"))
        {
            let path = entry.path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    assert!(!files.is_empty());
    for file in files {
        let name = file.strip_prefix(folder).expect("within").with_extension("");
        let name = name.display().to_string().replace('\\', "/");
        let is_it = |known: &&str| *known == name || known.starts_with(&format!("{name}("));
        assert!(known.iter().any(is_it), "{name} is nowhere: {known:?}");
    }
}

/// Numbers in a text outside backticks.
fn numbers(text: &str) -> Vec<f64> {
    let outside = text.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    let is_of_number = |c: char| c.is_ascii_digit() || c == '.';
    outside
        .split(|c| !is_of_number(c))
        .filter_map(|piece| piece.trim_end_matches('.').parse().ok())
        .collect()
}

/// The reason has the numbers of the ranking, and claims that nothing helps only if nothing does.
#[track_caller]
fn sentences_agree(result: &Value) {
    let reason = text(&result["reason"]);
    let quoted = numbers(reason);
    let ranking = list(result, "ranking");
    let effects = |row: &Value| -> Vec<String> {
        list(row, "effects").iter().map(|name| text(name).to_owned()).collect()
    };
    let square = |row: &Value, key: &str| row[key].as_f64();
    let base = ranking.iter().find(|row| effects(row).is_empty()).expect("the base model");
    let has = |row: &Value| {
        for key in ["train", "valid"] {
            let Some(square) = square(row, key) else { continue };
            let is_it = |number: &f64| (number / square - 1.0).abs() < 0.011;
            assert!(quoted.iter().any(is_it), "{key} {square} is not in: {reason}");
        }
    };
    has(base);
    if result["verdict"] == "unexplained" && list(result, "effects").is_empty() {
        let of_base = square(base, "train").expect("a number");
        let is_less = |row: &&Value| square(row, "train").is_some_and(|left| left < of_base);
        match ranking.iter().find(is_less) {
            Some(best) => {
                assert!(!reason.contains("nothing that was tried leaves less"), "{reason}");
                has(best);
                for name in effects(best) {
                    assert!(reason.contains(&format!("`{name}`")), "{name} is not in: {reason}");
                }
            }
            None => {
                assert!(reason.contains("leaves less") || reason.contains("no effect"), "{reason}");
            }
        }
    }
    for left in list(result, "unexplained") {
        let description = text(&left["description"]);
        if let Some((_, factor)) = description.split_once("still have ") {
            assert!(numbers(factor)[0] > 1.1, "{description}");
        }
    }
}

#[test]
fn effects_that_replace_the_same_are_screened_apart() {
    let result = found("bioreactor", "bio.dgd", ["train", "valid"], &[]);
    assert_eq!(names(&result), ["haldane"], "{}", result["reason"]);
    let inhibition = &result["effects"][0]["parameters"]["inh"];
    let [value, std] = ["value", "std"].map(|key| inhibition[key].as_f64().expect("a number"));
    assert!((value - 0.25).abs() < 4.0 * std && std < 0.01, "{inhibition}");
    nothing_vanishes(&result, &root().join("tests/defects/bioreactor/effects"));
    // Among other effects its promise is the same as alone.
    let file = |name: &str| root().join("tests/defects/bioreactor").join(name);
    let read = |name: &str| fs::read(file(name)).expect("a file");
    let folder = folder_with(&[("bio.dgd", &read("bio.dgd"))]);
    let library = folder_with(&[("haldane.dgd", &read("effects/haldane.dgd"))]);
    let (model, effects) = (path(&folder, "bio.dgd"), library.path().display().to_string());
    let data = file("train.csv.gz").display().to_string();
    let args = ["discover", &model, "--data", &data, "--effects", &effects, "--format", "json"];
    let alone = dgd(&args).done().json();
    let shares = [&alone, &result].map(|result| {
        let rows = list(result, "screened").iter();
        let row = rows.clone().find(|row| row["name"] == "haldane").expect("it was screened");
        row["share"].as_f64().expect("a number")
    });
    assert!((shares[0] / shares[1] - 1.0).abs() < 1e-3, "{shares:?}");
}

#[test]
fn a_fault_of_the_plant_and_one_of_its_sensor_are_named_together() {
    let result = found("tank", "tank3.dgd", ["a", "b"], &[]);
    assert_eq!(names(&result), ["element_failure", "probe_lag"], "{}", result["reason"]);
    let parameter = |effect: usize, name: &str| {
        result["effects"][effect]["parameters"][name]["value"].as_f64().expect("a number")
    };
    assert!((parameter(0, "lost") - 10.0).abs() < 0.1, "{}", parameter(0, "lost"));
    assert!((parameter(0, "t_fail") - 7000.0).abs() < 20.0, "{}", parameter(0, "t_fail"));
    assert!((parameter(1, "tau") - 25.0).abs() < 1.5, "{}", parameter(1, "tau"));
    nothing_vanishes(&result, &root().join("tests/defects/tank/effects"));
    let not_tried = list(&result, "not_tried");
    assert!(not_tried.iter().all(|row| !text(&row["reason"]).is_empty()));
    assert!(not_tried.iter().any(|row| row["name"] == "sensor_lag(T)"), "{not_tried:?}");
}

#[test]
fn an_effect_without_a_derivative_at_nothing_is_tried() {
    let result = found("drive", "drive.dgd", ["train", "valid"], &["--until", "100"]);
    nothing_vanishes(&result, &root().join("tests/defects/drive/effects"));
    let is_backlash = |row: &&Value| row["effects"].as_array().is_some_and(|e| *e == ["backlash"]);
    let row = list(&result, "ranking").iter().find(is_backlash).expect("it was fitted");
    let base = list(&result, "ranking").iter().find(|row| list(row, "effects").is_empty());
    let left = |row: &Value| row["train"].as_f64().expect("a number");
    assert!(left(row) < 0.1 * left(base.expect("the base model")), "{row}");
}

#[test]
fn what_a_model_that_runs_away_lacks_is_found_along_the_readings() {
    // Near the ground the rotors lift more: `eff` is larger there.
    let result = found("height", "quad.dgd", ["train", "valid"], &["--until", "100"]);
    assert_eq!(result["verdict"], "unexplained");
    assert!(names(&result).is_empty(), "{:?}", names(&result));
    let first = &list(&result, "unexplained")[0];
    assert_eq!(first["target"], "eff");
    let closest = &list(first, "together")[0];
    let text = [text(&closest["quantity"]), text(&closest["course"])];
    assert_eq!(text, ["z", "falls"]);
    assert!(closest["r2_held_out"].as_f64() > Some(0.9), "{closest}");
    // A runaway model must not name an effect for staying closer.
    let file = |name: &str| root().join("tests/defects/height").join(name).display().to_string();
    let [model, train, valid] = ["quad.dgd", "train.csv.gz", "valid.csv.gz"].map(file);
    let args = ["discover", &model, "--data", &train, "--valid", &valid, "--until", "100"];
    let fixed = dgd(&[&args[..], &["--fix", "kd,tau,eff", "--format", "json"]].concat());
    let result = fixed.done().json();
    assert_eq!(result["verdict"], "unexplained", "{:?}", names(&result));
}

#[test]
fn templates_and_effects_that_are_not_tried_have_a_reason() {
    let stray = b"effect stray on other\nkind plant\nparameter k [1] = 0\nnull k = 0\nreplace x by x*(1 + k)\n";
    let pressure =
        b"effect pressure(y: output [Pa])\nkind sensor\nparameter o [Pa] = 0\nnull o = 0\n\
                     replace output y by y + o\n";
    let model = fs::read(root().join("tests/defects/tank/tank3.dgd")).expect("a model");
    let folder = folder_with(&[("tank3.dgd", &model)]);
    let library = folder_with(&[("stray.dgd", stray), ("pressure.dgd", pressure)]);
    let data = root().join("tests/defects/tank/a.csv.gz").display().to_string();
    let (model, effects) = (path(&folder, "tank3.dgd"), library.path().display().to_string());
    let goal = path(&folder, "found");
    let args = ["discover", &model, "--data", &data, "--effects", &effects, "--until", "1500"];
    let run = dgd(&[&args[..], &["-o", &goal]].concat()).done();
    let result = fs::read_to_string(Path::new(&goal).join("result.json")).expect("a result");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    sentences_agree(&result);
    nothing_vanishes(&result, library.path());
    for words in ["`stray` is for the model `other`", "`pressure` finds nothing in the model"] {
        assert!(run.out.contains(words), "no {words:?} in\n{}", run.out);
    }
    // The ambient temperature does not change this early.
    let is_it = |row: &&Value| row["name"] == "input_gain(T_amb)";
    let row = list(&result, "not_tried").iter().find(is_it).expect("it has a reason");
    let why = text(&row["reason"]);
    assert_eq!(why, "changes nothing that is measured");
    let page = fs::read_to_string(Path::new(&goal).join("report.html")).expect("a report");
    assert!(run.out.contains(why) && run.out.contains("input_gain(T_amb)"), "{}", run.out);
    assert!(page.contains(why) && page.contains("input_gain(T_amb)"), "the page has it");
    // Templates are in the ranking, were screened, or have a reason.
    let in_ranking = |name: &str| {
        list(&result, "ranking").iter().flat_map(|row| list(row, "effects")).any(|e| *e == name)
    };
    for template in
        ["sensor_offset(T)", "input_gain(P)", "leak(T, heat)", "sensor_lag(T)", "overflow"]
    {
        let in_list = |key: &str| list(&result, key).iter().any(|row| row["name"] == template);
        let is_known = in_list("screened") || in_list("not_tried") || in_ranking(template);
        assert!(is_known, "{template} is nowhere");
    }
    // A lag of the probe has an initial value that only a fit can find.
    assert!(in_ranking("sensor_lag(T)"));
}
