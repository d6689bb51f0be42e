//! Recordings from Python: named columns of numbers, or files.

use std::path::PathBuf;

use dgd_data::{DataColumns, InMemory};
use pyo3::prelude::*;

use crate::numbers::PyNumbers;

/// Columns of numbers; a header is `name [unit]`, a missing value NaN.
#[pyclass(frozen, name = "Table", module = "dgd._dgd")]
#[derive(Debug)]
pub(crate) struct PyTable {
    columns: DataColumns,
}

#[pymethods]
impl PyTable {
    #[new]
    fn new(columns: Vec<(String, PyNumbers)>) -> Self {
        let column = |(header, values): (String, PyNumbers)| (header, values.0);
        PyTable { columns: DataColumns { all: columns.into_iter().map(column).collect() } }
    }

    /// The headers.
    #[getter]
    fn headers(&self) -> Vec<&str> {
        self.columns.all.iter().map(|(header, _)| header.as_str()).collect()
    }
}

/// A recording: a named table, or a file.
#[derive(FromPyObject)]
pub(crate) enum PyRecording {
    /// The name, and the numbers.
    #[pyo3(transparent)]
    Table((String, Py<PyTable>)),
    /// A file.
    #[pyo3(transparent)]
    File(PathBuf),
}

impl PyRecording {
    /// The path of the recording, after adding its table to these files.
    pub(crate) fn put(self, files: &mut InMemory) -> PathBuf {
        match self {
            PyRecording::File(path) => path,
            PyRecording::Table((name, table)) => {
                let path = PathBuf::from(name);
                let in_memory = std::mem::take(files);
                *files = in_memory.with_columns(&path, table.get().columns.clone());
                path
            }
        }
    }
}

/// Adds recordings to files; returns their paths.
pub(crate) fn put_all(all: Vec<PyRecording>, files: &mut InMemory) -> Vec<PathBuf> {
    all.into_iter().map(|recording| recording.put(files)).collect()
}
