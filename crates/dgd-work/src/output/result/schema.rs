//! The definitions of `docs/results.schema.json` that follow from types are those of the file.

use std::{env, fs};

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

use super::compare::CompareDocument;
use super::discover::DiscoverDocument;
use super::fit::FitDocument;
use super::linearize::LinearizeDocument;
use super::simulate::EventEntry;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/results.schema.json");

/// Definitions of results without a type.
const WRITTEN_BY_HAND: [&str; 17] = [
    "mistake",
    "error",
    "column",
    "simulate",
    "ensemble",
    "sensitivity",
    "invert",
    "check",
    "screen",
    "track_row",
    "track",
    "track_line",
    "identity",
    "job_run",
    "job_status",
    "job_piece",
    "job_report",
];

fn derived() -> Map<String, Value> {
    let mut generator = SchemaSettings::draft2020_12().into_generator();
    generator.subschema_for::<FitDocument>();
    generator.subschema_for::<LinearizeDocument>();
    generator.subschema_for::<CompareDocument>();
    generator.subschema_for::<EventEntry>();
    generator.subschema_for::<DiscoverDocument>();
    generator.take_definitions(true)
}

#[test]
fn the_file_has_the_definitions_of_the_types() {
    let text = fs::read_to_string(FILE).expect("the schema");
    let mut file: Value = serde_json::from_str(&text).expect("JSON");
    let definitions = file["$defs"].as_object().expect("definitions");
    let by_hand = definitions.iter().filter(|(name, _)| WRITTEN_BY_HAND.contains(&name.as_str()));
    let mut all: Map<String, Value> =
        by_hand.map(|(name, definition)| (name.clone(), definition.clone())).collect();
    all.extend(derived());
    if env::var_os("UPDATE_GOLDEN").is_some() {
        file["$defs"] = Value::Object(all);
        let text = serde_json::to_string_pretty(&file).expect("JSON") + "\n";
        fs::write(FILE, text).expect("the schema is written");
        return;
    }
    for (name, definition) in &all {
        assert_eq!(definitions.get(name), Some(definition), "`{name}`: set UPDATE_GOLDEN=1");
    }
    assert_eq!(definitions.len(), all.len(), "definitions without a type");
}
