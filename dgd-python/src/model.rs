//! Models: what was read once, and what is asked of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use dgd_compiler::model::typeset::formula::{Line, lines};
use dgd_compiler::model::typeset::{latex, mathml};
use dgd_compiler::pipeline::Directions;
use dgd_data::open::{Entry, read_import};
use dgd_data::{Disk, FileSystem, InMemory, Layers};
use dgd_work::{
    CheckRequest, Choices, DiscoverRequest, FitRequest, RunRequest, SensitivityRequest, Session,
    SimulateRequest, WorkError, check, discover, equations, fit, objective, sensitivity, simulate,
};
use pyo3::prelude::*;

use crate::data::{Recording, put_all};
use crate::errors::Task;
use crate::guard::supervised;
use crate::observer::Observer;
use crate::options::{
    self, DiscoverOptions, FitOptions, RunOptions, SensitivityOptions, SessionOptions, SetOptions,
    SimulateOptions, SolveOptions, SoughtOptions, TrackOptions,
};
use crate::points::{Equations, Objective};
use crate::results::{Discovered, Fitted, Sensitivities, Simulated};
use crate::tracker::Tracker;

/// The folder of effects beside a model.
const EFFECTS: &str = "effects";

/// A model that was read and checked, with all texts that it needs: it does not change when files do.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Model {
    path: PathBuf,
    texts: InMemory,
    choices: Choices,
    description: String,
    text: String,
    latex: String,
    equations: Vec<(String, String)>,
    remarks: Vec<String>,
}

/// Reads a model: from these texts where they have it, from files otherwise.
#[pyfunction]
pub(crate) fn load(
    py: Python<'_>,
    path: PathBuf,
    texts: Vec<(String, Vec<u8>)>,
    variant: Vec<String>,
    set: Vec<String>,
    apply: Vec<String>,
) -> PyResult<Model> {
    let add = |all: InMemory, (path, text): (String, Vec<u8>)| all.with(path, text);
    let given = texts.into_iter().fold(InMemory::default(), add);
    let choices = Choices::new(variant, set, apply);
    let observer = Arc::new(Observer::default());
    supervised(py, Task::Load, &observer, move |observer| {
        let files = Layers { above: &given, below: &Disk };
        let session = Session::new(observer).with_files(&files);
        let mut request = CheckRequest::new(&path);
        request.choices = choices.clone();
        let checked = check(&request, session)?;
        let Some(description) = checked.to_json() else {
            let words = format!("`{}` is an effect, not a model", path.display());
            return Err(WorkError::Usage(words));
        };
        let loaded = dgd_work::load(&path, &choices, &Directions::None, session)?;
        let is_text = |name: &str| Path::new(name).extension().is_some_and(|e| e == "dgd");
        let sources = loaded.sources.iter().filter(|source| is_text(&source.name));
        let read = sources.fold(effects_beside(&path, &files), |all, source| {
            all.with(&source.name, source.text.as_bytes())
        });
        let (asts, model) = (&loaded.compiled.asts, &loaded.compiled.model);
        let label = |line: &Line| match line {
            Line::Equation { label, .. } => label.clone().unwrap_or_default(),
            Line::Mode(_) | Line::Transition(_) | Line::Bound { .. } => String::new(),
        };
        let typeset = |line: &Line| (label(line), mathml::write(line));
        Ok(Model {
            text: match &loaded.changed {
                Some(changed) => changed.text(&loaded.sources),
                None => loaded.sources.get(asts[0].source).text.clone(),
            },
            latex: latex::write(asts, model),
            equations: lines(asts, model).iter().map(typeset).collect(),
            description: description.to_string(),
            remarks: observer.remarks(),
            texts: given.and(read),
            path,
            choices,
        })
    })
}

/// The effects beside a model, in whatever state they are: who asks for one is told.
fn effects_beside(model: &Path, files: &dyn FileSystem) -> InMemory {
    let folder = model.parent().unwrap_or_else(|| Path::new("")).join(EFFECTS);
    let mut all = InMemory::default();
    let inside = |entry: Entry| {
        if entry.is_folder { files.entries(&entry.path) } else { vec![entry] }
    };
    for entry in files.entries(&folder).into_iter().flat_map(inside) {
        if let Ok(text) = read_import(files, &entry.path) {
            all = all.with(&entry.path, text);
        }
    }
    all
}

