//! Answers a page, with compiled models and kept curves.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use dgd_data::FileSystem;
use dgd_data::open::read_text;
use dgd_identify::{Monitor, Progress};
use dgd_runtime::RunMonitor;
use dgd_runtime::signature::number::with_unit;
use dgd_work::check::ModelDescription;
use dgd_work::{
    ApplicableEffect, FitRequest, Mistake, ModelChoices, PreparedRun, Remark, Reporter, RunRequest,
    SensitivityRequest, SimulationResult, TaskContext, UsageError, WorkError, applicable, fit,
    neutral, prepare, sensitivity,
};
use serde_json::{Value, json};

use crate::answer::{controls, of_error, run};
use crate::ask::{PageAction, PageRequest};
use crate::figures::{KeptCurves, SectionCharts, of_run, of_sensitivities};
use crate::stop::StopHandle;
use crate::values::ParameterValues;

/// Number of models that stay compiled: a page switches between a few choices.
const MOST_READY: usize = 4;

/// Maximum number of kept curves that are distinguishable from the current ones.
const MOST_KEPT: usize = 4;

/// The choices of a compiled model: variants and effects.
type ModelSelection = (BTreeMap<String, String>, Vec<String>);

/// A compiled model.
struct ReadyModel {
    chosen: ModelSelection,
    /// The text of the model when it was read.
    text: String,
    /// Parameters whose values are in the text.
    written: Vec<String>,
    /// Effects that can be applied to it.
    effects: Vec<ApplicableEffect>,
    prepared: PreparedRun,
}

/// A model for interactive use.
pub struct ModelBench {
    request: RunRequest,
    ready: Vec<ReadyModel>,
    /// Files read for a model with errors.
    broken: Vec<PathBuf>,
    kept: Vec<KeptCurves>,
    /// Number of curves kept so far.
    count: u32,
    stop: StopHandle,
}

impl ModelBench {
    /// A bench for this run, whose choices and settings are the initial ones of a page.
    pub fn new(request: RunRequest) -> ModelBench {
        ModelBench {
            request,
            ready: Vec::new(),
            broken: Vec::new(),
            kept: Vec::new(),
            count: 0,
            stop: StopHandle::default(),
        }
    }

    /// Switches to another run, possibly of other files; kept curves stay.
    pub fn open(&mut self, request: RunRequest) {
        self.request = request;
        self.forget();
    }

    /// The initial data of a page.
    pub fn first(&self) -> Value {
        let ModelChoices { variant, apply, .. } = &self.request.choices;
        let pairs = variant.iter().filter_map(|text| text.split_once('='));
        let variant: BTreeMap<&str, &str> = pairs.map(|(a, b)| (a.trim(), b.trim())).collect();
        let data = self.request.data.as_ref().map(|data| data.display().to_string());
        let model = self.request.model.display().to_string();
        json!({ "file": model, "data": data, "variant": variant, "apply": apply })
    }

    /// Discards compiled models after a file has changed; they are read again when needed.
    pub fn forget(&mut self) {
        self.ready.clear();
    }

    /// The files on which the answers so far depend.
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

    /// A handle to stop the current answer.
    pub fn stop(&self) -> StopHandle {
        self.stop
    }

    /// The answer to a page, as JSON, from the current files; a stopped answer says that it is superseded.
    pub fn answer(&mut self, ask: &PageRequest, files: &dyn FileSystem) -> String {
        let ear = RemarkListener { stop: self.stop, remarks: Mutex::new(Vec::new()) };
        let session = TaskContext::new(&ear).with_files(files);
        let answered = match ask.act {
            PageAction::Run => self.run(ask, session),
            PageAction::Sensitivities => self.sensitivities(ask, session),
            PageAction::Keep => self.keep(ask, session),
            PageAction::Drop => Ok(self.release(&ask.kept)),
            PageAction::Fit => self.fit(ask, session),
        };
        if self.stop.is_asked() {
            return json!({ "ok": false, "overtaken": true }).to_string();
        }
        let answered = answered.unwrap_or_else(|error| ChartedAnswer::new(of_error(&error)));
        let remarks = ear.remarks.into_inner().unwrap_or_else(PoisonError::into_inner);
        answered.to_json(&remarks)
    }

