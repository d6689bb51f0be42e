//! What answers a page: models compiled and read once, and the curves that were kept.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use dgd_data::FileSystem;
use dgd_data::open::read_text;
use dgd_identify::{Progress, Watch};
use dgd_work::check::Description;
use dgd_work::{
    Choices, FitRequest, Listener, Mistake, Prepared, Remark, RunRequest, SensitivityRequest,
    Session, Simulated, WorkError, applicable, fit, prepare, sensitivity,
};
use serde_json::{Value, json};

use crate::answer::{controls, of_error, run};
use crate::ask::{Ask, Do};
use crate::figures::{Charts, Kept, of_run, of_sensitivities};
use crate::stop::Stop;
use crate::values::Values;

/// Models that stay compiled: a page goes back and forth between a few choices.
const MOST_READY: usize = 4;

/// Most curves that can be told apart beside the present ones.
const MOST_KEPT: usize = 4;

/// What is compiled: variants and effects.
type Chosen = (BTreeMap<String, String>, Vec<String>);

/// A model that is ready.
struct Ready {
    chosen: Chosen,
    /// The text of the model as it was read.
    text: String,
    prepared: Prepared,
}

/// A model that is played with.
pub struct Bench {
    request: RunRequest,
    ready: Vec<Ready>,
    /// What was read for a model that has mistakes.
    broken: Vec<PathBuf>,
    kept: Vec<Kept>,
    /// How many were kept so far.
    count: u32,
    stop: Stop,
}

impl Bench {
    /// Of this run; what it chooses and sets is where a page begins.
    pub fn new(request: RunRequest) -> Bench {
        Bench {
            request,
            ready: Vec::new(),
            broken: Vec::new(),
            kept: Vec::new(),
            count: 0,
            stop: Stop::default(),
        }
    }

    /// Another run, of other files perhaps; kept curves stay.
    pub fn open(&mut self, request: RunRequest) {
        self.request = request;
        self.forget();
    }

    /// What a page begins with.
    pub fn first(&self) -> Value {
        let Choices { variant, apply, .. } = &self.request.choices;
        let pairs = variant.iter().filter_map(|text| text.split_once('='));
        let variant: BTreeMap<&str, &str> = pairs.map(|(a, b)| (a.trim(), b.trim())).collect();
        let data = self.request.data.as_ref().map(|data| data.display().to_string());
        let model = self.request.model.display().to_string();
        json!({ "file": model, "data": data, "variant": variant, "apply": apply })
    }

    /// A file has changed: what was read of it is read again when it is needed.
    pub fn forget(&mut self) {
        self.ready.clear();
    }

    /// What was read for the answers so far: these files change them.
    pub fn files(&self) -> Vec<PathBuf> {
        let read = self.ready.iter().flat_map(|ready| ready.prepared.files.iter().cloned());
        let mut files: Vec<PathBuf> = read.collect();
        files.extend(self.broken.iter().cloned());
        files.push(self.request.model.clone());
        files.extend(self.request.data.clone());
        files.sort();
        files.dedup();
        files
    }

    /// Stops an answer that is under way.
    pub fn stop(&self) -> Stop {
        self.stop.clone()
    }

    /// The answer to a page, as JSON, of the files as they are now; one that was stopped says that it is overtaken.
    pub fn answer(&mut self, ask: &Ask, files: &dyn FileSystem) -> String {
        let ear = Ear { stop: self.stop.clone(), remarks: Mutex::new(Vec::new()) };
        let session = Session::new(&ear).with_files(files);
        let answered = match ask.act {
            Do::Run => self.run(ask, session),
            Do::Sensitivities => self.sensitivities(ask, session),
            Do::Keep => self.keep(ask, session),
            Do::Drop => Ok(self.release(&ask.kept)),
            Do::Fit => self.fit(ask, session),
        };
        if self.stop.is_asked() {
            return json!({ "ok": false, "overtaken": true }).to_string();
        }
        let answered = answered.unwrap_or_else(|error| Answer::new(of_error(&error)));
        let remarks = ear.remarks.into_inner().unwrap_or_else(PoisonError::into_inner);
        answered.to_json(&remarks)
    }

