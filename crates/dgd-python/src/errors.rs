//! Converts errors to the exceptions of `dgd._errors`, which are written in Python.

use dgd_work::{MistakeClass, WorkError};
use pyo3::prelude::*;
use serde_json::json;

/// The requested task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RequestedTask {
    /// Load a model.
    Load,
    /// Simulate.
    Simulate,
    /// Estimate.
    Fit,
    /// Search for missing terms.
    Discover,
}

impl RequestedTask {
    fn name(self) -> &'static str {
        match self {
            RequestedTask::Load => "load",
            RequestedTask::Simulate => "simulate",
            RequestedTask::Fit => "fit",
            RequestedTask::Discover => "discover",
        }
    }

    /// Whether it has a result when cancelled.
    pub(crate) fn has_best_so_far(self) -> bool {
        matches!(self, RequestedTask::Fit | RequestedTask::Discover)
    }
}

/// The exception for an error of `dgd-work`.
pub(crate) fn of_work(py: Python<'_>, error: &WorkError, task: RequestedTask) -> PyErr {
    let class = match error.class() {
        MistakeClass::Data => "data",
        MistakeClass::Usage => "usage",
        _ => "computation",
    };
    let mistakes = json!(error.mistakes()).to_string();
    made(py, "of_work", (class, task.name(), error.to_string(), mistakes))
}

/// The exception for an internal error.
pub(crate) fn internal(py: Python<'_>, words: &str) -> PyErr {
    made(py, "internal", (words,))
}

/// The exception for a usage error.
pub(crate) fn usage(py: Python<'_>, words: &str) -> PyErr {
    made(py, "of_work", ("usage", "load", words, "[]"))
}

fn made<'py>(py: Python<'py>, maker: &str, arguments: impl pyo3::call::PyCallArgs<'py>) -> PyErr {
    let made = py.import("dgd._errors").and_then(|module| module.getattr(maker)?.call1(arguments));
    made.map_or_else(|error| error, PyErr::from_value)
}
