//! Results: numbers as arrays in declared units, the rest as JSON, texts and figures.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use dgd_data::files::{ResultFolder, write_folder};
use dgd_data::write::{TableFormat, save};
use dgd_plot::Figure;
use dgd_work::{
    ColumnKind, DiscoveryResult, FitResult, NamedColumn, OutputPart, Sensitivities,
    SimulationResult, TimeTable, UnusableFile, UsageError, WorkError,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;

use crate::errors::RequestedTask;
use crate::figure;
use crate::guard::guarded;
use crate::numbers::PyNumbers;

/// Name, unit, kind and values of a column.
type ResultColumn = (String, String, &'static str, PyNumbers);

fn named(columns: &[NamedColumn]) -> Vec<ResultColumn> {
    let one = |column: &NamedColumn| {
        let kind = match column.kind {
            ColumnKind::Input => "input",
            ColumnKind::Unknown => "state",
            ColumnKind::Output => "output",
            ColumnKind::Derivative => "derivative",
        };
        let values = PyNumbers(column.in_unit());
        (column.name.clone(), column.unit.symbol.to_string(), kind, values)
    };
    columns.iter().map(one).collect()
}

/// A result over time: a simulation, or its derivatives.
pub(crate) trait OverTime: Send + Sync {
    fn table(&self) -> &TimeTable;
    /// The differentiated quantities.
    fn trajectories(&self) -> &[NamedColumn];
    fn details(&self) -> Value;
    fn to_json(&self) -> Value;
    /// The reason why it ended early.
    fn stopped(&self) -> Option<&str>;
    fn figure(&self) -> Figure;
    fn page(&self, command: &str) -> String;
}

/// Implements [`OverTime`] from the fields of a result; the second argument gives its trajectories.
macro_rules! over_time {
    ($result:ty, $trajectories:expr) => {
        impl OverTime for $result {
            fn table(&self) -> &TimeTable {
                &self.table
            }

            fn trajectories(&self) -> &[NamedColumn] {
                let trajectories: fn(&Self) -> &[NamedColumn] = $trajectories;
                trajectories(self)
            }

            fn details(&self) -> Value {
                <$result>::details(self)
            }

            fn to_json(&self) -> Value {
                <$result>::to_json(self)
            }

            fn stopped(&self) -> Option<&str> {
                self.stopped.as_deref()
            }

            fn figure(&self) -> Figure {
                <$result>::figure(self)
            }

            fn page(&self, command: &str) -> String {
                <$result>::page(self, command)
            }
        }
    };
}

over_time!(SimulationResult, |_| &[]);
over_time!(Sensitivities, |all| &all.trajectories);

/// States and outputs over time, or their derivatives.
#[pyclass(frozen, name = "Run", module = "dgd._dgd")]
pub(crate) struct PyRun {
    inner: Box<dyn OverTime>,
    remarks: Vec<String>,
}

impl PyRun {
    pub(crate) fn new((inner, remarks): (impl OverTime + 'static, Vec<String>)) -> Self {
        PyRun { inner: Box::new(inner), remarks }
    }
}

#[pymethods]
impl PyRun {
    #[getter]
    fn time(&self) -> PyNumbers {
        PyNumbers(self.inner.table().times.clone())
    }

    /// Derivatives: of the first quantity with respect to all, of the second, ….
    #[getter]
    fn columns(&self) -> Vec<ResultColumn> {
        named(&self.inner.table().columns)
    }

    #[getter]
    fn trajectories(&self) -> Vec<ResultColumn> {
        named(self.inner.trajectories())
    }

    #[getter]
    fn details(&self) -> String {
        self.inner.details().to_string()
    }

    #[getter]
    fn stopped(&self) -> Option<&str> {
        self.inner.stopped()
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    fn csv(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        guarded(py, RequestedTask::Simulate, || {
            let mut text = Vec::new();
            let written = self.inner.table().write_csv(&mut text);
            written.map_err(|error| UnusableFile::Output { what: OutputPart::Table, error })?;
            Ok(text)
        })
    }

    /// Writes the table to a file; its name gives the format.
    #[allow(clippy::needless_pass_by_value)]
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        guarded(py, RequestedTask::Simulate, || {
            let refused = |error| UsageError::UnwritableTable { path: path.clone(), error };
            let format = TableFormat::to_write(&path).map_err(refused)?.unwrap_or_default();
            if format.is_document() {
                let written = save(&path, |out| writeln!(out, "{}", self.inner.to_json()));
                return Ok(written?);
            }
            Ok(format.save(&path, |out| self.inner.table().write_csv(out))?)
        })
    }

    fn figure<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figure::dictionary(py, &guarded(py, RequestedTask::Simulate, || Ok(self.inner.figure()))?)
    }

    fn page(&self, py: Python<'_>, command: &str) -> PyResult<String> {
        guarded(py, RequestedTask::Simulate, || Ok(self.inner.page(command)))
    }
}

/// Findings from recordings: estimates, or missing terms.
pub(crate) trait PyFindings: Send {
    fn json(&self) -> Value;
    fn text(&self) -> String;
    /// The text of the fitted or corrected model, as a file in this folder.
    fn model_text(&self, folder: &Path) -> String;
    /// Reservations about the result.
    fn reservations(&self) -> &[String];
    /// Whether it ended before all was done.
    fn is_cut_short(&self) -> bool;
    /// Figures with their subjects: `None` for the whole, an estimate for its profile.
    fn figures(&self) -> Vec<(Option<String>, Figure)>;
    fn page(&self) -> Result<String, WorkError>;
    /// The files of the folder of results.
    fn files(&self, folder: &Path) -> Result<ResultFolder, WorkError>;
}

impl PyFindings for FitResult {
    fn json(&self) -> Value {
        self.to_json()
    }

    fn text(&self) -> String {
        self.to_text().to_owned()
    }

    fn model_text(&self, folder: &Path) -> String {
        FitResult::model_text(self, folder)
    }

    fn reservations(&self) -> &[String] {
        &self.left_out
    }

    fn is_cut_short(&self) -> bool {
        !self.left_out.is_empty()
    }

    fn figures(&self) -> Vec<(Option<String>, Figure)> {
        self.figures.iter().map(|one| (one.of.clone(), one.figure.clone())).collect()
    }

    fn page(&self) -> Result<String, WorkError> {
        Ok(FitResult::page(self))
    }

    fn files(&self, folder: &Path) -> Result<ResultFolder, WorkError> {
        Ok(FitResult::files(self, folder))
    }
}

impl PyFindings for DiscoveryResult {
    fn json(&self) -> Value {
        self.to_json()
    }

    fn text(&self) -> String {
        self.to_text(None)
    }

    fn model_text(&self, _: &Path) -> String {
        self.discovery.corrected.clone()
    }

    fn reservations(&self) -> &[String] {
        &self.reservations
    }

    fn is_cut_short(&self) -> bool {
        self.discovery.is_cut_short
    }

    fn figures(&self) -> Vec<(Option<String>, Figure)> {
        vec![(None, self.figure())]
    }

    fn page(&self) -> Result<String, WorkError> {
        DiscoveryResult::page(self)
    }

    fn files(&self, _: &Path) -> Result<ResultFolder, WorkError> {
        DiscoveryResult::files(self)
    }
}

/// Estimates, or missing terms.
#[pyclass(frozen, name = "Found", module = "dgd._dgd")]
pub(crate) struct PyFound {
    inner: Mutex<Box<dyn PyFindings>>,
    task: RequestedTask,
    remarks: Vec<String>,
}

impl PyFound {
    pub(crate) fn new(
        task: RequestedTask,
        (inner, remarks): (impl PyFindings + 'static, Vec<String>),
    ) -> Self {
        PyFound { inner: Mutex::new(Box::new(inner)), task, remarks }
    }

    fn inner(&self) -> MutexGuard<'_, Box<dyn PyFindings>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl PyFound {
    #[getter]
    fn json(&self) -> String {
        self.inner().json().to_string()
    }

    #[getter]
    fn text(&self) -> String {
        self.inner().text()
    }

    #[getter]
    fn reservations(&self) -> Vec<String> {
        self.inner().reservations().to_vec()
    }

    #[getter]
    fn is_cut_short(&self) -> bool {
        self.inner().is_cut_short()
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    #[allow(clippy::needless_pass_by_value)]
    fn model_text(&self, py: Python<'_>, folder: PathBuf) -> PyResult<String> {
        guarded(py, self.task, || Ok(self.inner().model_text(&folder)))
    }

    fn page(&self, py: Python<'_>) -> PyResult<String> {
        guarded(py, self.task, || self.inner().page())
    }

    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Vec<(Option<String>, Bound<'py, PyDict>)>> {
        let figures = guarded(py, self.task, || Ok(self.inner().figures()))?;
        figures.into_iter().map(|(of, one)| Ok((of, figure::dictionary(py, &one)?))).collect()
    }

    /// Names and contents of the files of a folder of results.
    #[allow(clippy::needless_pass_by_value)]
    fn files(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<(String, Vec<u8>)>> {
        guarded(py, self.task, || Ok(self.inner().files(&folder)?.written))
    }

    /// Writes the folder of results.
    #[allow(clippy::needless_pass_by_value)]
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        guarded(py, RequestedTask::Load, || {
            let files = self.inner().files(&folder)?;
            Ok(write_folder(&folder, &files)?)
        })
    }
}