impl Model {
    /// Does something long with the model's texts and these recordings.
    fn work<T: Send + 'static>(
        &self,
        py: Python<'_>,
        task: Task,
        files: InMemory,
        options: &SessionOptions,
        observer: &Arc<Observer>,
        work: impl FnOnce(Session<'_>) -> Result<T, WorkError> + Send + 'static,
    ) -> PyResult<T> {
        let (seed, threads) = (options.seed, options.threads);
        let above = self.texts.clone().and(files);
        supervised(py, task, observer, move |observer| {
            let files = Layers { above: &above, below: &Disk };
            let session = Session::new(observer).with_files(&files).with_seed(seed);
            let threads = threads.unwrap_or(session.threads).max(1);
            work(session.with_threads(threads))
        })
    }

    fn run(
        &self,
        py: Python<'_>,
        data: Option<Recording>,
        options: &Bound<'_, PyAny>,
        files: &mut InMemory,
    ) -> PyResult<RunRequest> {
        let mut run = RunRequest::new(&self.path);
        run.choices = options.extract::<SetOptions>()?.beside(&self.choices);
        run.data = data.map(|recording| recording.put(files));
        let every = options.extract::<RunOptions>()?.every;
        run.every = options::maybe_positive(py, "every", every)?;
        run.solve = options.extract::<SolveOptions>()?.request(py)?;
        Ok(run)
    }

    fn fit_request(
        &self,
        py: Python<'_>,
        data: Vec<Recording>,
        valid: Vec<Recording>,
        options: &Bound<'_, PyAny>,
        files: &mut InMemory,
    ) -> PyResult<FitRequest> {
        let own: FitOptions = options.extract()?;
        let mut request = FitRequest::new(&self.path, put_all(data, files));
        request.valid = put_all(valid, files);
        request.choices = options.extract::<SetOptions>()?.beside(&self.choices);
        request.sought = options.extract::<SoughtOptions>()?.request();
        request.outputs = own.outputs;
        request.noise = options::noise_from(py, &own.noise)?;
        request.evaluations = own.evaluations;
        request.search.loss = options::loss(py, &own.loss)?;
        request.search.starts = own.starts.max(1);
        request.intervals.profile = own.profile;
        request.intervals.bootstrap = own.bootstrap;
        request.intervals.information = own.information;
        request.regression.estimator = options::estimator(py, &own.estimator)?;
        request.regression.smoothing = options::maybe_positive(py, "smoothing", own.smoothing)?;
        request.regression.steady = own.steady;
        request.solve = options.extract::<SolveOptions>()?.request(py)?;
        request.figures = true;
        request.command = own.command;
        Ok(request)
    }
}

