//! Results: numbers as arrays in declared units, the rest as JSON, texts and figures.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use dgd_data::files::{Files, write_folder};
use dgd_work::{Kind, TimeTable, WorkError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::Task;
use crate::figure;
use crate::guard::guarded;
use crate::numbers::Numbers;

/// Name, unit, kind and values of a column.
type Column = (String, String, &'static str, Numbers);

fn columns(table: &TimeTable) -> Vec<Column> {
    let one = |column: &dgd_work::NamedColumn| {
        let kind = match column.kind {
            Kind::Input => "input",
            Kind::Unknown => "state",
            Kind::Output => "output",
            Kind::Derivative => "derivative",
        };
        let values = Numbers(column.in_unit());
        (column.name.clone(), column.unit.symbol.to_string(), kind, values)
    };
    table.columns.iter().map(one).collect()
}

fn csv(table: &TimeTable) -> Result<Vec<u8>, WorkError> {
    let mut text = Vec::new();
    table.write_csv(&mut text).map_err(|error| WorkError::Found(error.to_string()))?;
    Ok(text)
}

/// Names and contents of files.
fn contents(files: Files) -> Vec<(String, Vec<u8>)> {
    files.written
}

/// States and outputs over time.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Simulated {
    pub inner: dgd_work::Simulated,
    pub remarks: Vec<String>,
}

#[pymethods]
impl Simulated {
    #[getter]
    fn time(&self) -> Numbers {
        Numbers(self.inner.table.times.clone())
    }

    #[getter]
    fn columns(&self) -> Vec<Column> {
        columns(&self.inner.table)
    }

    #[getter]
    fn details(&self) -> String {
        self.inner.details().to_string()
    }

    /// Why it did not go to the end.
    #[getter]
    fn stopped(&self) -> Option<&str> {
        self.inner.stopped.as_deref()
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    fn csv(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        guarded(py, Task::Simulate, || csv(&self.inner.table))
    }

    fn figure<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figure::dictionary(py, &guarded(py, Task::Simulate, || Ok(self.inner.figure()))?)
    }

    fn page(&self, py: Python<'_>, command: &str) -> PyResult<String> {
        guarded(py, Task::Simulate, || Ok(self.inner.page(command)))
    }
}

/// Derivatives over time.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Sensitivities {
    pub inner: dgd_work::Sensitivities,
    pub remarks: Vec<String>,
}

#[pymethods]
impl Sensitivities {
    #[getter]
    fn time(&self) -> Numbers {
        Numbers(self.inner.table.times.clone())
    }

    /// The derivatives: of the first thing to all, of the second, ….
    #[getter]
    fn columns(&self) -> Vec<Column> {
        columns(&self.inner.table)
    }

    /// What was differentiated: its own values.
    #[getter]
    fn trajectories(&self) -> Vec<Column> {
        let columns_of = self.inner.trajectories.clone();
        columns(&TimeTable { columns: columns_of, ..TimeTable::default() })
    }

    #[getter]
    fn details(&self) -> String {
        self.inner.details().to_string()
    }

    #[getter]
    fn stopped(&self) -> Option<&str> {
        self.inner.stopped.as_deref()
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    fn csv(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        guarded(py, Task::Simulate, || csv(&self.inner.table))
    }

    fn figure<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figure::dictionary(py, &guarded(py, Task::Simulate, || Ok(self.inner.figure()))?)
    }

    fn page(&self, py: Python<'_>, command: &str) -> PyResult<String> {
        guarded(py, Task::Simulate, || Ok(self.inner.page(command)))
    }
}

/// Estimates and the fitted model.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Fitted {
    inner: Mutex<dgd_work::Fitted>,
    remarks: Vec<String>,
}

impl Fitted {
    pub(crate) fn new(inner: dgd_work::Fitted, remarks: Vec<String>) -> Self {
        Fitted { inner: Mutex::new(inner), remarks }
    }

    fn inner(&self) -> MutexGuard<'_, dgd_work::Fitted> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Fitted {
    #[getter]
    fn json(&self) -> String {
        self.inner().to_json().to_string()
    }

    #[getter]
    fn text(&self) -> String {
        self.inner().to_text().to_owned()
    }

    /// Why the estimates are not what they should be.
    #[getter]
    fn left_out(&self) -> Vec<String> {
        self.inner().left_out.clone()
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    /// The text of the fitted model, as a file in this folder.
    #[allow(clippy::needless_pass_by_value)]
    fn model_text(&self, py: Python<'_>, folder: PathBuf) -> PyResult<String> {
        guarded(py, Task::Fit, || Ok(self.inner().model_text(&folder)))
    }

    fn page(&self, py: Python<'_>) -> PyResult<String> {
        guarded(py, Task::Fit, || Ok(self.inner().page()))
    }

    /// Figures with what they are of: nothing for the recordings, an estimate for its profile.
    fn figures<'py>(&self, py: Python<'py>) -> PyResult<Vec<(Option<String>, Bound<'py, PyDict>)>> {
        let figures = self.inner().figures.clone();
        let one =
            |one: &dgd_work::FitFigure| Ok((one.of.clone(), figure::dictionary(py, &one.figure)?));
        figures.iter().map(one).collect()
    }

    /// Writes the folder of results.
    #[allow(clippy::needless_pass_by_value)]
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        guarded(py, Task::Load, || {
            let files = self.inner().files(&folder);
            Ok(write_folder(&folder, &files)?)
        })
    }
}

/// What a model lacks.
#[pyclass(frozen, module = "dgd._dgd")]
pub(crate) struct Discovered {
    inner: Mutex<dgd_work::Discovered>,
    remarks: Vec<String>,
}

impl Discovered {
    pub(crate) fn new(inner: dgd_work::Discovered, remarks: Vec<String>) -> Self {
        Discovered { inner: Mutex::new(inner), remarks }
    }

    fn inner(&self) -> MutexGuard<'_, dgd_work::Discovered> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Discovered {
    #[getter]
    fn json(&self) -> String {
        self.inner().to_json().to_string()
    }

    #[getter]
    fn text(&self) -> String {
        self.inner().to_text(None)
    }

    /// The text of the corrected model.
    #[getter]
    fn corrected(&self) -> String {
        self.inner().discovery.corrected.clone()
    }

    #[getter]
    fn is_cut_short(&self) -> bool {
        self.inner().discovery.is_cut_short
    }

    #[getter]
    fn reservations(&self) -> Vec<String> {
        self.inner().reservations.clone()
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    /// Names and contents of the folder of results.
    fn files(&self, py: Python<'_>) -> PyResult<Vec<(String, Vec<u8>)>> {
        guarded(py, Task::Discover, || self.inner().files().map(contents))
    }

    fn page(&self, py: Python<'_>) -> PyResult<String> {
        guarded(py, Task::Discover, || self.inner().page())
    }

    fn figure<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        figure::dictionary(py, &guarded(py, Task::Discover, || Ok(self.inner().figure()))?)
    }

    /// Writes the folder of results.
    #[allow(clippy::needless_pass_by_value)]
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        guarded(py, Task::Load, || write(&folder, &self.inner().files()?))
    }
}

fn write(folder: &Path, files: &Files) -> Result<(), WorkError> {
    Ok(write_folder(folder, files)?)
}
