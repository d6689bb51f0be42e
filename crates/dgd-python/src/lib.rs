//! The native part of the Python package: requests from Python to `dgd-work`, results back.
//!
//! Convenience is in Python: frames, units as attributes, pictures, notebooks. This crate only has the calls, each of
//! which releases the GIL, handles Ctrl-C, and turns errors into exceptions; no panic escapes ([`guard`]).

mod data;
mod errors;
mod figure;
mod guard;
mod model;
mod numbers;
mod observer;
mod options;
mod points;
mod results;
mod tracker;
mod workers;

use std::ffi::OsString;
use std::path::PathBuf;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::layout;
use dgd_scratch::Scratch;
use pyo3::prelude::*;

/// The allocator limited by `--memory` of the command.
#[global_allocator]
static ALLOCATOR: Scratch = Scratch;

/// The version of dgd.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Runs a command line, without the leading `dgd`; returns the exit code.
#[pyfunction]
fn command(py: Python<'_>, words: Vec<OsString>) -> PyResult<u8> {
    // Jobs on many assets start the command again, with the same interpreter.
    let executable: OsString = py.import("sys")?.getattr("executable")?.extract()?;
    let file: PathBuf = py.import("dgd._dgd")?.getattr("__file__")?.extract()?;
    let start = [executable, "-m".into(), "dgd".into()];
    Ok(py.detach(|| dgd_cli::run_words_of(start.into(), file, words)))
}

/// The text of a model in canonical layout, or unchanged if it cannot be read. A command would catch Ctrl-C for the
/// rest of the process.
#[pyfunction]
fn laid_out(text: String) -> String {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let id = sources.add(SourceText { name: String::new(), text: text.clone() });
    layout::format(id, &sources, &mut diagnostics).unwrap_or(text)
}

// Requires the GIL: nothing here supports free-threaded Python.
#[pymodule(gil_used = true)]
fn _dgd(module: &Bound<'_, PyModule>) -> PyResult<()> {
    guard::hear_panics();
    module.add("__version__", VERSION)?;
    module.add_function(wrap_pyfunction!(command, module)?)?;
    module.add_function(wrap_pyfunction!(laid_out, module)?)?;
    module.add_function(wrap_pyfunction!(model::load, module)?)?;
    module.add_function(wrap_pyfunction!(guard::panic_for_test, module)?)?;
    module.add_class::<data::PyTable>()?;
    module.add_class::<model::PyModel>()?;
    module.add_class::<results::PyRun>()?;
    module.add_class::<results::PyFound>()?;
    module.add_class::<points::PyEquations>()?;
    module.add_class::<points::PyObjective>()?;
    module.add_class::<tracker::PyTracker>()
}