    fn run(&mut self, ask: &Ask, session: Session<'_>) -> Result<Answer, WorkError> {
        let simulated = self.simulate(ask, session)?;
        let ready = self.ready(ask, session)?;
        let Ready { text, prepared, .. } = &self.ready[ready];
        let written = Values::of(text, &ask.variant);
        let written: Vec<String> = written.names().map(str::to_owned).collect();
        let description = &prepared.description;
        let effects = applicable(session.files, &self.request.model, &description.model);
        let controls = controls(description, &effects, &ask.apply, &written);
        let kept: Vec<&Kept> =
            self.kept.iter().filter(|kept| ask.kept.contains(&kept.number)).collect();
        let charts = of_run(&simulated, &kept, &ask.have);
        let mut all = run(&simulated);
        all["ok"] = json!(true);
        all["digest"] = json!(digest(text));
        all["controls"] = controls;
        Ok(Answer { all, charts: Some(charts) })
    }

    fn sensitivities(&self, ask: &Ask, session: Session<'_>) -> Result<Answer, WorkError> {
        let Some(description) = self.described(ask) else {
            return Ok(Answer::new(json!({ "ok": true, "markup": "" })));
        };
        let free = description.parameters.iter().filter(|parameter| !parameter.fixed);
        let to: Vec<String> = free.map(|parameter| parameter.name.clone()).collect();
        if to.is_empty() || description.outputs.is_empty() {
            return Ok(Answer::new(json!({ "ok": true, "markup": "" })));
        }
        let mut run = self.request_of(ask);
        run.choices.set.extend(ask.values.iter().map(|(name, value)| format!("{name}={value:?}")));
        let mut request = SensitivityRequest::new(run);
        request.scaled = true;
        request.to = to;
        let single = description.outputs.iter().filter(|output| output.range.is_none());
        let units: Vec<&str> = single.clone().map(|output| &*output.unit).collect();
        request.of = single.map(|output| output.name.clone()).collect();
        let found = sensitivity(&request, session)?;
        let charts = of_sensitivities(&found, &units, &ask.have);
        Ok(Answer { all: json!({ "ok": true }), charts: Some(charts) })
    }

    fn keep(&mut self, ask: &Ask, session: Session<'_>) -> Result<Answer, WorkError> {
        if self.kept.len() == MOST_KEPT {
            return Err(WorkError::Usage(format!(
                "{MOST_KEPT} sets are kept; let go of one to keep another"
            )));
        }
        let figures = self.simulate(ask, session)?.figures();
        self.count += 1;
        let what = self.in_words(ask);
        self.kept.push(Kept { number: self.count, what: what.clone(), figures });
        let kept = json!({ "number": self.count, "what": what });
        Ok(Answer::new(json!({ "ok": true, "kept": kept })))
    }

    fn release(&mut self, numbers: &[u32]) -> Answer {
        self.kept.retain(|kept| !numbers.contains(&kept.number));
        let kept = self.kept.iter();
        let kept = kept.map(|kept| json!({ "number": kept.number, "what": kept.what }));
        Answer::new(json!({ "ok": true, "left": kept.collect::<Vec<_>>() }))
    }

    fn fit(&self, ask: &Ask, session: Session<'_>) -> Result<Answer, WorkError> {
        let run = self.request_of(ask);
        let Some(data) = run.data else {
            return Err(WorkError::Usage("a fit needs a recording of the outputs".to_owned()));
        };
        let mut request = FitRequest::new(run.model, vec![data]);
        request.choices = run.choices;
        request
            .choices
            .set
            .extend(ask.values.iter().map(|(name, value)| format!("{name}={value:?}")));
        request.solve = run.solve;
        let fitted = fit(&request, session)?;
        let values = fitted.to_json()["parameters"].clone();
        let text = fitted.to_text();
        Ok(Answer::new(json!({ "ok": true, "parameters": values, "text": text })))
    }

    fn simulate(&mut self, ask: &Ask, session: Session<'_>) -> Result<Simulated, WorkError> {
        let at = self.ready(ask, session)?;
        let values: Vec<(&str, f64)> =
            ask.values.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        self.ready[at].prepared.simulate(&values)
    }

