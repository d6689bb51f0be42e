//! The files of a page, and the bench that answers requests about them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_data::InMemory;
use dgd_watch::{ModelBench, PageRequest, of_error};
#[cfg(not(feature = "discover"))]
use dgd_work::UsageError;
use dgd_work::{Engine, RunRequest, SilentReporter, TaskContext, WorkError, load, prepare};
use serde::Deserialize;
use serde_json::{Value, json};

/// A message of the worker.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Message {
    Open(Open),
    Ask(PageRequest),
    Inputs {},
    Table { values: BTreeMap<String, f64> },
    Discover(Discover),
}

/// Opens other files or another model.
#[derive(Debug, Deserialize)]
struct Open {
    files: BTreeMap<String, String>,
    model: String,
    data: Option<String>,
    until: Option<f64>,
    every: Option<f64>,
    #[serde(default)]
    variant: Vec<String>,
    #[serde(default)]
    rtol: Option<f64>,
}

/// A search for missing terms of the model.
#[derive(Debug, Deserialize)]
#[cfg_attr(not(feature = "discover"), allow(dead_code))]
struct Discover {
    /// The validation recording.
    valid: String,
    #[serde(default)]
    variant: BTreeMap<String, String>,
}

/// The files of a page, and the bench that answers requests about them.
pub struct Room {
    files: InMemory,
    request: RunRequest,
    bench: ModelBench,
}

impl Default for Room {
    fn default() -> Self {
        Room::of(InMemory::default(), RunRequest::new("model.dgd"))
    }
}

impl Room {
    fn of(files: InMemory, request: RunRequest) -> Room {
        Room { files, bench: ModelBench::new(request.clone()), request }
    }

    /// The answer to a message of the worker, as JSON.
    pub fn answer(&mut self, text: &[u8]) -> String {
        match serde_json::from_slice(text) {
            Ok(Message::Ask(ask)) => self.bench.answer(&ask, &self.files),
            Ok(message) => self.done(message).unwrap_or_else(|error| of_error(&error)).to_string(),
            Err(error) => json!({ "ok": false, "error": error.to_string() }).to_string(),
        }
    }

