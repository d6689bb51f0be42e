//! Models: read once, for any number of requests.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use dgd_compiler::model::typeset::formula::{FormulaLine, lines};
use dgd_compiler::model::typeset::{latex, mathml};
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_data::open::{FolderEntry, read_import};
use dgd_data::{DiskFiles, FileSystem, InMemory, LayeredFiles};
use dgd_work::{
    CheckRequest, DiscoverRequest, FitRequest, ModelChoices, RunRequest, SensitivityRequest,
    SimulateRequest, TaskContext, TrackRequest, UsageError, WorkError, check, discover, equations,
    fit, objective, sensitivity, simulate,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::data::{PyRecording, put_all};
use crate::errors::RequestedTask;
use crate::guard::supervised;
use crate::observer::PyObserver;
use crate::options::{self, SessionOptions};
use crate::points::{PyEquations, PyObjective};
use crate::results::{PyFound, PyRun};
use crate::tracker::PyTracker;

/// The folder of effects next to a model.
const EFFECTS: &str = "effects";

/// A checked model with all texts that it needs: it does not change when files do.
#[pyclass(frozen, name = "Model", module = "dgd._dgd")]
pub(crate) struct PyModel {
    path: PathBuf,
    texts: InMemory,
    choices: ModelChoices,
    description: String,
    text: String,
    latex: String,
    equations: Vec<(String, String)>,
    remarks: Vec<String>,
}

/// Reads a model: from these texts, or else from files.
#[pyfunction]
pub(crate) fn load(
    py: Python<'_>,
    path: PathBuf,
    texts: Vec<(String, Vec<u8>)>,
    variant: Vec<String>,
    set: Vec<String>,
    apply: Vec<String>,
) -> PyResult<PyModel> {
    let add = |all: InMemory, (path, text): (String, Vec<u8>)| all.with_file(path, text);
    let in_memory = texts.into_iter().fold(InMemory::default(), add);
    let choices = ModelChoices::new(variant, set, apply);
    let observer = Arc::new(PyObserver::new(None));
    supervised(py, RequestedTask::Load, &observer, move |observer| {
        let files = LayeredFiles { above: &in_memory, below: &DiskFiles };
        let session = TaskContext::new(observer).with_files(&files);
        let mut request = CheckRequest::new(&path);
        request.choices = choices.clone();
        let checked = check(&request, session)?;
        let Some(description) = checked.to_json() else {
            return Err(UsageError::EffectNotModel(path.clone()).into());
        };
        let loaded = dgd_work::load(&path, &choices, &SensitivityDirections::None, session)?;
        let is_text =
            |name: &str| [".dgd", ".csv", ".csv.gz"].iter().any(|ending| name.ends_with(ending));
        let sources = loaded.sources.files().filter(|source| is_text(&source.name));
        let read = sources.fold(effects_beside(&path, &files), |all, source| {
            all.with_file(&source.name, source.text.as_bytes())
        });
        let (asts, model) = (&loaded.compiled.asts, &loaded.compiled.model);
        let label = |line: &FormulaLine| match line {
            FormulaLine::Equation { label, .. } => label.clone().unwrap_or_default(),
            FormulaLine::Mode(_) | FormulaLine::Transition(_) | FormulaLine::Bound { .. } => {
                String::new()
            }
        };
        let typeset = |line: &FormulaLine| (label(line), mathml::write(line));
        Ok(PyModel {
            text: match &loaded.changed {
                Some(changed) => changed.text(&loaded.sources),
                None => loaded.sources.get(asts[0].source).text.clone(),
            },
            latex: latex::write(asts, model),
            equations: lines(asts, model).iter().map(typeset).collect(),
            description: description.to_string(),
            remarks: observer.remarks(),
            texts: in_memory.and(read),
            path,
            choices,
        })
    })
}

/// The effects next to a model, valid or not: errors are reported when one is used.
fn effects_beside(model: &Path, files: &dyn FileSystem) -> InMemory {
    let folder = model.parent().unwrap_or_else(|| Path::new("")).join(EFFECTS);
    let mut effects = InMemory::default();
    let inside = |entry: FolderEntry| {
        if entry.is_folder { files.entries(&entry.path) } else { vec![entry] }
    };
    for entry in files.entries(&folder).into_iter().flat_map(inside) {
        if let Ok(text) = read_import(files, &entry.path) {
            effects = effects.with_file(&entry.path, text);
        }
    }
    effects
}

impl PyModel {
    /// Runs a long task: prepares the request here, including the files of its recordings, and runs it in a thread.
    /// Returns the result and the remarks.
    fn work<R: Send + 'static, T: Send + 'static>(
        &self,
        (py, task): (Python<'_>, RequestedTask),
        options: &Bound<'_, PyDict>,
        progress: Option<Py<PyAny>>,
        prepare: impl FnOnce(&mut InMemory) -> PyResult<R>,
        work: impl FnOnce(&R, TaskContext<'_>) -> Result<T, WorkError> + Send + 'static,
    ) -> PyResult<(T, Vec<String>)> {
        let mut files = InMemory::default();
        let request = prepare(&mut files)?;
        let SessionOptions { seed, threads } = SessionOptions::read(options)?;
        let above = self.texts.clone().and(files);
        let observer = Arc::new(PyObserver::new(progress));
        let result = supervised(py, task, &observer, move |observer| {
            let files = LayeredFiles { above: &above, below: &DiskFiles };
            let session = TaskContext::new(observer).with_files(&files).with_seed(seed);
            let threads = threads.unwrap_or(session.threads).max(1);
            work(&request, session.with_threads(threads))
        })?;
        Ok((result, observer.remarks()))
    }

    /// A request with these options, about these recordings.
    fn request<'a, R: Args>(
        &self,
        options: &Bound<'_, PyDict>,
        data: impl IntoIterator<Item = &'a PathBuf>,
        valid: impl IntoIterator<Item = &'a PathBuf>,
    ) -> PyResult<R> {
        let data = data.into_iter().map(|path| ("data", path.as_path()));
        let valid = valid.into_iter().map(|path| ("valid", path.as_path()));
        options::request(options, &self.path, data.chain(valid))
    }

    /// The choices of this model, extended by the settings of a call.
    fn with_settings_of(&self, call: &ModelChoices) -> ModelChoices {
        let mut extended = self.choices.clone();
        extended.set.extend_from_slice(&call.set);
        extended
    }

    fn fit_request(
        &self,
        data: Vec<PyRecording>,
        valid: Vec<PyRecording>,
        options: &Bound<'_, PyDict>,
        files: &mut InMemory,
    ) -> PyResult<FitRequest> {
        let (data, valid) = (put_all(data, files), put_all(valid, files));
        let mut request: FitRequest = self.request(options, &data, &valid)?;
        request.choices = self.with_settings_of(&request.choices);
        request.figures = true;
        request.command = options::command(options)?;
        Ok(request)
    }
}

#[pymethods]
impl PyModel {
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }

    /// All texts, by path.
    #[getter]
    fn texts(&self) -> Vec<(String, Vec<u8>)> {
        let entry = |(path, text): (&Path, &[u8])| (path.display().to_string(), text.to_vec());
        self.texts.texts().map(entry).collect()
    }

    /// Variants, settings and effects.
    #[getter]
    fn choices(&self) -> (Vec<String>, Vec<String>, Vec<String>) {
        let ModelChoices { variant, set, apply, .. } = self.choices.clone();
        (variant, set, apply)
    }

    #[getter]
    fn description(&self) -> &str {
        &self.description
    }

    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    #[getter]
    fn latex(&self) -> &str {
        &self.latex
    }

    /// Labels and formulas, as MathML.
    #[getter]
    fn equations(&self) -> Vec<(String, String)> {
        self.equations.clone()
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    fn simulate(
        &self,
        py: Python<'_>,
        data: Option<PyRecording>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<PyRun> {
        let prepare = |files: &mut InMemory| {
            let data = data.map(|recording| recording.put(files));
            let mut request: SimulateRequest = self.request(options, &data, [])?;
            request.run.choices = self.with_settings_of(&request.run.choices);
            // The result may be plotted later.
            request.fields = true;
            Ok(request)
        };
        self.work((py, RequestedTask::Simulate), options, None, prepare, simulate).map(PyRun::new)
    }

    fn sensitivity(
        &self,
        py: Python<'_>,
        data: Option<PyRecording>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<PyRun> {
        let prepare = |files: &mut InMemory| {
            let data = data.map(|recording| recording.put(files));
            let mut request: SensitivityRequest = self.request(options, &data, [])?;
            request.run.choices = self.with_settings_of(&request.run.choices);
            Ok(request)
        };
        self.work((py, RequestedTask::Simulate), options, None, prepare, sensitivity)
            .map(PyRun::new)
    }

    fn fit(
        &self,
        py: Python<'_>,
        data: Vec<PyRecording>,
        valid: Vec<PyRecording>,
        options: &Bound<'_, PyDict>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<PyFound> {
        let prepare = |files: &mut InMemory| self.fit_request(data, valid, options, files);
        let fitted = self.work((py, RequestedTask::Fit), options, progress, prepare, fit)?;
        Ok(PyFound::new(RequestedTask::Fit, fitted))
    }

    fn objective(
        &self,
        py: Python<'_>,
        data: Vec<PyRecording>,
        noise: Vec<(String, f64)>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<PyObjective> {
        let prepare = |files: &mut InMemory| self.fit_request(data, Vec::new(), options, files);
        let made = move |request: &FitRequest, session: TaskContext<'_>| {
            objective(request, &noise, session)
        };
        let (inner, _) = self.work((py, RequestedTask::Fit), options, None, prepare, made)?;
        Ok(PyObjective::new(inner))
    }

    fn point_by_point(
        &self,
        py: Python<'_>,
        data: Option<PyRecording>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<PyEquations> {
        let prepare = |files: &mut InMemory| {
            let data = data.map(|recording| recording.put(files));
            let mut request: RunRequest = self.request(options, &data, [])?;
            request.choices = self.with_settings_of(&request.choices);
            Ok(request)
        };
        let (inner, _) =
            self.work((py, RequestedTask::Simulate), options, None, prepare, equations)?;
        Ok(PyEquations::new(inner))
    }

    fn discover(
        &self,
        py: Python<'_>,
        data: Vec<PyRecording>,
        valid: Vec<PyRecording>,
        options: &Bound<'_, PyDict>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<PyFound> {
        let prepare = |files: &mut InMemory| {
            let (data, valid) = (put_all(data, files), put_all(valid, files));
            let mut request: DiscoverRequest = self.request(options, &data, &valid)?;
            request.choices = self.with_settings_of(&request.choices);
            request.command = options::command(options)?;
            Ok(request)
        };
        let discovered =
            self.work((py, RequestedTask::Discover), options, progress, prepare, discover)?;
        Ok(PyFound::new(RequestedTask::Discover, discovered))
    }

    fn track(&self, options: &Bound<'_, PyDict>) -> PyResult<PyTracker> {
        let mut request: TrackRequest = self.request(options, [&PathBuf::from("rows")], [])?;
        request.choices = self.with_settings_of(&request.choices);
        request.strict = true;
        Ok(PyTracker::new(request, self.texts.clone()))
    }
}