    /// Where the model is ready with what is chosen.
    fn ready(&mut self, ask: &Ask, session: Session<'_>) -> Result<usize, WorkError> {
        let chosen = chosen_by(ask);
        if let Some(at) = self.ready.iter().position(|ready| ready.chosen == chosen) {
            return Ok(at);
        }
        // Before it is compiled: of a file that changes meanwhile the older text refuses to be written to.
        let text = read_text(session.files, &self.request.model).unwrap_or_default();
        self.broken.clear();
        let prepared = prepare(&self.request_of(ask), session).inspect_err(|error| {
            if let WorkError::Diagnosed { sources, .. } = error {
                let read = sources.iter().map(|source| PathBuf::from(&source.name));
                self.broken.extend(read.filter(|path| session.files.is_file(path)));
            }
        })?;
        if self.ready.len() == MOST_READY {
            self.ready.remove(0);
        }
        self.ready.push(Ready { chosen, text, prepared });
        Ok(self.ready.len() - 1)
    }

    /// What is in the model with what is chosen, where it is ready.
    fn described(&self, ask: &Ask) -> Option<&Description> {
        let ready = self.ready.iter().find(|ready| ready.chosen == chosen_by(ask))?;
        Some(&ready.prepared.description)
    }

    /// The run with what is chosen; the values of sliders are not in it.
    fn request_of(&self, ask: &Ask) -> RunRequest {
        let mut request = self.request.clone();
        let variant = ask.variant.iter().map(|(name, choice)| format!("{name}={choice}"));
        request.choices.variant = variant.collect();
        request.choices.apply.clone_from(&ask.apply);
        request
    }

    /// What is chosen and set in a line.
    fn in_words(&self, ask: &Ask) -> String {
        let parameters = self.described(ask).map(|description| &*description.parameters);
        let value = |(name, value): (&String, &f64)| {
            let own = parameters.and_then(|all| all.iter().find(|one| one.name == *name));
            let unit = own.map_or("", |parameter| &parameter.unit);
            let unit = if unit == "1" { "" } else { unit };
            format!("{name} = {value} {unit}").trim_end().to_owned()
        };
        let variants = ask.variant.iter().map(|(name, choice)| format!("{name}: {choice}"));
        let effects = ask.apply.iter().map(|effect| format!("with {effect}"));
        let all: Vec<String> =
            ask.values.iter().map(value).chain(variants).chain(effects).collect();
        if all.is_empty() { "as in the file".to_owned() } else { all.join(", ") }
    }
}

/// What tells a text from another one.
pub(crate) fn digest(text: &str) -> String {
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}

fn chosen_by(ask: &Ask) -> Chosen {
    (ask.variant.clone(), ask.apply.clone())
}

/// An answer, charts apart, whose numbers are text already.
struct Answer {
    all: Value,
    charts: Option<Charts>,
}

impl Answer {
    fn new(all: Value) -> Answer {
        Answer { all, charts: None }
    }

    fn to_json(&self, remarks: &[String]) -> String {
        let mut all = self.all.clone();
        all["remarks"] = json!(remarks);
        let Some(charts) = &self.charts else { return all.to_string() };
        all["markup"] = json!(charts.markup);
        let text = all.to_string();
        let open = text.strip_suffix('}').unwrap_or(&text);
        format!("{open},\"charts\":{}}}", charts.json)
    }
}

/// Hears what is remarked, and stops what is overtaken.
#[derive(Debug)]
struct Ear {
    stop: Stop,
    remarks: Mutex<Vec<String>>,
}

impl Watch for Ear {
    fn advanced(&self, _: Progress) {}

    fn is_stopped(&self) -> bool {
        self.stop.is_asked()
    }
}

impl Listener for Ear {
    fn remark(&self, remark: Remark<'_>) {
        let words = match remark {
            Remark::Words(words) => words.to_owned(),
            Remark::Diagnostic(diagnostic, sources) => Mistake::of(diagnostic, sources).message,
            // A kind of remark that is not known yet.
            _ => return,
        };
        self.remarks.lock().unwrap_or_else(PoisonError::into_inner).push(words);
    }
}