#[pymethods]
impl Model {
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }

    /// All texts, by path.
    #[getter]
    fn texts(&self) -> Vec<(String, Vec<u8>)> {
        let own = |(path, text): (&Path, &[u8])| (path.display().to_string(), text.to_vec());
        self.texts.texts().map(own).collect()
    }

    /// Variants, settings and effects.
    #[getter]
    fn choices(&self) -> (Vec<String>, Vec<String>, Vec<String>) {
        let Choices { variant, set, apply, .. } = self.choices.clone();
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
        data: Option<Recording>,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<Simulated> {
        let mut files = InMemory::default();
        let mut request = SimulateRequest::new(self.run(py, data, options, &mut files)?);
        request.noise_seed = options.extract::<SimulateOptions>()?.noise_seed;
        // The result may be drawn later.
        request.fields = true;
        let observer = Arc::new(Observer::default());
        let session = options.extract()?;
        let inner = self.work(py, Task::Simulate, files, &session, &observer, move |session| {
            simulate(&request, session)
        })?;
        Ok(Simulated { inner, remarks: observer.remarks() })
    }

    fn sensitivity(
        &self,
        py: Python<'_>,
        data: Option<Recording>,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<Sensitivities> {
        let mut files = InMemory::default();
        let mut request = SensitivityRequest::new(self.run(py, data, options, &mut files)?);
        let own: SensitivityOptions = options.extract()?;
        (request.of, request.to, request.scaled) = (own.of, own.to, own.scaled);
        let observer = Arc::new(Observer::default());
        let session = options.extract()?;
        let inner = self.work(py, Task::Simulate, files, &session, &observer, move |session| {
            sensitivity(&request, session)
        })?;
        Ok(Sensitivities { inner, remarks: observer.remarks() })
    }

    fn fit(
        &self,
        py: Python<'_>,
        data: Vec<Recording>,
        valid: Vec<Recording>,
        options: &Bound<'_, PyAny>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Fitted> {
        let mut files = InMemory::default();
        let request = self.fit_request(py, data, valid, options, &mut files)?;
        let observer = Arc::new(Observer::new(progress));
        let session = options.extract()?;
        let inner = self.work(py, Task::Fit, files, &session, &observer, move |session| {
            fit(&request, session)
        })?;
        Ok(Fitted::new(inner, observer.remarks()))
    }

    fn objective(
        &self,
        py: Python<'_>,
        data: Vec<Recording>,
        noise: Vec<(String, f64)>,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<Objective> {
        let mut files = InMemory::default();
        let request = self.fit_request(py, data, Vec::new(), options, &mut files)?;
        let observer = Arc::new(Observer::default());
        let session = options.extract()?;
        let inner = self.work(py, Task::Fit, files, &session, &observer, move |session| {
            objective(&request, &noise, session)
        })?;
        Ok(Objective::new(inner))
    }

    fn point_by_point(
        &self,
        py: Python<'_>,
        data: Option<Recording>,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<Equations> {
        let mut files = InMemory::default();
        let request = self.run(py, data, options, &mut files)?;
        let observer = Arc::new(Observer::default());
        let session = options.extract()?;
        let inner = self.work(py, Task::Simulate, files, &session, &observer, move |session| {
            equations(&request, session)
        })?;
        Ok(Equations::new(inner))
    }

    fn discover(
        &self,
        py: Python<'_>,
        data: Vec<Recording>,
        valid: Vec<Recording>,
        options: &Bound<'_, PyAny>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Discovered> {
        let mut files = InMemory::default();
        let own: DiscoverOptions = options.extract()?;
        let mut request = DiscoverRequest::new(&self.path, put_all(data, &mut files));
        request.valid = put_all(valid, &mut files);
        request.choices = options.extract::<SetOptions>()?.beside(&self.choices);
        request.sought = options.extract::<SoughtOptions>()?.request();
        request.effects = own.effects;
        request.budget = options::maybe_positive(py, "budget", own.budget)?;
        request.solve = options.extract::<SolveOptions>()?.request(py)?;
        request.command = own.command;
        let observer = Arc::new(Observer::new(progress));
        let session = options.extract()?;
        let inner = self.work(py, Task::Discover, files, &session, &observer, move |session| {
            discover(&request, session)
        })?;
        Ok(Discovered::new(inner, observer.remarks()))
    }

    fn track(&self, py: Python<'_>, options: &Bound<'_, PyAny>) -> PyResult<Tracker> {
        let own: TrackOptions = options.extract()?;
        let mut request = dgd_work::TrackRequest::new(&self.path, "rows");
        request.choices = options.extract::<SetOptions>()?.beside(&self.choices);
        request.sought = options.extract::<SoughtOptions>()?.request();
        request.estimator = options::tracker(py, &own.estimator)?;
        request.outputs = own.outputs;
        request.process_noise = own.process_noise;
        request.start_std = own.start_std;
        request.noise = own.noise;
        request.forgetting = own.forgetting;
        request.gate = options::maybe_positive(py, "gate", own.gate)?;
        request.strict = true;
        request.solve = options.extract::<SolveOptions>()?.request(py)?;
        Ok(Tracker::new(request, self.texts.clone()))
    }
}
