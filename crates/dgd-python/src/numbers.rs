//! Arrays between Python and Rust: eight bytes per number, in native byte order, as in NumPy.
//!
//! NumPy itself is not used here, so that the command runs without it and no dependency of dgd needs extra features for
//! it.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};

/// Bytes of a number.
const SIZE: usize = size_of::<f64>();

/// Numbers, to Python as a `bytearray`, from Python as `bytes`.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PyNumbers(pub Vec<f64>);

impl<'py> FromPyObject<'_, 'py> for PyNumbers {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let bytes = object.cast::<PyBytes>()?;
        let (numbers, rest) = bytes.as_bytes().as_chunks::<SIZE>();
        if !rest.is_empty() {
            return Err(PyValueError::new_err("these are not the bytes of numbers"));
        }
        Ok(PyNumbers(numbers.iter().map(|bytes| f64::from_ne_bytes(*bytes)).collect()))
    }
}

impl<'py> IntoPyObject<'py> for PyNumbers {
    type Target = PyByteArray;
    type Output = Bound<'py, PyByteArray>;
    type Error = PyErr;

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Self::Output> {
        PyByteArray::new_with(py, SIZE * self.0.len(), |bytes| {
            for (bytes, number) in bytes.as_chunks_mut::<SIZE>().0.iter_mut().zip(&self.0) {
                *bytes = number.to_ne_bytes();
            }
            Ok(())
        })
    }
}