#[cfg(test)]
mod tests {
    use dgd_data::InMemory;

    use super::*;

    const MODEL: &str = "model cooling\n\
        parameter tau [min] = 2 in 0.1 .. 100, log  /// time constant\n\
        parameter T_0 [K] = 80 in 0 .., fixed\n\
        state T [K] = T_0\n\
        variant law {\n  newton { equation cooling: tau*der(T) = -T }\n  none { equation cooling: tau*der(T) = 0*T }\n}\n\
        output T [K] noise 0.1\n";
    const EFFECT: &str = "/// Heated.\neffect heat on cooling\nkind plant\n\
        parameter P [K] = 1\nnull P = 0\nadd P to cooling\n";
    const DATA: &str = "time [s],T [K]\n0,80.1\n50,53.2\n100,36.1\n200,16.0\n300,7.1\n";

    fn bench() -> (Bench, InMemory) {
        let files = InMemory::default()
            .with("cooling.dgd", MODEL)
            .with("effects/heat.dgd", EFFECT)
            .with("cup.csv", DATA);
        let mut request = RunRequest::new("cooling.dgd");
        request.data = Some("cup.csv".into());
        (Bench::new(request), files)
    }

    fn asked(bench: &mut Bench, files: &InMemory, ask: &str) -> Value {
        let ask = Ask::read(ask.as_bytes()).expect("an ask");
        let answer = bench.answer(&ask, files);
        serde_json::from_str(&answer).expect("JSON")
    }

    /// The last number of a curve in the first panel of the first figure.
    fn last(answer: &Value, curve: usize) -> f64 {
        let charts = &answer["charts"];
        let series = &charts["figures"][0]["panels"][0]["series"][curve];
        let column = series["y"].as_u64().expect("a column") as usize;
        let column = charts["columns"][column].as_array().expect("numbers");
        column.last().and_then(Value::as_f64).expect("a number")
    }