    fn run(
        &mut self,
        ask: &PageRequest,
        session: TaskContext<'_>,
    ) -> Result<ChartedAnswer, WorkError> {
        let simulated = self.simulate(ask, session)?;
        let ready = self.ready(ask, session)?;
        let ReadyModel { text, written, effects, prepared, .. } = &self.ready[ready];
        let controls = controls(&prepared.description, effects, &ask.apply, written);
        let kept: Vec<&KeptCurves> =
            self.kept.iter().filter(|kept| ask.kept.contains(&kept.number)).collect();
        let charts = of_run(&simulated, &kept, &ask.have);
        let mut answer = run(&simulated);
        answer["ok"] = json!(true);
        answer["digest"] = json!(digest(text));
        answer["controls"] = controls;
        Ok(ChartedAnswer { all: answer, charts: Some(charts) })
    }

    fn sensitivities(
        &self,
        ask: &PageRequest,
        session: TaskContext<'_>,
    ) -> Result<ChartedAnswer, WorkError> {
        let Some(description) = self.described(ask) else {
            return Ok(ChartedAnswer::new(json!({ "ok": true, "markup": "" })));
        };
        let free = description.parameters.iter().filter(|parameter| !parameter.fixed);
        let directions: Vec<String> = free.map(|parameter| parameter.name.clone()).collect();
        if directions.is_empty() || description.outputs.is_empty() {
            return Ok(ChartedAnswer::new(json!({ "ok": true, "markup": "" })));
        }
        let mut run = self.request_of(ask);
        run.choices.set.extend(self.settings(ask));
        let mut request = SensitivityRequest::new(run);
        request.scaled = true;
        request.to = directions;
        let single = description.outputs.iter().filter(|output| output.range.is_none());
        let units: Vec<&str> = single.clone().map(|output| &*output.unit).collect();
        request.of = single.map(|output| output.name.clone()).collect();
        let sensitivities = sensitivity(&request, session)?;
        let charts = of_sensitivities(&sensitivities, &units, &ask.have);
        Ok(ChartedAnswer { all: json!({ "ok": true }), charts: Some(charts) })
    }

    fn keep(
        &mut self,
        ask: &PageRequest,
        session: TaskContext<'_>,
    ) -> Result<ChartedAnswer, WorkError> {
        if self.kept.len() == MOST_KEPT {
            return Err(UsageError::TooManyKept(MOST_KEPT).into());
        }
        let figures = self.simulate(ask, session)?.figures();
        self.count += 1;
        let what = self.in_words(ask);
        self.kept.push(KeptCurves { number: self.count, what: what.clone(), figures });
        let kept = json!({ "number": self.count, "what": what });
        Ok(ChartedAnswer::new(json!({ "ok": true, "kept": kept })))
    }

    fn release(&mut self, numbers: &[u32]) -> ChartedAnswer {
        self.kept.retain(|kept| !numbers.contains(&kept.number));
        let kept = self.kept.iter();
        let kept = kept.map(|kept| json!({ "number": kept.number, "what": kept.what }));
        ChartedAnswer::new(json!({ "ok": true, "left": kept.collect::<Vec<_>>() }))
    }

    fn fit(
        &mut self,
        ask: &PageRequest,
        session: TaskContext<'_>,
    ) -> Result<ChartedAnswer, WorkError> {
        self.ready(ask, session)?;
        let run = self.request_of(ask);
        let Some(data) = run.data else {
            return Err(UsageError::FitWithoutData.into());
        };
        let mut request = FitRequest::new(run.model, vec![data]);
        request.choices = run.choices;
        request.choices.set.extend(self.settings(ask));
        request.solve = run.solve;
        let fitted = fit(&request, session)?;
        let values = &fitted.result().parameters;
        let text = fitted.to_text();
        Ok(ChartedAnswer::new(json!({ "ok": true, "parameters": values, "text": text })))
    }

    fn simulate(
        &mut self,
        ask: &PageRequest,
        session: TaskContext<'_>,
    ) -> Result<SimulationResult, WorkError> {
        let position = self.ready(ask, session)?;
        let values = self.known_values(ask);
        self.ready[position].prepared.simulate(&values)
    }

