//! Results for programs conform to `docs/results.schema.json`.

use std::fs;
use std::process::Command;

use serde_json::Value;

use crate::support::{Run, dgd, folder_with, path, root};

const MODEL: &str = "models/mud_circulation.dgd";
const DATA: &str = "examples/data/circulation.csv";

/// Where and how a value violates a schema; `None` if it conforms.
///
/// Supports the parts of JSON Schema that the file uses: types, properties, items, alternatives and references.
fn departure(value: &Value, schema: &Value, all: &Value, place: &str) -> Option<String> {
    if let Some(name) = schema["$ref"].as_str() {
        let name = name.strip_prefix("#/$defs/").expect("a definition of this file");
        return departure(value, &all["$defs"][name], all, place);
    }
    if let Some(alternatives) = schema["anyOf"].as_array().or_else(|| schema["oneOf"].as_array()) {
        let tried: Option<Vec<String>> =
            alternatives.iter().map(|one| departure(value, one, all, place)).collect();
        return tried.map(|tried| tried.join(", or "));
    }
    if let Some(allowed) = schema["enum"].as_array()
        && !allowed.contains(value)
    {
        return Some(format!("{place} is {value}, not one of {allowed:?}"));
    }
    if let Some(only) = schema.get("const")
        && only != value
    {
        return Some(format!("{place} is {value}, not {only}"));
    }
    let types = match &schema["type"] {
        Value::String(one) => vec![one.as_str()],
        Value::Array(several) => several.iter().filter_map(Value::as_str).collect(),
        _ => return None,
    };
    let is = |name: &&str| match *name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("`{other}` is not a type"),
    };
    if !types.iter().any(is) {
        return Some(format!("{place} is {value}, not {types:?}"));
    }
    match value {
        Value::Array(items) => {
            let short = schema["minItems"].as_u64().is_some_and(|n| (items.len() as u64) < n);
            let long = schema["maxItems"].as_u64().is_some_and(|n| items.len() as u64 > n);
            if short || long {
                return Some(format!("{place} has {} items", items.len()));
            }
            let item = |(i, item)| departure(item, &schema["items"], all, &format!("{place}[{i}]"));
            items.iter().enumerate().find_map(item)
        }
        Value::Object(entries) => {
            let required = schema["required"].as_array().into_iter().flatten();
            let mut missing = required.filter_map(Value::as_str);
            if let Some(name) = missing.find(|name| !entries.contains_key(*name)) {
                return Some(format!("{place} has no `{name}`"));
            }
            entries.iter().find_map(|(name, entry)| {
                let place = format!("{place}.{name}");
                match (schema["properties"].get(name), schema.get("additionalProperties")) {
                    (Some(own), _) => departure(entry, own, all, &place),
                    (None, Some(Value::Bool(false))) => Some(format!("{place} is not described")),
                    (None, Some(others)) => departure(entry, others, all, &place),
                    (None, None) => None,
                }
            })
        }
        _ => None,
    }
}

#[track_caller]
pub(crate) fn assert_is(definition: &str, value: &Value) {
    let text = fs::read_to_string(root().join("docs/results.schema.json")).expect("a schema");
    let entries: Value = serde_json::from_str(&text).expect("JSON");
    let schema = &entries["$defs"][definition];
    assert!(schema.is_object(), "`{definition}` is defined");
    assert_eq!(departure(value, schema, &entries, definition), None);
}

fn json(args: &[&str]) -> Value {
    dgd(&[args, &["--format", "json"]].concat()).done().json()
}