    #[test]
    fn a_run_has_what_was_chosen_set_and_measured() {
        let (mut bench, files) = bench();
        let answer = asked(&mut bench, &files, "{}");
        assert_eq!(answer["ok"], json!(true), "{answer}");
        // 80 K exp(−300 s / 120 s).
        assert!((last(&answer, 0) - 6.566_8).abs() < 1e-3, "{}", last(&answer, 0));
        assert!((last(&answer, 1) - 7.1).abs() < 1e-9);
        let tau = &answer["controls"]["parameters"][0];
        assert_eq!(
            (&tau["name"], &tau["unit"], &tau["value"]),
            (&json!("tau"), &json!("min"), &json!(2.0))
        );
        assert_eq!((&tau["bounds"], &tau["log"]), (&json!([0.1, 100.0]), &json!(true)));
        assert_eq!(tau["writable"], json!(true));
        assert_eq!(answer["controls"]["effects"][0]["name"], json!("heat"));
        assert!(answer["agreement"].as_str().is_some_and(|table| table.contains("<table")));
        // In minutes, with the other law, and with the effect.
        let moved = asked(&mut bench, &files, r#"{"values":{"tau":4}}"#);
        assert!((last(&moved, 0) - 80.0 * (-1.25_f64).exp()).abs() < 1e-3);
        let held = asked(&mut bench, &files, r#"{"variant":{"law":"none"}}"#);
        assert!((last(&held, 0) - 80.0).abs() < 1e-3);
        let heated = asked(&mut bench, &files, r#"{"apply":["heat"],"values":{"P":3}}"#);
        assert!((last(&heated, 0) - (3.0 + 77.0 * (-2.5_f64).exp())).abs() < 1e-3);
        assert_eq!(heated["controls"]["effects"][0]["applied"], json!(true));
        let own = heated["controls"]["parameters"].as_array().expect("parameters");
        let effect = own.iter().find(|one| one["name"] == json!("P")).expect("the effect's");
        assert_eq!(effect["writable"], json!(false), "it stands in another file");
    }

    #[test]
    fn kept_curves_stay_beside_what_follows_until_they_are_let_go() {
        let (mut bench, files) = bench();
        let kept = asked(&mut bench, &files, r#"{"do":"keep","values":{"tau":4}}"#);
        assert_eq!(kept["kept"]["what"], json!("tau = 4 min"));
        let answer = asked(&mut bench, &files, r#"{"kept":[1]}"#);
        assert!((last(&answer, 2) - 80.0 * (-1.25_f64).exp()).abs() < 1e-3);
        assert!((last(&answer, 0) - 6.566_8).abs() < 1e-3);
        let residuals = &answer["charts"]["figures"][1]["panels"][0]["series"];
        assert_eq!(residuals.as_array().map(Vec::len), Some(2));
        // They are as they were, though the file is another one now.
        let files = files.with("cooling.dgd", MODEL.replace("= 80", "= 40"));
        bench.forget();
        let answer = asked(&mut bench, &files, r#"{"kept":[1]}"#);
        assert!((last(&answer, 0) - 3.283_4).abs() < 1e-3);
        assert!((last(&answer, 2) - 80.0 * (-1.25_f64).exp()).abs() < 1e-3);
        for _ in 0..3 {
            assert_eq!(asked(&mut bench, &files, r#"{"do":"keep"}"#)["ok"], json!(true));
        }
        let refused = asked(&mut bench, &files, r#"{"do":"keep"}"#);
        assert!(refused["error"].as_str().is_some_and(|why| why.contains("let go")));
        let left = asked(&mut bench, &files, r#"{"do":"drop","kept":[1,2]}"#);
        assert_eq!(left["left"].as_array().map(Vec::len), Some(2));
    }

    #[test]
    fn sensitivities_are_scaled_and_columns_are_sent_once() {
        let (mut bench, files) = bench();
        let first = asked(&mut bench, &files, "{}");
        let answer = asked(&mut bench, &files, r#"{"do":"sensitivities","values":{"tau":4}}"#);
        // tau dT/dtau = T t/tau, T after 300 s being 80 K exp(−1.25).
        let expected = 80.0 * (-1.25_f64).exp() * 1.25;
        assert!((last(&answer, 0) - expected).abs() < 1e-2, "{}", last(&answer, 0));
        let series = &answer["charts"]["figures"][0]["panels"][0]["series"];
        assert_eq!(series.as_array().map(Vec::len), Some(1), "T_0 is fixed");
        let keys = first["charts"]["keys"].to_string();
        let again = asked(&mut bench, &files, &format!("{{\"have\":{keys}}}"));
        let columns = again["charts"]["columns"].as_array().expect("columns");
        assert!(columns.iter().all(Value::is_null), "{columns:?}");
    }

    #[test]
    fn mistakes_have_places_and_the_text_around_them() {
        let (mut bench, files) = bench();
        let files = files.with("cooling.dgd", MODEL.replace("-T }", "-S }"));
        let answer = asked(&mut bench, &files, "{}");
        let mistake = &answer["mistakes"][0];
        assert_eq!((&mistake["code"], &mistake["places"][0]["line"]), (&json!("E201"), &json!(6)));
        assert!(answer["texts"]["cooling.dgd"].as_str().is_some_and(|text| text.contains("-S }")));
        let answer = asked(&mut bench, &files, r#"{"values":{"tau":1e9}}"#);
        assert_eq!(answer["ok"], json!(false));
    }

    #[test]
    fn a_fit_gives_values_for_the_sliders() {
        let (mut bench, files) = bench();
        let answer = asked(&mut bench, &files, r#"{"do":"fit"}"#);
        let tau = answer["parameters"]["tau"]["value"].as_f64().expect("a value");
        assert!((tau - 124.5 / 60.0).abs() < 0.05, "{answer}");
    }

    #[test]
    fn what_is_overtaken_says_so() {
        let (mut bench, files) = bench();
        bench.stop().stop();
        let answer = bench.answer(&Ask::default(), &files);
        assert_eq!(answer, r#"{"ok":false,"overtaken":true}"#);
        bench.stop().reset();
        assert_ne!(bench.answer(&Ask::default(), &files), answer);
        assert_eq!(bench.first()["file"], json!("cooling.dgd"));
        assert_eq!(bench.files(), [PathBuf::from("cooling.dgd"), "cup.csv".into()]);
    }
}