    /// The values of parameters that the model has: a page may still send those of an earlier text.
    fn known_values<'a>(&self, ask: &'a PageRequest) -> Vec<(&'a str, f64)> {
        let parameters = self.described(ask).map_or(&[][..], |found| &found.parameters);
        let is_known = |name: &str| parameters.iter().any(|parameter| parameter.name == name);
        let values = ask.values.iter().map(|(name, value)| (name.as_str(), *value));
        values.filter(|(name, _)| is_known(name)).collect()
    }

    /// [`Self::known_values`] in command-line form.
    fn settings(&self, ask: &PageRequest) -> Vec<String> {
        let values = self.known_values(ask).into_iter();
        values.map(|(name, value)| format!("{name}={value:?}")).collect()
    }

    /// The position of the compiled model with these choices, compiled if necessary.
    fn ready(&mut self, ask: &PageRequest, session: TaskContext<'_>) -> Result<usize, WorkError> {
        let chosen = chosen_by(ask);
        if let Some(at) = self.ready.iter().position(|ready| ready.chosen == chosen) {
            return Ok(at);
        }
        // Read before compilation: if the file changes meanwhile, writing is refused because of the older text.
        let text = read_text(session.files, &self.request.model).unwrap_or_default();
        self.broken.clear();
        let prepared = prepare(&self.request_of(ask), session).inspect_err(|error| {
            if let WorkError::Diagnosed { sources, .. } = error {
                let read = sources.files().map(|source| PathBuf::from(&source.name));
                self.broken.extend(read.filter(|path| session.files.is_file(path)));
            }
        })?;
        if self.ready.len() == MOST_READY {
            self.ready.remove(0);
        }
        let written =
            ParameterValues::read(&text, &ask.variant).names().map(str::to_owned).collect();
        let model = &prepared.description.model;
        let effects = applicable(session.files, &self.request.model, model);
        self.ready.push(ReadyModel { chosen, text, written, effects, prepared });
        Ok(self.ready.len() - 1)
    }

    /// The description of the model with these choices, if it is compiled.
    fn described(&self, ask: &PageRequest) -> Option<&ModelDescription> {
        let ready = self.ready.iter().find(|ready| ready.chosen == chosen_by(ask))?;
        Some(&ready.prepared.description)
    }

    /// The run with these choices, without the values of sliders.
    fn request_of(&self, ask: &PageRequest) -> RunRequest {
        let mut request = self.request.clone();
        let variant = ask.variant.iter().map(|(name, choice)| format!("{name}={choice}"));
        request.choices.variant = variant.collect();
        request.choices.apply.clone_from(&ask.apply);
        request
    }

    /// Choices and settings in one line.
    fn in_words(&self, ask: &PageRequest) -> String {
        let parameters = self.described(ask).map(|description| &*description.parameters);
        let value = |(name, value): (&String, &f64)| {
            let declared = parameters.and_then(|all| all.iter().find(|one| one.name == *name));
            let unit = declared.map_or("", |parameter| &parameter.unit);
            format!("{name} = {}", with_unit(value, unit))
        };
        let variants = ask.variant.iter().map(|(name, choice)| format!("{name}: {choice}"));
        let effects = ask.apply.iter().map(|effect| format!("with {effect}"));
        let words: Vec<String> =
            ask.values.iter().map(value).chain(variants).chain(effects).collect();
        if words.is_empty() { "as in the file".to_owned() } else { words.join(", ") }
    }
}

/// A digest that identifies a text.
pub(crate) fn digest(text: &str) -> String {
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}

fn chosen_by(ask: &PageRequest) -> ModelSelection {
    (ask.variant.clone(), ask.apply.clone())
}

/// An answer, with charts kept separate, since their numbers are already text.
struct ChartedAnswer {
    all: Value,
    charts: Option<SectionCharts>,
}

impl ChartedAnswer {
    fn new(all: Value) -> ChartedAnswer {
        ChartedAnswer { all, charts: None }
    }

    fn to_json(&self, remarks: &[String]) -> String {
        let mut fields = self.all.clone();
        fields["remarks"] = json!(remarks);
        let Some(charts) = &self.charts else { return fields.to_string() };
        fields["markup"] = json!(charts.markup);
        let text = fields.to_string();
        let open = text.strip_suffix('}').unwrap_or(&text);
        format!("{open},\"charts\":{}}}", charts.json)
    }
}

/// Receives remarks, and stops superseded work.
#[derive(Debug)]
struct RemarkListener {
    stop: StopHandle,
    remarks: Mutex<Vec<String>>,
}

impl Monitor for RemarkListener {
    fn advanced(&self, _: Progress) {}

    fn is_stopped(&self) -> bool {
        self.stop.is_asked()
    }

    fn watched(&self) -> Option<&'static RunMonitor> {
        Some(self.stop.watched())
    }
}

impl Reporter for RemarkListener {
    fn remark(&self, remark: Remark<'_>) {
        let words = match remark {
            Remark::Words(words) => words.to_owned(),
            Remark::Diagnostic(diagnostic, sources) => {
                Mistake::from_diagnostic(diagnostic, sources, neutral).message
            }
            // A kind of remark that is not known here.
            _ => return,
        };
        self.remarks.lock().unwrap_or_else(PoisonError::into_inner).push(words);
    }
}