#[test]
fn results_are_as_the_schema_says() {
    for model in [MODEL, "models/two_tanks.dgd", "models/transmission_line.dgd"] {
        assert_is("check", &json(&["check", model]));
    }
    let run = [MODEL, "--data", DATA, "--until", "40"];
    let simulated = json(&[&["simulate"], &run[..]].concat());
    assert_is("simulate", &simulated);
    let of_args = ["--of", "h_r,p_r", "--to", "c0", "--verify-sensitivities"];
    assert_is("sensitivity", &json(&[&["sensitivity"], &run[..], &of_args].concat()));
    for at in ["30", "steady", "mean"] {
        assert_is("linearize", &json(&["linearize", MODEL, "--data", DATA, "--at", at]));
    }
    let well = ["linearize", "models/dual_gradient_drilling.dgd", "--at", "steady"];
    let connection = ["--data", "examples/data/pipe_connection.csv"];
    assert_is("linearize", &json(&[&well[..], &connection].concat()));
    let invert = ["invert", MODEL, "--data", DATA, "--until", "200", "--for", "riser"];
    assert_is("invert", &json(&[&invert[..], &["--with-estimate"]].concat()));
    assert_is("screen", &json(&["screen", MODEL, "--data", DATA]));
    for estimator in ["output-error", "linearised", "least-squares", "recursive"] {
        let fit = ["fit", MODEL, "--data", DATA, "--estimator", estimator];
        assert_is("fit", &json(&fit));
    }
    let compare = ["compare", MODEL, "models/mud_circulation.dgd@flow=static", "--data", DATA];
    assert_is("compare", &json(&compare));
    let lines = dgd(&[&["track"], &run[..], &["--format", "json"]].concat()).done();
    for line in lines.out.lines() {
        assert_is("track_line", &serde_json::from_str(line).expect("a document a line"));
    }

    let folder = folder_with(&[("sets.csv", b"c0 [m]\n270\n280\n")]);
    let sets = path(&folder, "sets.csv");
    assert_is("ensemble", &json(&[&["simulate"], &run[..], &["--ensemble", &sets]].concat()));
    let tracked = path(&folder, "tracked.json");
    dgd(&[&["track"], &run[..], &["-o", &tracked]].concat()).done();
    let tracked = fs::read_to_string(tracked).expect("it was written");
    assert_is("track", &serde_json::from_str(&tracked).expect("JSON"));
    let discover = ["discover", MODEL, "--data", DATA, "--until", "200"];
    assert_is("discover", &json(&discover));
}

#[test]
fn refusals_are_as_the_schema_says() {
    let refused = |args: &[&str]| -> Run { dgd(&[args, &["--format", "json"]].concat()) };
    let folder = folder_with(&[("bad.dgd", b"model bad\nstate x [m] = y\nder(x) = 1\n")]);
    assert_is("error", &refused(&["check", &path(&folder, "bad.dgd")]).json());
    assert_is("error", &refused(&["check", "models/nothing.dgd"]).json());
    assert_is("error", &refused(&["simulate", MODEL]).json());
}

#[test]
fn a_result_says_what_it_was_made_of() {
    let run = |more: &[&str]| {
        let args = ["simulate", MODEL, "--data", DATA, "--until", "5", "--seed", "7"];
        json(&[&args[..], more].concat())["provenance"].clone()
    };
    let (one, again) = (run(&[]), run(&[]));
    assert_eq!(one, again);
    assert_eq!(one["seed"], 7);
    let schema: Value = serde_json::from_str(&dgd(&["schema"]).done().out).expect("JSON");
    assert_eq!(one["schema"], schema["version"]);
    assert_eq!(one["data"][0]["file"], DATA);
    for (digest, file) in [(&one["data"][0]["digest"], DATA), (&one["model"], MODEL)] {
        let digest = digest.as_str().and_then(|text| text.strip_prefix("sha256:"));
        assert!(digest.is_some_and(|digits| digits.len() == 64), "{digest:?}");
        // Not every system has coreutils.
        if let Ok(printed) = Command::new("sha256sum").arg(root().join(file)).output() {
            let printed = String::from_utf8_lossy(&printed.stdout);
            assert_eq!(printed.split_whitespace().next(), digest, "{file}");
        }
    }
    let folder = folder_with(&[("sets.csv", b"c0 [m]\n270\n")]);
    let sets = path(&folder, "sets.csv");
    let many = run(&["--ensemble", &sets]);
    assert_eq!(many["data"][0], one["data"][0]);
    assert!(many["data"][1]["digest"].is_string(), "the sets are data");
    let other = run(&["--set", "c0=270"]);
    assert_ne!(one["model"], other["model"], "what is set is part of the model");
    assert_eq!(one["data"], other["data"]);
}