    fn session(&self) -> TaskContext<'_> {
        TaskContext::new(&SilentReporter).with_files(&self.files).with_threads(1)
    }

    fn done(&mut self, message: Message) -> Result<Value, WorkError> {
        match message {
            Message::Open(open) => {
                self.open(open);
                Ok(json!({ "ok": true }))
            }
            Message::Ask(_) => Ok(Value::Null),
            Message::Inputs {} => self.inputs(),
            Message::Table { values } => self.table(&values),
            Message::Discover(wanted) => self.discover(&wanted),
        }
    }

    fn open(&mut self, open: Open) {
        let files = open.files.into_iter();
        self.files = files.fold(InMemory::default(), |all, (path, text)| all.with_file(path, text));
        let mut request = RunRequest::new(open.model);
        request.data = open.data.map(PathBuf::from);
        request.every = open.every;
        request.choices.variant = open.variant;
        request.solve.until = open.until;
        request.solve.engine = Engine::Interpreter;
        if let Some(rtol) = open.rtol {
            request.solve.rtol = rtol;
        }
        self.request = request.clone();
        // Kept curves stay while a text is edited.
        self.bench.open(request);
    }

    /// The model's inputs.
    fn inputs(&self) -> Result<Value, WorkError> {
        let RunRequest { model, choices, .. } = &self.request;
        let loaded = load(model, choices, &SensitivityDirections::None, self.session())?;
        let inputs = loaded.compiled.program.signature.inputs.iter();
        let inputs = inputs.map(|input| json!({ "name": input.name, "unit": input.unit.symbol }));
        Ok(json!({ "ok": true, "inputs": inputs.collect::<Vec<_>>() }))
    }

    fn table(&self, values: &BTreeMap<String, f64>) -> Result<Value, WorkError> {
        let values: Vec<(&str, f64)> = values.iter().map(|(name, x)| (name.as_str(), *x)).collect();
        let simulated = prepare(&self.request, self.session())?.simulate(&values)?;
        Ok(json!({ "ok": true, "result": simulated.to_json() }))
    }

    #[cfg(feature = "discover")]
    fn discover(&self, wanted: &Discover) -> Result<Value, WorkError> {
        use dgd_work::{DiscoverRequest, discover};

        let data = self.request.data.iter().cloned().collect();
        let mut request = DiscoverRequest::new(&self.request.model, data);
        request.valid = vec![PathBuf::from(&wanted.valid)];
        request.choices.clone_from(&self.request.choices);
        let variant = wanted.variant.iter().map(|(name, choice)| format!("{name}={choice}"));
        request.choices.variant = variant.collect();
        request.solve = self.request.solve.clone();
        let discovered = discover(&request, self.session())?;
        let page = discovered.page()?;
        Ok(
            json!({ "ok": true, "text": discovered.to_text(None), "page": page, "result": discovered.to_json() }),
        )
    }

    #[cfg(not(feature = "discover"))]
    #[expect(clippy::unused_self, reason = "with the feature it is used")]
    fn discover(&self, _: &Discover) -> Result<Value, WorkError> {
        Err(UsageError::DiscoveryNotLoaded.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: &str = "model tank\n\
        parameter A [m^2] = 2 in 0.1 .. 10\n\
        input q [lpm] linear\n\
        state h [m] = 1\n\
        equation level: A*der(h) = q\n\
        output h [m] noise 0.01\n";

    fn said(room: &mut Room, message: &Value) -> Value {
        let answer = room.answer(message.to_string().as_bytes());
        serde_json::from_str(&answer).expect("JSON")
    }

    fn opened(data: Option<&str>) -> Room {
        let mut room = Room::default();
        let mut files = json!({ "tank.dgd": MODEL });
        if let Some(data) = data {
            files["run.csv"] = json!(data);
        }
        let name = data.map(|_| "run.csv");
        let open =
            json!({ "open": { "files": files, "model": "tank.dgd", "data": name, "until": 60 } });
        assert_eq!(said(&mut room, &open), json!({ "ok": true }));
        room
    }

    #[test]
    fn a_model_says_what_it_must_be_given_and_runs_on_it() {
        let mut room = opened(None);
        let needs = said(&mut room, &json!({ "inputs": {} }));
        assert_eq!(
            (&needs["inputs"][0]["name"], &needs["inputs"][0]["unit"]),
            (&json!("q"), &json!("lpm"))
        );
        let refused = said(&mut room, &json!({ "ask": {} }));
        assert!(
            refused["error"].as_str().is_some_and(|why| why.contains("`q [lpm]`")),
            "{refused}"
        );
        // 600 lpm into 2 m² for a minute: 0.3 m.
        let mut room = opened(Some("time [s],q [lpm]\n0,600\n60,600\n"));
        let table = said(&mut room, &json!({ "table": { "values": {} } }));
        let columns = table["result"]["columns"].as_array().expect("columns");
        let h = columns.iter().find(|column| column["name"] == "h").expect("the level");
        let last = h["values"].as_array().and_then(|all| all.last()?.as_f64()).expect("a number");
        assert!((last - 1.3).abs() < 1e-9, "{last}");
        let halved = said(&mut room, &json!({ "table": { "values": { "A": 1.0 } } }));
        let columns = halved["result"]["columns"].as_array().expect("columns");
        let last = columns[1]["values"].as_array().and_then(|all| all.last()?.as_f64());
        assert!(last.is_some_and(|h| (h - 1.6).abs() < 1e-9), "{halved}");
        let answer = said(&mut room, &json!({ "ask": { "do": "run" } }));
        assert_eq!(answer["controls"]["parameters"][0]["name"], json!("A"), "{answer}");
    }

    #[test]
    fn what_is_no_question_is_answered_too() {
        let mut room = Room::default();
        for wrong in ["", "{}", "{\"shell\":{}}", "{\"ask\":{\"do\":\"nothing\"}}"] {
            let answer: Value = serde_json::from_str(&room.answer(wrong.as_bytes())).expect("JSON");
            assert_eq!(answer["ok"], json!(false), "{wrong}");
        }
        // Nothing is open yet.
        assert_eq!(said(&mut room, &json!({ "ask": {} }))["ok"], json!(false));
        let effect = json!({ "open": { "files": { "e.dgd": "effect e on tank\nkind plant\nparameter P [m^3/s] = 1\nnull P = 0\nadd P to level\n" }, "model": "e.dgd" } });
        said(&mut room, &effect);
        let answer = said(&mut room, &json!({ "inputs": {} }));
        assert!(answer["error"].as_str().is_some_and(|why| why.contains("an effect")), "{answer}");
    }
}
