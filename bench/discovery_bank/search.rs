//! What `dgd discover` says of a case, from files in memory, and what a law makes of a parameter.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use dgd_compiler::units::parse_unit;
use dgd_data::InMemory;
use dgd_work::{
    DiscoverRequest, ModelChoices, RunRequest, SilentReporter, SimulateRequest, StartChoice,
    TaskContext, discover, simulate,
};
use serde_json::{Value, json};

use crate::bank::Case;

/// The file with what each place would have needed.
const TRACES: &str = "unexplained.csv";
/// Folder of the files in memory.
pub(crate) const FOLDER: &str = "case";

/// What a search said.
#[derive(Debug, Clone)]
pub(crate) struct Answer {
    /// `result.json`; where there is none, an object with the `error`.
    pub(crate) json: Value,
    /// Texts of the other files, by their names.
    files: BTreeMap<String, String>,
    pub(crate) seconds: f64,
}

impl Answer {
    fn file(&self, name: &str) -> Option<&str> {
        self.files.get(name).map(String::as_str)
    }
}

/// Searches a case with one thread.
pub(crate) fn answer(case: &Case) -> Answer {
    let begin = Instant::now();
    let found = catch_unwind(AssertUnwindSafe(|| found(case)));
    let seconds = begin.elapsed().as_secs_f64();
    let none = |why: &str| (json!({ "verdict": "error", "error": why }), BTreeMap::new());
    let (json, files) = match found {
        Ok(Ok(answer)) => answer,
        Ok(Err(error)) => none(&error),
        Err(_) => none("it panicked"),
    };
    Answer { json, files, seconds }
}

fn found(case: &Case) -> Result<(Value, BTreeMap<String, String>), String> {
    let files = files(case);
    let path = |name: &str| format!("{FOLDER}/{name}");
    let mut request = DiscoverRequest::new(path("model.dgd"), vec![path("train.csv").into()]);
    request.valid = vec![path("valid.csv").into()];
    let session = TaskContext::new(&SilentReporter).with_files(&files).with_threads(1);
    let discovered = discover(&request, session).map_err(|error| error.to_string())?;
    let written = discovered.files().map_err(|error| error.to_string())?.written;
    let texts = written.into_iter().filter(|(name, _)| name != "report.html");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    let texts = texts.map(|(name, bytes)| (name, text(bytes))).collect();
    Ok((discovered.to_json(), texts))
}

/// The files of a case.
pub(crate) fn files(case: &Case) -> InMemory {
    let all = case.files().into_iter();
    all.fold(InMemory::default(), |files, (path, text)| {
        files.with_file(format!("{FOLDER}/{path}"), text)
    })
}

/// What the answer makes of a parameter over the training recording: by each law at it, by each effect that is
/// described and changes it, and by its trace. Values are in the unit that the model declares.
pub(crate) fn parameter_over_time(case: &Case, answer: &Answer, parameter: &str) -> Vec<Vec<f64>> {
    let Some(unit) = declared_unit(case, parameter) else { return Vec::new() };
    let list = |key: &str| answer.json[key].as_array().into_iter().flatten();
    let laws = list("unexplained").filter(|entry| entry["target"] == parameter);
    let changes = laws.map(|entry| &entry["law"]).chain(list("described"));
    let simulated = changes.filter_map(|change| simulated(case, answer, change, parameter, unit));
    let mut all: Vec<Vec<f64>> = simulated.collect();
    if let Some((values, shown)) = answer.file(TRACES).and_then(|csv| column(csv, parameter)) {
        let factor = |unit: &str| parse_unit(unit).map_or(1.0, |unit| unit.factor);
        let in_declared = factor(&shown) / factor(unit);
        let base = answer.json["base_parameters"][parameter]["value"].as_f64().unwrap_or(0.0);
        // A trace may be of the parameter itself or of what has to be added to it.
        all.push(values.iter().map(|value| base + in_declared * value).collect());
        all.push(values.iter().map(|value| in_declared * value).collect());
    }
    all
}

fn declared_unit<'a>(case: &'a Case, parameter: &str) -> Option<&'a str> {
    let declared = case.model.lines().find(|line| {
        let mut words = line.split_whitespace();
        words.next() == Some("parameter") && words.next() == Some(parameter)
    })?;
    let (_, rest) = declared.split_once('[')?;
    rest.split_once(']').map(|(unit, _)| unit)
}

/// The parameter in a simulation of the model with a law or a described effect: an object with the name of its
/// `file` or its text, how to `apply` it, and values of its `parameters`.
fn simulated(
    case: &Case,
    answer: &Answer,
    change: &Value,
    parameter: &str,
    unit: &str,
) -> Option<Vec<f64>> {
    let named = change["file"].as_str().or_else(|| change.as_str())?;
    let text = answer.file(named).unwrap_or(named);
    let arguments =
        change["apply"].as_str().and_then(|apply| apply.find('(').map(|at| &apply[at..]));
    let model = case.model.lines().find_map(|line| line.strip_prefix("model "))?.trim();
    let reading = format!(
        "effect reading_of_a_change on {model}\nkind sensor\n\
         output value_of_the_change [{unit}] = {parameter}\n"
    );
    let path = |name: &str| format!("{FOLDER}/{name}");
    let files =
        files(case).with_file(path("change.dgd"), text).with_file(path("reading.dgd"), reading);
    let mut run = RunRequest::new(path("model.dgd"));
    run.data = Some(path("train.csv").into());
    run.solve.start = StartChoice::Measured;
    let mut set = settings(&answer.json["base_parameters"]);
    set.extend(settings(&change["parameters"]));
    let apply = format!("{}{}", path("change.dgd"), arguments.unwrap_or_default());
    run.choices = ModelChoices::new(Vec::new(), set, vec![apply, path("reading.dgd")]);
    let session = TaskContext::new(&SilentReporter).with_files(&files).with_threads(1);
    let simulated = simulate(&SimulateRequest::new(run), session).ok()?;
    let columns = simulated.table.columns.iter();
    let mut columns = columns.filter(|column| column.name == "value_of_the_change");
    columns.next().map(dgd_work::NamedColumn::in_unit)
}

/// Parameters as they are set, from an object by name or a list of objects with a `name`.
fn settings(parameters: &Value) -> Vec<String> {
    let set = |name: &str, value: &Value| {
        let number = value["value"].as_f64().or_else(|| value.as_f64())?;
        let unit = value["unit"].as_str().map(|unit| format!(" [{unit}]")).unwrap_or_default();
        Some(format!("{name}={number}{unit}"))
    };
    let by_name = parameters.as_object().into_iter().flatten();
    let listed = parameters.as_array().into_iter().flatten();
    by_name
        .filter_map(|(name, value)| set(name, value))
        .chain(listed.filter_map(|value| set(value["name"].as_str()?, value)))
        .collect()
}

/// A column of a file by its name, and its unit.
fn column(csv: &str, name: &str) -> Option<(Vec<f64>, String)> {
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next()?.split(',').collect();
    let at = header.iter().position(|cell| cell.split(" [").next() == Some(name))?;
    let unit = header[at].split_once('[').map_or("1", |(_, unit)| unit.trim_end_matches(']'));
    let number = |line: &str| line.split(',').nth(at).and_then(|cell| cell.parse().ok());
    Some((lines.map(|line| number(line).unwrap_or(f64::NAN)).collect(), unit.to_owned()))
}
