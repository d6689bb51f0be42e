//! Converts options from Python, one dictionary for each call, to requests.

use dgd_data::Rename;
use dgd_execute::Engine;
use dgd_identify::{DrawnFrom, Loss};
use dgd_runtime::{PerSample, Steps};
use dgd_work::{
    Estimator, FreeParameters, ModelChoices, NoiseFrom, SolverOptions, StartChoice, TrackerKind,
};
use pyo3::prelude::*;

use crate::errors;

/// Random seed and number of threads.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SessionOptions {
    pub seed: u64,
    pub threads: Option<usize>,
}

/// Solver options.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SolveOptions {
    /// `model` or `measured`.
    begin: String,
    rename: Vec<(String, String)>,
    first: Option<f64>,
    until: Option<f64>,
    method: String,
    steps: String,
    rtol: f64,
    atol: Option<f64>,
    engine: String,
}

/// Settings in addition to those of the model.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SetOptions {
    pub set: Vec<String>,
}

/// Free and fixed parameters.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SoughtOptions {
    free: Vec<String>,
    fix: Vec<String>,
}

/// Rows to record in a run.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct RunOptions {
    pub every: Option<f64>,
}

/// Options of a simulation.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SimulateOptions {
    pub noise_seed: Option<u64>,
}

/// Options of sensitivities.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SensitivityOptions {
    pub of: Vec<String>,
    pub to: Vec<String>,
    pub scaled: bool,
}

/// Options of a fit.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct FitOptions {
    pub outputs: Vec<String>,
    pub noise: String,
    pub evaluations: Option<usize>,
    pub loss: String,
    pub starts: u32,
    pub spread: String,
    pub profile: Vec<String>,
    pub bootstrap: usize,
    pub information: bool,
    pub estimator: String,
    pub smoothing: Option<f64>,
    pub steady: Vec<String>,
    pub command: String,
}

/// Options of a search.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct DiscoverOptions {
    pub effects: Vec<std::path::PathBuf>,
    pub budget: Option<f64>,
    pub command: String,
}

/// Options of tracking.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct TrackOptions {
    pub estimator: String,
    pub outputs: Vec<String>,
    pub process_noise: Vec<String>,
    pub start_std: Vec<String>,
    pub noise: Vec<String>,
    pub forgetting: Option<f64>,
    pub gate: Option<f64>,
}

/// The value of one of several words.
fn one_of<T: Copy>(py: Python<'_>, name: &str, word: &str, all: &[(&str, T)]) -> PyResult<T> {
    all.iter().find(|(known, _)| *known == word).map(|(_, value)| *value).ok_or_else(|| {
        let known: Vec<String> = all.iter().map(|(known, _)| format!("\"{known}\"")).collect();
        errors::usage(py, &format!("`{name}` must be {}, not \"{word}\"", known.join(" or ")))
    })
}

/// A number that must be positive.
fn positive(py: Python<'_>, name: &str, value: f64) -> PyResult<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(errors::usage(py, &format!("`{name}` must be a number above 0, not {value}")))
}

/// A positive number that may be omitted.
pub(crate) fn maybe_positive(
    py: Python<'_>,
    name: &str,
    value: Option<f64>,
) -> PyResult<Option<f64>> {
    value.map(|value| positive(py, name, value)).transpose()
}

fn steps(py: Python<'_>, words: &str) -> PyResult<Steps> {
    match words.strip_prefix("per-sample=").map(str::parse) {
        Some(Ok(n)) => Ok(Steps::PerSample(PerSample::Exactly(n))),
        Some(Err(_)) => {
            let words = "the number of steps per sample must be a whole number, 1 or more";
            Err(errors::usage(py, words))
        }
        None => one_of(
            py,
            "steps",
            words,
            &[
                ("auto", Steps::Automatic),
                ("adaptive", Steps::Adaptive),
                ("per-sample", Steps::PerSample(PerSample::Automatic)),
            ],
        ),
    }
}

/// The word for a start at rest.
const STEADY: &str = "steady";

impl SolveOptions {
    pub(crate) fn begins_at_rest(&self) -> bool {
        self.begin == STEADY
    }

    pub(crate) fn request(self, py: Python<'_>) -> PyResult<SolverOptions> {
        let mut solve = SolverOptions::default();
        // A start at rest is a property of the model.
        let starts = [
            ("model", StartChoice::Model),
            ("measured", StartChoice::Measured),
            (STEADY, StartChoice::Model),
        ];
        solve.start = one_of(py, "start", &self.begin, &starts)?;
        let rename = |(column, name): (String, String)| Rename { column, name };
        solve.rename = self.rename.into_iter().map(rename).collect();
        for (name, time) in [("from_", self.first), ("until", self.until)] {
            if time.is_some_and(|time| !time.is_finite()) {
                return Err(errors::usage(py, &format!("`{name}` must be a finite number")));
            }
        }
        solve.from = self.first;
        solve.until = self.until;
        solve.method = self.method;
        solve.steps = steps(py, &self.steps)?;
        solve.rtol = positive(py, "rtol", self.rtol)?;
        solve.atol = maybe_positive(py, "atol", self.atol)?;
        let engines = [
            ("auto", Engine::Auto),
            ("native", Engine::Native),
            ("interpreter", Engine::Interpreter),
        ];
        solve.engine = one_of(py, "engine", &self.engine, &engines)?;
        Ok(solve)
    }
}

impl SetOptions {
    /// The choices of a model, extended by these settings.
    pub(crate) fn beside(self, choices: &ModelChoices) -> ModelChoices {
        let mut extended = choices.clone();
        extended.set.extend(self.set);
        extended
    }
}

impl SoughtOptions {
    pub(crate) fn request(self) -> FreeParameters {
        FreeParameters::new(self.free, self.fix)
    }
}

pub(crate) fn noise_from(py: Python<'_>, word: &str) -> PyResult<NoiseFrom> {
    let words = [("estimated", NoiseFrom::Estimated), ("declared", NoiseFrom::Declared)];
    one_of(py, "noise", word, &words)
}

pub(crate) fn spread(py: Python<'_>, word: &str) -> PyResult<DrawnFrom> {
    one_of(py, "spread", word, &[("values", DrawnFrom::Values), ("bounds", DrawnFrom::Bounds)])
}

pub(crate) fn loss(py: Python<'_>, word: &str) -> PyResult<Loss> {
    let losses = [Loss::Squares, Loss::Huber, Loss::Cauchy, Loss::Tukey];
    one_of(py, "loss", word, &losses.map(|loss| (loss.name(), loss)))
}

pub(crate) fn estimator(py: Python<'_>, word: &str) -> PyResult<Estimator> {
    let words = [
        Estimator::OutputError,
        Estimator::Linearised,
        Estimator::PredictionError,
        Estimator::LeastSquares,
        Estimator::Bounded,
        Estimator::Separable,
        Estimator::NelderMead,
        Estimator::Recursive,
    ];
    one_of(py, "estimator", word, &words.map(|estimator| (estimator.name(), estimator)))
}

pub(crate) fn tracker(py: Python<'_>, word: &str) -> PyResult<TrackerKind> {
    let words = [
        ("ekf", TrackerKind::Ekf),
        ("ukf", TrackerKind::Ukf),
        ("recursive", TrackerKind::Recursive),
    ];
    one_of(py, "estimator", word, &words)
}
