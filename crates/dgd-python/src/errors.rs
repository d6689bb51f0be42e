//! Converts errors to the exceptions of `dgd._errors`, which are written in Python.

use dgd_compiler::diagnostics::{Code, Diagnostic};
use dgd_work::{Argument, ArgumentUse, ArgumentValue, MistakeClass, WorkError};
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
    /// Whether it has a result when cancelled.
    pub(crate) fn has_best_so_far(self) -> bool {
        matches!(self, RequestedTask::Fit | RequestedTask::Discover)
    }
}

/// An argument as a keyword of a call.
pub(crate) fn keyword(given: &ArgumentUse) -> String {
    let name = keyword_name(given.argument);
    match &given.value {
        None => name,
        Some(ArgumentValue::Placeholder(word)) => format!("{name}={word}"),
        Some(ArgumentValue::Literal(text)) if text.parse::<f64>().is_ok() => {
            format!("{name}={text}")
        }
        Some(ArgumentValue::Literal(text)) => format!("{name}={}", json!(text)),
    }
}

fn keyword_name(argument: Argument) -> String {
    match argument {
        Argument::Set => "params".to_owned(),
        // Reserved words of Python.
        Argument::From | Argument::For => format!("{}_", argument.name()),
        other => other.name().replace('-', "_"),
    }
}

/// The exception for an error of `dgd-work`.
pub(crate) fn of_work(py: Python<'_>, error: &WorkError, task: RequestedTask) -> PyErr {
    let argument = match error {
        WorkError::Diagnosed { diagnostics, sources } => {
            diagnostics.first().and_then(|first| sources.argument(first.labels[0].span.source))
        }
        _ => error.sentence().argument(),
    };
    let argument = argument.map(keyword_name);
    let mistakes = json!(error.mistakes(keyword)).to_string();
    let kind = kind(error, task);
    made(py, "of_work", (kind, error.spelled(keyword), argument, mistakes, without_unit(error)))
}

/// The class of the exception: `usage`, `model`, `data`, `fit` or `simulation`.
fn kind(error: &WorkError, task: RequestedTask) -> &'static str {
    match (error.class(), error) {
        (MistakeClass::Usage, _) => "usage",
        (MistakeClass::Data, WorkError::Diagnosed { diagnostics, sources }) => {
            let is_given = |one: &Diagnostic| sources.argument(one.labels[0].span.source).is_some();
            if diagnostics.iter().all(|one| one.code.is_of_data()) {
                "data"
            } else if diagnostics.iter().all(is_given) {
                "usage"
            } else {
                "model"
            }
        }
        (MistakeClass::Data, _) if task == RequestedTask::Load => "model",
        (MistakeClass::Data, _) => "data",
        _ if task.has_best_so_far() => "fit",
        _ => "simulation",
    }
}

/// Columns that lack a unit.
fn without_unit(error: &WorkError) -> Vec<String> {
    let WorkError::Diagnosed { diagnostics, .. } = error else { return Vec::new() };
    // Other mistakes of headers are about no single column.
    let headers = diagnostics.iter().filter(|one| one.code == Code::MalformedHeader);
    headers.flat_map(|one| one.about.iter().cloned()).collect()
}

/// The exception for an internal error.
pub(crate) fn internal(py: Python<'_>, words: &str) -> PyErr {
    made(py, "internal", (words,))
}

/// The exception for a usage error.
pub(crate) fn usage(py: Python<'_>, words: &str) -> PyErr {
    let without: Vec<String> = Vec::new();
    made(py, "of_work", ("usage", words, None::<String>, "[]", without))
}

fn made<'py>(py: Python<'py>, maker: &str, arguments: impl pyo3::call::PyCallArgs<'py>) -> PyErr {
    let made = py.import("dgd._errors").and_then(|module| module.getattr(maker)?.call1(arguments));
    made.map_or_else(|error| error, PyErr::from_value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_keywords() {
        assert_eq!(keyword(&Argument::Until.taking("T")), "until=T");
        assert_eq!(keyword(&Argument::Start.with("measured")), "start=\"measured\"");
        assert_eq!(keyword(&Argument::StartPoint.with(3)), "start_point=3");
        assert_eq!(keyword(&Argument::Set.into()), "params");
        assert_eq!(keyword(&Argument::From.into()), "from_");
    }
}
